# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""docs/usd_support.md says of every property of USD's schemas what the loader does with it, and that is so.

Each property is set on a prim of its type, on a stage where it should show (see ``usd_probes``), and the stage is
loaded with it and without. ``yes`` and ``approximated``: the scene differs. A code: the diagnostic is told. ``none``:
neither scene nor diagnostics differ. What counts is told where it is of another type, or none of its schema's tokens;
blocked, it is as if it was not there.
"""

from __future__ import annotations

import dataclasses
import importlib.util
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from PIL import Image as PillowImage
from pxr import Gf, Sdf, Sdr, Usd, UsdGeom

from warp_rt.errors import SceneError
from warp_rt.scene import Scene
from warp_rt.scene.instance_transforms import LazyTransforms
from warp_rt.usd.load import load_stage

from .usd_probes import FIXTURES, HOSTS, PROBES, Fixture, Probe

DOCS = Path(__file__).resolve().parents[2] / "docs"
KINDS = ("yes", "approximated", "none")


def _load_script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("usd_support", DOCS / "usd_support.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


support = _load_script()
SCHEMAS = support.schemas()
TEXT = (DOCS / "usd_support.md").read_text(encoding="utf-8")
ROWS = support.read_page(TEXT)


# --- the page


def test_every_property_has_its_row() -> None:
    assert support.build_page(TEXT) == TEXT, "python docs/usd_support.py brings it up to date"


def test_every_row_says_something() -> None:
    for schema, rows in ROWS.items():
        for name, row in rows.items():
            assert row.support in KINDS or row.support[0] in "WN", f"{schema} {name}: {row.support!r}"
            if row.support in ("approximated", "none"):
                assert row.note, f"{schema} {name}: say why"


# --- what is tried

_DRAWN = support.Row("yes", "", 0)


@dataclasses.dataclass(frozen=True)
class Trial:
    """A property on a prim of a type."""

    schema: str
    """Whose section has the row, unless the type's own has one."""
    name: str
    host: str
    """Type of the prim."""
    fixture: Fixture
    applied: str = ""
    """Schema that is applied to it."""

    @property
    def row(self) -> support.Row | None:
        own = ROWS.get(self.host, {})
        if self.name in own:
            return own[self.name]
        # What a prim says that is left out altogether does not matter.
        for section, itself in ((ROWS.get(self.applied, {}), support.APPLIED), (own, support.PRIM)):
            if section.get(itself, _DRAWN).support not in KINDS:
                return section[itself]
        return ROWS.get(self.schema, {}).get(self.name)

    @property
    def probe(self) -> Probe:
        for key in (f"{self.host}.{self.name}", f"{self.schema}.{self.name}"):
            if key in PROBES:
                return PROBES[key]
        return Probe()

    def __str__(self) -> str:
        return f"{self.host} {self.name}"


def trials() -> Iterator[Trial]:
    """Yield every property of every prim type, and of applied schemas on the types that they are meant for."""
    for key, schema in SCHEMAS.items():
        if schema.domain in support.WITHOUT_PICTURE:
            continue
        for origin, name in dict.fromkeys(_properties(key)):
            if schema.is_concrete and key in FIXTURES:
                yield Trial(origin, name, key, FIXTURES[key])
            for host in HOSTS.get(key, ()):
                fixture = host if isinstance(host, Fixture) else FIXTURES[host]
                yield Trial(origin, name, host if isinstance(host, str) else key, fixture, applied=key)


def _properties(key: str) -> Iterator[tuple[str, str]]:
    """Yield the properties that prims of a schema have, with the schema that each comes from."""
    schema = SCHEMAS[key]
    for name in schema.rows:
        yield key, name
    for base in schema.bases:
        for origin, name in _properties(base):
            if name != support.PRIM:
                yield origin, name


# --- how it is tried


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("assets")
    PillowImage.fromarray(np.arange(48, dtype=np.uint8).reshape(4, 4, 3)).save(path / "a.png")
    PillowImage.fromarray(np.full((4, 4, 3), 99, np.uint8)).save(path / "b.png")
    (path / "a.ies").write_text(PROFILE)
    return path


PROFILE = """IESNA:LM-63-2002
TILT=NONE
1 1000 1 3 1 1 2 0 0 0
1 1 100
0 45 90
0
100 50 0
"""
METADATA = '#usda 1.0\n(\n    renderSettingsPrimPath = "/settings"\n)\n'


def _open(fixture: Fixture, folder: Path) -> Usd.Stage:
    text = fixture.text.replace("DIR", folder.as_posix()).replace("}", "\n}\n")
    header = METADATA if '"settings"' in text else "#usda 1.0\n"
    layer = Sdf.Layer.CreateAnonymous(".usda")
    assert layer.ImportFromString(header + text)
    return Usd.Stage.Open(layer)


def _attribute(prim: Usd.Prim, name: str, type_name: str = "") -> Usd.Attribute:
    attribute = prim.GetAttribute(name)
    if not attribute:
        attribute = prim.CreateAttribute(name, Sdf.ValueTypeNames.Find(type_name or "token"), custom=False)
    return attribute


def _set(prim: Usd.Prim, name: str, value: object, folder: Path, type_name: str = "") -> None:
    """Set a value, time samples (a dict), targets or, by a path of a property, a connection."""
    if prim.GetRelationship(name) or type_name == "rel":
        targets = value if isinstance(value, list) else [value]
        prim.CreateRelationship(name, custom=False).SetTargets([Sdf.Path(target) for target in targets])
        return
    attribute = _attribute(prim, name, type_name)
    if isinstance(value, str) and value.startswith("/") and "." in value:
        attribute.SetConnections([Sdf.Path(value)])
        return
    if isinstance(value, dict):
        for time, sample in value.items():
            attribute.Set(_typed(attribute, sample), time)
        return
    if isinstance(value, str):
        value = value.replace("DIR", folder.as_posix())
    attribute.Set(_typed(attribute, value))


def _set_typed(prim: Usd.Prim, name: str, value: object, folder: Path) -> None:
    """Set a property that others need: ``name``, with ``=type`` where no schema of the prim has it."""
    name, _, type_name = name.partition("=")
    if type_name or prim.HasProperty(name):
        _set(prim, name, value, folder, type_name)


def _typed(attribute: Usd.Attribute, value: object) -> object:
    kind = attribute.GetTypeName()
    if kind.isArray:
        scalar = kind.scalarType.type.pythonClass
        if str(kind.scalarType).startswith("quat"):
            value = [scalar(q[0], *q[1:]) for q in value]
        elif str(kind.scalarType).startswith("matrix"):
            value = [Gf.Matrix4d(*(x for row in m for x in row)) for m in value]
        return kind.type.pythonClass(value)
    if kind == "pathExpression":
        return Sdf.PathExpression(str(value))
    if str(kind).startswith("matrix"):
        return Gf.Matrix4d(*(x for row in value for x in row))
    return value


def _apply(prim: Usd.Prim, schema: str) -> None:
    if Usd.SchemaRegistry.GetSchemaKind(schema) != Usd.SchemaKind.NonAppliedAPI:
        is_multiple = Usd.SchemaRegistry.IsMultipleApplyAPISchema(schema)
        prim.AddAppliedSchema(f"{schema}:a" if is_multiple else schema)


def _port_type(trial: Trial) -> str:
    """Return the type of a shader node's input, which no prim definition holds."""
    node = Sdr.Registry().GetShaderNodeByIdentifier(trial.schema.removesuffix(" node"))
    port = node.GetShaderInput(trial.name.removeprefix("inputs:")) if node else None
    return str(port.GetTypeAsSdfType().GetSdfType()) if port else ""


def _values(attribute: Usd.Attribute, folder: Path) -> tuple[object, ...]:
    """Return values of an attribute's type that are not what it has."""
    known = attribute.Get()
    tokens = attribute.GetMetadata("allowedTokens")
    if tokens:
        return tuple(str(token) for token in tokens if str(token) != known)
    kind = str(attribute.GetTypeName())
    if kind == "bool":
        return (not known,)
    if kind.startswith("asset"):
        path = Sdf.AssetPath((folder / "b.png").as_posix())
        return ([path],) if kind.endswith("[]") else (path,)
    if kind.startswith(("token", "string")):
        return (["another"],) if kind.endswith("[]") else ("another",)
    if kind.startswith("matrix"):
        return (((0, 1, 0, 0), (-1, 0, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)),)
    if kind == "pathExpression":
        return ("/other",)
    if kind.startswith("quat"):
        return (type(known)(0, 1, 0, 0),)
    if kind == "opaque":
        return ()
    number = 1 if kind.startswith(("int", "uint")) else 0.375
    default = attribute.GetTypeName().scalarType.defaultValue
    size = len(default) if hasattr(default, "__len__") else 1
    row = tuple(number * (2 + place) for place in range(size))
    if attribute.GetTypeName().isArray:
        return ([row if size > 1 else number] * 2,)
    return (row if size > 1 else (known or 0) + number,)


def _prepared(trial: Trial, folder: Path) -> tuple[Usd.Stage, Usd.Prim]:
    fixture = trial.probe.fixture or trial.fixture
    stage = _open(fixture, folder)
    prim = stage.GetPrimAtPath(fixture.path)
    assert prim, f"{trial}: no {fixture.path}"
    if trial.applied and trial.name != support.APPLIED:
        _apply(prim, trial.applied)
    for name, value in trial.probe.given.items():
        _set_typed(prim, name, value, folder)
    for path, name, value in trial.probe.edits:
        _set_typed(stage.GetPrimAtPath(path), name, value, folder)
    return stage, prim


def _load(stage: Usd.Stage, trial: Trial) -> Scene:
    pass_path = "/pass" if trial.fixture.path == "/pass" and stage.GetPrimAtPath("/pass") else None
    return load_stage(stage, level=1, time=trial.probe.time, pass_path=pass_path)


def _differ(one: object, other: object) -> bool:
    """Return whether two scenes, or parts of them, differ in anything but their diagnostics."""
    if type(one) is not type(other):
        return True
    if isinstance(one, LazyTransforms):
        one, other = one[:], other[:]
    if isinstance(one, np.ndarray):
        return one.shape != other.shape or not np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
    if dataclasses.is_dataclass(one):
        names = (field.name for field in dataclasses.fields(one) if field.name not in ("diagnostics", "source"))
        return any(_differ(getattr(one, name), getattr(other, name)) for name in names)
    if isinstance(one, Mapping):
        return one.keys() != other.keys() or any(_differ(one[key], other[key]) for key in one)
    if isinstance(one, tuple | list):
        return len(one) != len(other) or any(map(_differ, one, other))
    return one != other


def _changes(trial: Trial, prim: Usd.Prim, folder: Path) -> Iterator[Callable[[Usd.Prim], None]]:
    """Yield what makes the difference: functions that change the prim."""
    if trial.name == support.PRIM:
        yield lambda changed: changed.GetStage().RemovePrim(changed.GetPath())
        return
    if trial.name == support.APPLIED:
        yield lambda changed: _apply(changed, trial.applied)
        return
    probe = trial.probe
    name = {"xformOp:NAME": "xformOp:translate"}.get(trial.name, trial.name.replace("NAME", "a"))
    values = probe.values or (("/other",) if prim.GetRelationship(name) else ())
    for value in values or _values(_attribute(prim, name, probe.type_name or _port_type(trial)), folder):

        def change(changed: Usd.Prim, value: object = value) -> None:
            _set(changed, name, value, folder, probe.type_name or _port_type(trial))
            if probe.interpolation:
                UsdGeom.Primvar(changed.GetAttribute(name)).SetInterpolation(probe.interpolation)

        yield change


def attempt(trial: Trial, folder: Path) -> tuple[bool, set[str], set[str]]:
    """Return whether a property changes the scene, which diagnostics it adds, and which there are without it."""
    stage, prim = _prepared(trial, folder)
    before = _load(stage, trial)
    told_before = {str(record) for record in before.diagnostics}
    differs, added = False, set()
    for change in _changes(trial, prim, folder):
        stage, changed = _prepared(trial, folder)
        change(changed)
        after = _load(stage, trial)
        differs = differs or _differ(before, after)
        added |= {str(record) for record in after.diagnostics} - told_before
    return differs, {text[:4] for text in added}, {text[:4] for text in told_before}


@pytest.mark.parametrize("domain", support.WITHOUT_PICTURE)
def test_domain_without_picture(domain: str, folder: Path) -> None:
    """All properties of all its schemas together change nothing, and nothing is told."""
    before = load_stage(_open(FIXTURES["Xform"], folder))
    stage = _open(FIXTURES["Xform"], folder)
    for number, (key, schema) in enumerate(SCHEMAS.items()):
        if schema.domain != domain or not (schema.is_concrete or schema.is_applied):
            continue
        prim = stage.DefinePrim(f"/x{number}", schema.name if schema.is_concrete else "Xform")
        if schema.is_applied:
            _apply(prim, key)
        for name in prim.GetPrimTypeInfo().GetPrimDefinition().GetPropertyNames():
            if prim.GetRelationship(name):
                _set(prim, name, "/p", folder)
            elif name not in ("visibility", "purpose", "xformOpOrder"):
                for value in _values(prim.GetAttribute(name), folder):
                    _set(prim, name, value, folder)
    after = load_stage(stage)
    assert not _differ(before, after)
    assert after.diagnostics == before.diagnostics == ()


def _mismatch(trial: Trial, folder: Path) -> str:
    """Return what is wrong with the row of a property; empty: nothing."""
    row = trial.row
    if row is None:
        return "has no row"
    differs, added, before = attempt(trial, folder)
    found = f"the scene {'differs' if differs else 'is the same'}, told: {', '.join(sorted(added)) or 'nothing'}"
    if row.support in ("yes", "approximated"):
        return "" if differs else found
    if row.support == "none":
        return found if differs or added else ""
    return "" if row.support in added | before else found


# What is of another type there has no effect, or is told where it is read.
_UNTOLD = re.compile(
    "outputs:|info:implementationSource$"  # connections alone count; UsdShade takes the fallback
    "|primvars:NAME"  # told where a material reads it
    "|order$"  # of NurbsCurves, whose trial lacks knots: told without
)


def _retype(prim: Usd.Prim, name: str) -> bool:
    """Author a property as what it is not: a number as text, text as a number, a relationship as an attribute."""
    attribute = prim.GetAttribute(name)
    is_text = not attribute or attribute.GetTypeName() in ("token", "string")
    prim.RemoveProperty(name)
    kind, value = (Sdf.ValueTypeNames.Double, 2.0) if is_text else (Sdf.ValueTypeNames.String, "two")
    spec = Sdf.CreatePrimInLayer(prim.GetStage().GetRootLayer(), prim.GetPath())
    Sdf.AttributeSpec(spec, name, kind).default = value
    return True


def _nonsense(prim: Usd.Prim, name: str) -> bool:
    attribute = prim.GetAttribute(name)
    has_tokens = attribute and attribute.GetTypeName() == "token" and attribute.GetMetadata("allowedTokens")
    return bool(has_tokens) and attribute.Set("nonsense")


def _remove(prim: Usd.Prim, name: str) -> bool:
    is_attribute = bool(prim.GetAttribute(name))
    prim.RemoveProperty(name)
    return is_attribute


def _block(prim: Usd.Prim, name: str) -> bool:
    if not prim.GetAttribute(name):
        return False
    prim.GetAttribute(name).ClearConnections()
    prim.GetAttribute(name).Block()
    return True


def _is_said(trial: Trial) -> bool:
    """Return whether a trial is of a property that counts."""
    return trial.name not in (support.PRIM, support.APPLIED) and trial.row.support in ("yes", "approximated")


def _authored(trial: Trial, folder: Path, author: Callable[[Usd.Prim, str], bool]) -> Scene | None:
    """Return the scene with what ``author`` does to a trial's property; None: it does not apply."""
    stage, prim = _prepared(trial, folder)
    name = {"xformOp:NAME": "xformOp:translate"}.get(trial.name, trial.name.replace("NAME", "a"))
    if not prim.GetRelationship(name) and trial.probe.type_name != "rel":
        _attribute(prim, name, trial.probe.type_name or _port_type(trial))
    return _load(stage, trial) if author(prim, name) else None


TRIALS: dict[str, list[Trial]] = {}
for _trial in trials():
    TRIALS.setdefault(_trial.schema, []).append(_trial)


@pytest.mark.parametrize("schema", TRIALS)
def test_values_of_another_type_or_none_of_the_tokens_are_told(schema: str, folder: Path) -> None:
    silent = []
    for trial in filter(_is_said, TRIALS[schema]):
        if _UNTOLD.match(trial.name):
            continue
        told = {str(record) for record in _load(_prepared(trial, folder)[0], trial).diagnostics}
        for author in (_retype, _nonsense):
            try:
                scene = _authored(trial, folder, author)
            except SceneError:  # what is refused is told
                continue
            if scene is not None and not {str(record) for record in scene.diagnostics} - told:
                silent.append(f"{trial}{author.__name__}")
    assert not silent


@pytest.mark.parametrize("schema", TRIALS)
def test_blocked_values_are_as_if_not_there(schema: str, folder: Path) -> None:
    """USD: a block makes an attribute resolve as if nothing was authored."""
    wrong = []
    for trial in filter(_is_said, TRIALS[schema]):
        if trial.name.endswith("includeRoot"):  # USD's own queries of collections take a block for false
            continue
        blocked = _authored(trial, folder, _block)
        if blocked is not None and _differ(blocked, _authored(trial, folder, _remove)):
            wrong.append(str(trial))
    assert not wrong


@pytest.mark.parametrize("schema", TRIALS)
def test_properties(schema: str, folder: Path) -> None:
    wrong: dict[str, list[str]] = {}
    for trial in TRIALS[schema]:
        found = _mismatch(trial, folder)
        if found:
            said = trial.row.support if trial.row else "?"
            wrong.setdefault(f"{trial.name} | {said} | {found}", []).append(trial.host)
    assert not wrong, "\n".join(f"{what} (on {', '.join(hosts)})" for what, hosts in wrong.items())
