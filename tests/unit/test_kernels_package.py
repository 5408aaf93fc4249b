# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``from warp_rt.kernels import ...`` finds files and functions, and nothing else."""

import importlib.util
import subprocess
import sys
from pathlib import Path
from pkgutil import iter_modules

import pytest
import warp as wp

import warp_rt.kernels

ROOT = Path(__file__).resolve().parents[2]


def test_files_and_functions_can_be_imported() -> None:
    from warp_rt.kernels import intersect_triangle, reflect, vector
    from warp_rt.kernels.vector import reflect as same

    assert reflect is same is vector.reflect
    rows = [(0.25, 0.25, 1), (0, 0, -1), (0, 0, 0), (1, 0, 0), (0, 1, 0)]
    hit = intersect_triangle(*(wp.vec3(*map(float, row)) for row in rows))
    assert (hit.t, hit.u, hit.v) == (1, 0.25, 0.25)


def test_a_function_goes_before_the_file_of_its_name() -> None:
    """Whether the file has been loaded before or not."""
    code = "from warp_rt.kernels import intersect_sphere, pick_triangle as first\n"
    code += "from warp_rt.kernels.pick_triangle import pick_triangle\n"
    code += "from warp_rt.kernels import pick_triangle as second\n"
    code += "print(intersect_sphere.key, first is pick_triangle is second)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout == "intersect_sphere True\n", done.stderr


def test_every_function_can_be_imported_from_here() -> None:
    """But for those, such as ``noise``, whose name another file has."""
    names = [file.name for file in iter_modules(warp_rt.kernels.__path__)]
    for file in names:
        module = importlib.import_module(f"warp_rt.kernels.{file}")
        for name, value in vars(module).items():
            is_own = isinstance(value, wp.Function) and value.func.__module__ == module.__name__
            if is_own and (name == file or name not in names):
                assert isinstance(getattr(warp_rt.kernels, name), wp.Function), name


def test_what_files_import_themselves_is_not_here() -> None:
    for name in ("wp", "nothing_of_the_kind", "_private"):
        with pytest.raises(AttributeError, match=name):
            getattr(warp_rt.kernels, name)


def test_a_second_copy_is_refused() -> None:
    spec = importlib.util.find_spec("warp_rt.kernels")
    folder = Path(spec.origin).parent
    code = f"import importlib.util as u; s = u.spec_from_file_location('kernels', {str(folder / '__init__.py')!r});"
    code += "s.loader.exec_module(u.module_from_spec(s))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "import warp_rt.kernels, not kernels" in done.stderr
