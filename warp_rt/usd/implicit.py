# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Sphere, Cube, Cylinder, Cone, Capsule and Plane as shared unit shapes; the prim's size goes into the transform.

A thousand spheres of any size are one sphere in memory. Cube and Plane are triangles, the others exact curved shapes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from pxr import Usd

from warp_rt.report import Report
from warp_rt.scene import Mesh, Primvar, ShapeKind, Shapes
from warp_rt.usd.attribute_values import AttributeReader, numbers, shown
from warp_rt.usd.mesh import INVALID_VALUE, ORIENTATIONS
from warp_rt.usd.polygons import MAX_COORDINATE
from warp_rt.usd.questions import get_type_name

TYPES = ("Sphere", "Cube", "Cylinder", "Cylinder_1", "Cone", "Capsule", "Capsule_1", "Plane")
BAD_SIZE = "W140"

_WITHOUT_AXIS = ("Sphere", "Cube")

# Columns: where local x, y and z point. Cyclic, so that no axis mirrors.
_AXES = {
    "X": np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    "Y": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
    "Z": np.eye(3),
}

_NOTHING: tuple[tuple[object, ...], tuple[float, float, float]] = (), (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Shape:
    """A unit shape by its recipe, and how large it is."""

    key: tuple[object, ...]
    """Equal for shapes that share their geometry; ``make_shape`` makes it."""
    local_from_unit: np.ndarray
    """float64, shape [4, 4]."""


def read_shape(prim: Usd.Prim, time: Usd.TimeCode, report: Report) -> Shape | None:
    """Return the shape of a prim whose type is one of ``TYPES``; None, with a diagnostic, if it has no extent."""
    kind = get_type_name(prim)
    attributes = AttributeReader(prim, time, INVALID_VALUE, report)
    values = {name: attributes.value(name) for name in _SIZES[kind]}
    signed = {name: _size(value) for name, value in values.items()}
    # A negative size has no meaning of its own; its magnitude keeps the shape from being turned inside out.
    sizes = {name: abs(size) for name, size in signed.items()}
    has_sizes = all(math.isfinite(size) for size in sizes.values())
    axis = attributes.token("axis", "Z", tuple(_AXES)) if kind not in _WITHOUT_AXIS else "Z"
    is_left_handed = attributes.token("orientation", ORIENTATIONS[0], ORIENTATIONS) == "leftHanded"
    key, scale = _unit_shape(kind, axis, sizes) if has_sizes else _NOTHING
    if not min(scale) > 0:
        report.warn(
            BAD_SIZE, prim.GetPath(), f"{kind} left out: {', '.join(f'{n} {shown(v)}' for n, v in values.items())}"
        )
        return None
    if negative := [f"{name} {size:g}" for name, size in signed.items() if size < 0]:
        report.warn(BAD_SIZE, prim.GetPath(), f"below 0, the magnitude is taken: {', '.join(negative)}")
    matrix = np.eye(4)
    matrix[:3, :3] = _AXES[axis] * np.array(scale)
    return Shape((is_left_handed, *key), matrix)


def _size(value: object) -> float:
    found = numbers(value)
    return found[0] if found is not None and len(found) == 1 else math.nan


def make_shape(key: tuple[object, ...]) -> Mesh | Shapes:
    """Return the unit shape that a ``Shape.key`` names."""
    is_left_handed, kind, *ratios = key
    if kind == "Cube":
        return _make_cube(bool(is_left_handed))
    if kind == "Plane":
        return _make_plane(str(ratios[0]), bool(is_left_handed))
    bottom, top, half_height = (float(ratio) for ratio in ratios)  # type: ignore[arg-type]
    z: tuple[float, ...]
    radii: tuple[float, ...]
    if kind == "Cylinder":
        which, z, radii = ShapeKind.FRUSTUM, (-half_height, half_height), (bottom, top)
    elif half_height:
        which = ShapeKind.ROUND_CONE
        z, radii = _capsule_balls(bottom, top, half_height)
    else:
        which, z, radii = ShapeKind.SPHERE, (0.0,), (bottom,)
    return Shapes(
        which,
        points=np.array([[(0.0, 0.0, level) for level in z]], np.float32),
        radii=np.array([radii], np.float32),
        is_inside_out=bool(is_left_handed),
        has_st=True,
    )


def _capsule_balls(bottom: float, top: float, half_height: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the heights and radii of the balls that a capsule of two radii is the hull of.

    ``radiusBottom`` and ``radiusTop`` are those of the circles, a height apart, in which the side meets the caps: as
    UsdGeomCapsule_1's extent shows, the caps continue the side without an edge, more and less than half spheres.
    """
    slope = (bottom - top) / (2 * half_height)
    longer = math.sqrt(1 + slope * slope)  # by which the spheres' radii are more than the circles'
    return (-half_height - bottom * slope, half_height - top * slope), (bottom * longer, top * longer)


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
    """Return the recipe of the unit shape and its scale along unit x, y and z."""
    if kind == "Cube":
        half = sizes["size"] / 2
        return ("Cube",), (half, half, half)
    if kind == "Plane":
        half_width, half_length = sizes["width"] / 2, sizes["length"] / 2
        # UsdGeomPlane: width runs along x, or along z about axis X; length along y, or along z about axis Y.
        return ("Plane", axis), (half_width, half_length, 1.0) if axis == "Z" else (half_length, half_width, 1.0)
    bottom = sizes.get("radiusBottom", sizes.get("radius", 0.0))
    top = 0.0 if kind == "Cone" else sizes.get("radiusTop", bottom)
    radius = max(bottom, top)
    if not radius > 0:
        return _NOTHING
    if kind in ("Sphere", "Capsule", "Capsule_1"):
        half_height = sizes.get("height", 0.0) / 2 / radius
        # Circles at one height are joined by no side; of other extremes the unit shape has no numbers.
        is_flat = abs(bottom - top) / radius > 2 * MAX_COORDINATE * half_height
        if is_flat or half_height > MAX_COORDINATE:
            return _NOTHING
        return ("Capsule", bottom / radius, top / radius, half_height), (radius, radius, radius)
    return ("Cylinder", bottom / radius, top / radius, 1.0), (radius, radius, sizes["height"] / 2)


def _make_plane(axis: str, is_left_handed: bool) -> Mesh:
    """Return the square [-1, 1]^2 that faces z, with ``st`` upright to whom it faces.

    s runs along x, about axis X along -z; t along y, about axis Y along -z.
    """
    points = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    lower_left = {"X": 3, "Y": 1, "Z": 0}[axis]
    return _join_squares(points, np.arange(4)[None], np.array([lower_left]), is_left_handed)


def _make_cube(is_left_handed: bool) -> Mesh:
    """Return the cube [-1, 1]^3, its faces numbered -x, x, -y, y, -z, z, with ``st`` upright from outside.

    t runs along y, on the upper face along -z and on the lower one along z.
    """
    corner = np.arange(8)
    points = np.stack([corner & 1, corner >> 1 & 1, corner >> 2], axis=1) * 2.0 - 1.0
    quads = np.array([(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)])
    return replace(_join_squares(points, quads, np.array([0, 3, 0, 1, 3, 0]), is_left_handed), is_closed=True)


def _join_squares(points: np.ndarray, quads: np.ndarray, lower_left: np.ndarray, is_left_handed: bool) -> Mesh:
    """Return squares, each with ``st`` from 0 to 1.

    Args:
        points: Shape [n, 3].
        quads: Corners of each square, counter-clockwise, shape [q, 4].
        lower_left: Which of its corners has st (0, 0), shape [q].
        is_left_handed: Whether they are wound the other way round.
    """
    split = np.array([0, 2, 1, 0, 3, 2] if is_left_handed else [0, 1, 2, 0, 2, 3])
    st = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)
    rows = (split - lower_left[:, None]) % 4
    return Mesh(
        points.astype(np.float32),
        quads[:, split].reshape(-1, 3).astype(np.int32),
        primvars={"st": Primvar(st, rows.reshape(-1, 3).astype(np.int32))},
        face_ids=np.repeat(np.arange(len(quads)), 2).astype(np.int32),
    )
