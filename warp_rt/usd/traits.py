# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the walk does with a prim, by its type and by what it authors: found out once for all that are alike."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

from pxr import Usd

from warp_rt.usd import geometry
from warp_rt.usd.authored import Authored, AuthoredReader
from warp_rt.usd.context import COMPLEXITY
from warp_rt.usd.questions import get_authored_property_names, get_property_names
from warp_rt.usd.schemas import FOREIGN, PrimType, TypeReader
from warp_rt.usd.unknown_names import unknown_properties, unknown_schemas

RENDER_TYPES = ("RenderSettings", "RenderPass")
SKINNING = ("primvars:skel:jointIndices", "skel:blendShapes")

_HEEDED_TYPES = frozenset(("SkelRoot", "Camera", "GeomSubset", "PointInstancer", *RENDER_TYPES))
_HEEDED_NAMES = frozenset((*SKINNING, "visibility", "purpose", COMPLEXITY, "primvars:normals"))


@dataclass(frozen=True, slots=True, eq=False)
class Traits:
    """What prims of one type that author the same have in common."""

    type: PrimType
    authored: Authored
    is_moved: bool
    """Whether it may have a transform."""
    hands_down: bool
    """Whether prims below it may have a binding or a primvar from it."""
    is_geometry: bool
    """Whether it is of one of ``geometry.TYPES``."""
    is_instancer: bool
    """Whether it is a PointInstancer."""
    is_ordinary: bool
    """Whether it has nothing that the walk heeds but a transform, geometry, bindings, primvars and children."""
    unknown_properties: tuple[str, ...]
    """Names that USD does not know; so too of schemas that are applied."""
    unknown_schemas: tuple[str, ...]


class TraitsReader:
    """Tells the traits of prims; those that are alike share one record."""

    def __init__(self) -> None:
        self._types = TypeReader()
        self._authored = AuthoredReader()
        self._known: defaultdict[PrimType, dict[tuple[str, ...], Traits]] = defaultdict(dict)

    def read(self, prim: Usd.Prim, has_clips: bool) -> Traits:
        """Return the traits of a prim.

        Args:
            prim: The prim.
            has_clips: See ``AuthoredReader.read``.
        """
        prim_type = self._types.read(prim)
        names = tuple(get_property_names(prim) if has_clips else get_authored_property_names(prim))
        of_type = self._known[prim_type]
        traits = of_type.get(names)
        if traits is None:
            traits = of_type[names] = _traits(prim_type, self._authored.record(names))
        return traits


def _traits(prim_type: PrimType, authored: Authored) -> Traits:
    names, kind = authored.names, prim_type.name
    return Traits(
        prim_type,
        authored,
        is_moved=prim_type.is_xformable and bool(authored.operations or "xformOpOrder" in names),
        hands_down=bool(authored.bindings or authored.primvars),
        is_geometry=kind in geometry.TYPES,
        is_instancer=kind == "PointInstancer",
        is_ordinary=prim_type.is_known
        and not (prim_type.schemas or prim_type.is_light or kind in _HEEDED_TYPES)
        and names.isdisjoint(_HEEDED_NAMES)
        and (prim_type.is_xformable or names.isdisjoint(FOREIGN)),
        unknown_properties=unknown_properties(prim_type, names),
        unknown_schemas=unknown_schemas(prim_type),
    )
