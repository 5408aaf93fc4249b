# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The prims that are drawn: listed as the walk meets them, their geometry and materials read when all are known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from pxr import Usd

from warp_rt.report import Report
from warp_rt.scene import Instances, Mesh, Shapes
from warp_rt.usd import curves
from warp_rt.usd.authored import Authored, AuthoredReader
from warp_rt.usd.bindings import Bindings, extend_bindings
from warp_rt.usd.context import Context
from warp_rt.usd.displacements import DisplacementReader, Move
from warp_rt.usd.draw_modes import StandIn
from warp_rt.usd.geometry import read_geometry
from warp_rt.usd.implicit import Shape, make_shape
from warp_rt.usd.materials import MaterialReader
from warp_rt.usd.motion import read_times
from warp_rt.usd.skinning import Skin
from warp_rt.usd.sources import MeshSource, Source


@dataclass(frozen=True)
class Gprims:
    """What is drawn of the listed prims, a row each; prims, meshes and sets of materials count from the first drawn."""

    meshes: tuple[Mesh | Shapes, ...]
    prims: tuple[str, ...]
    """Paths."""
    tail_starts: tuple[int, ...]
    """Where, in each of these paths, what belongs to the innermost instance begins: see ``Context``."""
    material_sets: tuple[tuple[int, ...], ...]
    """Materials of the slots of a mesh."""
    mesh: np.ndarray
    """int32, shape [n], row of ``meshes``; -1: there is nothing to draw."""
    prim: np.ndarray
    """int32, shape [n], row of ``prims``."""
    materials: np.ndarray
    """int32, shape [n], row of ``material_sets``."""
    primvars: tuple[frozenset[str], ...]
    """Names of the primvars that each mesh has of its prim, so that none is inherited."""
    object_from_local: Mapping[int, np.ndarray]
    """By row of ``prims``, of those that are unit shapes: see ``Scene``."""

    def has_own(self, name: str, rows: np.ndarray) -> np.ndarray:
        """Return which rows have a mesh with a primvar of that name: bool, shape [k]."""
        of_mesh = np.array([name in names for names in self.primvars] or [False])
        return of_mesh[self.mesh[rows]]


_Listed: TypeAlias = tuple[Usd.Prim, str, int, Context, tuple[int, ...], np.ndarray | None]
"""A prim that is drawn, its path, the row of its source, what its children have from it, the materials that it has
whatever is bound (empty: none), and its object from local where it is a unit shape: float64, shape [4, 4]. (With names
it would take five times as long to make.)"""


class GprimReader:
    """Lists the prims that are drawn, then reads them.

    Geometry that instances share, or that is a unit shape, is read once.

    Args:
        time: When attributes are read.
        materials: Gives the material of each prim.
        report: Takes the diagnostics.
        level: Refinements of subdivision surfaces of which no prim says how often they are refined.
        base_time: See ``read_times``; None: ``time``.
        levels: Refinements of the surfaces of some prims, by path.
    """

    def __init__(
        self,
        time: Usd.TimeCode,
        materials: MaterialReader,
        report: Report,
        level: int,
        base_time: Usd.TimeCode | None = None,
        levels: Mapping[str, int] | None = None,
    ) -> None:
        self._time = time
        self._base_time = time if base_time is None else base_time
        self._materials = materials
        self._report = report
        self._level = level
        self._levels = levels or {}
        self._displacements = DisplacementReader(materials, report)
        self._authored = AuthoredReader()
        self._listed: list[_Listed] = []
        self._sources: list[Source | Shape | StandIn] = []
        self._rows: dict[object, int] = {}
        """Row of the source with a certain key."""

    def add(
        self,
        prim: Usd.Prim,
        path: str,
        kind: str,
        context: Context,
        authored: Authored,
        skin: Skin | None,
        has_children: bool,
    ) -> int:
        """List a prim of one of ``geometry.TYPES``; return its row.

        Args:
            prim: The prim.
            path: Its path.
            kind: Its type.
            context: What its children have from it.
            authored: What it authors.
            skin: Deforms it.
            has_children: Whether there are prims below it.
        """
        # Instances of a mesh share it, but each skeleton makes another one of it.
        key = str(prim.GetPrimInPrototype().GetPath()) if context.is_proxy and skin is None else path
        time, carried_to = self._time, None
        if "velocities" in authored.names or "accelerations" in authored.names:
            time, carried_to = read_times(prim, time, self._base_time, self._report)
        level = context.level
        if level is None:
            level = self._levels.get(path, self._level) if self._levels else self._level
        has_space = context.may_have_color_space
        width = context.width if kind in curves.TYPES else None
        # Its fields by name would take twice as long, for every prim.
        fields = (prim, authored, skin, time, carried_to, level, kind, has_children, has_space, width)
        return self._add(prim, path, (key, level, width), tuple.__new__(Source, fields), context)

    def add_shape(self, prim: Usd.Prim, path: str, context: Context, shape: Shape) -> int:
        """List a prim that is a unit shape; return its row."""
        return self._add(prim, path, shape.key, shape, context, object_from_local=shape.local_from_unit)

    def add_stand_in(self, prim: Usd.Prim, path: str, context: Context, stand_in: StandIn) -> int:
        """List a model that is replaced; return its row."""
        return self._add(prim, path, stand_in.key, stand_in, context, stand_in.materials)

    def _add(
        self,
        prim: Usd.Prim,
        path: str,
        key: object,
        source: Source | Shape | StandIn,
        context: Context,
        materials: tuple[int, ...] = (),
        object_from_local: np.ndarray | None = None,
    ) -> int:
        row = self._rows.setdefault(key, len(self._sources))
        if row == len(self._sources):
            self._sources.append(source)
        self._listed.append((prim, path, row, context, materials, object_from_local))
        return len(self._listed) - 1

    def read(self) -> Gprims:
        """Return the listed prims' geometry and materials."""
        sources = self._read_sources()
        rows: list[tuple[int, int, int]] = []
        meshes: dict[object, int] = {}
        drawn: list[Mesh | Shapes] = []
        names: list[frozenset[str]] = []
        prims: dict[tuple[str, int], int] = {}
        material_sets: dict[tuple[int, ...], int] = {}
        spaces: dict[int, np.ndarray] = {}
        no_names: frozenset[str] = frozenset()  # unit shapes have stand-ins alone
        for prim, path, row, context, fixed, object_from_local in self._listed:
            source = sources[row]
            if source is None:
                rows.append((-1, -1, -1))
                continue
            bound = fixed or self._bind(prim, context.bindings, source)
            move = None
            if self._displacements.concern(bound):
                move = self._move(prim, row, context, source, bound)
            key = row if move is None else (row, *move.key)
            mesh = meshes.setdefault(key, len(meshes))
            if len(meshes) > len(drawn):
                drawn.append(source.mesh if move is None else self._displacements.apply(source.mesh, move))
                is_own = drawn[-1].primvars and not isinstance(self._sources[row], Shape)
                names.append(frozenset(drawn[-1].primvars) if is_own else no_names)
            number = prims.setdefault((path, context.tail_start), len(prims))
            if object_from_local is not None:
                spaces[number] = object_from_local
            rows.append((mesh, number, material_sets.setdefault(bound, len(material_sets))))
        of_mesh, of_prim, of_materials = np.array(rows, np.int32).reshape(-1, 3).T.copy()
        return Gprims(
            meshes=tuple(drawn),
            prims=tuple(path for path, _ in prims),
            tail_starts=tuple(start for _, start in prims),
            material_sets=tuple(material_sets),
            mesh=of_mesh,
            prim=of_prim,
            materials=of_materials,
            primvars=tuple(names),
            object_from_local=spaces,
        )

    def report_unreached(self, instances: Instances, prims: Sequence[str]) -> None:
        """Report what instances say of heights in vain: see ``DisplacementReader.report_unreached``."""
        self._displacements.report_unreached(instances, prims)

    def _move(
        self, prim: Usd.Prim, row: int, context: Context, source: MeshSource, materials: tuple[int, ...]
    ) -> Move | None:
        held = self._sources[row]
        level = held.level if isinstance(held, Source) else None
        return self._displacements.read(prim, source.mesh, level, materials, context.constants)

    def _read_sources(self) -> list[MeshSource | None]:
        rows = [row for row, source in enumerate(self._sources) if isinstance(source, Source)]
        held = [source for source in self._sources if isinstance(source, Source)]
        found = dict(zip(rows, read_geometry(held, self._report), strict=True))
        for row, source in enumerate(self._sources):
            if isinstance(source, Shape):
                found[row] = MeshSource(make_shape(source.key))
            elif isinstance(source, StandIn):
                found[row] = MeshSource(source.geometry)
        return [found[row] for row in range(len(self._sources))]

    def _bind(self, prim: Usd.Prim, bindings: Bindings, source: MeshSource) -> tuple[int, ...]:
        """Return the materials of a mesh's slots."""
        row = self._materials.bind(prim, bindings)
        if not source.subsets:
            return (row,)
        rows = [row]
        for name in source.subsets:
            subset = prim.GetChild(name)
            said = extend_bindings(bindings, subset, self._authored.read(subset, has_clips=False).bindings)
            rows.append(self._materials.bind(subset, said))
        return tuple(rows)
