# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a normalised light is divided by.

Reference: UsdLux schema documentation, "Quantities and Units"; OpenUSD's hdEmbree.
"""

from __future__ import annotations

import math

import numpy as np

from warp_rt.scene import LightKind
from warp_rt.scene.light_shapes import ellipse_circumference, ellipsoid_area
from warp_rt.usd.mesh_lights import ShiningMesh


def distant_divisor(angle: float) -> float:
    """Return what a normalised distant light's intensity is divided by: the cone's projected solid angle [sr].

    The schema's rule; beyond a half angle of 90 degrees what comes from below the horizon counts, too.
    """
    if angle <= 0:
        return 1.0
    sine_squared = math.sin(angle / 2) ** 2
    return math.pi * (sine_squared if angle <= math.pi else 2.0 - sine_squared)


def world_area(kind: LightKind, matrix: np.ndarray, radius: float, width: float, height: float, length: float) -> float:
    """Return the area of a light's surface in world space [scene unit^2].

    Args:
        kind: RECT, DISK, SPHERE or CYLINDER.
        matrix: The light's ``world_from_local``, shape [4, 4].
        radius: In the light's space, as the others; of a rectangle it does not count.
        width: Of a rectangle, along x.
        height: Of a rectangle, along y.
        length: Of a cylinder, along x.
    """
    x, y, z = matrix[:3, 0], matrix[:3, 1], matrix[:3, 2]
    if kind == LightKind.RECT:
        return float(np.linalg.norm(np.cross(x * width, y * height)))
    if kind == LightKind.DISK:
        return math.pi * radius**2 * float(np.linalg.norm(np.cross(x, y)))
    a, b, c = (float(np.linalg.norm(axis)) * radius for axis in (x, y, z))
    if kind == LightKind.CYLINDER:
        return ellipse_circumference(b, c) * float(np.linalg.norm(x)) * length
    return ellipsoid_area(a, b, c)


def mesh_area(matrix: np.ndarray, mesh: ShiningMesh) -> float:
    """Return the area in world space [scene unit^2] of geometry that shines.

    Args:
        matrix: The light's ``world_from_local``, shape [4, 4].
        mesh: What shines, in the light's space.
    """
    corners = mesh.triangles @ matrix[:3, :3].T
    sides = corners[:, 1:] - corners[:, :1]
    return float(np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2) * mesh.density
