# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Meshes, shapes that rays meet exactly, their primvars, and where they are placed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import IntEnum, IntFlag

import numpy as np

from warp_rt.errors import SceneError
from warp_rt.scene.instance_transforms import LazyTransforms, Transforms, choose


@dataclass(frozen=True)
class Primvar:
    """Values over a mesh, looked up by triangle corner, or along shapes. Every USD interpolation fits: ``indices``."""

    values: np.ndarray
    """float32, shape [k, c] with c = 1 to 4 components, k >= 1."""
    indices: np.ndarray | None = None
    """Rows of ``values``, int32; None: constant, row 0 everywhere.

    Of a mesh: shape [triangle_count, 3], one row a corner; vertex interpolation shares ``Mesh.triangles``, uniform
    repeats one row thrice. Of shapes: shape [shape_count, r], the r = 1, 2 or 4 Bernstein coefficients of a polynomial
    in the shape's u: r = 1 is uniform, 2 is linear from end to end, 4 follows a cubic curve."""


@dataclass(frozen=True)
class Mesh:
    """Triangles in their own space, shared by any number of instances."""

    points: np.ndarray
    """float32, shape [n, 3], local space."""
    triangles: np.ndarray
    """int32, shape [m, 3], wound so that cross(p1 - p0, p2 - p0) is the outward geometric normal
    (leftHanded orientation is undone here; a mirroring transform is not)."""
    normals: Primvar | None = None
    """Shading normals, local space, three components; None: flat shading with the geometric normal."""
    primvars: Mapping[str, Primvar] = field(default_factory=dict)
    """By name without the ``primvars:`` prefix: ``st``, ``displayColor``, ..."""
    material_slots: np.ndarray | None = None
    """int32, shape [m], slot of each triangle in its instance's materials; None: slot 0 for all."""
    face_ids: np.ndarray | None = None
    """int32, shape [m], face of the source mesh that each triangle was cut from; None: the triangle's own index."""
    is_closed: bool = False
    """Whether the surface bounds a volume (every edge used once each way): only then does refraction bend rays."""


class ShapeKind(IntEnum):
    """Curved primitives that rays meet exactly, without triangles."""

    SPHERE = 1
    """About one point."""
    FRUSTUM = 2
    """A truncated cone about the line between two points, each the centre of a circle; a cylinder, a cone."""
    ROUND_CONE = 3
    """What a ball sweeps on its way between two points, its radius changing linearly; a capsule."""
    LINEAR_TUBE = 4
    """A segment of a curve: a round cone that rays meet from outside only, so that its joints do not show."""
    CUBIC_TUBE = 5
    """What a ball sweeps along a cubic Bezier curve, its radius a cubic too; met from outside only."""


SHAPE_POINTS: Mapping[ShapeKind, int] = {
    ShapeKind.SPHERE: 1,
    ShapeKind.FRUSTUM: 2,
    ShapeKind.ROUND_CONE: 2,
    ShapeKind.LINEAR_TUBE: 2,
    ShapeKind.CUBIC_TUBE: 4,
}
"""Control points of each kind."""


@dataclass(frozen=True)
class Shapes:
    """Curved primitives of one kind in their own space, shared by any number of instances like a ``Mesh``.

    Where a ray meets one, u runs from the first point (0) to the last (1). The primvar ``st`` of a solid that has none
    of its own is its parametrisation: s the turn about the line from the first to the last point (of a sphere: about
    z), counter-clockwise from x, t the way along it (of a sphere: the latitude), both from 0 to 1.
    """

    kind: ShapeKind
    points: np.ndarray
    """float32, shape [n, k, 3], k as ``SHAPE_POINTS`` has it, local space."""
    radii: np.ndarray
    """float32, shape [n, k], at the points, not negative."""
    caps: tuple[bool, bool] = (True, True)
    """Whether disks close frusta at their first and at their last points."""
    primvars: Mapping[str, Primvar] = field(default_factory=dict)
    """By name without the ``primvars:`` prefix."""
    face_ids: np.ndarray | None = None
    """int32, shape [n], element of the source prim that each was made from; None: its own index."""
    is_closed: bool = True
    """Whether each bounds a volume: only then does refraction bend rays."""
    is_inside_out: bool = False
    """Whether normals point inwards, as ``orientation`` leftHanded asks for."""
    has_st: bool = False
    """Whether the parametrisation stands in for a primvar ``st``; never of tubes."""

    def __post_init__(self) -> None:
        """Refuse numbers that a hierarchy cannot be built over.

        Raises:
            SceneError: A point is not finite, or a radius is not or is negative.
        """
        if not (np.isfinite(self.points).all() and np.isfinite(self.radii).all() and (self.radii >= 0).all()):
            raise SceneError("shapes: finite points and finite radii of at least 0 expected")

    @property
    def cap_bits(self) -> int:
        """``caps`` as bits: 1 for the first, 2 for the last."""
        return self.caps[0] + 2 * self.caps[1]


class RayMask(IntFlag):
    """Kinds of rays."""

    EYE = 1
    BOUNCES = 2
    """Reflection and refraction."""
    SHADOWS = 4
    ALL = 7


@dataclass(frozen=True)
class Instances:
    """The placed meshes and sets of shapes, one row each."""

    mesh: np.ndarray
    """int32, shape [n], row of ``Scene.meshes``."""
    world_from_local: Transforms
    """float64, shape [n, 4, 4], invertible and affine; an array, or what is read as one: see ``LazyTransforms``."""
    material_offset: np.ndarray
    """int32, shape [n]: the material of a triangle is ``material_table[material_offset[i] + slot]``."""
    material_table: np.ndarray
    """int32, shape [k], rows of ``Scene.materials``."""
    prim: np.ndarray
    """int32, shape [n], row of ``Scene.prims``: the primId."""
    instance_id: np.ndarray
    """int32, shape [n], row of ``Scene.instance_paths`` or -1 where the geometry is not instanced: the instanceId."""
    primvars: Mapping[str, np.ndarray] = field(default_factory=dict)
    """Values that take precedence over the mesh's primvar of that name: float32, shape [n, c]; a row of NaN: none."""
    seen_by: np.ndarray | None = None
    """uint8, shape [n], ``RayMask`` of the rays that each is there for; others pass straight through. None: all."""
    is_matte: np.ndarray | None = None
    """bool, shape [n], which hold out: where eye rays meet them, the picture is black and transparent. None: none."""

    def __post_init__(self) -> None:
        """Refuse transforms that place nothing anywhere.

        Raises:
            SceneError: A number is not finite.
        """
        placed = self.world_from_local
        if not (placed.are_finite if isinstance(placed, LazyTransforms) else np.isfinite(placed).all()):
            raise SceneError("instances: finite transforms expected")

    def __len__(self) -> int:
        return len(self.mesh)

    def __getitem__(self, rows: np.ndarray) -> Instances:
        """Return some of them, in the order of ``rows``."""
        return replace(
            self,
            mesh=self.mesh[rows],
            world_from_local=choose(self.world_from_local, rows),
            material_offset=self.material_offset[rows],
            prim=self.prim[rows],
            instance_id=self.instance_id[rows],
            primvars={name: values[rows] for name, values in self.primvars.items()},
            seen_by=None if self.seen_by is None else self.seen_by[rows],
            is_matte=None if self.is_matte is None else self.is_matte[rows],
        )


def is_closed(triangles: np.ndarray) -> bool:
    """Return whether a triangle mesh is closed: each directed edge is matched by just as many opposite ones.

    Args:
        triangles: Vertex indices, shape [m, 3]. Vertices that merely coincide count as different ones.
    """
    if not len(triangles):
        return False
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).astype(np.int64)
    edges = edges[edges[:, 0] != edges[:, 1]]
    key = edges.min(axis=1) * (int(triangles.max()) + 1) + edges.max(axis=1)
    _, edge = np.unique(key, return_inverse=True)
    balance = np.bincount(edge.reshape(-1), weights=np.where(edges[:, 0] < edges[:, 1], 1.0, -1.0))
    return bool((balance == 0).all())
