# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Device code: every ``@wp.func`` and kernel of the ray tracer, importable one by one and free of host code.

Functions can be had from their file, ``from warp_rt.kernels.vector import reflect``, or from here,
``from warp_rt.kernels import reflect``; the files are loaded when first asked for.
"""

from importlib import import_module
from pkgutil import iter_modules
from typing import Any

if __name__ != "warp_rt.kernels":
    raise ImportError("import warp_rt.kernels, not kernels: a second copy would define every wp.struct twice")


def __getattr__(name: str) -> Any:
    files = [info.name for info in iter_modules(__path__)]
    if name not in files and not name.startswith("_"):
        for file in files:
            value = vars(import_module(f".{file}", __name__)).get(name)
            # Not what the file itself imports from elsewhere, such as Warp.
            if getattr(getattr(value, "func", None), "__module__", None) == f"{__name__}.{file}":
                return value
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
