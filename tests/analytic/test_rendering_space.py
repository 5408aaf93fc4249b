# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""renderingColorSpace: a coloured light on a coloured surface, multiplied in published primaries."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image as PilImage
from pxr import Usd, UsdLux

import warp_rt

# To linear Rec. 709: of ACEScg with D60 adapted to D65, and of Rec. 2020 (ITU-R BT.2087).
TO_REC709 = {
    "lin_ap1_scene": [(1.70505, -0.62179, -0.08326), (-0.13026, 1.14080, -0.01055), (-0.02400, -0.12897, 1.15297)],
    "lin_rec2020_scene": [(1.6605, -0.5876, -0.0728), (-0.1246, 1.1329, -0.0083), (-0.0182, -0.1006, 1.1187)],
}
LIGHT, ALBEDO = np.array((0.9, 0.2, 0.05)), np.array((51, 153, 204)) / 255

STAGE = """#usda 1.0
( renderSettingsPrimPath = "/S" )
def RenderSettings "S" {{
    {space}
    color3f warp_rt:background = (0.25, 0.5, 0.75)
}}
def Camera "c" {{
    token projection = "orthographic"
    float horizontalAperture = 20
    float verticalAperture = 20
    double3 xformOp:translate = (0, 0, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
def DistantLight "l" {{
    color3f inputs:color = {light}
    float inputs:intensity = 3.14159265
    float inputs:angle = 0
}}
def Mesh "m" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
    point3f[] points = [(-1, -1, 0), (0, -1, 0), (0, 1, 0), (-1, 1, 0)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    uniform token subdivisionScheme = "none"
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")
    {mesh}
}}
def Material "M" {{
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S" {{
        uniform token info:id = "UsdPreviewSurface"
        int inputs:useSpecularWorkflow = 1
        float inputs:ior = 1
        color3f inputs:diffuseColor{diffuse}
        token outputs:surface
    }}
    def Shader "T" {{
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @{image}@
        token inputs:sourceColorSpace = "raw"
        float2 inputs:st.connect = </M/R.outputs:result>
        float3 outputs:rgb
    }}
    def Shader "R" {{
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "st"
        float2 outputs:result
    }}
}}
"""
BOUND = "rel material:binding = </M>"


def pixels(folder: Path, space: str, diffuse: str = " = (1, 1, 1)", mesh: str = BOUND, light: object = LIGHT) -> tuple:
    """Return the colour of the surface, and of the background beside it, linear Rec. 709."""
    named = f'uniform token renderingColorSpace = "{space}"' if space else ""
    path = folder / "stage.usda"
    color = tuple(np.asarray(light).tolist())
    fields = {"space": named, "light": color, "diffuse": diffuse, "mesh": mesh, "image": folder / "albedo.png"}
    path.write_text(STAGE.format(**fields))
    image = warp_rt.render(path, width=2, height=2)
    return image["color"][0, 0], image["color"][0, 1]


def expected(space: str) -> np.ndarray:
    matrix = np.array(TO_REC709[space])
    from_rec709 = np.linalg.inv(matrix)
    return matrix @ ((from_rec709 @ LIGHT) * (from_rec709 @ ALBEDO))


@pytest.mark.parametrize("space", list(TO_REC709))
@pytest.mark.parametrize("source", ["constant", "primvar", "texture"])
def test_colours_are_multiplied_in_its_primaries(tmp_path: Path, space: str, source: str) -> None:
    codes = np.rint(ALBEDO * 255).astype(np.uint8)
    PilImage.fromarray(np.broadcast_to(codes, (2, 2, 3)).copy()).save(tmp_path / "albedo.png")
    albedo = tuple(ALBEDO.tolist())
    said = {
        "constant": {"diffuse": f" = {albedo}"},
        "primvar": {"mesh": f'color3f[] primvars:displayColor = [{albedo}] (interpolation = "constant")'},
        "texture": {"diffuse": ".connect = </M/T.outputs:rgb>"},
    }[source]
    surface, background = pixels(tmp_path, space, **said)
    plain, _ = pixels(tmp_path, "", **said)
    np.testing.assert_allclose(plain, LIGHT * ALBEDO, atol=2e-6)
    # Four digits of the published matrices.
    np.testing.assert_allclose(surface, expected(space), atol=3e-4)
    assert np.abs(surface - plain).max() > 0.01
    np.testing.assert_allclose(background, (0.25, 0.5, 0.75), atol=1e-5)


def test_what_has_no_hue_is_the_same_in_all(tmp_path: Path) -> None:
    PilImage.fromarray(np.zeros((2, 2, 3), np.uint8)).save(tmp_path / "albedo.png")
    surface, _ = pixels(tmp_path, "lin_ap1_scene", diffuse=" = (0.5, 0.5, 0.5)", light=(1, 1, 1))
    np.testing.assert_allclose(surface, 0.5, atol=1e-5)


def test_the_names_of_rec709_change_nothing(tmp_path: Path) -> None:
    PilImage.fromarray(np.zeros((2, 2, 3), np.uint8)).save(tmp_path / "albedo.png")
    plain, _ = pixels(tmp_path, "")
    np.testing.assert_array_equal(pixels(tmp_path, "lin_rec709_scene")[0], plain)


@pytest.mark.parametrize("space", ["srgb_rec709_scene", "lin_ciexyzd65_scene", "nonsense"])
def test_what_is_no_linear_space_with_that_white_is_told(tmp_path: Path, space: str) -> None:
    PilImage.fromarray(np.zeros((2, 2, 3), np.uint8)).save(tmp_path / "albedo.png")
    plain, _ = pixels(tmp_path, "")
    np.testing.assert_array_equal(pixels(tmp_path, space)[0], plain)
    (told,) = [d for d in warp_rt.load_scene(tmp_path / "stage.usda").diagnostics if d.code == "W522"]
    assert space in told.message


@pytest.mark.parametrize("space", ["", *TO_REC709])
def test_colours_of_a_light_are_multiplied_in_them_too(space: str) -> None:
    """A mesh light by its own colour and what its material emits; a sphere light by its colour and temperature."""
    glow = (0.1, 0.7, 0.3)
    mesh = f"""def Plane "P" (prepend apiSchemas = ["MeshLightAPI", "MaterialBindingAPI"]) {{
    color3f inputs:color = {tuple(LIGHT.tolist())}
    rel material:binding = </M>
}}
def SphereLight "L" {{
    color3f inputs:color = {tuple(LIGHT.tolist())}
    bool inputs:enableColorTemperature = 1
    float inputs:colorTemperature = 3000
}}"""
    named = f'uniform token renderingColorSpace = "{space}"' if space else ""
    text = (
        STAGE.format(
            space=named,
            light=(1, 1, 1),
            diffuse=f" = (0, 0, 0)\ncolor3f inputs:emissiveColor = {glow}",
            mesh="",
            image="none.png",
        )
        + mesh
    )
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(text)
    scene = warp_rt.load_scene(stage)
    to_rec709 = np.array(TO_REC709.get(space, np.eye(3)))
    light, *factors = (np.linalg.solve(to_rec709, c) for c in (LIGHT, glow, UsdLux.BlackbodyTemperatureAsRgb(3000)))
    found = {light.path: light.radiance for light in scene.lights}
    for path, factor in zip(("/P", "/L"), factors, strict=True):
        np.testing.assert_allclose(found[path], light * factor, rtol=2e-3, atol=1e-4)
