# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Whether what instances hand down binds the same materials to all that is below them, so that they can share it.

A collection goes by paths: two instances of one prototype below one prim have the same bindings, and yet different
materials where a collection holds one of them, or something in one of them.

Reference: Usd CollectionAPI, expansion rules; UsdShadeMaterialBindingAPI, collection-based bindings.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pxr import Sdf, Usd

from warp_rt.usd.bindings import Binding, Bindings

_HERE = Sdf.Path("/__instance")  # in place of the instance's path: what is below is the same in all of them


@dataclass(frozen=True)
class _Collection:
    """Which paths a collection holds."""

    query: Usd.UsdCollectionMembershipQuery
    rules: Mapping[Sdf.Path, str]
    """Empty where an expression decides."""
    below: Mapping[Sdf.Path, Sequence[Sdf.Path]]
    """The paths of rules, by each path above them."""


class SharedBindings:
    """Tells instances apart by the materials that are bound below them.

    Args:
        stage: Of the instances.
    """

    def __init__(self, stage: Usd.Stage) -> None:
        self._stage = stage
        self._collections: dict[Sdf.Path, _Collection | None] = {}

    def key(self, instance: Usd.Prim, bindings: Bindings) -> tuple[object, ...]:
        """Return what is equal for instances of one prototype below which the same materials are bound.

        Args:
            instance: A native instance.
            bindings: What is said on it and above it.
        """
        path = instance.GetPath()
        return tuple(self._said(instance, path, binding) for binding in bindings)

    def _said(self, instance: Usd.Prim, path: Sdf.Path, binding: Binding) -> object:
        if binding.holder is None and not any(target.HasPrefix(path) for target in binding.targets):
            return binding
        targets = tuple(self._target(instance, path, target) for target in binding.targets)
        levels = None if binding.holder is None else path.pathElementCount - binding.holder.pathElementCount
        return binding.name, targets, binding.strength, levels, binding.is_applied

    def _target(self, instance: Usd.Prim, path: Sdf.Path, target: Sdf.Path) -> object:
        if Usd.CollectionAPI.IsCollectionAPIPath(target):
            collection = self._collection(target, is_kept=not target.HasPrefix(path))
            if collection is not None:
                return _held(collection, instance, path)
        return target.ReplacePrefix(path, _HERE)

    def _collection(self, path: Sdf.Path, *, is_kept: bool) -> _Collection | None:
        if path in self._collections:
            return self._collections[path]
        found = _read(Usd.CollectionAPI.Get(self._stage, path))
        if is_kept:
            self._collections[path] = found
        return found


def _read(collection: Usd.CollectionAPI) -> _Collection | None:
    if not collection:
        return None
    query = collection.ComputeMembershipQuery()
    rules = dict(query.GetAsPathExpansionRuleMap()) if query.UsesPathExpansionRuleMap() else {}
    below: dict[Sdf.Path, list[Sdf.Path]] = {}
    for path in rules:
        for above in path.GetPrefixes()[:-1]:
            below.setdefault(above, []).append(path)
    return _Collection(query, rules, below)


def _held(collection: _Collection, instance: Usd.Prim, path: Sdf.Path) -> object:
    """Return what a collection holds of an instance and all below it, in a form that does not name the instance."""
    if not collection.query.UsesPathExpansionRuleMap():
        prims = Usd.PrimRange(instance, Usd.TraverseInstanceProxies())
        return tuple(collection.query.IsPathIncluded(prim.GetPath()) for prim in prims)
    rules = collection.rules
    above = tuple(rules[one] for one in (Sdf.Path.absoluteRootPath, *path.GetPrefixes()) if one in rules)
    inner = sorted((one.ReplacePrefix(path, _HERE), rules[one]) for one in collection.below.get(path, ()))
    return above, path in rules, tuple(inner)
