# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Colour spaces, against their published primaries and curves, and against Gf's own conversion."""

import numpy as np
import pytest
from pxr import Gf, Usd

from warp_rt.report import Report
from warp_rt.usd.color_spaces import color_space, color_space_of
from warp_rt.usd.load import load_stage

D65 = (0.3127, 0.3290)
PRIMARIES = {
    "rec709": ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06), D65),
    "rec2020": ((0.708, 0.292), (0.170, 0.797), (0.131, 0.046), D65),
    "p3d65": ((0.680, 0.320), (0.265, 0.690), (0.150, 0.060), D65),
    "adobergb": ((0.64, 0.33), (0.21, 0.71), (0.15, 0.06), D65),
}


def rgb_to_xyz(name: str) -> np.ndarray:
    """Return the matrix of primaries and white (SMPTE RP 177)."""
    *corners, white = (np.array([x / y, 1, (1 - x - y) / y]) for x, y in PRIMARIES[name])
    columns = np.column_stack(corners)
    return columns * np.linalg.solve(columns, white)


def linear(name: str, value: object) -> np.ndarray:
    space = color_space(name)
    assert space is not None
    return space.to_linear(np.asarray(value, float))


@pytest.mark.parametrize("name", ["rec2020", "p3d65", "adobergb"])
def test_primaries_go_through_xyz(name: str) -> None:
    value = np.array([(0.8, 0.1, 0.3), (0.0, 1.0, 0.0)])
    expected = value @ (np.linalg.inv(rgb_to_xyz("rec709")) @ rgb_to_xyz(name)).T
    np.testing.assert_allclose(linear(f"lin_{name}_scene", value), expected, atol=2e-4)


def test_white_of_aces_becomes_white() -> None:
    """D60 is adapted to D65, as ACES renders do it: ACEScg's red is (1.705, -0.130, -0.024)."""
    np.testing.assert_allclose(linear("acescg", (1, 1, 1)), (1, 1, 1), atol=1e-5)
    np.testing.assert_allclose(linear("lin_ap1_scene", (1, 0, 0)), (1.70505, -0.13026, -0.02400), atol=2e-4)


@pytest.mark.parametrize(("name", "gamma"), [("g18_rec709", 1.8), ("g22_rec709", 2.2), ("gamma24", 2.4)])
def test_powers(name: str, gamma: float) -> None:
    values = np.array([0.0, 0.02, 0.5])
    np.testing.assert_allclose(linear(name, values), values**gamma, rtol=1e-5)
    np.testing.assert_allclose(linear(name, -values), -(values**gamma), rtol=1e-5)


def test_srgb_is_the_piecewise_curve() -> None:
    np.testing.assert_allclose(linear("srgb_texture", (0.04, 0.5, 1)), (0.04 / 12.92, (0.555 / 1.055) ** 2.4, 1))
    assert color_space("srgb_texture").is_srgb
    assert not color_space("srgb_displayp3").is_srgb


NAMES = {str(getattr(Gf.ColorSpaceNames, name)) for name in dir(Gf.ColorSpaceNames) if not name.startswith("_")}


@pytest.mark.parametrize("name", sorted(NAMES - {"unknown"}))
def test_every_space_of_usd_is_converted_as_usd_does(name: str) -> None:
    value = (0.7, 0.25, 0.02)
    expected = Gf.ColorSpace("lin_rec709_scene").Convert(Gf.ColorSpace(name), Gf.Vec3f(*value)).GetRGB()
    np.testing.assert_allclose(linear(name, value), expected, atol=1e-4)  # their sRGB curve has other knees


@pytest.mark.parametrize("name", ["lin_rec709", "raw", "Raw", "data", "identity", "linear"])
def test_linear_and_data_are_left_alone(name: str) -> None:
    assert color_space(name).is_linear_rec709


@pytest.mark.parametrize("name", ["ADX10", "ARRI LogC4", "unknown", "", "rec709"])
def test_unknown_names(name: str) -> None:
    assert color_space(name) is None


STAGE = """#usda 1.0
def Scope "A" (
    prepend apiSchemas = ["ColorSpaceAPI", "ColorSpaceDefinitionAPI:mine"]
)
{
    uniform token colorSpace:name = "lin_ap1_scene"
    uniform token colorSpaceDefinition:mine:name = "mine"
    float colorSpaceDefinition:mine:gamma = 2
    float2 colorSpaceDefinition:mine:redChroma = (0.64, 0.33)
    float2 colorSpaceDefinition:mine:greenChroma = (0.3, 0.6)
    float2 colorSpaceDefinition:mine:blueChroma = (0.15, 0.06)
    float2 colorSpaceDefinition:mine:whitePoint = (0.3127, 0.329)
    def Scope "B"
    {
        color3f inherits
        color3f own (colorSpace = "g22_rec709_scene")
        color3f defined (colorSpace = "mine")
        color3f odd (colorSpace = "nobody's")
        float3 vector
    }
}
def Scope "C"
{
    color3f silent
}
"""


@pytest.mark.parametrize(
    ("path", "expected", "codes"),
    [
        ("/A/B.inherits", (0.25 * 1.70505, 0.25 * -0.13026, 0.25 * -0.024), []),
        ("/A/B.own", (0.25**2.2, 0, 0), []),
        ("/A/B.defined", (0.25**2, 0, 0), []),
        ("/A/B.odd", None, ["W205"]),
        ("/A/B.vector", None, []),
        ("/C.silent", None, []),
    ],
)
def test_space_of_a_colour(path: str, expected: tuple | None, codes: list) -> None:
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(STAGE)
    report = Report()
    space = color_space_of(stage.GetAttributeAtPath(path), report)
    assert [d.code for d in report] == codes
    if expected is None:
        assert space is None
    else:
        np.testing.assert_allclose(space.to_linear(np.array((0.25, 0.0, 0.0))), expected, atol=1e-4)


SPACE = 'prepend apiSchemas = ["ColorSpaceAPI"]'
SRGB = 'uniform token colorSpace:name = "srgb_rec709_scene"\n'
GREY_MESH = """def Mesh "Mesh" {
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    color3f[] primvars:displayColor = [(0.5, 0.5, 0.5)]
}
"""


@pytest.mark.parametrize(
    ("text", "is_srgb"),
    [
        (f'def Xform "A" {{\n{GREY_MESH}}}\n', False),
        (f'def Xform "A" ({SPACE}) {{\n{SRGB}def Xform "B" {{\n{GREY_MESH}}}\n}}\n', True),
        (GREY_MESH.replace('"Mesh" {', f'"Mesh" ({SPACE}) {{\n{SRGB}'), True),
        (
            f'class Xform "C" {{\n{GREY_MESH}}}\n'
            f'def "I" (instanceable = true\ninherits = </C>\n{SPACE}) {{\n{SRGB}}}\n',
            True,
        ),
        (
            f'over "Library" ({SPACE}) {{\n{SRGB}def Xform "P" {{\n{GREY_MESH}}}\n}}\ndef PointInstancer "I" {{\n'
            "rel prototypes = </Library/P>\nint[] protoIndices = [0]\npoint3f[] positions = [(0, 0, 0)]\n}\n",
            True,
        ),
    ],
    ids=["nobody", "two above", "the mesh", "an instance", "above a prototype that is not drawn itself"],
)
def test_the_nearest_space_above_a_mesh_is_that_of_its_color(text: str, is_srgb: bool) -> None:
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(f"#usda 1.0\n{text}")
    (mesh,) = load_stage(stage).meshes
    expected = ((0.5 + 0.055) / 1.055) ** 2.4 if is_srgb else 0.5
    np.testing.assert_allclose(mesh.primvars["displayColor"].values, [[expected] * 3], rtol=1e-6)
