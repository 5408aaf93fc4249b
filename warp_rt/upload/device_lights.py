# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Lights in world space: what the scale of a light's transform does to its shape, and what its kind sends out."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from warp_rt.kernels.codes import UNEVEN, VARIED
from warp_rt.scene import Light, LightKind
from warp_rt.scene.light_shapes import ellipsoid_area
from warp_rt.upload.light_tables import LightTables

_EVEN = 1e-3  # transforms are float32 in many files


def light_record(light: Light, origin: np.ndarray, tables: LightTables) -> dict[str, Any]:
    """Return the fields of ``kernels.light_structs.LightData``.

    Args:
        light: As the scene has it; the scale of its transform applies to its shape.
        origin: World point that device coordinates are relative to, shape [3].
        tables: Takes what the light has and few others do.
    """
    axes, lengths = unit_axes(light.world_from_light)
    normal = axes[2]
    if light.kind in (LightKind.RECT, LightKind.DISK):
        normal = np.linalg.inv(light.world_from_light[:3, :3])[2]
    texture, mean_color = tables.add_texture(light)
    half_axes = light.world_from_light[:3, :3].T * _half_sizes(light)[:, None]
    return {
        "kind": int(light.kind),
        "position": light.world_from_light[:3, 3] - origin,
        "axis_z": axes[2],
        "normal": normal / np.linalg.norm(normal),
        "emission": _emission(light) * mean_color,
        "radius": _radius(light, lengths),
        "half_x": half_axes[0],
        "half_y": half_axes[1],
        "half_z": half_axes[2],
        "varies": _varies(light, lengths),
        "meridians": _meridians(light, lengths, tables),
        "cap": 2.0 * np.sin(light.angle / 4) ** 2,
        "has_falloff": light.has_falloff,
        "casts_shadow": light.casts_shadow,
        "diffuse": light.diffuse,
        "specular": light.specular,
        "focus": light.focus,
        "focus_tint": light.focus_tint,
        "cone_angle": light.cone_angle,
        "cone_softness": min(light.cone_softness, 1.0),
        "receivers": tables.links.add(light.receivers),
        "shadow": tables.add_shadow(light.shadow),
        "profile": tables.add_profile(light),
        "texture": texture,
        "mesh": tables.add_mesh(light, origin),
        "glows": light.glows,
        "is_visible": light.is_visible,
    }


def _varies(light: Light, lengths: np.ndarray) -> int:
    """Return ``kernels.light_structs.LightData.varies``: UNEVEN, VARIED, both or neither."""
    is_varied = light.is_shaped or light.image >= 0
    axes = light.world_from_light[:3, :3] / np.where(lengths > 0, lengths, 1.0)
    is_sheared = np.abs(axes.T @ axes - np.eye(3)).max() > _EVEN
    round_lengths = {LightKind.DISK: lengths[:2], LightKind.CYLINDER: lengths[1:]}.get(light.kind, lengths)
    is_uneven = is_sheared or round_lengths.max() > round_lengths.min() * (1 + _EVEN)
    return (VARIED if is_varied else 0) | (UNEVEN if is_uneven and light.kind != LightKind.RECT else 0)


def _meridians(light: Light, lengths: np.ndarray, tables: LightTables) -> int:
    """Return the row of the meridians of a light that has a shape; -1: none."""
    if light.kind in (LightKind.POINT, LightKind.DISTANT):
        return -1
    axes = light.world_from_light[:3, :3] / lengths.max()
    return tables.add_meridians(light, is_even=np.abs(axes.T @ axes - np.eye(3)).max() <= _EVEN)


def _half_sizes(light: Light) -> np.ndarray:
    """Return half the extent of a light's shape along its own axes, shape [3]."""
    if light.kind == LightKind.RECT:
        return np.array([light.width / 2, light.height / 2, 0.0])
    if light.kind == LightKind.CYLINDER:
        return np.array([light.length / 2, light.radius, light.radius])
    if light.kind == LightKind.DISK:
        return np.array([light.radius, light.radius, 0.0])
    return np.full(3, light.radius)


def unit_axes(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the unit directions (rows of [3, 3]) and the lengths [3] of the axes of a transform, shape [4, 4]."""
    columns = matrix[:3, :3].T
    lengths = np.linalg.norm(columns, axis=1)
    return columns / np.where(lengths > 0, lengths, 1.0)[:, None], lengths


def _emission(light: Light) -> np.ndarray:
    """Return the irradiance of a facing surface where it is the same everywhere, else the radiance."""
    radiance = np.array(light.radiance)
    if light.kind == LightKind.DISTANT and light.angle > 0:
        # A cone of uniform radiance: pi sin^2 of the half angle.
        return radiance * (np.pi * np.sin(min(light.angle / 2, np.pi / 2)) ** 2)
    if light.kind == LightKind.POINT and not light.has_falloff:
        return radiance * np.pi  # I_l = E / pi is the radiance attribute itself
    return radiance


def _radius(light: Light, lengths: np.ndarray) -> float:
    """Return the radius of a round light under an even scale, and of a point light under any.

    That of a point light is of the sphere that has the ellipsoid's area: averaged over all directions, a convex body
    covers the same solid angle as the sphere of its area (Cauchy: its mean projection is a quarter of its surface).
    """
    a, b, c = (float(length) for length in lengths)
    if light.kind in (LightKind.DISK, LightKind.CYLINDER):
        return light.radius * b
    return light.radius * math.sqrt(ellipsoid_area(a, b, c) / (4 * math.pi))
