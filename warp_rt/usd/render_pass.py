# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The collections of a RenderPass: what is drawn, what eye rays see, what holds out.

Reference: UsdRenderPass schema documentation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np
from pxr import Tf, Usd

from warp_rt.errors import SceneError
from warp_rt.report import Report
from warp_rt.scene import Dome, Instances, Light, Mesh, RayMask, Shapes
from warp_rt.usd.linking import LinkReader
from warp_rt.usd.placement import PlacedPrim
from warp_rt.usd.stage import error_text

BAD_COLLECTION = "W527"

_NAMES = ("renderVisibility", "cameraVisibility", "prune", "matte")

_AnyLight = TypeVar("_AnyLight", Light, Dome)


class PassCollections:
    """What a pass says of geometry and lights.

    Args:
        prim: The RenderPass.
        report: Takes diagnostics.

    Raises:
        SceneError: USD cannot read a collection, such as one whose members are no relationship.
    """

    def __init__(self, prim: Usd.Prim, report: Report) -> None:
        self._prim = prim
        self._report = report
        for name in _NAMES:
            try:
                self._query(name)
            except Tf.ErrorException as error:
                raise SceneError(f"{prim.GetPath()}: the collection {name}: {error_text(error)}") from error

    def geometry(self, instances: Instances, links: LinkReader) -> Instances:
        """Return the placed meshes that take part, with what the pass says of each.

        Args:
            instances: All.
            links: Tells which of them a collection holds.
        """
        rendered, seen, pruned, is_matte = (self._rows(links, name, len(instances)) for name in _NAMES)
        if not seen.all():
            rays = np.uint8(RayMask.ALL) if instances.seen_by is None else instances.seen_by
            seen_by = np.where(seen, rays, rays & np.uint8(RayMask.ALL & ~RayMask.EYE)).astype(np.uint8)
            instances = replace(instances, seen_by=seen_by)
        if is_matte.any():
            instances = replace(instances, is_matte=is_matte)
        kept = rendered & ~pruned
        return instances if kept.all() else instances[np.flatnonzero(kept)]

    def lights(self, placed: Sequence[PlacedPrim], links: LinkReader) -> tuple[PlacedPrim, ...]:
        """Return the lights that shine in this pass; ``links`` tells which of them a collection holds."""
        rendered, pruned = self._query("renderVisibility"), self._query("prune")
        return tuple(
            light for light in placed if links.holds(rendered, light.path) and not links.holds(pruned, light.path)
        )

    def seen(self, lights: Sequence[_AnyLight], links: LinkReader) -> list[_AnyLight]:
        """Return lights or domes, hidden from eye rays where the pass says so; ``links`` as for ``lights``."""
        seen = self._query("cameraVisibility")
        return [light if links.holds(seen, light.path) else replace(light, is_visible=False) for light in lights]

    def _rows(self, links: LinkReader, name: str, count: int) -> np.ndarray:
        held = links.read(self._prim, str(self._prim.GetPath()), name, BAD_COLLECTION)
        return np.ones(count, bool) if held is None else held

    def _query(self, name: str) -> Usd.UsdCollectionMembershipQuery:
        return Usd.CollectionAPI(self._prim, name).ComputeMembershipQuery()


def without_unused(
    meshes: tuple[Mesh | Shapes, ...], instances: Instances
) -> tuple[tuple[Mesh | Shapes, ...], Instances]:
    """Return the meshes that are placed, and the placed meshes with their new rows."""
    used, rows = np.unique(instances.mesh, return_inverse=True)
    return tuple(meshes[row] for row in used), replace(instances, mesh=rows.reshape(-1).astype(np.int32))
