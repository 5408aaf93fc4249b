# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a prim authors: asked once, so that nothing is asked for that is not there."""

from __future__ import annotations

from dataclasses import dataclass

from pxr import Usd

from warp_rt.usd.questions import get_authored_property_names, get_property_names

_PRIMVARS = "primvars:"
_INDICES = ":indices"
_BINDINGS = ("material:binding", "skel:skeleton", "skel:animationSource")


@dataclass(frozen=True, slots=True, eq=False)
class Authored:
    """Names of a prim's properties that may have values."""

    names: frozenset[str]
    primvars: tuple[str, ...]
    """Those of primvars."""
    primvar_names: tuple[tuple[str, str, str], ...]
    """Of each of these that holds no indices: the attribute's name, the primvar's, that of its indices or nothing."""
    bindings: tuple[str, ...]
    """Those of relationships that hold for all prims below."""
    operations: tuple[str, ...]
    """Those of operations of a transform."""


class AuthoredReader:
    """Reads what prims author; those that author the same share one record, for there are few kinds of prims."""

    def __init__(self) -> None:
        self._known: dict[tuple[str, ...], Authored] = {}

    def read(self, prim: Usd.Prim, has_clips: bool) -> Authored:
        """Return what a prim authors.

        Args:
            prim: The prim.
            has_clips: Whether value clips may hold values of the schema's properties that no layer names.
        """
        return self.record(tuple(get_property_names(prim) if has_clips else get_authored_property_names(prim)))

    def record(self, names: tuple[str, ...]) -> Authored:
        """Return the record of prims that author properties of these names."""
        authored = self._known.get(names)
        if authored is None:
            primvars = tuple(name for name in names if name.startswith(_PRIMVARS))
            authored = self._known[names] = Authored(
                frozenset(names),
                primvars,
                tuple(
                    (name, name.removeprefix(_PRIMVARS), name + _INDICES if name + _INDICES in primvars else "")
                    for name in primvars
                    if not name.endswith(_INDICES)
                ),
                tuple(name for name in names if name.startswith(_BINDINGS)),
                tuple(name for name in names if name.startswith("xformOp:")),
            )
        return authored
