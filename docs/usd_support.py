# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Keep docs/usd_support.md complete: a row for each property of each schema that the installed USD knows.

    python docs/usd_support.py

What a row says is written by hand, and held against the loader by tests/packaging/test_usd_support.py. This script
puts schemas and properties in order, adds rows for those that have none (support ``?``, which the test refuses), and
leaves out rows of properties that USD no longer has.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pxr import Plug, Sdr, Tf, Usd

PAGE = Path(__file__).resolve().parent / "usd_support.md"

PRIM = "*prim*"  # the row of the prim, or node, itself
APPLIED = "*applied*"  # that of an applied schema which has no properties
SHADER_NODES = "Shader nodes"
# Domains in the page's order, and what they are called there.
DOMAINS = {
    "usd": "Usd",
    "usdGeom": "UsdGeom",
    "usdShade": "UsdShade",
    "sdr": SHADER_NODES,
    "usdLux": "UsdLux",
    "usdRender": "UsdRender",
    "usdSkel": "UsdSkel",
    "usdVol": "UsdVol",
    "usdLod": "UsdLod",
    "usdSemantics": "UsdSemantics",
    "usdProc": "UsdProc",
    "usdHydra": "UsdHydra",
    "usdRi": "UsdRi",
    "usdMedia": "UsdMedia",
    "usdPhysics": "UsdPhysics",
    "usdUI": "UsdUI",
    "UsdProfiles": "UsdProfiles",
}
# Domains of which no property takes part in a picture: one row each.
WITHOUT_PICTURE = ("usdMedia", "usdPhysics", "usdUI", "UsdProfiles")
# What a schema's documentation names although its definition does not hold it.
UNDEFINED = {
    "PrimvarsAPI": ("primvars:NAME", "primvars:NAME:indices"),
    "Xformable": ("xformOp:NAME",),
    "MaterialBindingAPI": (
        "material:binding",
        "material:binding:full",
        "material:binding:preview",
        "material:binding:collection:NAME",
    ),
}

_ROW = re.compile(r"^\| (?P<names>[^|]+) \| (?P<support>[^|]+) \| (?P<note>[^|]*)\|$")
_RULE = "| property | support | |\n|---|---|---|"


@dataclass(frozen=True)
class Schema:
    """A schema, or a node of the shader registry."""

    name: str
    domain: str
    properties: tuple[str, ...]
    """Those that it does not have from another schema."""
    bases: tuple[str, ...] = ()
    """Schemas that its prims have properties of: base types and built-in API schemas, nearest first."""
    is_concrete: bool = False
    """Whether prims of this type, or nodes, can be made."""
    is_applied: bool = False

    @property
    def rows(self) -> tuple[str, ...]:
        """What the page says something about."""
        named = self.properties + UNDEFINED.get(self.name, ())
        if self.is_concrete:
            return (PRIM, *named)
        return (APPLIED,) if self.is_applied and not named else named


@dataclass(frozen=True)
class Row:
    """What the page says about a property."""

    support: str
    """``yes``, ``approximated``, ``none``, or the code of a diagnostic."""
    note: str
    line: int
    """Number of its line in the page, so that rows that share one stay together."""


# --- what USD knows


def schemas() -> dict[str, Schema]:
    """Return all schemas and shader nodes by name, in the page's order."""
    types = [t for t in Tf.Type.Find(Usd.SchemaBase).GetAllDerivedTypes() if Usd.SchemaRegistry.FindSchemaInfo(t)]
    found = [_schema(schema_type) for schema_type in types] + list(_shader_nodes())
    order = list(DOMAINS)
    found.sort(key=lambda schema: (order.index(schema.domain), schema.is_concrete, schema.name))
    return {(f"{schema.name} node" if schema.domain == "sdr" else schema.name): schema for schema in found}


def _schema(schema_type: Tf.Type) -> Schema:
    info = Usd.SchemaRegistry.FindSchemaInfo(schema_type)
    own = _properties(schema_type)
    bases = []
    for base in schema_type.baseTypes:
        if base != Tf.Type.Find(Usd.SchemaBase):
            own -= _properties(base)
            bases.append(str(Usd.SchemaRegistry.FindSchemaInfo(base).identifier))
    for api in _built_in(schema_type):
        # A collection's meaning is that of whoever has it, so that its properties are counted as their owner's.
        if api.partition(":")[0] not in ("CollectionAPI", info.identifier):
            own -= set(Usd.SchemaRegistry().FindAppliedAPIPrimDefinition(api).GetPropertyNames())
            bases.append(api)
    kinds = (Usd.SchemaKind.SingleApplyAPI, Usd.SchemaKind.MultipleApplyAPI)
    domain = str(Plug.Registry().GetPluginForType(schema_type).name)
    names = tuple(sorted(name.replace("__INSTANCE_NAME__", "NAME") for name in own))
    is_concrete, is_applied = info.kind == Usd.SchemaKind.ConcreteTyped, info.kind in kinds
    return Schema(str(info.identifier), domain, names, tuple(bases), is_concrete, is_applied)


def _definition(schema_type: Tf.Type) -> Usd.PrimDefinition | None:
    name = Usd.SchemaRegistry.FindSchemaInfo(schema_type).identifier
    registry = Usd.SchemaRegistry()
    return registry.FindConcretePrimDefinition(name) or registry.FindAppliedAPIPrimDefinition(name)


def _definitions(schema_type: Tf.Type) -> list[Usd.PrimDefinition]:
    """Return a type's definition, or those of all concrete types that an abstract one is a base of."""
    own = _definition(schema_type)
    return [own] if own else list(filter(None, map(_definition, schema_type.GetAllDerivedTypes())))


def _properties(schema_type: Tf.Type) -> set[str]:
    """Return the properties that every prim of a type has."""
    found = [set(definition.GetPropertyNames()) for definition in _definitions(schema_type)]
    return set.intersection(*found) if found else set()


def _built_in(schema_type: Tf.Type) -> list[str]:
    """Return the API schemas that every prim of a type has, in the order that the first of them has them."""
    found = [list(definition.GetAppliedAPISchemas()) for definition in _definitions(schema_type)]
    return [api for api in found[0] if all(api in others for others in found)] if found else []


def _shader_nodes() -> Iterator[Schema]:
    registry = Sdr.Registry()
    for name in registry.GetShaderNodeIdentifiers():
        node = registry.GetShaderNodeByIdentifier(name)
        if node.GetContext() == "light":  # an own light shader's inputs are the attributes of the light's schema
            continue
        # Those that begin with Hw are Hydra's own, and only named.
        ports = () if name.startswith("Hw") else sorted(node.GetShaderInputNames())
        inputs = tuple(f"inputs:{port}" for port in ports)
        yield Schema(str(name), "sdr", inputs, is_concrete=True)


# --- the page


def read_page(text: str) -> dict[str, dict[str, Row]]:
    """Return the rows by schema and property. Domains without a picture are one row each, under the domain's name."""
    found: dict[str, dict[str, Row]] = {}
    heading = domain = ""
    for number, line in enumerate(text.splitlines()):
        if line.startswith("#"):
            heading = line.lstrip("# ")
            domain = heading if line.startswith("## ") else domain
        row = _ROW.match(line)
        if row and row["support"].strip() != "support" and not line.startswith("|---"):
            schema = f"{heading} node" if domain == SHADER_NODES else heading
            for name in row["names"].replace("`", "").split(", "):
                known = found.setdefault(schema, {})
                if name in known:
                    raise ValueError(f"line {number + 1}: {schema} {name} has two rows")
                known[name.strip()] = Row(row["support"].strip(), row["note"].strip(), number)
    return found


def build_page(text: str) -> str:
    """Return the page with the rows that are missing, and without those of what USD does not know."""
    rows = read_page(text)
    head = text.partition("\n## ")[0].rstrip()
    lines = [head]
    domain = ""
    for key, schema in schemas().items():
        if schema.domain != domain:
            domain = schema.domain
            lines += ["", f"## {DOMAINS[domain]}", *_introduction(text, DOMAINS[domain])]
            if domain in WITHOUT_PICTURE:
                row = rows.get(DOMAINS[domain], {}).get("all", Row("?", "", 0))
                lines += ["", _RULE, _line(["all"], row)]
        if domain not in WITHOUT_PICTURE:
            lines += _table(schema, rows.get(key, {}))
    return "\n".join(lines) + "\n"


def _introduction(text: str, domain: str) -> list[str]:
    """Return the lines by hand between a domain's heading and its first table or schema."""
    found = re.search(rf"^## {re.escape(domain)}\n(.*?)(?=^#|^\| |\Z)", text, re.MULTILINE | re.DOTALL)
    words = found[1].strip() if found else ""
    return ["", words] if words else []


def _table(schema: Schema, known: dict[str, Row]) -> list[str]:
    # What a schema inherits has a row where it has another effect on this schema's prims.
    names = [*schema.rows, *sorted(set(known) - set(schema.rows))]
    if not names:
        return []
    together: dict[object, list[str]] = {}
    for name in names:
        together.setdefault(known[name].line if name in known else name, []).append(name)
    body = [_line(group, known.get(group[0], Row("?", "", 0))) for group in together.values()]
    return ["", f"### {schema.name}", "", _RULE, *body]


def _line(names: list[str], row: Row) -> str:
    shown = ", ".join(name if name in (PRIM, APPLIED, "all") else f"`{name}`" for name in names)
    return f"| {shown} | {row.support} | {row.note}{' ' if row.note else ''}|"


if __name__ == "__main__":
    PAGE.write_text(build_page(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
