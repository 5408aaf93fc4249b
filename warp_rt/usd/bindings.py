# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Relationships that hold for all prims below: what they say, in a form in which the same compares equal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from pxr import Sdf, Tf, Usd, UsdShade

from warp_rt.usd.authored import AuthoredReader
from warp_rt.usd.questions import get_forwarded_targets, get_path, get_relationship, has_api

BINDING_PURPOSES = ("full", "", "preview")
"""Material purposes of the bindings that count where no render settings name others. What is bound for previews alone
is what usdrecord draws, and nearer to what is meant than no material."""

_COLLECTION = "material:binding:collection:"


class Binding(NamedTuple):
    """What one relationship says."""

    name: str
    targets: tuple[Sdf.Path, ...]
    strength: str | None
    holder: Sdf.Path | None
    """The prim that has it, where that matters: which prims a collection holds goes by their paths."""
    is_applied: bool
    """Whether its prim has the schema that it belongs to; USD complains of the others, each time it reads them."""


Bindings = tuple[Binding, ...]
"""From the root down to a prim. Prims of which the same is said have the same material."""


def extend_bindings(above: Bindings, prim: Usd.Prim, names: Sequence[str], has_heirs: bool = True) -> Bindings:
    """Return what material and skeleton bindings on a prim and above it say.

    Args:
        above: What those above it say.
        prim: The prim.
        names: Of its properties that may be such relationships: ``Authored.bindings``.
        has_heirs: Whether there is anything below it, which is all that the strength of a binding matters to.
    """
    said = above
    for name in names:
        relationship = get_relationship(prim, name)
        try:
            targets = get_forwarded_targets(relationship)
        except Tf.ErrorException:
            if relationship:
                raise
            continue  # it is an attribute
        binding = Binding(
            name,
            tuple(targets),
            relationship.GetMetadata("bindMaterialAs") if has_heirs else None,
            get_path(prim) if name.startswith(_COLLECTION) else None,
            has_api(prim, UsdShade.MaterialBindingAPI) or not name.startswith("material:"),
        )
        said = (*said, binding)
    return said


def read_bindings(prim: Usd.Prim) -> Bindings:
    """Return what bindings on a prim and all above it say."""
    chain = []
    while prim and not prim.IsPseudoRoot():
        chain.append(prim)
        prim = prim.GetParent()
    said: Bindings = ()
    authored = AuthoredReader()
    for prim in reversed(chain):
        said = extend_bindings(said, prim, authored.read(prim, has_clips=False).bindings)
    return said


def bound_material(prim: Usd.Prim, purposes: Sequence[str]) -> tuple[UsdShade.Material, Usd.Relationship | None]:
    """Return the material that is bound to a prim, and the relationship that says so; None: nothing is.

    Args:
        prim: Whose binding counts, inherited and collection-based bindings included.
        purposes: Material purposes, the first of which there is a binding for; empty: bindings without a purpose.
    """
    general: tuple[UsdShade.Material, Usd.Relationship | None] | None = None  # what is bound without a purpose
    for purpose in purposes:
        found = general
        if purpose or found is None:
            # USD takes what is bound without a purpose where nothing is for this one.
            found = _computed(prim, purpose)
        if not found[1]:
            general = UsdShade.Material(), None
        elif purpose_of(found[1].GetName()) == purpose:
            return found
        else:
            general = found
    return UsdShade.Material(), None


def _computed(prim: Usd.Prim, purpose: str) -> tuple[UsdShade.Material, Usd.Relationship | None]:
    try:
        return UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(purpose)
    except Tf.ErrorException:  # what should be a binding is an attribute
        return UsdShade.Material(), None


def purpose_of(name: str) -> str:
    """Return the material purpose that a binding of a name is for."""
    if name.startswith(_COLLECTION):
        return name.removeprefix(_COLLECTION).rpartition(":")[0]
    return name.removeprefix("material:binding").removeprefix(":")


def is_shared(bindings: Bindings) -> bool:
    """Return whether all prims of which the same is said have the same material, as quietly."""
    return all(binding.is_applied and binding.holder is None for binding in bindings)
