# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""warp_rt: Whitted ray tracing of USD stages in Warp kernels.

Importing the package loads neither Warp nor pxr; each name below arrives with its module when first used (PEP 562).
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from warp_rt.api import load_scene, render, render_series, trace_tree
    from warp_rt.bvh.accel import Accel, build_accel, refit_accel
    from warp_rt.bvh.queries import Hits, any_hit, closest_hit, count_hits
    from warp_rt.errors import DeviceError, LimitError, OptionError, OutputError, SceneError, WarpRtError
    from warp_rt.image.depth_series import DepthSeries
    from warp_rt.image.image import Image
    from warp_rt.options import RenderOptions
    from warp_rt.rendering.film import Film
    from warp_rt.rendering.renderer import Renderer
    from warp_rt.scene import Scene
    from warp_rt.tree.ray_tree import RayTree

_MODULES = {
    "api": ("load_scene", "render", "render_series", "trace_tree"),
    "bvh.accel": ("Accel", "build_accel", "refit_accel"),
    "bvh.queries": ("Hits", "any_hit", "closest_hit", "count_hits"),
    "errors": ("DeviceError", "LimitError", "OptionError", "OutputError", "SceneError", "WarpRtError"),
    "image.depth_series": ("DepthSeries",),
    "image.image": ("Image",),
    "options": ("RenderOptions",),
    "rendering.film": ("Film",),
    "rendering.renderer": ("Renderer",),
    "scene": ("Scene",),
    "tree.ray_tree": ("RayTree",),
}
_HOME = {name: module for module, names in _MODULES.items() for name in names}

__all__ = ["__version__", *sorted(_HOME)]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'warp_rt' has no attribute {name!r}")
    value = getattr(import_module(f"warp_rt.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
