# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Which prims their materials displace, and what of that a picture does not show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdGeom

from warp_rt.report import Report
from warp_rt.scene import Instances, Mesh, Shapes
from warp_rt.scene.displacement import Displacement, displaced
from warp_rt.usd.materials import DISPLACEMENT, MaterialReader
from warp_rt.usd.mesh import SUBDIVISION_SCHEMES
from warp_rt.usd.primvars import BLOCKED, Values
from warp_rt.usd.questions import get_type_name

COARSE = "N914"


@dataclass(frozen=True, eq=False)
class Move:
    """What materials do to a mesh."""

    displacements: tuple[Displacement | None, ...]
    """By material slot."""
    constants: Values
    """Primvars that heights are read from, and that the mesh has from above."""

    @property
    def key(self) -> tuple[object, ...]:
        """Equal for moves that make the same of a mesh."""
        return (self.displacements, *((name, value.tobytes()) for name, value in sorted(self.constants.items())))


class DisplacementReader:
    """Finds what materials do to the meshes that they are bound to.

    Args:
        materials: The materials.
        report: Takes the diagnostics.
    """

    def __init__(self, materials: MaterialReader, report: Report) -> None:
        self._materials = materials
        self._report = report
        self._heights: dict[str, dict[str, np.ndarray | None]] = {}
        """Of each displaced prim, the primvars that heights are read from, and what they are from above."""
        self._moving: dict[tuple[int, ...], bool] = {}

    def concern(self, materials: tuple[int, ...]) -> bool:
        """Return whether any of the materials of a prim's slots moves a surface."""
        moves = self._moving.get(materials)
        if moves is None:
            moves = self._moving[materials] = any(map(self._materials.displacement, materials))
        return moves

    def read(
        self,
        prim: Usd.Prim,
        geometry: Mesh | Shapes,
        level: int | None,
        materials: tuple[int, ...],
        constants: Values,
    ) -> Move | None:
        """Return what materials do to a prim's geometry; None: nothing, told, where they should.

        Args:
            prim: The prim.
            geometry: Its geometry.
            level: Refinements of its surface; None: the prim holds no geometry, but is a shape of a few numbers.
            materials: Those of its slots.
            constants: Primvars that it has from above.
        """
        displacements = tuple(map(self._materials.displacement, materials))
        if not any(displacements):
            return None
        if not isinstance(geometry, Mesh) or level is None:
            message = f"displacement left out: a {get_type_name(prim)} is a shape of its own, not a mesh"
            self._report.warn(DISPLACEMENT, prim.GetPath(), message)
            return None
        heights = [displacement.height for displacement in displacements if displacement]
        textures = self._materials.textures
        names = {textures[height.texture].primvar if height.texture >= 0 else height.primvar for height in heights}
        given = {
            name: value
            for name, value in constants.items()
            if name in names and name not in geometry.primvars and value is not BLOCKED
        }
        told = set()
        for name in sorted(names - {"", *given, *geometry.primvars}):
            primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
            if primvar and primvar.HasValue():
                message = f"displaced by the fallback of the primvar {name}, which is authored on or above an instance"
                self._report.warn(DISPLACEMENT, prim.GetPath(), message)
                told.add(name)
        scheme = prim.GetAttribute("subdivisionScheme").Get(Usd.TimeCode.EarliestTime())
        if level == 0 and str(scheme) in SUBDIVISION_SCHEMES:
            message = f"displaced at the {len(geometry.points)} points of its cage alone: --complexity gives it more"
            self._report.warn(COARSE, prim.GetPath(), message)
        self._heights[str(prim.GetPath())] = {name: given.get(name) for name in sorted(names - {"", *told})}
        return Move(displacements, given)

    def report_unreached(self, instances: Instances, prims: Sequence[str]) -> None:
        """Report primvars of which instances have values of their own, for heights are read once for all of them.

        Args:
            instances: What is drawn.
            prims: Paths that ``Instances.prim`` counts.
        """
        for row, path in enumerate(prims if self._heights and instances.primvars else ()):
            for name, used in self._heights.get(path, {}).items():
                values = instances.primvars.get(name)
                if values is None:
                    continue
                own = values[instances.prim == row]
                own = own[~np.isnan(own[:, 0])]
                # What is inherited stands there, too, and has been used.
                if len(own) and (used is None or (own[:, : len(used)] != used).any()):
                    message = f"values of the primvar {name} that instances have of their own do not displace them"
                    self._report.warn(DISPLACEMENT, path, message)

    def apply(self, mesh: Mesh | Shapes, move: Move | None) -> Mesh | Shapes:
        """Return the moved mesh."""
        if move is None or not isinstance(mesh, Mesh):
            return mesh
        return displaced(mesh, move.displacements, move.constants, self._materials.textures, self._materials.images)
