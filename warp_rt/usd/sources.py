# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Prims whose geometry is read, and what comes of it."""

from __future__ import annotations

from typing import NamedTuple

from pxr import Tf, Usd

from warp_rt.report import Report
from warp_rt.scene import Mesh, Shapes
from warp_rt.usd.authored import Authored
from warp_rt.usd.skinning import Skin
from warp_rt.usd.stage import error_text

UNREADABLE_PRIM = "W118"


class Source(NamedTuple):
    """A prim that holds geometry."""

    prim: Usd.Prim
    authored: Authored
    skin: Skin | None
    """Deforms it."""
    time: Usd.TimeCode
    """When its attributes are read."""
    carried_to: Usd.TimeCode | None
    """When its velocities have carried its points from their sample; None: they do not."""
    level: int
    """Refinements of its surface, if it is a smooth one."""
    kind: str = "Mesh"
    """Its type."""
    may_have_subsets: bool = True
    """Whether there are prims below it."""
    may_have_color_space: bool = True
    """Whether a ColorSpaceAPI may say how its colours are meant, or those of prims above it."""
    width: float | None = None
    """Of curves and points that have none of their own; None: none is handed down to them."""


class MeshSource(NamedTuple):
    """A mesh and what its material slots stand for."""

    mesh: Mesh | Shapes
    subsets: tuple[str, ...] = ()
    """Names of the GeomSubset children that slots 1, 2, ... take their material from; slot 0 is the mesh's own."""


def report_unreadable(prim: Usd.Prim, error: Tf.ErrorException, report: Report, what: str = "left out") -> None:
    """Report a prim that USD cannot read."""
    report.warn(UNREADABLE_PRIM, prim.GetPath(), f"{what}: {error_text(error)}")
