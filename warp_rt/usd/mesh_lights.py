# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Geometry that shines: its triangles, and what its materials emit.

Reference: UsdLux MeshLightAPI, GeometryLight, and LightAPI's ``light:materialSyncMode``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from pxr import Usd

from warp_rt.report import Report
from warp_rt.scene import Image, Input, Instances, Material, MaterialModel, Mesh, ShapeKind, Shapes, Texture
from warp_rt.usd import implicit
from warp_rt.usd.glow import Glow, glow_of
from warp_rt.usd.questions import get_type_name
from warp_rt.usd.solid_triangles import MOST, SOLIDS, enclosing_triangles, placed_triangles


@dataclass(frozen=True)
class ShiningMesh:
    """What geometry gives the light that is applied to it, or that names it."""

    triangles: np.ndarray
    """float32, shape [n, 3, 3], the light's space, wound as seen from outside."""
    density: float
    """Area of the geometry by that of the triangles: below 1 where these stand out of a curved shape."""
    is_closed: bool
    """Whether it bounds a volume."""
    ball_triangles: int
    """How many of the triangles stand for a ball, each so many in a row; 0: they do not."""
    is_solid: bool
    """Whether it is a curved shape, which has no side but its outside."""
    glow: Glow
    """What its materials emit, a row a triangle."""


class MeshLightReader:
    """Finds the geometry of mesh lights among what is drawn.

    Args:
        meshes: All of the scene.
        instances: Where they are placed.
        prims: Path of each of their ``prim``.
        materials: Rows of the instances' materials.
        textures: Of the materials.
        images: Of the textures.
    """

    def __init__(
        self,
        meshes: Sequence[Mesh | Shapes],
        instances: Instances,
        prims: Sequence[str],
        materials: Sequence[Material],
        textures: Sequence[Texture],
        images: Sequence[Image],
    ) -> None:
        self._meshes = meshes
        self._instances = instances
        self._prims = prims
        self._materials = materials
        self._textures = textures
        self._images = images
        self._own: list[tuple[np.ndarray, tuple[float, float, float]]] = []

    def rows(self, prim: Usd.Prim) -> np.ndarray:
        """Return the rows of the instances that draw a prim: int64, shape [n]; none where it is not drawn."""
        rows, starts = self._by_prim
        found = [rows[starts[k] : starts[k + 1]] for k in self._numbers.get(str(prim.GetPath()), ())]
        return np.sort(np.concatenate([np.zeros(0, np.int64), *found]))

    @cached_property
    def _numbers(self) -> dict[str, list[int]]:
        """The numbers that ``Instances.prim`` has for each path."""
        numbers: dict[str, list[int]] = {}
        for number, path in enumerate(self._prims):
            numbers.setdefault(path, []).append(number)
        return numbers

    @cached_property
    def _by_prim(self) -> tuple[np.ndarray, np.ndarray]:
        """The rows of the instances, prim by prim, and where each prim's begin: its number's row and the next."""
        prims = self._instances.prim
        return np.argsort(prims, kind="stable"), np.searchsorted(np.sort(prims), np.arange(len(self._prims) + 1))

    def show_as_light(self, prim: Usd.Prim, radiance: Sequence[float]) -> None:
        """Have geometry that shines answer to no light: ``light:materialSyncMode`` is noMaterialResponse.

        Args:
            prim: The geometry.
            radiance: What is seen of it.
        """
        red, green, blue = (max(float(value), 0.0) for value in radiance)
        self._own.append((self.rows(prim), (red, green, blue)))

    def surfaces(self) -> tuple[Instances, tuple[Material, ...]]:
        """Return the scene's instances and materials, with those of what is to be seen as its light."""
        if not self._own:
            return self._instances, tuple(self._materials)
        offset, table = self._instances.material_offset.copy(), [self._instances.material_table]
        materials: list[Material] = []
        start = len(table[0])
        for rows, radiance in self._own:
            slots = 1 + max(int(self._slots(row).max(initial=0)) for row in rows)
            offset[rows] = start
            table.append(np.full(slots, len(self._materials) + len(materials), table[0].dtype))
            materials.append(_lamp(radiance))
            start += slots
        instances = replace(self._instances, material_offset=offset, material_table=np.concatenate(table))
        return instances, (*self._materials, *materials)

    def _slots(self, row: int) -> np.ndarray:
        """Return the material slot of each triangle of an instance's mesh: nothing where all have the first."""
        mesh = self._meshes[self._instances.mesh[row]]
        slots = mesh.material_slots if isinstance(mesh, Mesh) else None
        return np.zeros(0, int) if slots is None else slots

    def read(
        self, prim: Usd.Prim, world_from_local: np.ndarray, time: Usd.TimeCode, *, is_shaped: bool
    ) -> ShiningMesh | None:
        """Return what shines of geometry that is a light itself; None where it is not drawn, or cannot shine.

        Args:
            prim: The geometry.
            world_from_local: Shape [4, 4], of the copy that is asked for, which may have primvars of its own.
            time: When.
            is_shaped: Whether the light is: see :func:`enclosing_triangles`.
        """
        rows = self.rows(prim)
        if not len(rows):
            return None
        local_from_mesh = np.eye(4)
        if get_type_name(prim) in implicit.TYPES:
            shape = implicit.read_shape(prim, time, Report())  # what is wrong with it has been told
            if shape is None:
                return None
            local_from_mesh = shape.local_from_unit
        row = rows[0]
        if self._instances.primvars and len(rows) > 1:
            places = np.stack([self._instances.world_from_local[row] for row in rows])
            row = rows[np.abs(places - world_from_local @ local_from_mesh).sum(axis=(1, 2)).argmin()]
        return self._shining(int(row), local_from_mesh, is_shaped)

    def read_target(self, prim: Usd.Prim, world_from_light: np.ndarray, *, is_shaped: bool) -> ShiningMesh | None:
        """Return what shines of geometry that a GeometryLight names, everywhere it is drawn; None if it cannot shine.

        Args:
            prim: The geometry.
            world_from_light: The light's, float64, shape [4, 4], invertible.
            is_shaped: Whether the light is: see :func:`enclosing_triangles`.
        """
        light_from_world = np.linalg.inv(world_from_light)
        world_from_local = self._instances.world_from_local
        rows = self.rows(prim)
        parts = [self._shining(int(row), light_from_world @ world_from_local[row], is_shaped) for row in rows]
        found = [part for part in parts if part is not None]
        if not found:
            return None
        colors = np.concatenate([part.glow.colors for part in found])
        glow = Glow(colors, any(part.glow.is_mean for part in found))
        each = {part.ball_triangles for part in found}
        return replace(
            found[0],
            triangles=np.concatenate([part.triangles for part in found]),
            ball_triangles=each.pop() if len(each) == 1 else 0,
            glow=glow,
        )

    def _shining(self, row: int, light_from_mesh: np.ndarray, is_shaped: bool) -> ShiningMesh | None:
        """Return what shines of an instance; None of curves, and of more than ``MOST`` points."""
        mesh = self._meshes[self._instances.mesh[row]]
        if isinstance(mesh, Shapes):
            if mesh.kind not in SOLIDS or len(mesh.points) > MOST:
                return None
            triangles, density = enclosing_triangles(mesh, light_from_mesh, is_shaped=is_shaped)
            ball_triangles = _per_ball(mesh, light_from_mesh, len(triangles))
        else:
            ball_triangles = 0
            triangles = placed_triangles(mesh.points[mesh.triangles].astype(float), light_from_mesh)
            triangles, density = triangles.astype(np.float32), 1.0
        sides = triangles[:, 1:] - triangles[:, :1]
        areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).astype(float)
        table = self._instances.material_table[self._instances.material_offset[row] :]
        slots = 1 + int(self._slots(row).max(initial=0))
        materials = [self._materials[table[slot]] for slot in range(slots)]
        values = {name: rows[row] for name, rows in self._instances.primvars.items()}
        constants = {name: value for name, value in values.items() if not np.isnan(value).any()}
        glow = glow_of(mesh, materials, constants, self._textures, self._images, areas)
        is_solid = isinstance(mesh, Shapes)
        return ShiningMesh(triangles, density, mesh.is_closed, ball_triangles, is_solid, glow)


def _per_ball(shapes: Shapes, matrix: np.ndarray, count: int) -> int:
    """Return how many of ``count`` triangles stand for each of some shapes under a matrix; 0: these are no balls."""
    scales = matrix[:3, :3].T @ matrix[:3, :3]
    is_even = np.allclose(scales, np.eye(3) * scales[0, 0], rtol=0, atol=1e-4 * scales[0, 0])
    balls = int(np.count_nonzero(shapes.radii.max(axis=1)))
    if shapes.kind != ShapeKind.SPHERE or shapes.is_inside_out or not is_even or not balls:
        return 0
    return 0 if count % balls else count // balls


def _lamp(radiance: tuple[float, float, float]) -> Material:
    """Return the material that emits a radiance and answers to no light."""
    black = Input((0.0, 0.0, 0.0, 1.0))
    inputs = {"diffuseColor": black, "specularColor": black, "emissiveColor": Input((*radiance, 1.0))}
    return Material("/__lightRadiance", MaterialModel.PREVIEW, inputs, use_specular_workflow=True)
