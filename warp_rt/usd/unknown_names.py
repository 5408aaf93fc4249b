# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Properties, applied schemas and metadata that USD does not know: misspelt, of other programs, or users' own."""

from __future__ import annotations

import difflib
import functools
import re
from collections import Counter
from collections.abc import Iterable, Set

from pxr import Sdf, Tf, Usd

from warp_rt.near_matches import near_matches
from warp_rt.report import Report
from warp_rt.usd.light_omissions import old_names
from warp_rt.usd.render_vars import LAYER_NAME
from warp_rt.usd.schemas import FOREIGN, PrimType

NO_SUCH_PROPERTY = "N942"
OTHERS_NAMES = "N943"

_CONNECTABLE = ("Material", "NodeGraph", "Shader")
# What any prim may have beside what schemas list: data for shaders and of users, and our own; of physics and of user
# interfaces, nothing shows.
_ANY_PRIM = re.compile(
    "primvars:|userProperties:|physics:|ui:|xformOp:|material:binding:(full|preview|physics|collection:)"
    "|subsetFamily:[^:]+:familyType$|config:mtlx:version$|extentsHint$|warp_rt:(complexity|falloff)$"
)
_NETWORK = re.compile("inputs:|outputs:|info:")
_OF_TYPE = {
    "RenderSettings": re.compile("warp_rt:"),  # told by a code of their own
    "BlendShape": re.compile("inbetweens:"),
    "RenderVar": re.compile(f"{LAYER_NAME}$"),
}
# What USD reads of prims alone that have the schema applied.
_COUNTS_IF_APPLIED = {
    "colorSpace:name": "ColorSpaceAPI",
    "(guide|proxy|render)Visibility": "VisibilityAPI",
    "lod:default:index": "LODRootAPI",
    "lod:override:(index|mode)": "LODOverrideAPI",
    "semantics:labels:.+": "SemanticsLabelsAPI",
}
_INSTANCE = "__INSTANCE_NAME__"
_COMPOSITION = ("references", "inherits", "specializes", "variants", "variantSets", "relocates", "subLayers")
_LEAST_LIKENESS = 0.85  # of a name and one of USD's that it misspells: one slip in seven letters
_MOST_OF_NAMESPACE = 3  # names that a prim may have of one without all being taken for another program's


def unknown_properties(prim_type: PrimType, names: Set[str]) -> tuple[str, ...]:
    """Return the names of properties, sorted, that neither a prim's type nor any schema that may be applied to it has.

    Args:
        prim_type: Its type; of one that USD does not know nothing is returned, for it is told as such.
        names: What it authors.
    """
    if not prim_type.is_known:
        return ()
    definition = prim_type.info.GetPrimDefinition()
    not_owned = names - set(definition.GetPropertyNames())
    others = not_owned - FOREIGN
    if prim_type.is_light:  # told by a code of their own
        others -= old_names(definition)
    allowed = [_ANY_PRIM, _applied_names()]
    if prim_type.is_light or prim_type.name in _CONNECTABLE:
        allowed.append(_NETWORK)
    if prim_type.name in _OF_TYPE:
        allowed.append(_OF_TYPE[prim_type.name])
    unknown = {name for name in others if not any(pattern.match(name) for pattern in allowed)}
    idle = {name for name in not_owned if prim_type.is_imageable and missing_schema(name)}
    return tuple(sorted(unknown | idle))


def missing_schema(name: str) -> str:
    """Return the schema that has to be applied for a property of this name to count; empty: none, or it counts."""
    return next((schema for pattern, schema in _COUNTS_IF_APPLIED.items() if re.fullmatch(pattern, name)), "")


def unknown_schemas(prim_type: PrimType) -> tuple[str, ...]:
    """Return the names of applied schemas that USD does not know, without those of their instances."""
    names = dict.fromkeys(schema.partition(":")[0] for schema in prim_type.info.GetAppliedAPISchemas())
    return tuple(name for name in names if name not in _schemas())


class UnknownNameReporter:
    """Notes what USD does not know; each name of a type of prims once, on the first that has it.

    Args:
        report: Takes the notes.
    """

    def __init__(self, report: Report) -> None:
        self._report = report
        self._told: set[tuple[str, str]] = set()
        self._others: dict[str, None] = {}
        self._first = ""

    def add(self, prim: Usd.Prim, prim_type: PrimType, properties: tuple[str, ...], schemas: tuple[str, ...]) -> None:
        """Note the properties that are like those of schemas, and keep others' for the end."""
        known = set(prim_type.info.GetPrimDefinition().GetPropertyNames())
        spaces = Counter(name.partition(":")[0] for name in properties)
        words = []
        for name in properties:
            if schema := missing_schema(name):
                if (name, prim_type.name) not in self._told:
                    self._told.add((name, prim_type.name))
                    words.append(f"{name} ({schema} is not applied)")
                continue
            space, colon, _ = name.partition(":")
            is_close = bool(difflib.get_close_matches(space, _namespaces(), 1, _LEAST_LIKENESS))
            if colon and (not is_close or spaces[space] > _MOST_OF_NAMESPACE):
                self._keep(prim, f"{space}:*" + (f" but {LAYER_NAME}" if LAYER_NAME.startswith(f"{space}:") else ""))
            elif (name, prim_type.name) not in self._told:
                self._told.add((name, prim_type.name))
                words.append(name + _meant(name, known))
        owner = f"a {prim_type.name}" if prim_type.name else "a prim without a type"
        for schema in schemas:
            near = _nearest(schema, filter(_may_show, _schemas()))
            if near:
                message = f"USD has no schema {schema} to apply (did you mean {near}?); ignored"
                self._report.warn(NO_SUCH_PROPERTY, prim.GetPath(), message)
            else:
                self._keep(prim, schema)
        if words:
            self._report.warn(NO_SUCH_PROPERTY, prim.GetPath(), f"{owner} has no {', '.join(words)}; ignored")

    def add_metadata(self, item: Usd.Prim | Usd.Property) -> None:
        """Note metadata like those that prims, properties, or the stage, may have, and keep others' for the end."""
        unknown = [name for name, value in item.GetAllAuthoredMetadata().items() if _is_unknown(value)]
        if not unknown:
            return
        if isinstance(item, Usd.Prim):
            prim, owner = item, "a stage" if item.IsPseudoRoot() else "a prim"
            (spec,) = item.GetPrimStack()[:1] or (item.GetStage().GetRootLayer().pseudoRoot,)
            known = (*spec.GetMetaDataInfoKeys(), *_COMPOSITION)
        else:
            prim, owner = item.GetPrim(), "a property"
            known = tuple(item.GetPropertyStack()[0].GetMetaDataInfoKeys())
        words = []
        for name in sorted(unknown):
            near = near_matches(name, known)
            if not near:
                self._keep(prim, name)
            elif (name, owner) not in self._told:
                self._told.add((name, owner))
                words.append(f"{name} ({near.removeprefix('; ')})")
        if words:
            self._report.warn(NO_SUCH_PROPERTY, item.GetPath(), f"{owner} has no metadata {', '.join(words)}; ignored")

    def finish(self) -> None:
        """Note what has been kept, all at once: stages hold much of it."""
        if self._others:
            names = ", ".join(sorted(self._others))
            self._report.warn(OTHERS_NAMES, self._first, f"not read, here or elsewhere: {names}")

    def _keep(self, prim: Usd.Prim, name: str) -> None:
        if not self._others:
            self._first = str(prim.GetPath())
        self._others[name] = None


def nearest_type(name: str) -> str:
    """Return the type of prims that a name misspells; empty: there is none."""
    is_abstract = Usd.SchemaRegistry.FindSchemaInfo(name) is not None
    return "" if is_abstract else _nearest(name, _types())


def _nearest(name: str, known: Iterable[str]) -> str:
    """Return the known name that one misspells, capitals aside; empty: there is none."""
    by_letters = {other.lower(): other for other in known}
    near = difflib.get_close_matches(name.lower(), by_letters, 1, _LEAST_LIKENESS)
    return by_letters[near[0]] if near else ""


def _may_show(schema: str) -> bool:
    """Return whether a schema may make a difference to pictures: other programs name theirs after those of physics."""
    return not schema.startswith("Physics")


def _is_unknown(value: object) -> bool:
    return isinstance(value, Sdf.UnregisteredValue)


def _meant(name: str, known: Set[str]) -> str:
    """Return what was probably meant, in brackets: a name like it, or the same in a namespace."""
    spaced = sorted(other for other in known if other.endswith(f":{name}"))
    meant = f"; did you mean {spaced[0]}?" if spaced else near_matches(name, known)
    return f" ({meant.removeprefix('; ')})" if meant else ""


@functools.cache
def _schemas() -> frozenset[str]:
    """Return the names of the schemas that may be applied; that of usdMtlx is USD's, but not usd-core's."""
    types = Tf.Type.Find(Usd.APISchemaBase).GetAllDerivedTypes()
    return frozenset(Usd.SchemaRegistry.GetSchemaTypeName(known) for known in types) | {"MaterialXConfigAPI"}


@functools.cache
def _types() -> frozenset[str]:
    """Return the names of the types of prims."""
    types = Tf.Type.Find(Usd.Typed).GetAllDerivedTypes()
    return frozenset(filter(None, map(Usd.SchemaRegistry.GetConcreteSchemaTypeName, types)))


@functools.cache
def _templates() -> tuple[str, ...]:
    """Return the names of these schemas' properties."""
    registry = Usd.SchemaRegistry()
    definitions = map(registry.FindAppliedAPIPrimDefinition, sorted(_schemas()))
    names = {name for definition in definitions if definition for name in definition.GetPropertyNames()}
    return (*sorted(names), "material:binding")


@functools.cache
def _applied_names() -> re.Pattern[str]:
    """Return what matches them: they may be read where the schema is not applied."""
    return re.compile("|".join(f"{re.escape(name).replace(_INSTANCE, '.+')}$" for name in _templates()))


@functools.cache
def _namespaces() -> frozenset[str]:
    """Return the first words of names that schemas give to properties, but for those of which nothing shows."""
    spaces = frozenset(name.partition(":")[0] for name in _templates() if ":" in name)
    return (spaces | {"primvars", "warp_rt"}) - {"drive", "limit", "physics", "ui", "accessibility"}
