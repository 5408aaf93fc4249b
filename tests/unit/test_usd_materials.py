# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Bindings and surfaces: which material a prim has, and which inputs the surface says."""

import numpy as np
import OpenEXR
import pytest
from PIL import Image as PilImage
from pxr import Usd, UsdShade

from warp_rt.report import Report
from warp_rt.scene import Input, MaterialModel, OpacityMode
from warp_rt.usd.bindings import BINDING_PURPOSES
from warp_rt.usd.materials import DISPLAY_COLOR_MATERIAL, MaterialReader
from warp_rt.usd.shading_network import Node, find_source

TIME = Usd.TimeCode.Default()


def _stage(body):
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString("#usda 1.0\n" + body)
    return stage


def _material(shader, outputs="token outputs:surface.connect = </M/S.outputs:surface>", more=""):
    """Return the source of /Mesh bound to /M with the shader /M/S."""
    return f"""
def Mesh "Mesh" (apiSchemas = ["MaterialBindingAPI"]) {{
    rel material:binding = </M>
}}
def Material "M" {{
    {outputs}
    def Shader "S" {{
        {shader}
        token outputs:surface
    }}
    {more}
}}
"""


def _read(body, path="/Mesh", purposes=BINDING_PURPOSES):
    """Return the material bound to a prim, the reader, and the diagnostics' codes."""
    stage = _stage(body)
    report = Report()
    reader = MaterialReader(stage, TIME, report, purposes)
    row = reader.bind(stage.GetPrimAtPath(path))
    return reader.materials[row], reader, [d.code for d in report]


def _value(material, name):
    return material.inputs[name].value


# --- models


def test_whitted_surface():
    shader = """uniform token info:id = "WhittedSurface"
        color3f inputs:ambient = (0.1, 0.2, 0.3)
        color3f inputs:diffuse = (0.4, 0.5, 0.6)
        color3f inputs:specular = (0.7, 0.8, 0.9)
        float inputs:shininess = 80
        color3f inputs:reflection = (0.25, 0.5, 0.75)
        color3f inputs:transmission = (1, 0, 0.5)
        float inputs:ior = 1.25"""
    outputs = "token outputs:warp_rt:surface.connect = </M/S.outputs:surface>"
    material, _, codes = _read(_material(shader, outputs))
    assert (material.path, material.model, codes) == ("/M", MaterialModel.WHITTED, [])
    assert _value(material, "ambient") == pytest.approx((0.1, 0.2, 0.3, 0))
    assert _value(material, "diffuse") == pytest.approx((0.4, 0.5, 0.6, 0))
    assert _value(material, "specular") == pytest.approx((0.7, 0.8, 0.9, 0))
    assert _value(material, "reflection") == (0.25, 0.5, 0.75, 0)
    assert _value(material, "transmission") == (1, 0, 0.5, 0)
    assert (_value(material, "shininess")[0], _value(material, "ior")[0]) == (80, 1.25)


def test_inputs_that_say_nothing_are_absent():
    material, _, _ = _read(_material('uniform token info:id = "UsdPreviewSurface"\ncolor3f inputs:diffuseColor'))
    assert (material.model, dict(material.inputs)) == (MaterialModel.PREVIEW, {})
    assert not material.use_specular_workflow
    assert material.opacity_mode == OpacityMode.TRANSPARENT
    assert material.opacity_threshold == 0


@pytest.mark.parametrize("identifier", ["UsdPreviewSurface", "ND_UsdPreviewSurface_surfaceshader"])
def test_preview_surface(identifier):
    shader = f'''uniform token info:id = "{identifier}"
        int inputs:useSpecularWorkflow = 1
        token inputs:opacityMode = "presence"
        float inputs:opacityThreshold = 0.5
        color3f inputs:diffuseColor = (1, 0.5, 0.25)
        float inputs:roughness = 0.125
        normal3f inputs:normal = (0, 0, 1)'''
    material, _, codes = _read(_material(shader))
    assert (material.model, codes) == (MaterialModel.PREVIEW, [])
    assert material.use_specular_workflow
    assert (material.opacity_mode, material.opacity_threshold) == (OpacityMode.PRESENCE, 0.5)
    assert _value(material, "diffuseColor") == (1, 0.5, 0.25, 0)
    assert _value(material, "roughness")[0] == 0.125
    assert _value(material, "normal") == (0, 0, 1, 0)


# --- which surface


def _two_surfaces(first, second):
    return _material(
        'uniform token info:id = "UsdPreviewSurface"',
        f"token outputs:{first}.connect = </M/S.outputs:surface>\n"
        f"token outputs:{second}.connect = </M/T.outputs:surface>",
        'def Shader "T" {\nuniform token info:id = "WhittedSurface"\ntoken outputs:surface\n}',
    )


def test_our_own_output_comes_before_the_universal_one():
    assert _read(_two_surfaces("surface", "warp_rt:surface"))[0].model == MaterialModel.WHITTED
    assert _read(_two_surfaces("warp_rt:surface", "surface"))[0].model == MaterialModel.PREVIEW


def test_the_universal_output_comes_before_another_renderers():
    assert _read(_two_surfaces("surface", "mtlx:surface"))[0].model == MaterialModel.PREVIEW


def test_another_renderers_output_counts_where_there_is_no_other():
    outputs = "token outputs:mtlx:surface.connect = </M/S.outputs:surface>"
    material, _, codes = _read(_material('uniform token info:id = "UsdPreviewSurface"', outputs))
    assert (material.path, codes) == ("/M", [])


def test_a_known_surface_comes_before_one_that_would_be_approximated():
    body = _material(
        'uniform token info:id = "ND_standard_surface_surfaceshader"',
        "token outputs:surface.connect = </M/S.outputs:surface>\n"
        "token outputs:glslfx:surface.connect = </M/T.outputs:surface>",
        'def Shader "T" {\nuniform token info:id = "UsdPreviewSurface"\n'
        "float inputs:roughness = 1\ntoken outputs:surface\n}",
    )
    material, _, codes = _read(body)
    assert (list(material.inputs), codes) == (["roughness"], [])


def test_surfaces_that_nobody_knows_show_display_color():
    for shader in ('uniform token info:id = "totally_unknown"', ""):
        material, _, codes = _read(_material(shader))
        assert (material.path, codes) == (DISPLAY_COLOR_MATERIAL, ["W301"])
    assert _read(_material("", outputs=""))[2] == ["W307"]


def test_source_code_is_named_by_its_file():
    shader = (
        'uniform token info:implementationSource = "sourceAsset"\nuniform asset info:mdl:sourceAsset = @OmniPBR.mdl@'
    )
    stage = _stage(_material(shader))
    report = Report()
    MaterialReader(stage, TIME, report).bind(stage.GetPrimAtPath("/Mesh"))
    (diagnostic,) = report
    assert diagnostic.prim == "/M/S"
    assert "mdl:OmniPBR.mdl" in diagnostic.message


def test_standard_surface_is_told_as_a_preview_surface():
    shader = """uniform token info:id = "ND_standard_surface_surfaceshader"
        float inputs:base = 0.5
        color3f inputs:base_color = (1, 0.5, 0)
        float inputs:metalness = 1
        float inputs:transmission = 0.75
        float inputs:emission = 2
        color3f inputs:emission_color = (1, 2, 3)"""
    material, _, codes = _read(_material(shader))
    assert (material.model, codes) == (MaterialModel.PREVIEW, ["W302"])
    assert _value(material, "diffuseColor") == (0.5, 0.25, 0, 0)
    assert _value(material, "emissiveColor") == (2, 4, 6, 0)
    assert _value(material, "metallic")[0] == 1
    assert _value(material, "roughness")[0] == pytest.approx(0.2)
    assert _value(material, "opacity")[0] == 0.25


@pytest.mark.parametrize("mode", [1, 2])
def test_what_is_there_in_part_has_the_reflectance_that_it_asks_for(mode):
    """Coverage bends no rays: an index of refraction of 1 is then all that ``specular`` 0 means."""
    shader = f"""uniform token info:id = "ND_gltf_pbr_surfaceshader"
        float inputs:specular = 0
        float inputs:alpha = 0.25
        int inputs:alpha_mode = {mode}"""
    material, _, _ = _read(_material(shader))
    assert _value(material, "ior")[0] == 1
    glass = shader.replace("float inputs:alpha = 0.25", "float inputs:transmission = 1")
    material, _, _ = _read(_material(glass))
    assert material.inputs.get("ior", Input((1.5, 0, 0, 0))).value[0] == 1.5


def test_weight_of_a_texture_goes_into_its_scale():
    shader = """uniform token info:id = "ND_standard_surface_surfaceshader"
        float inputs:base = 0.5
        color3f inputs:base_color.connect = </M/T.outputs:out>"""
    more = """def Shader "T" {
        uniform token info:id = "ND_image_color3"
        color3f inputs:default = (1, 0.5, 0)
        color3f outputs:out
    }"""
    material, reader, codes = _read(_material(shader, more=more))
    texture = reader.textures[material.inputs["diffuseColor"].texture]
    assert texture.scale[:3] == (0.5, 0.5, 0.5)
    assert texture.fallback[:3] == (0.5, 0.25, 0)
    assert sorted(codes) == ["W201", "W302"]


# --- bindings


def test_unbound_prims_share_one_display_color_material():
    stage = _stage('def Mesh "A" {}\ndef Sphere "B" {}')
    report = Report()
    reader = MaterialReader(stage, TIME, report)
    assert reader.bind(stage.GetPrimAtPath("/A")) == reader.bind(stage.GetPrimAtPath("/B")) == 0
    (material,) = reader.materials
    assert material.inputs["diffuseColor"] == Input((0.5, 0.5, 0.5, 0), primvar="displayColor")
    assert material.inputs["opacity"] == Input((1, 0, 0, 0), primvar="displayOpacity", channel=0)
    assert material.opacity_mode == OpacityMode.PRESENCE
    assert len(report) == 0


def test_a_material_is_read_once():
    stage = _stage(
        _material('uniform token info:id = "UsdPreviewSurface"')
        + 'def Cube "C" (apiSchemas = ["MaterialBindingAPI"]) {\nrel material:binding = </M>\n}'
    )
    reader = MaterialReader(stage, TIME, Report())
    assert reader.bind(stage.GetPrimAtPath("/Mesh")) == reader.bind(stage.GetPrimAtPath("/C"))
    assert len(reader.materials) == 1


BINDINGS = """
def Xform "Parent" (apiSchemas = ["MaterialBindingAPI", "CollectionAPI:picked"]) {
    rel material:binding = </A> (bindMaterialAs = "%s")
    rel material:binding:collection:pick = [</Parent.collection:picked>, </C>]
    rel collection:picked:includes = </Parent/Picked>
    def Mesh "Inherits" {}
    def Mesh "Picked" {}
    def Mesh "Own" (apiSchemas = ["MaterialBindingAPI"]) {
        rel material:binding = </B>
        rel material:binding:full = </Full>
        def GeomSubset "faces" (apiSchemas = ["MaterialBindingAPI"]) {
            rel material:binding = </C>
        }
    }
}
""" + "".join(
    f'def Material "{name}" {{\ntoken outputs:surface.connect = </{name}/S.outputs:surface>\n'
    'def Shader "S" {\nuniform token info:id = "UsdPreviewSurface"\ntoken outputs:surface\n}\n}\n'
    for name in ("A", "B", "C", "Full")
)


@pytest.mark.parametrize(
    ("strength", "prim", "purpose", "material"),
    [
        ("weakerThanDescendants", "/Parent/Inherits", "full", "/A"),
        ("weakerThanDescendants", "/Parent/Picked", "full", "/C"),
        ("weakerThanDescendants", "/Parent/Own", "full", "/Full"),
        ("weakerThanDescendants", "/Parent/Own", "preview", "/B"),
        ("weakerThanDescendants", "/Parent/Own", "", "/B"),
        ("weakerThanDescendants", "/Parent/Own/faces", "", "/C"),
        ("strongerThanDescendants", "/Parent/Own", "", "/A"),
    ],
)
def test_binding(strength, prim, purpose, material):
    assert _read(BINDINGS % strength, prim, purposes=(purpose, ""))[0].path == material


def test_a_material_for_previews_alone_is_drawn():
    body = """
def Mesh "Mesh" (apiSchemas = ["MaterialBindingAPI"]) {
    rel material:binding:preview = </M>
}
def Material "M" {
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        token outputs:surface
    }
}
"""
    assert (_read(body)[0].path, _read(body)[2]) == ("/M", [])


def test_binding_to_nothing_is_named():
    body = (
        'def Xform "P" (apiSchemas = ["MaterialBindingAPI"]) {\nrel material:binding = </Gone>\ndef Mesh "Mesh" {}\n}'
    )
    material, _, codes = _read(body, "/P/Mesh")
    assert (material.path, codes) == (DISPLAY_COLOR_MATERIAL, ["W310"])


COLLECTION = """
def Xform "P" (apiSchemas = ["MaterialBindingAPI", "CollectionAPI:c"]) {
    rel collection:c:includes = </P/Mesh>
    rel material:binding = </M>
    rel material:binding:collection:x = [%s]
    def Mesh "Mesh" {}
}
"""
PLAIN = """
def Material "M" {
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S" { uniform token info:id = "UsdPreviewSurface"
        token outputs:surface
    }
}
"""


@pytest.mark.parametrize(
    ("bindings", "material"),
    [
        ("rel material:binding:full = </Gone>\nrel material:binding = </M>", DISPLAY_COLOR_MATERIAL),
        ("rel material:binding:preview = </Gone>", DISPLAY_COLOR_MATERIAL),
        ("rel material:binding = </M/S>", DISPLAY_COLOR_MATERIAL),
        ("rel material:binding = [</M>, </N>]", DISPLAY_COLOR_MATERIAL),
        ("rel material:binding = </M.outputs:surface>", DISPLAY_COLOR_MATERIAL),
        # Those that do not count, as another precedes them, do no harm.
        ("rel material:binding:preview = </Gone>\nrel material:binding = </M>", None),
    ],
)
def test_direct_bindings_to_nothing_are_named(bindings, material):
    """What UsdShade's resolution finds is obeyed where it leads to nothing: no weaker binding steps in."""
    body = f'def Mesh "Mesh" (apiSchemas = ["MaterialBindingAPI"]) {{ {bindings}\n}}{PLAIN}'
    found, _, codes = _read(body)
    assert (found.path, codes) == ((material, ["W310"]) if material else ("/M", []))


@pytest.mark.parametrize(
    ("targets", "material"),
    [
        ("</P.collection:c>, </Gone>", DISPLAY_COLOR_MATERIAL),
        ("</P.collection:gone>, </M>", "/M"),  # UsdShade passes over it, to the direct one
        ("</P.collection:c>, </M>, </N>", "/M"),
        ("</P.collection:c>", "/M"),
    ],
)
def test_bindings_of_collections_that_do_not_fit_are_named(targets, material):
    found, _, codes = _read(COLLECTION % targets + PLAIN, "/P/Mesh")
    assert (found.path, codes) == (material, ["W310"])


# --- networks


def test_sources_that_there_are_and_are_no_outputs_are_not_called_missing():
    shader = """uniform token info:id = "UsdPreviewSurface"
        float inputs:roughness.connect = </Mesh.size>
        float inputs:metallic.connect = [</M.inputs:a>, </M.inputs:b>]"""
    more = "float inputs:a = 0.25\nfloat inputs:b = 0.5"
    stage = _stage(_material(shader, more=more).replace("rel material", "custom float size = 1\nrel material"))
    report = Report()
    reader = MaterialReader(stage, TIME, report)
    material = reader.materials[reader.bind(stage.GetPrimAtPath("/Mesh"))]
    assert {name: value.value[0] for name, value in material.inputs.items()} == {"metallic": 0.25}
    assert [(d.code, d.message) for d in report] == [
        ("W304", "connected to 2 sources: the first counts"),
        ("W304", "connected to /Mesh.size, which is no input or output"),
    ]


@pytest.mark.parametrize("name", ["metallic", "roughness", "clearcoat", "clearcoatRoughness", "opacity"])
@pytest.mark.parametrize(("value", "taken"), [(-0.5, 0), (0, 0), (1, 1), (2, 1)])
def test_shares_are_from_0_to_1(name, value, taken):
    material, _, codes = _read(_material(f'uniform token info:id = "UsdPreviewSurface"\nfloat inputs:{name} = {value}'))
    assert (material.inputs[name].value[0], codes) == (taken, ["W312"] if value != taken else [])


@pytest.mark.parametrize(("value", "taken"), [(-3, 0), (0, 0), (200, 200)])
def test_exponents_are_not_below_0(value, taken):
    material, _, codes = _read(_material(f'uniform token info:id = "WhittedSurface"\nfloat inputs:shininess = {value}'))
    assert (material.inputs["shininess"].value[0], codes) == (taken, ["W312"] if value != taken else [])


def test_inputs_through_node_graphs_and_interfaces_of_any_depth():
    body = _material(
        """uniform token info:id = "UsdPreviewSurface"
        float inputs:roughness.connect = </M.inputs:rough>
        color3f inputs:diffuseColor.connect = </M/G.outputs:color>
        color3f inputs:emissiveColor.connect = </M/G/H.outputs:value>""",
        "float inputs:rough = 0.25\ncolor3f inputs:tint = (1, 2, 3)\n"
        "token outputs:surface.connect = </M/S.outputs:surface>",
        """def NodeGraph "G" {
            color3f inputs:c.connect = </M.inputs:tint>
            color3f outputs:color.connect = </M/G.inputs:c>
            def NodeGraph "H" {
                color3f inputs:c.connect = </M/G.inputs:c>
                color3f outputs:value.connect = </M/G/H/R.outputs:result>
                def Shader "R" {
                    uniform token info:id = "UsdPrimvarReader_float3"
                    string inputs:varname = "paint"
                    float3 inputs:fallback.connect = </M/G/H.inputs:c>
                    float3 outputs:result
                }
            }
        }""",
    )
    material, _, codes = _read(body)
    assert codes == []
    assert _value(material, "roughness")[0] == 0.25
    assert _value(material, "diffuseColor") == (1, 2, 3, 0)
    assert material.inputs["emissiveColor"] == Input((1, 2, 3, 0), primvar="paint")


def test_surface_through_a_node_graph():
    outputs = "token outputs:surface.connect = </M/G.outputs:surface>"
    more = 'def NodeGraph "G" {\ntoken outputs:surface.connect = </M/S.outputs:surface>\n}'
    assert _read(_material('uniform token info:id = "UsdPreviewSurface"', outputs, more))[0].path == "/M"


CYCLES = _material(
    """uniform token info:id = "UsdPreviewSurface"
    color3f inputs:diffuseColor.connect = </M.inputs:loop>
    color3f inputs:emissiveColor.connect = </M.inputs:self>
    float inputs:metallic = 0.75
    float inputs:metallic.connect = </M/Gone.outputs:r>
    float inputs:opacity.connect = </M/G.outputs:a>
    float inputs:ior.connect = </M.inputs:unset>
    float inputs:clearcoat.connect = </M/T.outputs:r>""",
    """color3f inputs:loop.connect = </M/S.inputs:diffuseColor>
    color3f inputs:self.connect = </M.inputs:self>
    float inputs:unset
    token outputs:surface.connect = </M/S.outputs:surface>""",
    """def NodeGraph "G" {
        float outputs:a.connect = </M/G.outputs:b>
        float outputs:b.connect = </M/G.outputs:a>
    }
    def Shader "T" {
        uniform token info:id = "ND_convert_float_float"
        float inputs:in.connect = </M/T.outputs:r>
        float outputs:r
    }""",
)


def test_cycles_and_broken_connections_end_in_a_diagnostic():
    material, _, codes = _read(CYCLES)
    assert {name: source.value[0] for name, source in material.inputs.items()} == {"metallic": 0.75}
    assert codes.count("W304") == 4
    assert set(codes) == {"W304", "W303"}


def test_sources_are_those_that_usdshade_finds():
    stage = _stage(CYCLES)
    for port in UsdShade.Shader(stage.GetPrimAtPath("/M/S")).GetInputs():
        if port.GetBaseName() in ("diffuseColor", "emissiveColor", "opacity"):
            continue  # cycles, about which UsdShade writes to stderr
        expected = port.GetValueProducingAttributes()
        found = find_source(port, Report())
        if isinstance(found, Node):
            found = found.shader.GetOutput(found.output).GetAttr()
        assert ([found] if found else []) == expected


WITHOUT_END = """
def Material "M" {
    float inputs:none
    float inputs:on.connect = </M.inputs:none>
    float inputs:broken = 0.4
    float inputs:broken.connect = </M/Nothing.outputs:x>
    token outputs:surface.connect = </M/S.outputs:surface>
    def NodeGraph "G" {
        float inputs:a = 0.9
        float inputs:a.connect = </M.inputs:none>
        float outputs:a.connect = </M/G.inputs:a>
        float outputs:held = 0.3
    }
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        float inputs:roughness = 0.2
        float inputs:roughness.connect = </M.inputs:none>
        float inputs:metallic = 0.25
        float inputs:metallic.connect = </M.inputs:on>
        float inputs:clearcoat = 0.1
        float inputs:clearcoat.connect = </M/G.outputs:a>
        float inputs:ior = 1.7
        float inputs:ior.connect = </M.inputs:broken>
        float inputs:occlusion = 0.8
        float inputs:occlusion.connect = </M/G.outputs:held>
        float inputs:opacity.connect = </M.inputs:on>
        token outputs:surface
    }
}
"""


def test_where_a_connection_ends_without_a_value_the_last_one_on_the_way_counts():
    """As UsdShade has it: a shader keeps its own where the material's interface says nothing."""
    stage = _stage(WITHOUT_END)
    found = {}
    for port in UsdShade.Shader(stage.GetPrimAtPath("/M/S")).GetInputs():
        source = find_source(port, Report())
        assert ([source] if source else []) == port.GetValueProducingAttributes()
        found[port.GetBaseName()] = round(source.Get(), 6) if source else None
    assert found == {
        "roughness": 0.2, "metallic": 0.25, "clearcoat": 0.9, "ior": 0.4, "occlusion": 0.3, "opacity": None
    }  # fmt: skip


WRONG_SIZES = """
def Mesh "Mesh" (apiSchemas = ["MaterialBindingAPI"]) {
    rel material:binding = </M>
}
def Material "M" {
    color3f inputs:rough = (0.25, 0.5, 0.75)
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        float inputs:roughness.connect = </M.inputs:rough>
        float inputs:opacity.connect = </M/R.outputs:result>
        token outputs:surface
    }
    def Shader "R" {
        uniform token info:id = "UsdPrimvarReader_float"
        string inputs:varname = "cover"
        float3 inputs:fallback = (1, 2, 3)
        float outputs:result
    }
}
"""


def test_values_of_a_wrong_type_are_named():
    shader = """uniform token info:id = "UsdPreviewSurface"
        string inputs:roughness = "rough"
        color3f inputs:diffuseColor = (nan, 0, 0)
        float inputs:emissiveColor = 2
        color3f inputs:metallic = (0.5, 0, 0)
        int inputs:clearcoat = 1"""
    material, _, codes = _read(_material(shader))
    assert codes == ["W306"] * 4
    assert {name: value.value[0] for name, value in material.inputs.items()} == {"clearcoat": 1}


def test_values_of_a_wrong_type_are_told_in_one_line_each_with_what_they_are():
    stage, report = _stage(WRONG_SIZES), Report()
    material = MaterialReader(stage, TIME, report)
    inputs = material.materials[material.bind(stage.GetPrimAtPath("/Mesh"))].inputs
    assert [(d.code, d.prim, d.message) for d in report] == [
        ("W306", "/M.inputs:rough", "is Gf.Vec3f(0.25, 0.5, 0.75), not a finite number; the default is used"),
        ("W306", "/M/R.inputs:fallback", "is Gf.Vec3f(1.0, 2.0, 3.0), not a finite number; the default is used"),
    ]
    assert (inputs["opacity"].primvar, inputs["opacity"].value[0]) == ("cover", 0)
    assert "roughness" not in inputs


def test_constants_cannot_be_connected_to_nodes():
    shader = """uniform token info:id = "UsdPreviewSurface"
        float inputs:opacityThreshold.connect = </M/R.outputs:result>"""
    more = 'def Shader "R" {\nuniform token info:id = "UsdPrimvarReader_float"\nfloat outputs:result\n}'
    material, _, codes = _read(_material(shader, more=more))
    assert (material.opacity_threshold, codes) == (0, ["W308"])


# --- displacement and normal maps


@pytest.mark.parametrize(
    ("displacement", "codes"),
    [("", []), ("float inputs:displacement = 0", []), ("float inputs:displacement = 1", [])],
)
def test_displacement_is_read(displacement, codes):
    outputs = (
        "token outputs:surface.connect = </M/S.outputs:surface>\n"
        "token outputs:displacement.connect = </M/S.outputs:displacement>"
    )
    shader = f'uniform token info:id = "UsdPreviewSurface"\n{displacement}\ntoken outputs:displacement'
    assert _read(_material(shader, outputs))[2] == codes


@pytest.mark.parametrize(
    ("inputs", "warnings"),
    [
        (
            'token inputs:sourceColorSpace = "raw"\n'
            "float4 inputs:scale = (2, 2, 2, 1)\nfloat4 inputs:bias = (-1, -1, -1, 0)",
            0,
        ),
        ('token inputs:sourceColorSpace = "raw"', 1),
        ("float4 inputs:scale = (2, 2, 2, 1)\nfloat4 inputs:bias = (-1, -1, -1, 0)", 1),
        ("", 2),
    ],
)
def test_normal_maps_that_are_not_taken_to_minus_one_to_one_are_named(tmp_path, inputs, warnings):
    path = tmp_path / "n.png"
    PilImage.fromarray(np.full((2, 2, 3), 128, np.uint8)).save(path)
    assert _normal_map_codes(path, inputs) == ["W309"] * warnings


@pytest.mark.parametrize(
    ("texels", "codes"),
    [
        ([(0.5, 0.5, 1.0), (0.25, 0.75, 0.9)], ["W309"]),
        ([(-0.5, 0.5, 0.7), (0.25, 0.75, 0.6)], []),
        ([(0.0, 0.0, 1.0), (0.0, 0.0, 1.0)], []),
    ],
    ids=["from 0 to 1", "from -1 to 1", "flat"],
)
def test_normal_maps_of_floats_tell_by_their_texels_whether_they_need_a_scale(tmp_path, texels, codes):
    path = tmp_path / "n.exr"
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"RGB": np.array([texels], np.float32)}) as file:
        file.write(str(path))
    assert _normal_map_codes(path, "") == codes


def _normal_map_codes(path, inputs):
    """Return the codes about a material whose normal map is a file's."""
    shader = 'uniform token info:id = "UsdPreviewSurface"\nnormal3f inputs:normal.connect = </M/T.outputs:rgb>'
    more = f"""def Shader "T" {{
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @{path.as_posix()}@
        float2 inputs:st.connect = </M/R.outputs:result>
        {inputs}
        float3 outputs:rgb
    }}
    def Shader "R" {{
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "st"
        float2 outputs:result
    }}"""
    material, _, codes = _read(_material(shader, more=more))
    assert material.inputs["normal"].texture == 0
    return codes


@pytest.mark.parametrize(
    "value",
    [
        'string inputs:useSpecularWorkflow = "yes"',
        'token inputs:opacityMode = "glass"',
        "float2 inputs:opacityMode = (1, 2)",
        "float[] inputs:opacityThreshold = [1, 2]",
    ],
)
def test_constants_that_mean_nothing_are_named(value):
    material, _, codes = _read(_material(f'uniform token info:id = "UsdPreviewSurface"\n{value}'))
    assert codes == ["W306"]
    assert (material.use_specular_workflow, material.opacity_threshold) == (False, 0)
    assert material.opacity_mode == OpacityMode.TRANSPARENT


@pytest.mark.parametrize("value", ["-1", "0"])
@pytest.mark.parametrize("identifier", ["UsdPreviewSurface", "WhittedSurface", "ND_gltf_pbr_surfaceshader"])
def test_an_index_of_refraction_is_above_zero(identifier, value):
    material, _, codes = _read(_material(f'uniform token info:id = "{identifier}"\nfloat inputs:ior = {value}'))
    assert ("ior" in material.inputs, [code for code in codes if code != "W302"]) == (False, ["W306"])


def test_misspelt_inputs_of_our_own_surface_are_named():
    body = "color3f inputs:reflectance = (1, 1, 1)\ncolor3f inputs:diffuse = (1, 0, 0)"
    material, _, codes = _read(_material(f'uniform token info:id = "WhittedSurface"\n{body}'))
    assert (codes, set(material.inputs)) == (["W311"], {"diffuse"})


@pytest.mark.parametrize("identifier", ["UsdPreviewSurface", "ND_UsdPreviewSurface_surfaceshader"])
def test_inputs_that_a_preview_surface_does_not_have_are_noted_in_one_line(identifier):
    body = "float inputs:roughnes = 0\ncolor3f inputs:baseColor = (1, 0, 0)\nfloat inputs:displacement = 0"
    body += "\nfloat inputs:opacityThreshold = 0\nint inputs:useSpecularWorkflow = 0\nfloat inputs:metallic = 1"
    body += '\ntoken inputs:opacityMode = "transparent"'
    stage, report = _stage(_material(f'uniform token info:id = "{identifier}"\n{body}')), Report()
    MaterialReader(stage, TIME, report).bind(stage.GetPrimAtPath("/Mesh"))
    found = [(d.code, d.prim, "inputs:baseColor, inputs:roughnes;" in d.message, d.is_warning) for d in report]
    assert found == [("N917", "/M/S", True, False)]


def test_inputs_that_the_nodes_of_a_preview_surface_do_not_have_are_noted():
    surface = 'uniform token info:id = "UsdPreviewSurface"\ncolor3f inputs:diffuseColor.connect = </M/T.outputs:rgb>'
    nodes = """
    def Shader "T" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @none.png@
        token inputs:isSRGB = "auto"
        token inputs:wrapS = "repeat"
        float2 inputs:st.connect = </M/X.outputs:result>
        float3 outputs:rgb
    }
    def Shader "X" {
        uniform token info:id = "UsdTransform2d"
        float2 inputs:in.connect = </M/R.outputs:result>
        float2 inputs:translate = (0, 1)
        float2 outputs:result
    }
    def Shader "R" {
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "st"
        token inputs:name = "st"
        float2 outputs:result
    }"""
    stage, report = _stage(_material(surface, more=nodes)), Report()
    MaterialReader(stage, TIME, report).bind(stage.GetPrimAtPath("/Mesh"))
    assert {(d.prim, d.message) for d in report if d.code == "N917"} == {
        ("/M/T", "UsdUVTexture has no inputs:isSRGB; ignored"),
        ("/M/X", "UsdTransform2d has no inputs:translate; ignored"),
        ("/M/R", "UsdPrimvarReader has no inputs:name; ignored"),
    }


@pytest.mark.parametrize(
    ("space", "expected", "codes"),
    [
        ("srgb_texture", (0.214041, 0.050876, 1.0), []),
        ("g22_rec709", (0.5**2.2, 0.25**2.2, 1.0), []),
        ("acescg", (0.664680, 0.206060, 1.075600), []),
        ("lin_rec709", (0.5, 0.25, 1.0), []),
        ("raw", (0.5, 0.25, 1.0), []),
        ("ARRI LogC4", (0.5, 0.25, 1.0), ["W205"]),
    ],
)
def test_colours_in_other_spaces_become_linear(space, expected, codes):
    body = f'color3f inputs:diffuseColor = (0.5, 0.25, 1) (colorSpace = "{space}")'
    material, _, found = _read(_material(f'uniform token info:id = "UsdPreviewSurface"\n{body}'))
    if space == "acescg":  # the AP1 to Rec. 709 matrix of ACES, D60 adapted to D65
        matrix = [(1.70505, -0.62179, -0.08326), (-0.13026, 1.14080, -0.01055), (-0.02400, -0.12897, 1.15297)]
        expected = np.array(matrix) @ (0.5, 0.25, 1)
    np.testing.assert_allclose(_value(material, "diffuseColor")[:3], expected, atol=5e-4)
    assert found == codes
