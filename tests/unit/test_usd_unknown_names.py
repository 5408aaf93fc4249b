# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What USD does not know of a prim, by the registry of schemas: told, and what it knows or leaves to users is not."""

from __future__ import annotations

import pytest
from pxr import Usd

from warp_rt.usd.load import load_stage

SQUARE = """
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    uniform token subdivisionScheme = "none"
"""


def told(body: str) -> list[tuple[str, str, str]]:
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString("#usda 1.0\n" + body.replace("}", "\n}") + "\n")
    found = load_stage(stage).diagnostics
    return [(record.code, record.prim, record.message) for record in found if record.code in ("N942", "N943")]


def mesh(body: str, name: str = "m") -> str:
    return f'def Mesh "{name}" {{ {SQUARE} {body}\n}}\n'


@pytest.mark.parametrize(
    ("body", "name", "meant"),
    [
        ('token orientaton = "leftHanded"', "orientaton", "orientation"),
        ("color3f[] displayColor = [(1, 0, 0)]", "displayColor", "primvars:displayColor"),
        ("color3f[] primvar:displayColor = [(1, 0, 0)]", "primvar:displayColor", "primvars:displayColor"),
        ("rel material:bindng = </m>", "material:bindng", ""),
        ("custom double3 pivotPosition = (0, 0, 0)", "pivotPosition", ""),
        ("double radius = 2", "radius", ""),  # a Sphere's
    ],
)
def test_a_property_that_no_schema_of_the_prim_has_is_told(body: str, name: str, meant: str) -> None:
    hint = f" (did you mean {meant}?)" if meant else ""
    assert told(mesh(body)) == [("N942", "/m", f"a Mesh has no {name}{hint}; ignored")]


@pytest.mark.parametrize(
    ("kind", "name", "meant"),
    [
        ("Camera", "fstop", "fStop"),
        ("Camera", "shutterOpen", "shutter:open"),
        ("Camera", "focal_length", "focalLength"),
        ("RenderSettings", "Resolution", "resolution"),
        ("RenderProduct", "ordered_vars", "orderedVars"),
        ("RenderVar", "source_name", "sourceName"),
        ("PointInstancer", "invisbleIds", "invisibleIds"),
    ],
)
def test_other_spellings_are_told_with_what_was_meant(kind: str, name: str, meant: str) -> None:
    (note,) = told(f'def {kind} "p" {{ int {name} = 1 }}')
    assert note[:2] == ("N942", "/p")
    assert f"{name} (did you mean {meant}" in note[2]


def test_it_is_told_once_of_each_type_and_of_all_of_a_prim_together() -> None:
    body = "int foo = 1\nint bar = 2"
    found = told(mesh(body, "a") + mesh(body, "b") + f'def Camera "c" {{ {body}\n}}\ndef "d" {{ int foo = 1 }}\n')
    assert found == [
        ("N942", "/a", "a Mesh has no bar, foo; ignored"),
        ("N942", "/c", "a Camera has no bar, foo; ignored"),
        ("N942", "/d", "a prim without a type has no foo; ignored"),
    ]


def test_names_of_other_programs_are_told_once_of_a_stage() -> None:
    body = mesh("int arnold:smoothing = 1\nint arnold:opaque = 0", "a") + mesh("float houdini:guidescale = 2", "b")
    body += 'def Camera "c" (prepend apiSchemas = ["HoudiniCameraPlateAPI", "ManyAPI:one"]) { int arnold:fov = 60 }\n'
    (note,) = told(body)
    assert note == ("N943", "/a", "not read, here or elsewhere: HoudiniCameraPlateAPI, ManyAPI, arnold:*, houdini:*")


def test_of_what_hosts_say_of_a_layer_its_name_alone_is_read() -> None:
    name = 'def RenderVar "v" { string driver:parameters:aov:name = "beauty"'
    assert told(name + "}") == []
    (note,) = told(name + '\ntoken driver:parameters:aov:format = "half4" }')
    assert note == ("N943", "/v", "not read, here or elsewhere: driver:* but driver:parameters:aov:name")


def test_many_names_of_one_namespace_are_taken_for_another_programs() -> None:
    names = [f"semantic:{letter}" for letter in "abcd"]
    assert told(mesh("\n".join(f"int {name} = 1" for name in names))) == [
        ("N943", "/m", "not read, here or elsewhere: semantic:*")
    ]
    assert told(mesh("int semantic:a = 1")) == [("N942", "/m", "a Mesh has no semantic:a; ignored")]


@pytest.mark.parametrize(
    "body",
    [
        mesh("float[] primvars:anything:at:all = [1]\nint[] primvars:anything:at:all:indices = [0]"),
        mesh('custom string userProperties:author = "nobody"'),
        mesh("double3 xformOp:translate:pivot = (0, 0, 0)"),
        mesh("rel material:binding:full = </m>\nrel material:binding:collection:preview:some = None"),
        mesh('uniform token subsetFamily:materialBind:familyType = "partition"'),
        mesh("rel skel:skeleton = </m>\nuniform token[] skel:joints = []"),  # of a schema that is not applied
        mesh("rel collection:some:includes = </m>\nfloat physics:density = 3\nfloat2 ui:nodegraph:node:pos = (0, 0)"),
        mesh("float3[] extentsHint = [(0, 0, 0), (1, 1, 0)]\nint warp_rt:complexity = 1"),
        'def Material "m" { float inputs:gain = 1\ntoken outputs:surface\ndef Shader "s" { int info:own = 1 } }',
        'def SphereLight "l" { float inputs:shaping:focus = 1\nfloat intensity = 3\ntoken warp_rt:falloff = "none" }',
        'def RenderSettings "r" { int warp_rt:depth = 3 }',
        'def Material "m" (prepend apiSchemas = ["MaterialXConfigAPI"]) { string config:mtlx:version = "1.39" }',
        'def BlendShape "b" { vector3f[] inbetweens:half = [] }',
        'def Unheard "u" { int of = 1 }',  # the type is told, N911
        'def Scope "s" { token purpose = "guide"\nuniform token[] xformOpOrder = [] }',  # N924's
    ],
)
def test_what_usd_knows_or_leaves_to_users_is_not_told(body: str) -> None:
    assert told(body) == []


def test_prims_of_instances_and_prototypes_are_looked_at() -> None:
    body = f'def "Asset" {{ {mesh("int foo = 1")} }}\n'
    body += 'def "i" (instanceable = true\nreferences = </Asset>) {}\n'
    assert [record[0] for record in told(body)] == ["N942"]


def test_misspelt_metadata_is_told_and_that_of_others_is_kept_for_the_end() -> None:
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString("""#usda 1.0
        (
            metersPerUnits = 1
            customLayerData = { int a = 1 }
        )
        def Xform "a" (
            instancable = true
            kind = "component"
            mayaSelectability = "on"
        )
        {
        }
        def Xform "b" (
            instancable = true
        )
        {
        }
    """)
    found = load_stage(stage).diagnostics
    assert [(record.code, record.prim, record.message) for record in found if record.code in ("N942", "N943")] == [
        ("N942", "/", "a stage has no metadata metersPerUnits (did you mean metersPerUnit?); ignored"),
        ("N942", "/a", "a prim has no metadata instancable (did you mean instanceable?); ignored"),
        ("N943", "/a", "not read, here or elsewhere: mayaSelectability"),
    ]


@pytest.mark.parametrize(
    ("kind", "meant"),
    [
        ("Spere", "Sphere"),
        ("mesh", "Mesh"),
        ("RectLigth", "RectLight"),
        ("Look", ""),
        ("RisPattern", ""),
        ("FieldAsset", ""),
    ],
)
def test_types_that_are_misspelt_are_told_with_what_was_meant(kind: str, meant: str) -> None:
    stage = Usd.Stage.CreateInMemory()
    stage.DefinePrim("/p", kind)
    (note,) = [record for record in load_stage(stage).diagnostics if record.code == "N911"]
    assert ("did you mean" in note.message, f"did you mean {meant}?" in note.message) == (bool(meant), bool(meant))


def test_schemas_that_are_misspelt_are_told_with_what_was_meant() -> None:
    (note,) = told('def Sphere "s" (prepend apiSchemas = ["MaterialBindingApi"]) {}')
    message = "USD has no schema MaterialBindingApi to apply (did you mean MaterialBindingAPI?); ignored"
    assert note == ("N942", "/s", message)
    (note,) = told('def Sphere "s" (prepend apiSchemas = ["PhysxCollisionAPI"]) {}')
    assert note[0] == "N943"


@pytest.mark.parametrize(
    ("attribute", "schema"),
    [
        ('uniform token renderVisibility = "invisible"', "VisibilityAPI"),
        ('uniform token colorSpace:name = "srgb_rec709_scene"', "ColorSpaceAPI"),
        ('token[] semantics:labels:class = ["ball"]', "SemanticsLabelsAPI"),
        ('uniform token lod:override:mode = "noOverride"', "LODOverrideAPI"),
    ],
)
def test_attributes_of_schemas_that_are_not_applied_are_told(attribute: str, schema: str) -> None:
    name = attribute.split(" = ")[0].split()[-1]
    note = ("N942", "/s", f"a Sphere has no {name} ({schema} is not applied); ignored")
    assert told(f'def Sphere "s" {{ {attribute} }}') == [note]
    applied = f"{schema}:class" if schema.startswith("Semantics") else schema
    assert told(f'def Sphere "s" (prepend apiSchemas = ["{applied}"]) {{ {attribute} }}') == []
