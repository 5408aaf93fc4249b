# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Device code: every ``@wp.func`` and kernel of the ray tracer, importable one by one and free of host code.

Functions can be had from their file, ``from warp_rt.kernels.vector import reflect``, or from here,
``from warp_rt.kernels import reflect``; the files are loaded when first asked for. Where a file has the name of a
function in it, that name is the function here; of any other file it is the file.

A kernel of one's own compiles them with the options of its own module. Those of the kernels here are
``wp.set_module_options({"enable_backward": False, "fuse_fp": False})``: with fused products no triangle test is
watertight.
"""

from importlib import import_module
from os import scandir
from pkgutil import iter_modules
from sys import modules
from types import ModuleType
from typing import Any

if __name__ != "warp_rt.kernels":
    raise ImportError("import warp_rt.kernels, not kernels: a second copy would define every wp.struct twice")


def _file_states() -> dict[str, tuple[int, ...]]:
    """Return what tells that a file of this folder has been written to, by its name; nothing in an archive."""
    try:
        files = [(file.name, file.stat()) for file in scandir(__path__[0]) if file.name.endswith(".py")]
    except OSError:
        return {}
    return {name: (state.st_mtime_ns, state.st_ctime_ns, state.st_size, state.st_ino) for name, state in files}


_states_at_import: dict[str, tuple[int, ...]] = globals().get("_states_at_import") or _file_states()  # not if reloaded


def is_as_imported() -> bool:
    """Return whether the files are known to be what they were before this process imported the first of them."""
    return bool(_states_at_import) and _file_states() == _states_at_import


def _own(file: ModuleType, name: str) -> Any:
    """Return the function or kernel of this name in a file, not what it imports, such as Warp; None: it has none."""
    value = vars(file).get(name)
    return value if getattr(getattr(value, "func", None), "__module__", None) == file.__name__ else None


class _Package(ModuleType):
    """This package, to which a file is bound under its name when it has been loaded."""

    def __setattr__(self, name: str, value: Any) -> None:
        own = _own(value, name) if isinstance(value, ModuleType) else None
        super().__setattr__(name, value if own is None else own)


modules[__name__].__class__ = _Package


def __getattr__(name: str) -> Any:
    files = [info.name for info in iter_modules(__path__)]
    if name not in files and not name.startswith("_"):
        for file in files:
            value = _own(import_module(f".{file}", __name__), name)
            if value is not None:
                return value
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
