# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Where in namespace the copies are that paths of instances name."""

from __future__ import annotations

from pxr import Usd, UsdGeom


class InstancePlaces:
    """Finds what a path such as ``/Set/Trees[7]/oak`` is a copy of.

    Args:
        stage: Of the instances.
        time: When the instancers are read.
    """

    def __init__(self, stage: Usd.Stage, time: Usd.TimeCode) -> None:
        self._stage = stage
        self._time = time
        self._instancers: dict[str, tuple[str, ...]] = {}
        self._prototypes: dict[str, tuple[list[int], list[str]]] = {}

    def places(self, name: str) -> tuple[str, ...]:
        """Return the path of the prim that an instance shows, and of the instancers that repeat it from elsewhere.

        Args:
            name: Path of the instance: that of a prim, but for the numbers of PointInstancers, each in place of the way
                from the instancer to the prototype.
        """
        end = name.rfind("]")
        if end < 0:
            return (name,)
        head, _, number = name[:end].rpartition("[")
        above = self._instancers.get(head)
        if above is None:
            above = self._instancers[head] = self.places(head)
        instancer, *holders = above
        prototype = self._prototype(instancer, int(number))
        if not prototype.startswith(f"{instancer}/"):
            holders.append(instancer)
        return (prototype + name[end + 1 :], *holders)

    def _prototype(self, instancer: str, number: int) -> str:
        known = self._prototypes.get(instancer)
        if known is None:
            schema = UsdGeom.PointInstancer(self._stage.GetPrimAtPath(instancer))
            targets = [str(path) for path in schema.GetPrototypesRel().GetForwardedTargets()]
            known = self._prototypes[instancer] = list(schema.GetProtoIndicesAttr().Get(self._time)), targets
        indices, targets = known
        return targets[indices[number]]
