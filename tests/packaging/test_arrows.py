# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The house stands: every import goes along an arrow of docs/architecture.md, and none in a circle."""

import ast
import graphlib
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

# What each part of the host code may import: parts, and libraries. The parts are the floors of the house, and an
# arrow within a part is always allowed. A new package, or a module in none, has to be given its floor here.
PARTS = {
    "base": ["errors", "near_matches", "options", "report", "stand_ins"],
    "colour": ["srgb"],
    "triangulation": ["triangulate"],
    "scene": ["scene.*"],
    "subdivision": ["subdivision.*"],
    "splines": ["splines.*"],
    "nff": ["nff.*"],
    "usd": ["usd.*"],
    "device": ["warp_setup", "device.*"],
    "bvh": ["bvh.*"],
    "upload": ["upload.*"],
    "rendering": ["rendering.*"],
    "image": ["image.*"],
    "tree": ["tree.*"],
    "api": ["api"],
    "cli": ["cli.*", "__main__"],
    "front": ["__init__"],
}
ARROWS = {
    "base": (),
    "colour": (),
    "triangulation": (),
    "scene": ("base", "colour"),
    "subdivision": (),
    "splines": (),
    "nff": ("base", "scene", "triangulation"),
    "usd": ("base", "colour", "scene", "subdivision", "splines", "triangulation"),
    "device": ("base", "kernels"),
    "bvh": ("base", "scene", "device", "kernels"),
    "upload": ("base", "colour", "scene", "device", "kernels"),
    "rendering": ("base", "scene", "device", "bvh", "upload", "kernels", "tree"),
    "image": ("base", "colour", "scene", "front"),  # front: its version
    "tree": ("base", "image", "usd"),
    "api": ("base", "scene", "nff", "usd", "rendering", "image", "tree"),
    "cli": ("base", "scene", "device", "rendering", "image", "tree", "api", "front"),
    "front": ("base", "scene", "bvh", "rendering", "image", "tree", "api"),  # by name only, when first used
}
LIBRARIES = {
    "base": (),
    "colour": ("numpy",),
    "triangulation": ("numpy", "mapbox_earcut"),
    "scene": ("numpy",),
    "subdivision": ("numpy",),
    "splines": ("numpy", "mapbox_earcut"),
    "nff": ("numpy",),
    "usd": ("numpy", "pxr", "PIL", "OpenEXR"),
    "device": ("numpy", "warp"),
    "bvh": ("numpy", "warp"),
    "upload": ("numpy", "warp"),
    "rendering": ("numpy", "warp"),
    "image": ("numpy", "PIL", "OpenEXR"),
    "tree": ("numpy",),
    "api": (),
    "cli": ("numpy", "rich"),  # numpy: in annotations
    "front": (),
}

HOST_FILES = sorted(path for path in (ROOT / "warp_rt").rglob("*.py") if "kernels" not in path.relative_to(ROOT).parts)
KERNEL_FILES = sorted((ROOT / "kernels").glob("*.py"))


def _module(path: Path) -> str:
    """Return the name below warp_rt: ``cli.main``, ``__init__``, ``kernels.light``."""
    if path.parent == ROOT / "kernels":
        return f"kernels.{path.stem}"
    return ".".join(path.relative_to(ROOT / "warp_rt").with_suffix("").parts)


def _part(module: str) -> str:
    if module.partition(".")[0] == "kernels":
        return "kernels"
    for part, patterns in PARTS.items():
        if module in patterns or f"{module.partition('.')[0]}.*" in patterns:
            return part
    raise AssertionError(f"warp_rt.{module} is on no floor: add it to PARTS, where docs/architecture.md has it")


def _imports(path: Path) -> Iterator[str]:
    """Yield the full name of every module that a file imports, wherever in the file it does."""
    package = ["warp_rt", *_module(path).split(".")[:-1]]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) + 1 - node.level] if node.level else []
            origin = ".".join([*base, *(node.module or "").split(".")]).strip(".")
            names = [f"{origin}.{alias.name}" for alias in node.names]
            yield from (name if _is_module(name) else origin for name in names)


def _is_module(name: str) -> bool:
    package, *rest = name.split(".")
    if package != "warp_rt" or not rest:
        return False
    base = ROOT / "kernels" if rest[0] == "kernels" else ROOT / "warp_rt" / rest[0]
    path = base.joinpath(*rest[1:])
    return path.with_suffix(".py").is_file() or path.is_dir()


def _inside(name: str) -> str | None:
    """Return the module below warp_rt that a full name means; None for libraries."""
    package, _, module = name.partition(".")
    return (module or "__init__") if package == "warp_rt" else None


@pytest.mark.parametrize("path", HOST_FILES, ids=_module)
def test_host_code_imports_along_the_arrows(path):
    part = _part(_module(path))
    for name in _imports(path):
        inside = _inside(name)
        if inside is not None:
            target = _part(inside)
            assert target == part or target in ARROWS[part], f"{path.name} ({part}) imports {name} ({target})"
        elif name.partition(".")[0] not in sys.stdlib_module_names:
            assert name.partition(".")[0] in LIBRARIES[part], f"{path.name} ({part}) imports {name}"


def test_arrows_go_one_way():
    """But for the front, whose version everybody may ask for and which fetches names when they are first used."""
    floors = {part: set(targets) - {"front"} for part, targets in ARROWS.items()}
    assert len(list(graphlib.TopologicalSorter(floors).static_order())) == len(PARTS) + 1  # and kernels


def test_every_arrow_is_gone_along():
    gone = {(_part(_module(path)), name) for path in HOST_FILES for name in _imports(path)}
    parts = {(part, _part(inside)) for part, name in gone if (inside := _inside(name)) is not None}
    libraries = {(part, name.partition(".")[0]) for part, name in gone if _inside(name) is None}
    assert {(part, target) for part, targets in ARROWS.items() for target in targets} <= parts
    assert {(part, library) for part, names in LIBRARIES.items() for library in names} <= libraries


@pytest.mark.parametrize("path", KERNEL_FILES, ids=_module)
def test_kernels_import_warp_math_and_each_other(path):
    source = ast.parse(path.read_text(encoding="utf-8"))
    finders = ("importlib", "os", "pkgutil", "sys", "types") if path.name == "__init__.py" else ()
    text = {"re"} if path.name == "native.py" else set()
    for node in ast.walk(source):
        if isinstance(node, ast.Import):
            assert {alias.name for alias in node.names} <= {"warp", "math", *text}, path.name
        elif isinstance(node, ast.ImportFrom):
            is_own_file = node.level == 1 and node.module  # what kernel_binaries looks for
            assert is_own_file or node.module in ("typing", "math", "warp", "__future__", *finders), path.name


def test_kernels_folder_is_flat():
    """A folder below would be missing from the wheel, whose packages are listed by name."""
    assert [path.name for path in (ROOT / "kernels").iterdir() if path.is_dir() and path.name != "__pycache__"] == []


@pytest.mark.parametrize("files", [HOST_FILES, KERNEL_FILES], ids=["host", "kernels"])
def test_no_circles(files):
    files_by_module = {_module(path): path for path in files if path.stem != "__init__"}
    graph = {
        module: {inside for name in _imports(path) if (inside := _inside(name)) in files_by_module and inside != module}
        for module, path in files_by_module.items()
    }
    assert sum(map(len, graph.values())) > len(graph) / 2  # the names were understood
    order = list(graphlib.TopologicalSorter(graph).static_order())  # CycleError names the circle
    assert set(order) == set(files_by_module)


def test_only_usd_knows_pxr():
    users = {_module(path).partition(".")[0] for path in HOST_FILES if any(n.startswith("pxr") for n in _imports(path))}
    assert users == {"usd"}
