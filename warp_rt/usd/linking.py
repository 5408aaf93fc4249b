# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Light linking: which placed meshes the collections of a light hold.

Reference: UsdLux LightAPI, "Linking"; Usd CollectionAPI.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from warp_rt.report import Report
from warp_rt.scene import Instances
from warp_rt.usd.attribute_values import shown
from warp_rt.usd.instance_places import InstancePlaces
from warp_rt.usd.stage import OUTSIDE_MASK, is_outside_mask

BAD_LINKING = "W404"
ABSENT_MEMBER = "N946"

_EXPANDED = (Usd.Tokens.expandPrims, Usd.Tokens.expandPrimsAndProperties)


class LinkReader:
    """Reads linking collections as one truth value for each placed mesh.

    What a native instance holds is asked for by the path that it has below that instance. Copies of a PointInstancer
    have no path of their own: where the prototype stands below the instancer, its path counts. Where it stands
    elsewhere, two paths count, its own and the instancer's, and the copy is held as the one says that departs from
    what holds for the root: either can be excluded from a collection of everything, either included in one of nothing.
    So it is with instances within instances.

    Args:
        stage: Where the lights are.
        instances: The placed meshes.
        prims: Path of each of their ``prim``.
        tail_starts: Where, in each of these paths, what belongs to the innermost instance, or to the prototype that it
            is of, begins; 0: the prim is below a prototype that stands elsewhere, or in no instance.
        names: Path of each of their ``instance_id``.
        time: When the instancers are read.
        report: Takes diagnostics.
    """

    def __init__(
        self,
        stage: Usd.Stage,
        instances: Instances,
        prims: Sequence[str],
        tail_starts: Sequence[int],
        names: Sequence[str],
        time: Usd.TimeCode,
        report: Report,
    ) -> None:
        self._stage = stage
        self._instances = instances
        self._prims = prims
        self._tail_starts = tail_starts
        self._names = names
        self._places = InstancePlaces(stage, time)
        self._report = report

    def read(self, prim: Usd.Prim, path: str, name: str, code: str = BAD_LINKING) -> np.ndarray | None:
        """Return which placed meshes a collection of a light, or of another prim, holds.

        Args:
            prim: The light.
            path: Of this copy of it, which may be an instance proxy's.
            name: Of the collection, such as ``lightLink`` or ``shadowLink``.
            code: Of the diagnostics.

        Returns:
            bool, shape [instance_count]; None where it holds all of them.
        """
        if Sdf.Path.IsValidPathString(path):
            prim = self._stage.GetPrimAtPath(path) or prim
        collection = Usd.CollectionAPI(prim, name)
        if prim.GetAuthoredPropertiesInNamespace(f"collection:{name}"):
            self._report_oddities(collection, path, code)
        if not _is_restricted(collection):
            return None
        held = self._held_rows(collection.ComputeMembershipQuery())
        return None if held.all() else held

    def holds(self, query: Usd.UsdCollectionMembershipQuery, path: str) -> bool:
        """Return whether a collection holds a light, given its path or that of a copy of it."""
        return _holds(query, map(Sdf.Path, self._places.places(path)))

    def _report_oddities(self, collection: Usd.CollectionAPI, path: str, code: str) -> None:
        """Report what a collection says in vain, or what USD holds against it."""
        name = collection.GetName()
        for attribute, kind in (
            (collection.GetModeAttr(), str),
            (collection.GetExpansionRuleAttr(), str),
            (collection.GetIncludeRootAttr(), bool),
            (collection.GetMembershipExpressionAttr(), Sdf.PathExpression),
        ):
            value = attribute.Get() if attribute else None
            tokens = attribute.GetMetadata("allowedTokens") if kind is str else None
            if value is not None and (not isinstance(value, kind) or (tokens and value not in tokens)):
                what = attribute.GetName().rpartition(":")[2]
                why = f"none of {', '.join(tokens)}" if tokens else f"no {attribute.GetTypeName()}"
                self._report.warn(code, path, f"the collection {name}: {what} is {shown(value)}, {why}; ignored")
        is_valid, reason = collection.Validate()
        if not is_valid and "expansionRule" not in reason:
            self._report.warn(code, path, f"the collection {name}: {' '.join(reason.split())}")
        for target in (*collection.GetIncludesRel().GetTargets(), *collection.GetExcludesRel().GetTargets()):
            named = self._stage.GetPrimAtPath(target.GetPrimPath())
            if named and named.IsA(UsdGeom.Subset):
                message = f"the collection {name} names the face subset {target}; only whole meshes count"
                self._report.warn(code, path, message)
            elif not named and is_outside_mask(self._stage, target.GetPrimPath()):
                message = f"the collection {name} names {target}, which the mask leaves out"
                self._report.warn(OUTSIDE_MASK, path, message)
            elif not named or (target.IsPropertyPath() and not named.HasProperty(target.name)):
                self._report.warn(ABSENT_MEMBER, path, f"the collection {name} names {target}, which is not there")

    def _held_rows(self, query: Usd.UsdCollectionMembershipQuery) -> np.ndarray:
        candidates, row = self._paths
        return np.array([_holds(query, paths) for paths in candidates], bool)[row]

    @cached_property
    def _paths(self) -> tuple[list[tuple[Sdf.Path, ...]], np.ndarray]:
        """The paths that count, each set of them once, and the row of its set for each placed mesh."""
        instances = self._instances
        found = [self._places.places(name) for name in self._names]
        number = {place: k for k, place in enumerate(dict.fromkeys([("",), *found]))}
        # Row -1 of the names, that of what is in no instance, is the last one here.
        place_of_name = np.array([*(number[place] for place in found), 0])
        key = place_of_name[instances.instance_id] * len(self._prims) + instances.prim
        unique, row = np.unique(key, return_inverse=True)
        known = list(number)
        sets = [self._paths_of(known[k // len(self._prims)], k % len(self._prims)) for k in unique.tolist()]
        return sets, row.reshape(-1)

    def _paths_of(self, place: tuple[str, ...], prim: int) -> tuple[Sdf.Path, ...]:
        path, start = self._prims[prim], self._tail_starts[prim]
        return tuple(map(Sdf.Path, (place[0] + path[start:] if start else path, *place[1:])))


def _holds(query: Usd.UsdCollectionMembershipQuery, paths: Iterable[Sdf.Path]) -> bool:
    """Return whether a collection holds what several paths count for."""
    decide = all if query.GetAsPathExpansionRuleMap().get(Sdf.Path.absoluteRootPath) in _EXPANDED else any
    return decide(query.IsPathIncluded(path) for path in paths)


def _is_restricted(collection: Usd.CollectionAPI) -> bool:
    """Return whether a linking collection may hold anything but everything."""
    if any(rel and rel.HasAuthoredTargets() for rel in (collection.GetIncludesRel(), collection.GetExcludesRel())):
        return True
    if collection.GetMembershipExpressionAttr().HasAuthoredValue() or collection.GetModeAttr().HasAuthoredValue():
        return True
    if collection.GetExpansionRuleAttr().Get() == Usd.Tokens.explicitOnly:  # the root, and nothing below it
        return True
    return not collection.GetIncludeRootAttr().Get()
