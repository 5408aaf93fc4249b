# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The scene: frozen dataclasses of NumPy arrays that know neither pxr nor Warp.

Kernels check nothing. A :class:`Scene` refuses rows that do not exist, and building a hierarchy refuses coordinates
that are too large or not finite; all else has been validated by whoever made it: triangles name points, transforms are
invertible. Matrices act on column vectors and read right to left, ``p_world = world_from_local @ p_local``. Colours are
linear Rec. 709. Lengths are scene units, angles radians.
"""

from warp_rt.scene.bounds import local_bounds, local_boxes, point_bounds, primitive_count, shape_boxes
from warp_rt.scene.cameras import Camera, look_at
from warp_rt.scene.geometry import SHAPE_POINTS, Instances, Mesh, Primvar, RayMask, ShapeKind, Shapes, is_closed
from warp_rt.scene.lights import Dome, Light, LightKind, Profile, Shadow
from warp_rt.scene.materials import (
    MATERIAL_DEFAULTS,
    Image,
    Input,
    MagFilter,
    Material,
    MaterialModel,
    NormalFrame,
    OpacityMode,
    Texture,
    Tiles,
    Wrap,
)
from warp_rt.scene.scene import Scene, check_scene
from warp_rt.scene.settings import Product, RenderVar, Settings

__all__ = [
    "MATERIAL_DEFAULTS",
    "SHAPE_POINTS",
    "Camera",
    "Dome",
    "Image",
    "Input",
    "Instances",
    "Light",
    "LightKind",
    "MagFilter",
    "Material",
    "MaterialModel",
    "Mesh",
    "NormalFrame",
    "OpacityMode",
    "Primvar",
    "Product",
    "Profile",
    "RayMask",
    "RenderVar",
    "Scene",
    "Settings",
    "Shadow",
    "ShapeKind",
    "Shapes",
    "Texture",
    "Tiles",
    "Wrap",
    "check_scene",
    "is_closed",
    "local_bounds",
    "local_boxes",
    "look_at",
    "point_bounds",
    "primitive_count",
    "shape_boxes",
]
