# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What docs/usd.md says is left out or repaired is told, under the code that the documents name, about the right prim.

One stage of a few lines for each code; the test of docs/diagnostics.md asks that none is missing.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as PillowImage
from pxr import Tf, Usd

from warp_rt import Renderer, RenderOptions
from warp_rt.scene import Scene, Settings
from warp_rt.usd.load import load_stage
from warp_rt.usd.settings import RenderTerms
from warp_rt.usd.walk import Limits

DOCS = Path(__file__).resolve().parents[2] / "docs"

QUAD = """
    point3f[] points = [(0,0,0), (1,0,0), (1,1,0), (0,1,0)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    uniform token subdivisionScheme = "none"
"""
STRAND = "point3f[] points = [(0,0,0), (1,0,0)]\nfloat[] widths = [1, 1]\n"
ONE = "int[] protoIndices = [0]\npoint3f[] positions = [(0,0,0)]\n"


def mesh(body: str = "", arrays: str = QUAD, children: str = "") -> str:
    return f'def Mesh "m" {{\n{arrays}\n{body}\n{children}\n}}'


def instancer(body: str, children: str = 'def Sphere "p" {}') -> str:
    return f'def PointInstancer "i" {{\n{body}\n{children}\n}}'


def patch(body: str) -> str:
    axes = "".join(f"int {a}VertexCount = 2\nint {a}Order = 2\ndouble[] {a}Knots = [0, 0, 1, 1]\n" for a in "uv")
    return f'def NurbsPatch "p" {{ point3f[] points = [(0,0,0), (1,0,0), (0,1,0), (1,1,0)]\n{axes}{body}\n}}'


SPHERE_ST = 'texCoord2f[] primvars:st = [(0, 0)] (interpolation = "constant")'
VARNAME_GLOW = 'string inputs:varname = "glow"'
QUAD_GLOW = 'color3f[] primvars:glow = [(0, 0, 0), (1, 1, 1), (1, 1, 1), (0, 0, 0)] (interpolation = "vertex")'


def bound(surface: str, nodes: str = "", material: str = "") -> str:
    """Return a sphere and its material /M, whose surface /M/S has the given body."""
    return f"""
        def Sphere "s" (prepend apiSchemas = ["MaterialBindingAPI"]) {{ rel material:binding = </M>
            {SPHERE_ST}
        }}
        def Material "M" {{
            token outputs:surface.connect = </M/S.outputs:surface>
            {material}
            def Shader "S" {{
                {surface}
                token outputs:surface
            }}
            {nodes}
        }}
    """


def shader(kind: str, body: str = "") -> str:
    return f'uniform token info:id = "{kind}"\n{body}\n'


def textured(texture: str, surface: str = "", nodes: str = "") -> str:
    """Return a UsdPreviewSurface whose diffuseColor comes from the UsdUVTexture /M/T."""
    connected = shader("UsdPreviewSurface", "color3f inputs:diffuseColor.connect = </M/T.outputs:rgb>\n" + surface)
    return bound(
        connected, f'def Shader "T" {{\n{shader("UsdUVTexture", texture)}\nfloat3 outputs:rgb\n}}\n{nodes}{READER}'
    )


READER = """
    def Shader "R" {
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "st"
        float2 outputs:result
    }
"""
ST = "float2 inputs:st.connect = </M/R.outputs:result>\n"


def settings(body: str, others: str = "", metadata: str = 'renderSettingsPrimPath = "/S"') -> tuple[str, str]:
    return metadata, f'def RenderSettings "S" {{\n{body}\n}}\n{others}'


def light(kind: str, body: str = "", schemas: str = "") -> str:
    applied = f"(prepend apiSchemas = [{schemas}])" if schemas else ""
    return f'def {kind} "l" {applied} {{\n{body}\n}}'


# By code: the stage's body, or its metadata and body, and the prims that the code is told about.
# DIR stands for a folder with good.png and bad.png.
CASES: dict[str, tuple[str | tuple[str, str], set[str]]] = {
    "W101": (mesh("", QUAD.replace("[4]", "[2, 2]")), {"/m"}),
    "W102": (mesh("", QUAD.replace("2, 3]", "2, 9]")), {"/m"}),
    "W103": (mesh("", QUAD.replace("(1,1,0)", "(1,nan,0)")), {"/m"}),
    "W104": (mesh("", QUAD.replace("[4]", "[4]\nint[] holeIndices = []").replace("2, 3]", "2, 3, 0]")), {"/m"}),
    "W105": (
        'def Xform "x" { double3 xformOp:scale = (1, 0, 1)\n'
        'uniform token[] xformOpOrder = ["xformOp:scale"]\ndef Sphere "s" {}\n}',
        {"/x"},
    ),
    "W106": (mesh('float[] primvars:a = [1, 2] (interpolation = "vertex")'), {"/m"}),
    "W107": (mesh('float[] primvars:a = [1] (interpolation = "uniform")\nint[] primvars:a:indices = [7]'), {"/m"}),
    "W108": (mesh('float2[] primvars:displayColor = [(1, 2)] (interpolation = "constant")'), {"/m"}),
    "W109": (mesh('float[] primvars:a = [nan] (interpolation = "constant")'), {"/m"}),
    "W110": (
        mesh(
            children="\n".join(
                f'def GeomSubset "{name}" {{ uniform token elementType = "face"\n'
                'uniform token familyName = "materialBind"\nint[] indices = [0]\n}'
                for name in "ab"
            )
        ),
        {"/m/b"},
    ),
    "W111": (
        mesh(
            children='def GeomSubset "a" { uniform token elementType = "face"\n'
            'uniform token familyName = "materialBind"\nint[] indices = [5]\n}'
        ),
        {"/m/a"},
    ),
    "W112": (mesh("float[] primvars:a.connect = </m.primvars:b>"), {"/m.primvars:a"}),
    "W113": (mesh("int[] holeIndices = [4]"), {"/m"}),
    "W114": ('def Cylinder "s" { token axis = "W" }', {"/s"}),
    "W115": (mesh("int[] cornerIndices = [0]", QUAD.replace('"none"', '"catmullClark"')), {"/m"}),
    "W116": (mesh("", QUAD.replace('"none"', '"loop"')), {"/m"}),
    "W117": (f'def BasisCurves "c" {{ {STRAND}\nint[] curveVertexCounts = [3]\n}}', {"/c"}),
    "W120": (
        instancer("int[] protoIndices = [0, 0]\npoint3f[] positions = [(0,0,0)]\nrel prototypes = </i/p>"),
        {"/i"},
    ),
    "W121": (instancer(ONE.replace("[0]", "[3]") + "rel prototypes = </i/p>"), {"/i"}),
    "W122": (instancer(ONE + "float3[] scales = [(0, 1, 1)]\nrel prototypes = </i/p>"), {"/i"}),
    "W119": (
        f'def "g" {{\nnormal3f[] primvars:normals = [(0, 0, 1)] (interpolation = "constant")\n{mesh()}\n}}',
        {"/g"},
    ),
    "W123": (
        instancer(
            ONE + "rel prototypes = </i/p>",
            f'def Xform "p" {{ def PointInstancer "j" {{ {ONE} rel prototypes = </i/p>\n}}\n}}',
        ),
        {"/i/p/j"},
    ),
    "W130": ('def Volume "v" {}', {"/v"}),
    "W131": (
        f'def SkelRoot "r" {{ def Mesh "m" {{ {QUAD}\n'
        'int[] primvars:skel:jointIndices = [0] (interpolation = "constant"\nelementSize = 1)\n}\n}',
        {"/r/m"},
    ),
    "W132": (
        'def Xform "x" (kind = "component"\nprepend apiSchemas = ["GeomModelAPI"]) {\n'
        'uniform token model:drawMode = "cards"\nuniform token model:cardGeometry = "fromTexture"\n'
        "asset model:cardTextureXPos = @DIR/good.png@\n}",
        {"/x"},
    ),
    "W133": (
        'def Xform "x" (prepend apiSchemas = ["LODRootAPI"]) {\nrel lod:heuristics = </r>\n'
        'def Sphere "a" {}\n}\n'
        'def LODDistanceHeuristic "r" {\nuniform token lod:domain = "imaging"\n}',
        {"/x"},
    ),
    "W140": ('def Sphere "s" { double radius = 0 }', {"/s"}),
    "W141": (patch("double[] pointWeights = [1]"), {"/p"}),
    "W142": (patch("int[] trimCurve:counts = [1]"), {"/p"}),
    "W201": (textured(ST + "asset inputs:file = @gone.png@"), {"/M/T"}),
    "W202": (textured(ST + "asset inputs:file = @DIR/bad.png@"), {"/M/T"}),
    "W204": (textured(ST + 'asset inputs:file = @DIR/good.png@\ntoken inputs:wrapS = "twice"'), {"/M/T"}),
    "W205": (textured(ST + 'asset inputs:file = @DIR/good.png@ (colorSpace = "ADX10")'), {"/M/T"}),
    "W206": (textured("asset inputs:file = @DIR/good.png@"), {"/M/T"}),
    "W301": (bound(shader("NobodysSurface")), {"/M/S"}),
    "W302": (bound(shader("ND_standard_surface_surfaceshader")), {"/M/S"}),
    "W303": (
        bound(
            shader("UsdPreviewSurface", "float inputs:roughness.connect = </M/N.outputs:out>"),
            f'def Shader "N" {{ {shader("ND_flake2d")} float outputs:out\n}}',
        ),
        {"/M/N"},
    ),
    "W304": (
        bound(shader("UsdPreviewSurface", "float inputs:roughness.connect = </M/Gone.outputs:out>")),
        {"/M/S.inputs:roughness"},
    ),
    "W305": (
        bound(
            shader("UsdPreviewSurface", "float inputs:displacement = 1\ntoken outputs:displacement"),
            material="token outputs:displacement.connect = </M/S.outputs:displacement>",
        ),
        {"/s"},
    ),
    "W306": (bound(shader("UsdPreviewSurface", 'string inputs:roughness = "very"')), {"/M/S.inputs:roughness"}),
    "W307": (
        'def Sphere "s" (prepend apiSchemas = ["MaterialBindingAPI"]) { rel material:binding = </M> }\n'
        'def Material "M" {}',
        {"/M"},
    ),
    "W308": (
        bound(shader("UsdPreviewSurface", "float inputs:opacityThreshold.connect = </M/R.outputs:result>"), READER),
        {"/M/S.inputs:opacityThreshold"},
    ),
    "W309": (
        textured(
            ST + 'asset inputs:file = @DIR/good.png@\ntoken inputs:sourceColorSpace = "raw"',
            "normal3f inputs:normal.connect = </M/T.outputs:rgb>",
        ),
        {"/M/S"},
    ),
    "W310": (
        'def Sphere "s" (prepend apiSchemas = ["MaterialBindingAPI"]) { rel material:binding = </Gone> }',
        {"/s"},
    ),
    "W311": (bound(shader("WhittedSurface", "color3f inputs:reflectance = (1, 1, 1)")), {"/M/S.inputs:reflectance"}),
    "W312": (bound(shader("UsdPreviewSurface", "float inputs:clearcoat = 2")), {"/M/S.inputs:clearcoat"}),
    "W313": (
        bound(
            shader("UsdPreviewSurface", "float inputs:roughness.connect = </M/N.outputs:out>"),
            f'def Shader "N" {{ {shader("ND_checkerboard_color3", "float2 inputs:uvtiling = (901, 900)")}'
            "color3f outputs:out\n}",
        ),
        {"/M/S.inputs:roughness"},
    ),
    "N938": (
        bound(
            shader("UsdPreviewSurface", "float inputs:roughness.connect = </M/N.outputs:out>"),
            f'def Shader "N" {{ {shader("ND_ramplr_float", "float inputs:valuer = 1")} float outputs:out\n}}',
        ),
        {"/M/S.inputs:roughness"},
    ),
    "W401": (
        light("PortalLight")
        + 'def GeometryLight "g" {}\n'
        + f'def Mesh "m" (prepend apiSchemas = ["MeshLightAPI"]) {{ {QUAD}\nuniform token purpose = "guide" }}',
        {"/l", "/g", "/m"},
    ),
    "W402": (light("SphereLight", "asset inputs:shaping:ies:file = @a.ies@", '"ShapingAPI"'), {"/l"}),
    "W403": (light("SphereLight", "rel light:filters = </f>") + 'def LightFilter "f" {}', {"/l"}),
    "W404": (
        light("SphereLight", "rel collection:lightLink:excludes = </m/s>")
        + f'def Mesh "m" {{ {QUAD}\ndef GeomSubset "s" {{ int[] indices = [0] }} }}',
        {"/l"},
    ),
    "W407": (light("SphereLight", "float intensity = 5"), {"/l.intensity"}),
    "W409": (light("DiskLight", "float inputs:radius = 0"), {"/l"}),
    "W410": (light("DomeLight", "rel portals = </p>") + 'def Xform "p" {}', {"/l"}),
    "W411": (
        light(
            "DomeLight",
            'asset inputs:texture:file = @DIR/good.png@\ntoken inputs:texture:format = "cubeMapVerticalCross"',
        ),
        {"/l"},
    ),
    "W412": (light("SphereLight", "bool treatAsPoint = 1\nfloat inputs:radius = 0"), {"/l"}),
    "W413": (light("SphereLight", 'string inputs:intensity = "x"'), {"/l"}),
    "W415": (light("SphereLight", "float inputs:shaping:cone:softness = 2", '"ShapingAPI"'), {"/l"}),
    "W416": (
        light("SphereLight", "float inputs:intensity.connect = </x.inputs:i>")
        + 'def NodeGraph "x" { float inputs:i = 1\n}',
        {"/l.inputs:intensity"},
    ),
    "N918": (
        bound(
            shader("UsdPreviewSurface", "color3f inputs:emissiveColor.connect = </M/G.outputs:result>"),
            f'def Shader "G" {{\n{shader("UsdPrimvarReader_float3", VARNAME_GLOW)}\nfloat3 outputs:result\n}}',
        )
        .replace('Sphere "s" (prepend apiSchemas = [', 'Mesh "s" (prepend apiSchemas = ["MeshLightAPI", ')
        .replace(SPHERE_ST, f"{QUAD}\n{QUAD_GLOW}"),
        {"/s"},
    ),
    "N919": (light("DistantLight", "float inputs:shaping:cone:angle = 20", '"ShapingAPI"'), {"/l"}),
    "N926": (light("SphereLight", 'token warp_rt:falloff = "none"'), {"/l"}),
    "N934": (light("SphereLight", "float inputs:intesity = 2"), {"/l"}),
    "W419": (light("SphereLight", 'uniform token light:shaderId = "TheirLight"'), {"/l"}),
    "W421": ('def Camera "c" { float fStop = 2 }', {"/c"}),
    "W422": ('def Camera "c" { int clippingPlanes = 1 }', {"/c"}),
    "W423": ('def Xform "x" (prepend apiSchemas = ["MotionAPI"]) { float motion:blurScale = 0.5 }', {"/x"}),
    "W424": ('def Camera "c" { float focalLength = 0 }', {"/c"}),
    "W425": ('def Camera "c" (prepend apiSchemas = ["BackPlateAPI:plate"]) {}', {"/c"}),
    "W426": ('def Sphere "s" {}\ndef Camera "c" { float2 clippingRange = (5, 10) }', {"/c"}),
    "W501": ('def "a" (references = @gone.usda@) {}', {"/a"}),
    "W502": ('def "a" (references = </Gone>) {}', {"/a"}),
    "W503": ('def "a" (references = </a/b>) { def "b" {} }', {"/a"}),
    "W504": ('def "a" (references = </b> (scale = -1)) {}def "b" {}', {"/a"}),
    "W510": (('upAxis = "X"', ""), {"DIR/scene.usda"}),
    "W511": (("metersPerUnit = 0", ""), {"DIR/scene.usda"}),
    "W512": (("startTimeCode = inf", ""), {"DIR/scene.usda"}),
    "W521": (('renderSettingsPrimPath = "/Gone"', ""), {"/Gone"}),
    "W522": (settings('uniform token renderingColorSpace = "srgb_rec709_scene"'), {"/S"}),
    "W523": (settings("int warp_rt:depth = 0"), {"/S"}),
    "W524": (
        settings("rel products = </P>", 'def RenderProduct "P" { uniform token productType = "deepRaster" }'),
        {"/P"},
    ),
    "N941": (
        settings(
            "rel products = </P>",
            'def RenderProduct "P" { rel orderedVars = </V> }\n'
            'def RenderVar "V" { uniform string sourceName = "primId"\nuniform token dataType = "float" }',
        ),
        {"/V"},
    ),
    "N942": ('def Sphere "s" { double radus = 2 }', {"/s"}),
    "N943": ('def Sphere "s" (prepend apiSchemas = ["OthersAPI"]) { int others:quality = 2 }', {"/s"}),
    "W525": (
        settings(
            "rel products = </P>",
            'def RenderProduct "P" { rel orderedVars = </V> }\n'
            'def RenderVar "V" { uniform string sourceName = "hairDepth" }',
        ),
        {"/V"},
    ),
    "N903": (settings("int warp_rt:depth = 2", metadata=""), {"/S"}),
    "N905": ('def Sphere "s" { token visibility = "invisible" }', {"DIR/scene.usda"}),
    "N910": ('def Mesh "m" {}', {"/m"}),
    "N913": ('def Points "c" { point3f[] points = [(0,0,0)]\n}', {"/c"}),
    "N917": (bound(shader("UsdPreviewSurface", "float inputs:roughnes = 0")), {"/M/S"}),
    "N911": ('def Frobnicator "f" {}', {"/f"}),
    "N915": (
        mesh("normal3f[] normals = [(0,0,1), (0,0,1), (0,0,1), (0,0,1)]", QUAD.replace('"none"', '"catmullClark"')),
        {"/m"},
    ),
    "N921": ('def Sphere "s" { double3 xformOp:translate = (1, 0, 0)\n}', {"/s"}),
    "N922": (
        'def "a" (instanceable = true\nreferences = </c>) { over "s" {} }\nclass "c" { def Sphere "s" {} }',
        {"/a"},
    ),
    "N923": (instancer(ONE + "rel prototypes = </i/p>", 'def Sphere "p" {}\ndef Camera "c" {}'), {"/i"}),
    "N925": ('def Sphere "s" (variants = { string size = "big" }) {}', {"/s"}),
    "N924": ('def "g" { token visibility = "invisible"\ndef Sphere "s" {}\n}', {"/g"}),
    "N914": (
        bound(
            shader("UsdPreviewSurface", "float inputs:displacement = 1\ntoken outputs:displacement"),
            material="token outputs:displacement.connect = </M/S.outputs:displacement>",
        )
        .replace('Sphere "s"', 'Mesh "s"')
        .replace(SPHERE_ST, QUAD.replace('"none"', '"bilinear"')),
        {"/s"},
    ),
    "N927": (
        textured(ST + "asset inputs:file = @DIR/good.png@")
        .replace('Sphere "s"', 'Mesh "s"')
        .replace(SPHERE_ST, QUAD + "\nfloat[] primvars:st = [0.5]"),
        {"/M"},
    ),
    "W513": ('def Sphere "s" { rel radius = </s> }', {"/s.radius"}),
    "N946": (light("SphereLight", "rel collection:lightLink:excludes = </Gone>"), {"/l"}),
    "N944": (
        'def Sphere "s" { uniform token[] xformOpOrder.timeSamples = { 0: ["!resetXformStack!"]\n} }',
        {"/s.xformOpOrder"},
    ),
    "N936": (
        'def Points "p" { point3f[] points = [(0, 0, 0)]\nfloat[] widths = [1]\nvector3f[] velocities = [(1, 0, 0)]\n}',
        {"/p"},
    ),
    "N912": (
        textured(ST + "asset inputs:file = @DIR/good.png@").replace('Sphere "s"', 'Mesh "s"').replace(SPHERE_ST, QUAD),
        {"/M"},
    ),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("assets")
    PillowImage.fromarray(np.zeros((2, 2, 3), np.uint8)).save(path / "good.png")
    (path / "bad.png").write_bytes(b"nonsense")
    return path


def load(case: str | tuple[str, str], folder: Path, level: int = 1) -> Scene:
    metadata, body = case if isinstance(case, tuple) else ("", case)
    text = f"#usda 1.0\n({metadata}\n)\n{body}\n".replace("DIR", folder.as_posix())
    file = folder / "scene.usda"
    file.write_text(text.replace("}", "\n}\n"))  # a statement ends with its line
    stage = Usd.Stage.Open(str(file))
    stage.Reload()
    return load_stage(stage, level=level)  # what is said of subdivision surfaces counts where they are refined


@pytest.mark.parametrize("code", CASES)
def test_code_is_told_about_its_prim(code: str, folder: Path) -> None:
    case, prims = CASES[code]
    scene = load(case, folder, level=0 if code == "N914" else 1)
    # Most of these stages have no geometry, which is told, too.
    told = {(record.code, record.prim) for record in scene.diagnostics if record.code == code or record.code != "N905"}
    expected = {(code, prim.replace("DIR", folder.as_posix())) for prim in prims}
    assert told == expected, [str(record) for record in scene.diagnostics]


# --- codes that no stage gives by itself


def test_what_usd_cannot_read_is_left_out(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        Tf.RaiseRuntimeError("damaged")

    monkeypatch.setattr("warp_rt.usd.load.read_lights", fail)
    monkeypatch.setattr("warp_rt.usd.load.read_camera", fail)
    monkeypatch.setattr("warp_rt.usd.implicit.read_shape", fail)
    scene = load(light("SphereLight") + 'def Camera "c" {}\ndef Sphere "s" {}', folder)
    assert [(record.code, record.prim) for record in scene.diagnostics] == [
        ("W118", "/s"),
        ("W420", "/l"),
        ("W420", "/c"),
        ("N905", f"{folder}/scene.usda"),
    ]
    assert (scene.lights, scene.cameras) == ((), ())


def test_warnings_of_usd_are_notes(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def read_settings(*_: object) -> RenderTerms:
        Tf.Warn("something about </a>")
        return RenderTerms()

    monkeypatch.setattr("warp_rt.usd.load.read_settings", read_settings)
    scene = load('def Sphere "s" {}', folder)
    assert [(record.code, record.prim) for record in scene.diagnostics] == [("N920", "/a")]


def test_framing_and_headlight_are_notes(folder: Path) -> None:
    invisible = light("SphereLight", 'token visibility = "invisible"')
    renderer = Renderer(load(mesh() + invisible, folder), RenderOptions(width=3, height=3))
    film = renderer.render()
    assert [record.code for record in renderer.diagnostics] == ["N901", "N902"]
    # A grey that faces the eye: displayColor's 0.5 under a light of colour 1; the picture shows the whole square.
    np.testing.assert_allclose(film.color[1, 1], 0.5, rtol=1e-3)


@pytest.mark.parametrize(
    ("lights", "samples", "codes"),
    [
        (light("SphereLight"), 0, ["N901", "N907"]),
        (light("DomeLight"), 0, ["N901", "N907"]),
        (light("SphereLight"), 2, ["N901"]),
        (light("SphereLight", "bool treatAsPoint = true"), 0, ["N901"]),
        (light("SphereLight", "bool treatAsPoint = true"), 2, ["N901", "N935"]),
        (light("DomeLight"), 2, ["N901"]),
        ("", 2, ["N901", "N902", "N935"]),
        (light("DistantLight", "float inputs:angle = 0"), 0, ["N901"]),
    ],
)
def test_sharp_shadows_of_lights_with_an_extent_are_noted(
    folder: Path, lights: str, samples: int, codes: list[str]
) -> None:
    renderer = Renderer(load(mesh() + lights, folder), RenderOptions(width=2, height=2, light_samples=samples))
    renderer.render()
    assert [record.code for record in renderer.diagnostics] == codes


def test_every_code_of_the_documents_has_its_stage() -> None:
    documented = re.findall(r"^\| ([WN]\d{3}) \|", (DOCS / "diagnostics.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert set(documented) == {
        *CASES,
        "W118",
        "W150",
        "W420",
        "W527",
        "N920",
        "N901",
        "N902",
        "N904",
        "N906",
        "N907",
        "N908",
        "N916",
        "N930",
        "N931",
        "N932",
        "N933",
        "N935",
        "N937",
        "N939",
        "N940",
        "N945",
    }


def test_tables_can_be_read() -> None:
    """What takes more than a few lines of a cell has a paragraph below the table."""
    lines = (DOCS / "usd.md").read_text(encoding="utf-8").splitlines()
    cells = [cell for line in lines if line.startswith("|") for cell in line.strip("|").split(" | ")]
    assert max(map(len, cells)) <= 250


# --- what is supported


SUPPORTED = f"""
def Xform "world" (prepend apiSchemas = ["SemanticsLabelsAPI:class"]) {{
    token[] semantics:labels:class = ["world"]
    color3f[] primvars:displayColor = [(1, 0, 0)] (interpolation = "constant")
    {mesh("uniform bool doubleSided = 1")}
    {"".join(f'def {kind} "{kind}" {{}}' for kind in ("Sphere", "Cube", "Cylinder", "Cone", "Capsule", "Plane"))}
    def Cylinder_1 "Cylinder_1" {{}}
    def Capsule_1 "Capsule_1" {{}}
    {instancer(ONE + "rel prototypes = </world/i/p>")}
    def "n" (instanceable = true
    references = </shared>) {{}}
    def Skeleton "skeleton" {{}}
    def Scope "scope" {{}}
    def Cube "render" {{ uniform token purpose = "render" }}
    def Cube "proxy" {{ uniform token purpose = "proxy" }}
    def Cube "hidden" {{ token visibility = "invisible" }}
}}
class "shared" {{ def Cube "c" {{}} }}
{"".join(f'def {k}Light "{k}" {{}}' for k in ("Sphere", "Disk", "Rect", "Cylinder", "Distant", "Dome"))}
def DomeLight_1 "Dome1" {{}}
def SphereLight "point" {{ bool treatAsPoint = 1
    uniform token purpose = "guide"
}}
def Camera "c" {{ token projection = "orthographic"
    uniform token purpose = "guide"
}}
"""


def test_what_is_supported_gives_no_diagnostics(folder: Path) -> None:
    scene = load(SUPPORTED, folder)
    assert [str(record) for record in scene.diagnostics] == []
    shapes = ("Sphere", "Cube", "Cylinder", "Cone", "Capsule", "Plane", "Cylinder_1", "Capsule_1", "proxy", "m", "i/p")
    drawn = {f"/world/{name}" for name in shapes}
    assert drawn < set(scene.prims)
    assert len(scene.instances) == len(drawn) + 1  # the native instance's cube
    assert len(scene.lights) == 6
    assert len(scene.domes) == 2
    assert len(scene.cameras) == 1
    assert scene.labels == {"/world": {"class": ("world",)}}


def test_purposes(folder: Path) -> None:
    body = "".join(
        f'def Cube "{p}" {{ uniform token purpose = "{p}" }}' for p in ("default", "render", "proxy", "guide")
    )
    assert load(body, folder).prims == ("/default", "/proxy")
    stage = Usd.Stage.Open(str(folder / "scene.usda"))
    assert load_stage(stage, purposes=("guide",)).prims == ("/default", "/guide")
    assert load(settings('uniform token[] includedPurposes = ["render"]', body), folder).prims == ("/render",)


def test_settings_that_nothing_names_do_not_count(folder: Path) -> None:
    assert load(settings("int warp_rt:depth = 2", metadata=""), folder).settings == Settings()
    assert load(settings("int warp_rt:depth = 2"), folder).settings.depth == 2


def test_children_of_unknown_types_are_drawn(folder: Path) -> None:
    scene = load('def Frobnicator "f" { def Sphere "s" {} }', folder)
    assert scene.prims == ("/f/s",)


def test_limits_are_those_of_the_walk() -> None:
    text = " ".join((DOCS / "usd.md").read_text(encoding="utf-8").split())
    limits = Limits()
    assert limits.prims == limits.instances == 10_000_000
    assert "10 million prims visited, 10 million instances" in text
    assert f"{limits.depth} levels of namespace" in text
    assert f"{limits.nesting} instances within one another" in text
