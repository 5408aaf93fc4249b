# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What properties say in vain is told once: connections, samples that USD does not look at, what is of another kind."""

from __future__ import annotations

import pytest
from pxr import Usd, UsdGeom

from warp_rt.usd.load import load_stage
from warp_rt.usd.property_checks import ASKED_FOR_PROPERTIES


def stage_of(body: str) -> Usd.Stage:
    stage = Usd.Stage.CreateInMemory()
    assert stage.GetRootLayer().ImportFromString("#usda 1.0\n" + body.replace("}", "\n}") + "\n")
    return stage


def told(stage: Usd.Stage) -> list[tuple[str, str]]:
    return [(record.code, record.prim) for record in load_stage(stage).diagnostics if record.code not in FRAMING]


FRAMING = ("N901", "N902")
API = 'prepend apiSchemas = ["MaterialBindingAPI"]'


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ('def Sphere "s" { double radius.connect = </other.x> }', ("W112", "/s.radius")),
        ('def Camera "s" { float focalLength.connect = </other.x> }\ndef Sphere "t" {}', ("W112", "/s.focalLength")),
        (f'def Sphere "s" ({API}) {{ double material:binding:full = 3 }}', ("W513", "/s.material:binding:full")),
        ('def Sphere "s" { double proxyPrim = 3 }', ("W513", "/s.proxyPrim")),
        (
            f'def Sphere "s" ({API}) {{ rel material:binding (bindMaterialAs = "best") }}',
            ("W310", "/s.material:binding"),
        ),
        ('def Sphere "s" { rel radius = </s> }', ("W513", "/s.radius")),
        ('def Sphere "s" { float[] primvars:a = [1] (interplation = "vertex") }', ("N942", "/s.primvars:a")),
        (
            'def Sphere "s" { uniform token[] xformOpOrder.timeSamples = { 0: ["xformOp:translate"]\n} }',
            ("N944", "/s.xformOpOrder"),
        ),
    ],
)
def test_what_a_property_says_in_vain_is_told_once(body: str, expected: tuple[str, str]) -> None:
    assert told(stage_of(body)) == [expected]


@pytest.mark.parametrize(
    "body",
    [
        'def Sphere "s" { double radius = 2\ndouble radius.timeSamples = { 0: 1\n} }',
        'def Sphere "s" { double radius\nrel proxyPrim\nrel material:binding }',
        'def Sphere "s" { double radius = None\nuniform token purpose.timeSamples = { 0: "proxy"\n} }',
        'def Sphere "s" { double radius = 2 (doc = "its size"\ncustomData = { int a = 1\n}) }',
        'def SphereLight "s" { rel inputs:filters = </s> }',  # N934's
        'def "s" { double radius.connect = </other.x>\ntoken outputs:x.connect = </other.x> }\ndef Sphere "t" {}',
    ],
)
def test_what_counts_or_belongs_to_nothing_drawn_is_not_told(body: str) -> None:
    assert [code for code, _ in told(stage_of(body)) if code in ("W112", "W513", "N944")] == []


def test_samples_of_an_order_do_not_count_for_usd_either() -> None:
    stage = stage_of(
        'def Sphere "s" { double3 xformOp:translate = (1, 0, 0)\n'
        'uniform token[] xformOpOrder.timeSamples = { 0: ["xformOp:translate"]\n} }'
    )
    xformable = UsdGeom.Xformable(stage.GetPrimAtPath("/s"))
    assert xformable.GetLocalTransformation(0) == type(xformable.GetLocalTransformation(0))(1)
    assert told(stage) == [("N944", "/s.xformOpOrder"), ("N921", "/s")]


def test_an_output_that_is_a_relationship_is_told() -> None:
    stage = stage_of(
        f'def Material "m" {{ rel outputs:surface = </s> }}\ndef Sphere "s" ({API}) {{ rel material:binding = </m> }}'
    )
    assert told(stage) == [("W304", "/m.outputs:surface"), ("W307", "/m")]


def test_labels_of_the_wrong_kind_are_none() -> None:
    api = 'prepend apiSchemas = ["SemanticsLabelsAPI:class"]'
    scene = load_stage(stage_of(f'def Sphere "s" ({api}) {{ double semantics:labels:class = 2 }}'))
    assert scene.labels == {}


def test_no_more_prims_are_asked_than_stages_written_by_hand_have() -> None:
    spheres = "".join(f'def Sphere "s{number}" {{}}\n' for number in range(ASKED_FOR_PROPERTIES))
    last = 'def Sphere "last" { double radius.connect = </other.x> }'
    assert told(stage_of(spheres + last)) == []
    assert told(stage_of(last + "\n" + spheres)) == [("W112", "/last.radius")]
