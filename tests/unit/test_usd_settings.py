# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Render settings, the products' overrides, and our own attributes."""

import pytest
from pxr import Usd

from warp_rt.errors import SceneError
from warp_rt.report import Report
from warp_rt.scene import Settings
from warp_rt.usd.load import load_stage
from warp_rt.usd.settings import read_settings

CAMERAS = "".join(f'def Camera "{name}" {{\n}}\n' for name in ("Cam", "Other"))


def _read(settings="", products="", metadata='renderSettingsPrimPath = "/Render/S"', path=None):
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(
        f"#usda 1.0\n({metadata}\n)\n{CAMERAS}"
        f'def "Render" {{\ndef RenderSettings "S" {{\n{settings}\n}}\n{products}\n}}'
    )
    report = Report()
    found = read_settings(stage, report, path)
    assert not any("\n" in d.message for d in report)
    return found.settings, found.purposes, [d.code for d in report]


def _products(settings="", products="", variables=""):
    stage = Usd.Stage.CreateInMemory()
    assert stage.GetRootLayer().ImportFromString(
        f'#usda 1.0\n(renderSettingsPrimPath = "/S"\n)\n{CAMERAS}def RenderSettings "S" {{\n{settings}\n}}\n'
        f"{products}\n{variables}"
    )
    report = Report()
    found = read_settings(stage, report)
    return found.products, [d.code for d in report]


def test_nothing_is_said():
    assert _read(metadata="") == (Settings(), None, [])
    assert _read() == (Settings(path="/Render/S"), None, [])


def test_our_own_terms():
    body = (
        "color3f warp_rt:ambient = (0.1, 0.2, 0.3)\ncolor3f warp_rt:background = (1, 0, 0.5)\n"
        "int warp_rt:depth = 4\nfloat warp_rt:threshold = 0.25"
    )
    found, _, codes = _read(body)
    assert found.ambient == pytest.approx((0.1, 0.2, 0.3))
    assert found.background == (1, 0, 0.5)
    assert (found.depth, found.threshold, codes) == (4, 0.25, [])


def test_standard_terms():
    body = (
        "uniform int2 resolution = (640, 480)\nuniform float pixelAspectRatio = 2\n"
        'uniform token aspectRatioConformPolicy = "cropAperture"\nrel camera = </Cam>\n'
        'uniform token[] includedPurposes = ["default", "guide"]'
    )
    found, purposes, codes = _read(body)
    assert (found.resolution, found.pixel_aspect_ratio, found.aspect_policy) == ((640, 480), 2, "cropAperture")
    assert (found.camera, purposes, codes) == ("/Cam", ("default", "guide"), [])


def test_first_raster_product_overrides_what_it_authors():
    products = (
        'def RenderProduct "Deep" {\nuniform token productType = "deepRaster"\nuniform int2 resolution = (1, 1)\n}\n'
        'def RenderProduct "P" {\nuniform int2 resolution = (32, 16)\nrel camera = </Other>\n}\n'
        'def RenderProduct "Q" {\nuniform int2 resolution = (2, 2)\n}'
    )
    body = (
        "rel products = [</Render/Deep>, </Render/P>, </Render/Q>]\nuniform int2 resolution = (640, 480)\n"
        "uniform float pixelAspectRatio = 2\nrel camera = </Cam>"
    )
    found, _, codes = _read(body, products)
    assert (found.resolution, found.pixel_aspect_ratio, found.camera) == ((32, 16), 2, "/Other")
    assert codes == ["W524"]


def test_a_path_is_taken_before_the_metadata():
    assert _read(metadata="", path="/Render/S")[0].path == "/Render/S"
    with pytest.raises(SceneError, match="/Nothing is no RenderSettings prim"):
        _read(path="/Nothing")


def test_samples_stand_for_a_default_that_is_not_authored():
    body = "uniform int2 resolution.timeSamples = { 1: (30, 40), 2: (50, 60) }"
    one = "uniform int2 resolution.timeSamples = { 1: (30, 40) }"
    for text, resolution, codes in (
        (one, (30, 40), []),
        (body, (30, 40), ["W523"]),  # settings are uniform: they hold for all frames
        (f"{body}\nuniform int2 resolution = (10, 20)", (10, 20), ["W523"]),
    ):
        found, _, told = _read(text)
        assert (found.resolution, told) == (resolution, codes)


def test_metadata_that_lead_nowhere_are_named():
    assert _read(metadata='renderSettingsPrimPath = "/Nothing"') == (Settings(), None, ["W521"])


@pytest.mark.parametrize(
    "body",
    [
        "uniform int2 resolution = (0, 480)",
        "uniform int2 resolution = (640, 1000000)",
        "uniform float2 resolution = (640.5, 480)",
        "uniform float pixelAspectRatio = 0",
        "uniform float pixelAspectRatio = 1e-7",  # which no EXR could hold
        'uniform token aspectRatioConformPolicy = "stretch"',
        "matrix2d aspectRatioConformPolicy = ((1, 2), (3, 4))",
        "int warp_rt:depth = 0",
        "float warp_rt:depth = 2.7",
        "float warp_rt:lightSamples = 0.5",
        "float warp_rt:threshold = -1",
        "float warp_rt:threshold = nan",
        "float warp_rt:ambient = 1",
        'string warp_rt:background = "red"',
        'token includedPurposes = "render"',
        "token[] includedPurposes = []",
        'token[] includedPurposes = ["final"]',
        'token materialBindingPurposes = "full"',
        "uniform token[] materialBindingPurposes = []",
        "uniform float4 dataWindowNDC = (0.5, 0, 0.5, 1)",
    ],
)
def test_values_without_meaning_are_named_and_left_out(body):
    assert _read(body) == (Settings(path="/Render/S"), None, ["W523"])


@pytest.mark.parametrize(
    "body",
    [
        'uniform token renderingColorSpace = "srgb_texture"',
        "int warp_rt:dept = 3",
    ],
)
def test_terms_that_are_ignored_are_named(body):
    assert _read(body) == (Settings(path="/Render/S"), None, ["W522"])


def test_products_override_what_they_author():
    products, codes = _products(
        "rel products = [</A>, </B>]\nuniform int2 resolution = (64, 48)\n"
        "uniform float4 dataWindowNDC = (0, 0, 0.5, 1)\n"
        "uniform bool disableMotionBlur = 1",
        'def RenderProduct "A" {\ntoken productName = "a.exr"\nuniform int2 resolution = (8, 4)\n'
        "rel camera = </Cam>\n}\n"
        'def RenderProduct "B" {\nuniform float4 dataWindowNDC = (0, 0, 1, 1)\nuniform bool disableMotionBlur = 0\n}',
    )
    first, second = products
    assert codes == []
    assert (first.path, first.settings.path, first.name, first.variables) == ("/A", "/A", "a.exr", ())
    assert (first.settings.resolution, first.settings.camera) == ((8, 4), "/Cam")
    assert (first.settings.data_window, first.settings.disables_motion_blur) == ((0, 0, 0.5, 1), True)
    assert (second.name, second.settings.resolution) == ("", (64, 48))
    assert (second.settings.data_window, second.settings.disables_motion_blur) == ((0, 0, 1, 1), False)


@pytest.mark.parametrize("settings", ["float products = 3", "rel products = </P>\nfloat camera = 3"])
def test_attributes_in_place_of_relationships_are_told(settings):
    stage = Usd.Stage.CreateInMemory()
    assert stage.GetRootLayer().ImportFromString(
        f'#usda 1.0\n(renderSettingsPrimPath = "/S"\n)\ndef RenderSettings "S" {{\n{settings}\n}}\n'
        'def RenderProduct "P" {\nint orderedVars = 2\n}\n'
        f'{CAMERAS}def RenderPass "R" {{\nrel renderSource = </S>\nint fileName = 3\n}}\n'
        'def RenderPass "bad" {\nfloat renderSource = 3\n}\n'
        'def RenderPass "worse" {\nrel renderSource = </S>\nint collection:prune:includes = 3\n}\ndef Sphere "s" {\n}'
    )
    told = [(d.code, d.prim) for d in load_stage(stage, pass_path="/R").diagnostics if d.is_warning]
    others = [("W523", "/S")] if "float products" in settings else [("W523", "/P"), ("W523", "/S")]
    assert sorted(told) == sorted([("W522", "/R"), *others])
    with pytest.raises(SceneError, match="/bad names no renderSource"):
        load_stage(stage, pass_path="/bad")
    with pytest.raises(SceneError, match="/worse: the collection prune: "):
        load_stage(stage, pass_path="/worse")


def test_a_product_has_the_resolution_of_its_schema_where_none_is_authored():
    """Pictures that the command asks for are as wide as it says."""
    products = 'def RenderProduct "P" {\n}\ndef RenderProduct "Q" {\nuniform int2 resolution = (8, 4)\n}'
    (first, second), _ = _products("rel products = [</P>, </Q>]", products)
    assert (first.settings.resolution, second.settings.resolution) == ((2048, 1080), (8, 4))
    assert _read("rel products = </Render/P>", products)[0].resolution is None
    (first, _), _ = _products("rel products = [</P>, </Q>]\nuniform int2 resolution = (64, 48)", products)
    assert first.settings.resolution == (64, 48)


def test_inactive_prims_ask_for_nothing():
    off = "(active = false)"
    variable = 'def RenderVar "v" {name} {{\nuniform string sourceName = "Ci"\n}}'
    product = 'def RenderProduct "P" {name} {{\nrel orderedVars = </v>\n}}'
    for of_product, of_variable, expected in ((off, "", ((), ["W524"])), ("", off, ([()], ["W525"]))):
        products, codes = _products(
            "rel products = </P>", product.format(name=of_product), variable.format(name=of_variable)
        )
        assert ([one.variables for one in products], codes) == (list(expected[0]), expected[1])
    stage = Usd.Stage.CreateInMemory()
    text = f'#usda 1.0\n(renderSettingsPrimPath = "/S"\n)\ndef RenderSettings "S" {off} {{\n}}'
    stage.GetRootLayer().ImportFromString(text)
    report = Report()
    assert (read_settings(stage, report).settings, [d.code for d in report]) == (Settings(), ["W521"])


def test_a_product_name_may_be_another_at_each_frame():
    """Unlike other settings it is not uniform; hosts write the names of all frames."""
    samples = 'token productName.timeSamples = { 1: "x.1.exr", 2: "x.2.exr" }'
    (found,), codes = _products("rel products = </P>", f'def RenderProduct "P" {{\n{samples}\n}}')
    assert (found.name, found.names, codes) == ("", ((1, "x.1.exr"), (2, "x.2.exr")), [])
    assert [found.name_at(time) for time in (None, 0, 1, 1.9, 2, 9)] == ["", *["x.1.exr"] * 3, *["x.2.exr"] * 2]


@pytest.mark.parametrize(
    ("body", "aov"),
    [
        ('uniform string sourceName = "Ci"', "color"),
        ('uniform string sourceName = "raw"', "color"),  # the prim is called color
        ("", "color"),
        ('uniform string sourceName = "a"', "alpha"),
        ('uniform string sourceName = "depth"', "cameraDepth"),
        ('uniform string sourceName = "N"\nuniform token sourceType = "intrinsic"', "normal"),
        ('uniform string sourceName = "Peye"', "Peye"),
        ('uniform string sourceName = "primId"', "primId"),
        ('uniform string sourceName = "st"\nuniform token sourceType = "primvar"', "uv"),
        ('uniform string sourceName = "C.*[<L.>O]"\nuniform token sourceType = "lpe"', "color"),
        ('uniform string sourceName = "lpe:C.*L"\nuniform token sourceType = "lpe"', "color"),
        ('uniform string sourceName = "C<RD>[<L.>O]"\nuniform token sourceType = "lpe"', None),
        ('uniform string sourceName = "color"\nuniform token sourceType = "primvar"', "primvars:color"),
        ('uniform string sourceName = "primvars:a:b"\nuniform token sourceType = "primvar"', "primvars:a:b"),
        ('uniform string sourceName = "primvars:displayColor"', "primvars:displayColor"),
        ('uniform string sourceName = "no name"\nuniform token sourceType = "primvar"', None),
        ('uniform string sourceName = "normals"', "normal"),
        ('uniform string sourceName = "albedo"', None),
    ],
)
def test_render_vars_are_aovs(body, aov):
    product = 'def RenderProduct "P" {\nrel orderedVars = </color>\n}'
    (found,), codes = _products("rel products = </P>", product, f'def RenderVar "color" {{\n{body}\n}}')
    assert [variable.aov for variable in found.variables] == ([] if aov is None else [aov])
    assert codes == (["W525"] if aov is None else [])


@pytest.mark.parametrize(
    ("data_type", "source", "is_told"),
    [
        (None, "depth", False),  # the schema's fallback, color3f, asks for nothing
        ("float", "depth", False),
        ("double", "depth", False),
        ("color3f", "depth", True),
        ("color3f", "Ci", False),
        ("color4h", "Ci", False),
        ("float", "Ci", True),
        ("int", "primId", False),
        ("uint", "elementId", False),
        ("float", "primId", True),
        ("normal3h", "N", False),
        ("int3", "N", True),
        ("texCoord2f", "uv", False),
        ("point3f", "primvars:rest", False),  # of as many components as the stage has
        ("int", "primvars:number", True),
        ("string", "P", True),
        ("normal3f[]", "N", True),
        ("rgb", "Ci", True),
    ],
)
def test_types_that_files_do_not_have_are_told(data_type, source, is_told):
    asked = "" if data_type is None else f'uniform token dataType = "{data_type}"\n'
    (found,), codes = _products(
        "rel products = </P>",
        'def RenderProduct "P" {\nrel orderedVars = </v>\n}',
        f'def RenderVar "v" {{\n{asked}uniform string sourceName = "{source}"\n}}',
    )
    assert (len(found.variables), codes) == (1, ["N941"] if is_told else [])


def test_a_kind_of_source_that_there_is_not_is_told():
    product = 'def RenderProduct "P" {\nrel orderedVars = </depth>\n}'
    variable = 'def RenderVar "depth" {\nuniform token sourceType = "row"\n}'
    (found,), codes = _products("rel products = </P>", product, variable)
    assert (found.variables, codes) == ((), ["W525"])


def test_layers_of_render_vars():
    product = 'def RenderProduct "P" {\nrel orderedVars = [</beauty>, </N>, </Gone>]\n}'
    variables = (
        'def RenderVar "beauty" {\nuniform token dataType = "color3h"\nuniform string sourceName = "Ci"\n}\n'
        'def RenderVar "N" {\nuniform token dataType = "normal3f"\nuniform string sourceName = "Neye"\n'
        'string driver:parameters:aov:name = "eyeNormals"\n}'
    )
    (found,), codes = _products("rel products = </P>", product, variables)
    assert [(v.path, v.layer, v.aov, v.is_half) for v in found.variables] == [
        ("/beauty", "beauty", "color", True),
        ("/N", "eyeNormals", "Neye", False),
    ]
    assert codes == ["W525"]


@pytest.mark.parametrize(
    ("purposes", "color"),
    [
        ('["full", ""]', 0.1),
        ('["preview", ""]', 0.2),
        ('[""]', 0.3),
        (None, 0.1),
        ('["mine", "preview", "full", ""]', 0.2),
        ('["mine", "", "full"]', 0.3),
        ('["full"]', 0.1),
        ('["allPurpose", "full"]', 0.3),  # as Houdini writes ""
    ],
)
def test_materials_are_bound_for_the_purpose(purposes, color):
    asked = f"uniform token[] materialBindingPurposes = {purposes}" if purposes else ""
    materials = "".join(
        f'def Material "{name}" {{\ntoken outputs:surface.connect = </{name}/S.outputs:surface>\ndef Shader "S" {{\n'
        f'uniform token info:id = "UsdPreviewSurface"\nfloat inputs:roughness = {value}\n'
        "token outputs:surface\n}\n}\n"
        for name, value in (("F", 0.1), ("P", 0.2), ("A", 0.3))
    )
    stage = Usd.Stage.CreateInMemory()
    assert stage.GetRootLayer().ImportFromString(
        f'#usda 1.0\n(renderSettingsPrimPath = "/S"\n)\ndef RenderSettings "S" {{\n{asked}\n}}\n{materials}'
        'def Sphere "s" (prepend apiSchemas = ["MaterialBindingAPI"]) {\nrel material:binding = </A>\n'
        "rel material:binding:full = </F>\nrel material:binding:preview = </P>\n}"
    )
    scene = load_stage(stage)
    (material,) = scene.materials
    assert material.inputs["roughness"].value[0] == pytest.approx(color)
    assert scene.diagnostics == ()


@pytest.mark.parametrize(
    ("purposes", "bound"),
    [
        ('["full", "preview"]', {"/w/s": "/C", "/w/t": "/__displayColor", "/w/u": "/P"}),
        ('["preview", ""]', {"/w/s": "/A", "/w/t": "/A", "/w/u": "/P"}),
        ('["", "full"]', {"/w/s": "/A", "/w/t": "/A", "/w/u": "/A"}),
    ],
)
def test_purposes_that_nothing_is_bound_for_are_passed_over(purposes, bound):
    """All are bound to A for all purposes, one in a collection for ``full``, one directly for ``preview``."""
    materials = "".join(
        f'def Material "{name}" {{\ntoken outputs:surface.connect = </{name}/S.outputs:surface>\ndef Shader "S" {{\n'
        'uniform token info:id = "UsdPreviewSurface"\ntoken outputs:surface\n}\n}\n'
        for name in "ACP"
    )
    stage = Usd.Stage.CreateInMemory()
    assert stage.GetRootLayer().ImportFromString(
        f"""#usda 1.0
        (renderSettingsPrimPath = "/S"
        )
        def RenderSettings "S" {{ uniform token[] materialBindingPurposes = {purposes}
        }}
        {materials}
        def Xform "w" (prepend apiSchemas = ["MaterialBindingAPI", "CollectionAPI:c"]) {{
            rel collection:c:includes = </w/s>
            rel material:binding = </A>
            rel material:binding:collection:full:c = [</w.collection:c>, </C>]
            def Sphere "s" {{}}
            def Sphere "t" {{}}
            def Sphere "u" (prepend apiSchemas = ["MaterialBindingAPI"]) {{ rel material:binding:preview = </P>
            }}
        }}
        """
    )
    scene = load_stage(stage)
    rows = zip(scene.instances.prim, scene.instances.material_table[scene.instances.material_offset], strict=True)
    assert {scene.prims[prim]: scene.materials[row].path for prim, row in rows} == bound
    assert scene.diagnostics == ()


@pytest.mark.parametrize(
    ("metadata", "expected"),
    [
        ("", [("N903", "/R/A"), ("N903", "/R/B"), ("N903", "/R/P")]),
        ('renderSettingsPrimPath = "/R/B"', [("N903", "/R/P")]),
        ('renderSettingsPrimPath = "/R/C"', [("W521", "/R/C"), ("N903", "/R/A"), ("N903", "/R/B"), ("N903", "/R/P")]),
    ],
)
def test_settings_that_nothing_names_are_noted(metadata, expected):
    """usdrecord, too, passes over them; beside settings that are named, others are its alternatives."""
    stage = Usd.Stage.CreateInMemory()
    prims = 'def RenderSettings "A" {\n}\ndef RenderSettings "B" {\n}\ndef RenderPass "P" {\n}'
    text = f'#usda 1.0\n({metadata}\n)\ndef Sphere "s" {{\n}}\ndef Scope "R" {{\n{prims}\n}}'
    stage.GetRootLayer().ImportFromString(text)
    assert [(d.code, d.prim) for d in load_stage(stage).diagnostics] == expected


def test_a_camera_that_is_not_there_is_named():
    stage = Usd.Stage.CreateInMemory()
    text = (
        '#usda 1.0\n(renderSettingsPrimPath = "/S"\n)\ndef RenderSettings "S" {\nrel camera = </Cam>\n}\n'
        'def Sphere "s" {\n}\n'
    )
    stage.GetRootLayer().ImportFromString(text)
    assert [(d.code, d.prim) for d in load_stage(stage).diagnostics] == [("W523", "/S")]
    stage.GetRootLayer().ImportFromString(text + 'def Camera "Cam" {\n}')
    assert load_stage(stage).diagnostics == ()


@pytest.mark.parametrize(
    ("name", "of_settings", "senseless", "field", "expected"),
    [
        ("uniform int2 resolution", "(64, 48)", "(0, 5)", "resolution", (64, 48)),
        ("uniform float pixelAspectRatio", "2", "-1", "pixel_aspect_ratio", 2.0),
        ("uniform token aspectRatioConformPolicy", '"cropAperture"', '"stretch"', "aspect_policy", "cropAperture"),
        ("uniform float4 dataWindowNDC", "(0, 0, 0.5, 1)", "(1, 0, 0, 1)", "data_window", (0.0, 0.0, 0.5, 1.0)),
        ("rel camera", "</Other>", "</S>", "camera", "/Other"),
        ("rel camera", "</Other>", "</Gone>", "camera", "/Other"),
        ("int warp_rt:depth", "3", "0", "depth", 3),
    ],
)
def test_what_makes_no_sense_in_a_product_is_as_if_it_were_not_there(name, of_settings, senseless, field, expected):
    (found,), codes = _products(
        f"rel products = </P>\n{name} = {of_settings}", f'def RenderProduct "P" {{\n{name} = {senseless}\n}}'
    )
    assert (getattr(found.settings, field), codes) == (expected, ["W523"])


def test_a_camera_that_is_none_is_told_of_the_prim_that_names_it():
    stage = Usd.Stage.CreateInMemory()
    text = (
        '#usda 1.0\n(renderSettingsPrimPath = "/S"\n)\n'
        'def RenderSettings "S" {\nrel products = [</A>, </B>, </C>]\nrel camera = </off>\n}\n'
        'def RenderProduct "A" {\nrel camera = </s>\n}\ndef RenderProduct "B" {\nrel camera = </Cam>\n}\n'
        'def RenderProduct "C" {\n}\ndef Camera "Cam" {\n}\ndef Camera "off" (active = false) {\n}\n'
        'def Sphere "s" {\n}\n'
    )
    assert stage.GetRootLayer().ImportFromString(text)
    told = [(d.code, d.prim, d.message) for d in load_stage(stage).diagnostics]
    assert told == [
        ("W523", "/A", "camera: /s is no camera of the stage; ignored"),
        ("W523", "/S", "camera: /off is no camera of the stage; ignored"),
    ]


def test_a_product_whose_own_value_makes_no_sense_is_named():
    stage = Usd.Stage.CreateInMemory()
    text = (
        '#usda 1.0\n(renderSettingsPrimPath = "/S"\n)\n'
        'def RenderSettings "S" {\nrel products = </P>\nfloat pixelAspectRatio = -1\n}\n'
        'def RenderProduct "P" {\nint2 resolution = (0, 5)\n}\ndef Sphere "s" {\n}\n'
    )
    assert stage.GetRootLayer().ImportFromString(text)
    found = {(d.code, d.prim, d.message.split(":")[0]) for d in load_stage(stage).diagnostics}
    assert found == {("W523", "/P", "resolution"), ("W523", "/S", "pixelAspectRatio")}
