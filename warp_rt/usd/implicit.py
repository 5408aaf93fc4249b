# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Sphere, Cube, Cylinder, Cone, Capsule and Plane as shared unit meshes; the prim's size goes into the transform.

A thousand spheres of any size are one mesh. Curved shapes are inscribed in the exact surface and carry its normals.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from pxr import Usd

from warp_rt.report import Report
from warp_rt.scene import Mesh, Primvar
from warp_rt.usd.attribute_values import AttributeReader, numbers, shown
from warp_rt.usd.mesh import INVALID_VALUE, ORIENTATIONS, encloses_volume

TYPES = ("Sphere", "Cube", "Cylinder", "Cylinder_1", "Cone", "Capsule", "Capsule_1", "Plane")
BAD_SIZE = "W140"

# 96 chords about a circle of 1000 pixels stay within 0.27 pixels of it: radius (1 - cos(pi / 96)).
_SEGMENTS = 96
_QUARTER_RINGS = _SEGMENTS // 4

# Columns: where local x, y and z point. Cyclic, so that no axis mirrors.
_AXES = {
    "X": np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    "Y": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
    "Z": np.eye(3),
}


@dataclass(frozen=True)
class Shape:
    """A unit mesh by its recipe, and how large it is."""

    key: tuple[object, ...]
    """Equal for shapes that share a mesh; ``make_shape`` makes it."""
    local_from_unit: np.ndarray
    """float64, shape [4, 4]."""


@dataclass(frozen=True)
class Band:
    """Part of the outline that a surface of revolution is made of; outlines run from the bottom to the top."""

    start: tuple[float, float]
    """Radius and z."""
    end: tuple[float, float]
    start_normal: tuple[float, float]
    """Outward, along radius and z."""
    end_normal: tuple[float, float]


def read_shape(prim: Usd.Prim, time: Usd.TimeCode, report: Report) -> Shape | None:
    """Return the shape of a prim whose type is one of ``TYPES``; None, with a diagnostic, if it has no extent."""
    kind = prim.GetTypeName()
    # A negative size has no meaning of its own; its magnitude keeps the shape from being turned inside out.
    attributes = AttributeReader(prim, time, INVALID_VALUE, report)
    values = {name: attributes.value(name) for name in _SIZES[kind]}
    sizes = {name: _magnitude(value) for name, value in values.items()}
    has_sizes = all(math.isfinite(size) for size in sizes.values())
    axis = attributes.token("axis", "Z", tuple(_AXES))
    is_left_handed = attributes.token("orientation", ORIENTATIONS[0], ORIENTATIONS) == "leftHanded"
    key, scale = _unit_shape(kind, axis, sizes) if has_sizes else ((), (0.0, 0.0, 0.0))
    is_flat_capsule = kind == "Capsule_1" and not sizes["height"] and len({*sizes.values(), 0.0}) > 2
    if not min(scale) > 0 or is_flat_capsule:
        report.warn(
            BAD_SIZE, prim.GetPath(), f"{kind} left out: {', '.join(f'{n} {shown(v)}' for n, v in values.items())}"
        )
        return None
    matrix = np.eye(4)
    matrix[:3, :3] = _AXES[axis] * np.array(scale)
    return Shape((is_left_handed, *key), matrix)


def _magnitude(value: object) -> float:
    found = numbers(value)
    return abs(found[0]) if found is not None and len(found) == 1 else math.nan


def make_shape(key: tuple[object, ...]) -> Mesh:
    """Return the unit mesh that a ``Shape.key`` names."""
    is_left_handed, kind, *ratios = key
    if kind == "Cube":
        mesh = _cube()
    elif kind == "Plane":
        square = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], np.float32)
        mesh = Mesh(square, np.array([(0, 1, 2), (0, 2, 3)], np.int32), face_ids=np.zeros(2, np.int32))
    else:
        bottom, top, half_height = (float(ratio) for ratio in ratios)  # type: ignore[arg-type]
        mesh = _revolve(_outline(kind == "Capsule", bottom, top, half_height))
    return _turned_inside_out(mesh) if is_left_handed else mesh


def _turned_inside_out(mesh: Mesh) -> Mesh:
    """Return the mesh that ``orientation = "leftHanded"`` asks for: wound the other way, normals reversed."""
    normals = mesh.normals
    if normals is not None:
        indices = None if normals.indices is None else normals.indices[:, [0, 2, 1]]
        normals = Primvar(-normals.values, indices)
    return replace(mesh, triangles=mesh.triangles[:, [0, 2, 1]], normals=normals)


_SIZES = {
    "Sphere": ("radius",),
    "Cube": ("size",),
    "Cylinder": ("radius", "height"),
    "Cylinder_1": ("radiusBottom", "radiusTop", "height"),
    "Cone": ("radius", "height"),
    "Capsule": ("radius", "height"),
    "Capsule_1": ("radiusBottom", "radiusTop", "height"),
    "Plane": ("width", "length"),
}


def _unit_shape(kind: str, axis: str, sizes: dict[str, float]) -> tuple[tuple[object, ...], tuple[float, float, float]]:
    """Return the recipe of the unit mesh and its scale along unit x, y and z."""
    if kind == "Cube":
        half = sizes["size"] / 2
        return ("Cube",), (half, half, half)
    if kind == "Plane":
        half_width, half_length = sizes["width"] / 2, sizes["length"] / 2
        # UsdGeomPlane: width runs along x, or along z about axis X; length along y, or along z about axis Y.
        return ("Plane",), (half_width, half_length, 1.0) if axis == "Z" else (half_length, half_width, 1.0)
    bottom = sizes.get("radiusBottom", sizes.get("radius", 0.0))
    top = 0.0 if kind == "Cone" else sizes.get("radiusTop", bottom)
    radius = max(bottom, top)
    if not radius > 0:
        return ("Capsule", 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    if kind in ("Sphere", "Capsule", "Capsule_1"):
        half_height = sizes.get("height", 0.0) / 2 / radius
        return ("Capsule", bottom / radius, top / radius, half_height), (radius, radius, radius)
    return ("Cylinder", bottom / radius, top / radius, 1.0), (radius, radius, sizes["height"] / 2)


def _outline(is_capsule: bool, bottom: float, top: float, half_height: float) -> list[Band]:
    """Return the outline of a truncated cone, closed by disks, or by spherical caps that continue it smoothly.

    Where the radii of a capsule differ, its caps are more and less than half spheres: UsdGeomCapsule_1's extent
    shows that they touch the side without an edge.
    """
    slope = np.array([2 * half_height, bottom - top]) if half_height > 0 else np.array([1.0, 0.0])
    side = slope / np.linalg.norm(slope)
    elevation = math.atan2(side[1], side[0])
    bands = []
    if bottom > 0:
        if is_capsule:
            bands += _cap(bottom, -half_height, -math.pi / 2, elevation)
        else:
            bands.append(Band((0.0, -half_height), (bottom, -half_height), (0.0, -1.0), (0.0, -1.0)))
    if half_height > 0:
        across = (float(side[0]), float(side[1]))
        bands.append(Band((bottom, -half_height), (top, half_height), across, across))
    if top > 0:
        if is_capsule:
            bands += _cap(top, half_height, elevation, math.pi / 2)
        else:
            bands.append(Band((top, half_height), (0.0, half_height), (0.0, 1.0), (0.0, 1.0)))
    return bands


def _cap(rim: float, rim_z: float, low: float, high: float) -> list[Band]:
    """Return the part of a sphere's outline between two elevations, one of them the rim's and one a pole's [rad]."""
    is_top = high == math.pi / 2
    elevation = low if is_top else high
    radius = rim / math.cos(elevation)
    center = rim_z - radius * math.sin(elevation)
    ring_count = math.ceil(round((high - low) / (math.pi / 2) * _QUARTER_RINGS, 6))
    normals = [(math.cos(angle), math.sin(angle)) for angle in np.linspace(low, high, ring_count + 1)]
    ring = [(radius * r, center + radius * z) for r, z in normals]
    # Exactly the rim that the side has, and exactly the axis.
    ring[0 if is_top else -1] = (rim, rim_z)
    pole = -1 if is_top else 0
    normals[pole] = (0.0, 1.0 if is_top else -1.0)
    ring[pole] = (0.0, center + radius * normals[pole][1])
    return [Band(ring[i], ring[i + 1], normals[i], normals[i + 1]) for i in range(ring_count)]


def _revolve(bands: Sequence[Band]) -> Mesh:
    """Return the surface that an outline sweeps about z, closed where the outline begins and ends on the axis."""
    angle = np.arange(_SEGMENTS) * (2 * np.pi / _SEGMENTS)
    points, normals = _Rings(angle), _Rings(angle)
    # At a tip each triangle has a normal of its own: the surface's halfway between the triangle's two sides.
    tip_normals = _Rings(angle + np.pi / _SEGMENTS)
    triangles, corners = [], []
    here = np.arange(_SEGMENTS)
    beyond = (here + 1) % _SEGMENTS
    for band in bands:
        low, high = points.row(band.start), points.row(band.end)
        low_normal, high_normal = normals.row(band.start_normal), normals.row(band.end_normal)
        if band.end[0] > 0:
            triangles.append(np.stack([low[here], high[beyond], high[here]], axis=1))
            first = low_normal[here] if band.start[0] > 0 else -1 - tip_normals.row(band.start_normal)
            corners.append(np.stack([first, high_normal[beyond], high_normal[here]], axis=1))
        if band.start[0] > 0:
            triangles.append(np.stack([low[here], low[beyond], high[beyond]], axis=1))
            last = high_normal[beyond] if band.end[0] > 0 else -1 - tip_normals.row(band.end_normal)
            corners.append(np.stack([low_normal[here], low_normal[beyond], last], axis=1))
    indices = np.concatenate(corners)
    plain = normals.rows()
    indices = np.where(indices < 0, len(plain) - 1 - indices, indices).astype(np.int32)
    mesh_points = points.rows()
    mesh_triangles = np.concatenate(triangles).astype(np.int32)
    return Mesh(
        points=mesh_points,
        triangles=mesh_triangles,
        normals=Primvar(np.concatenate([plain, tip_normals.rows()]), indices),
        is_closed=encloses_volume(mesh_points, mesh_triangles),
    )


class _Rings:
    """Circles of vectors about z, each stored once; one on the axis is a single vector."""

    def __init__(self, angle: np.ndarray) -> None:
        self._circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        self._rows: dict[tuple[float, float], np.ndarray] = {}
        self._values: list[np.ndarray] = []
        self._count = 0

    def row(self, ring: tuple[float, float]) -> np.ndarray:
        """Return the row of each of the circle's vectors, shape [segments], making the ring (radius, z) if new."""
        if ring not in self._rows:
            radius, z = ring
            count = _SEGMENTS if radius > 0 else 1
            self._rows[ring] = self._count + (np.arange(_SEGMENTS) % count)
            flat = self._circle[:count] * radius
            self._values.append(np.concatenate([flat, np.full((count, 1), z)], axis=1))
            self._count += count
        return self._rows[ring]

    def rows(self) -> np.ndarray:
        """Return the vectors: float32, shape [k, 3]."""
        return np.concatenate([*self._values, np.zeros((0, 3))]).astype(np.float32)


def _cube() -> Mesh:
    """Return the cube [-1, 1]^3, its faces numbered -x, x, -y, y, -z, z."""
    corner = np.arange(8)
    points = np.stack([corner & 1, corner >> 1 & 1, corner >> 2], axis=1) * 2.0 - 1.0
    quads = np.array([(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)])
    triangles = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3).astype(np.int32)
    return Mesh(
        points.astype(np.float32), triangles, face_ids=np.repeat(np.arange(6), 2).astype(np.int32), is_closed=True
    )
