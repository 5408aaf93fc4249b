# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdPreviewSurface's normal, in the frame of the texture coordinates: s is x, t is y, the surface's normal is z."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image as PillowImage
from pxr import Sdf, Usd, UsdGeom, UsdLux, UsdShade

import warp_rt

MAP = np.array((0.6, 0.3, 0.9))
MAP /= np.linalg.norm(MAP)
TEXEL = np.rint((MAP + 1) / 2 * 255)
BENT = TEXEL / 255 * 2 - 1
BENT /= np.linalg.norm(BENT)

TEXTURED = """
    normal3f inputs:normal.connect = </M/T.outputs:rgb>
}
def Shader "T"
{
    uniform token info:id = "UsdUVTexture"
    asset inputs:file = @FILE@
    token inputs:sourceColorSpace = "raw"
    token inputs:wrapS = "repeat"
    token inputs:wrapT = "repeat"
    float4 inputs:scale = (2, 2, 2, 1)
    float4 inputs:bias = (-1, -1, -1, 0)
    float2 inputs:st.connect = </M/R.outputs:result>
    float3 outputs:rgb
}
def Shader "R"
{
    uniform token info:id = "UsdPrimvarReader_float2"
    string inputs:varname = "st"
    float2 outputs:result
"""


def stage(surface: str, mesh: str = "", st: str = "[(0,0), (1,0), (1,1), (0,1)]", points: str = "") -> Usd.Stage:
    """Return a stage with a square in the plane z = 0, seen from +z, or from -z by the camera /Below."""
    points = points or "[(-1,-1,0), (1,-1,0), (1,1,0), (-1,1,0)]"
    result = Usd.Stage.CreateInMemory()
    result.GetRootLayer().ImportFromString(f"""#usda 1.0
(
    upAxis = "Z"
)
def Mesh "Square" (
    prepend apiSchemas = ["MaterialBindingAPI"]
)
{{
    rel material:binding = </M>
    point3f[] points = {points}
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    uniform token subdivisionScheme = "none"
    texCoord2f[] primvars:st = {st} (
        interpolation = "vertex"
    )
    {mesh}
}}
def Material "M"
{{
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S"
    {{
        uniform token info:id = "UsdPreviewSurface"
        token outputs:surface
        {surface}
    }}
}}
def Camera "Above"
{{
    token projection = "orthographic"
    double3 xformOp:translate = (0.1, 0.2, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
def Camera "Below"
{{
    token projection = "orthographic"
    double3 xformOp:translate = (0.1, 0.2, -5)
    double xformOp:rotateY = 180
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateY"]
}}
""")
    return result


def normal(opened: Usd.Stage, camera: str = "/Above") -> np.ndarray:
    """Return the shading normal in the middle of the picture."""
    scene = warp_rt.load_scene(opened)
    tree = warp_rt.trace_tree(scene, 1, 1, camera=camera, width=3, height=3, device="cpu")
    return np.array(tree.roots[0].normal)


@pytest.fixture(scope="module")
def textured(tmp_path_factory: pytest.TempPathFactory) -> str:
    path: Path = tmp_path_factory.mktemp("normal") / "map.png"
    PillowImage.fromarray(np.tile(TEXEL.astype(np.uint8), (4, 4, 1))).save(path)
    return TEXTURED.replace("FILE", path.as_posix())


CASES = {
    "plain": ({}, (1, 1, 1)),
    "s runs the other way": ({"st": "[(1,0), (0,0), (0,1), (1,1)]"}, (-1, 1, 1)),
    "t runs the other way": ({"st": "[(0,1), (1,1), (1,0), (0,0)]"}, (1, -1, 1)),
    "left-handed": ({"mesh": 'uniform token orientation = "leftHanded"'}, (1, 1, -1)),
    "mirrored": (
        {"mesh": 'double3 xformOp:scale = (-1, 1, 1)\nuniform token[] xformOpOrder = ["xformOp:scale"]'},
        (-1, 1, 1),
    ),
    "mirrored along its normal": (
        {"mesh": 'double3 xformOp:scale = (1, 1, -1)\nuniform token[] xformOpOrder = ["xformOp:scale"]'},
        (1, 1, -1),
    ),
    "normals of its own": ({"mesh": "normal3f[] normals = [(0,0,1), (0,0,1), (0,0,1), (0,0,1)]"}, (1, 1, 1)),
}


@pytest.mark.parametrize("case", CASES)
def test_the_frame_follows_the_texture_coordinates(textured: str, case: str) -> None:
    """Whichever side is seen: what is a bump from one is a dent from the other."""
    options, signs = CASES[case]
    outward = BENT * signs
    opened = stage(textured, **options)
    np.testing.assert_allclose(normal(opened), outward * np.sign(outward[2]), atol=1e-5)
    np.testing.assert_allclose(normal(opened, "/Below"), -outward * np.sign(outward[2]), atol=1e-5)


def test_turned_coordinates_turn_the_frame(textured: str) -> None:
    got = normal(stage(textured, st="[(0,0), (0,1), (-1,1), (-1,0)]"))  # s runs along -y, t along +x
    np.testing.assert_allclose(got, (BENT[1], -BENT[0], BENT[2]), atol=1e-5)


def moved(textured: str, rotation: float, scale: tuple[float, float], prefix: str = "") -> str:
    """Return the map behind a UsdTransform2d, or behind MaterialX's."""
    through = textured.replace("inputs:st.connect = </M/R.outputs:result>", "inputs:st.connect = </M/X.outputs:result>")
    return f"""{through}
    }}
    def Shader "X"
    {{
        uniform token info:id = "{prefix}UsdTransform2d"
        float2 inputs:in.connect = </M/R.outputs:result>
        float inputs:rotation = {rotation}
        float2 inputs:scale = {scale}
        float2 inputs:translation = (0.3, -0.2)
        float2 outputs:result
    """


@pytest.mark.parametrize("camera", ["/Above", "/Below"])
@pytest.mark.parametrize(
    ("rotation", "scale", "x", "y"),
    [
        (0, (2, 0.5), (1, 0), (0, 1)),
        (90, (1, 1), (0, -1), (1, 0)),
        (180, (1, 1), (-1, 0), (0, -1)),
        (0, (1, -1), (1, 0), (0, -1)),
        (90, (-3, 1), (0, -1), (-1, 0)),
        (30, (1, 1), (np.sqrt(0.75), -0.5), (0.5, np.sqrt(0.75))),
    ],
)
def test_what_turns_the_image_turns_its_bumps(
    textured: str, rotation: float, scale: tuple[float, float], x: tuple, y: tuple, camera: str
) -> None:
    """The map's x and y are along the image's own edges, as these lie on the surface."""
    outward = BENT[0] * np.array((*x, 0)) + BENT[1] * np.array((*y, 0)) + BENT[2] * np.array((0, 0, 1))
    expected = outward if camera == "/Above" else -outward
    np.testing.assert_allclose(normal(stage(moved(textured, rotation, scale)), camera), expected, atol=1e-5)


def test_materialx_has_the_frame_of_the_primvar(textured: str) -> None:
    """Its library takes the tangents of the texture coordinates, whatever moves them."""
    opened = stage(moved(textured, 90, (1, -1), "ND_"))
    opened.GetPrimAtPath("/M/S").GetAttribute("info:id").Set("ND_UsdPreviewSurface_surfaceshader")
    np.testing.assert_allclose(normal(opened), BENT, atol=1e-5)


def test_uneven_scale_bends_the_normal_in_the_world(textured: str) -> None:
    """The frame is made of unit vectors of the placed surface: scale does not flatten bumps."""
    scaled = 'double3 xformOp:scale = (4, 1, 2)\nuniform token[] xformOpOrder = ["xformOp:scale"]'
    np.testing.assert_allclose(normal(stage(textured, scaled)), BENT, atol=1e-5)


@pytest.mark.parametrize("body", ["", "normal3f inputs:normal = (0, 0, 1)"])
def test_the_default_is_no_map(body: str) -> None:
    np.testing.assert_allclose(normal(stage(body)), (0, 0, 1), atol=1e-6)


def test_a_value_bends_as_a_map_does() -> None:
    body = f"normal3f inputs:normal = ({MAP[0]}, {MAP[1]}, {MAP[2]})"
    np.testing.assert_allclose(normal(stage(body, st="[(1,0), (0,0), (0,1), (1,1)]")), MAP * (-1, 1, 1), atol=1e-5)


def test_a_primvar_bends_as_a_map_does() -> None:
    reader = """
        normal3f inputs:normal.connect = </M/P.outputs:result>
    }
    def Shader "P"
    {
        uniform token info:id = "UsdPrimvarReader_normal"
        string inputs:varname = "bump"
        normal3f outputs:result
    """
    bump = f"normal3f[] primvars:bump = [({MAP[0]}, {MAP[1]}, {MAP[2]})]"
    np.testing.assert_allclose(normal(stage(reader, bump)), MAP, atol=1e-5)


def test_without_coordinates_nothing_is_bent(textured: str) -> None:
    np.testing.assert_allclose(normal(stage(textured, st="[(0,0), (0,0), (0,0), (0,0)]")), (0, 0, 1), atol=1e-6)


WHITE = """
    color3f inputs:diffuseColor = (1, 1, 1)
    int inputs:useSpecularWorkflow = 1
    float inputs:ior = 1
"""
MIRROR = """
    color3f inputs:diffuseColor = (1, 1, 1)
    float inputs:metallic = 1
    float inputs:roughness = 0
"""


def lit(bent: tuple[float, float, float], elevation: float) -> float:
    """Return the radiance of a white sheet, bent, seen from above under a light of irradiance pi from +x."""
    opened = stage(f"{WHITE}normal3f inputs:normal = {bent}")
    light = UsdLux.DistantLight.Define(opened, "/Light")
    light.CreateIntensityAttr(np.pi)
    light.CreateAngleAttr(0)
    light.AddRotateYOp().Set(90 - elevation)
    image = warp_rt.render(warp_rt.load_scene(opened), camera="/Above", width=3, height=3, device="cpu")
    return float(image.linear[1, 1, 0])


def test_no_light_leaks_through_a_bent_sheet() -> None:
    """A light 30 degrees above it shines by N.L of the bent normal; one as far below it does not shine."""
    assert lit((0.8, 0, 0.6), 30) == pytest.approx(0.8 * np.cos(np.pi / 6) + 0.6 * 0.5, abs=1e-5)
    assert lit((0.8, 0, 0.6), -30) == 0.0


def test_what_is_bent_just_away_from_the_eye_looks_as_what_is_just_seen() -> None:
    """Nothing jumps where N.V = 0: N is brought back, not turned round."""
    just_seen, just_not = (lit((1, 0, z), 30) for z in (1e-4, -1e-4))
    assert just_seen == pytest.approx(np.cos(np.pi / 6), abs=1e-3)
    assert just_not == pytest.approx(just_seen, abs=1e-3)


@pytest.mark.parametrize("x", [0.3, 0.6, 0.71, 0.9, -0.9])
def test_a_bent_mirror_shows_nothing_from_beneath_itself(x: float) -> None:
    """A white wall stands behind it, nothing before it."""
    opened = stage(f"{MIRROR}normal3f inputs:normal = ({x}, 0, {np.sqrt(1 - x * x)})")
    wall = UsdGeom.Plane.Define(opened, "/Wall")
    wall.CreateWidthAttr(1e4)
    wall.CreateLengthAttr(1e4)
    wall.AddTranslateOp().Set((0, 0, -1))
    glow = UsdShade.Material.Define(opened, "/Glow")
    shader = UsdShade.Shader.Define(opened, "/Glow/S")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("emissiveColor", Sdf.ValueTypeNames.Color3f).Set((1, 1, 1))
    glow.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", Sdf.ValueTypeNames.Token))
    UsdShade.MaterialBindingAPI.Apply(wall.GetPrim()).Bind(glow)
    UsdLux.DistantLight.Define(opened, "/Light").CreateIntensityAttr(0)
    scene = warp_rt.load_scene(opened)
    above, below = (
        warp_rt.render(scene, camera=camera, width=3, height=3, device="cpu") for camera in ("/Above", "/Below")
    )
    assert (above.linear[1, 1, 0], below.linear[1, 1, 0]) == (0, 1)


OF_THE_WORLD = """
    float3 inputs:normal.connect = </M/N.outputs:out>
}
def Shader "W"
{
    uniform token info:id = "ND_normal_vector3"
    string inputs:space = "world"
    float3 outputs:out
}
def Shader "N"
{
    uniform token info:id = "ND_add_vector3"
    float3 inputs:in1.connect = </M/W.outputs:out>
    float3 inputs:in2 = (0.3, 0.2, 0)
    float3 outputs:out
"""


@pytest.mark.parametrize(("camera", "side"), [("/Above", 1), ("/Below", -1)])
@pytest.mark.parametrize("st", ["[(0,0), (1,0), (1,1), (0,1)]", "[(1,0), (1,1), (0,1), (0,0)]", ""])
def test_a_normal_that_is_computed_in_the_world_knows_no_frame(camera: str, side: int, st: str) -> None:
    """Of a turned square, whatever its texture coordinates; from behind, a bump is a dent."""
    turned = 'float xformOp:rotateX = 20\nuniform token[] xformOpOrder = ["xformOp:rotateX"]'
    opened = stage(OF_THE_WORLD, turned, st or "[(0,0), (0,0), (0,0), (0,0)]")
    UsdShade.Shader(opened.GetPrimAtPath("/M/S")).CreateIdAttr("ND_standard_surface_surfaceshader")
    expected = np.array((0.3, 0.2 - np.sin(np.radians(20)), np.cos(np.radians(20))))
    np.testing.assert_allclose(normal(opened, camera), side * expected / np.linalg.norm(expected), atol=1e-5)
