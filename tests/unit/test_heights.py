# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Normals of heights that are computed of the place: against their derivatives in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Usd

import warp_rt

SHOWN = """#usda 1.0
{gprim}
def Camera "Eye"
{{
    token projection = "orthographic"
    float horizontalAperture = {width}
    float verticalAperture = {width}
    float2 clippingRange = (0.1, 100)
    double3 xformOp:translate = (0, 0, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
def Material "M"
{{
    token outputs:mtlx:surface.connect = </M/S.outputs:out>
    def Shader "S"
    {{
        uniform token info:id = "ND_surface_unlit"
        color3f inputs:emission_color.connect = </M/N.outputs:out>
        token outputs:out
    }}
{nodes}
}}
"""
BOUND = 'prepend apiSchemas = ["MaterialBindingAPI"]'


def shown(gprim: str, nodes: str, width: float, pixels: int = 16) -> np.ndarray:
    """Return what a node N gives, as light, from bottom to top: shape [pixels, pixels, 3]."""
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(SHOWN.format(gprim=gprim, nodes=nodes, width=10 * width))
    scene = warp_rt.load_scene(stage)
    assert {d.code for d in scene.diagnostics} <= {"W302"}
    return warp_rt.render(scene, camera="/Eye", width=pixels, height=pixels, device="cpu")["color"][::-1]


def shader(name: str, identifier: str, kind: str, *lines: str) -> str:
    body = "\n".join((f'uniform token info:id = "ND_{identifier}"', *lines, f"{kind} outputs:out"))
    return f'def Shader "{name}" {{\n{body}\n}}\n'


def along(way: str) -> str:
    """Return the node H, the way along a vector in the object's space."""
    wire = "float3 inputs:in1.connect = </M/P.outputs:out>"
    place = shader("P", "position_vector3", "float3")
    return place + shader("H", "dotproduct_vector3", "float", wire, f"float3 inputs:in2 = {way}")


def test_normals_of_heights_of_the_place() -> None:
    """Waves along x of a sheet that is 4 wide and 2 high, over one unit of texture coordinates each way, and scaled."""
    sheet = f"""def Mesh "Sheet" ({BOUND})
    {{
        point3f[] points = [(-2, -1, 0), (2, -1, 0), (2, 1, 0), (-2, 1, 0)]
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")
        uniform token subdivisionScheme = "none"
        rel material:binding = </M>
        float3 xformOp:scale = (1, 2, 3)
        uniform token[] xformOpOrder = ["xformOp:scale"]
    }}"""
    nodes = along("(1.5, 0.5, 0)") + shader("W", "sin_float", "float", "float inputs:in.connect = </M/H.outputs:out>")
    lines = ("float inputs:in.connect = </M/W.outputs:out>", "float inputs:scale = 2")
    found = shown(sheet, nodes + shader("N", "heighttonormal_vector3", "float3", *lines), 4.0)
    x, y = np.meshgrid((np.arange(16) - 7.5) / 4, (np.arange(16) - 7.5) / 8)  # the sheet's own
    wave = 2 * np.cos(1.5 * x + 0.5 * y) / 16
    normal = np.stack([-wave * 1.5 * 4, -wave * 0.5 * 2, np.ones_like(x)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    np.testing.assert_allclose(found, 0.5 * normal + 0.5, atol=5e-4)


def test_normals_of_heights_on_a_sphere() -> None:
    """By z, the cosine of the turn from the pole, which t tells in halves of a turn."""
    ball = f'def Sphere "Ball" ({BOUND}) {{\ndouble radius = 2\nrel material:binding = </M>\n}}'
    nodes = along("(0, 0, 1)")
    lines = ("float inputs:in.connect = </M/H.outputs:out>",)
    found = shown(ball, nodes + shader("N", "heighttonormal_vector3", "float3", *lines), 2.0)
    x, y = np.meshgrid((np.arange(16) - 7.5) / 8, (np.arange(16) - 7.5) / 8)
    slope = np.pi * np.hypot(x, y) / 16
    normal = np.stack([0 * slope, -slope, np.ones_like(slope)], axis=-1) / np.hypot(slope, 1)[..., None]
    np.testing.assert_allclose(found, 0.5 * normal + 0.5, atol=1e-3)


def tilted(way: str) -> float:
    """Return how a sheet in slanting light is lit that is bumped along a vector, by 16, for the library's scale."""
    sheet = f"""def Mesh "Sheet" ({BOUND})
    {{
        point3f[] points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
        int[] faceVertexCounts = [4]
        int[] faceVertexIndices = [0, 1, 2, 3]
        texCoord2f[] primvars:st = [(0, 0), (2, 0), (2, 2), (0, 2)] (interpolation = "vertex")
        uniform token subdivisionScheme = "none"
        rel material:binding = </M>
    }}
    def DistantLight "Sun" {{
        float inputs:intensity = 1
        float inputs:angle = 0
        float3 xformOp:rotateXYZ = (0, 30, 0)
        uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
    }}"""
    lines = ("float inputs:height.connect = </M/H.outputs:out>", "float inputs:scale = 16")
    nodes = along(way) + shader("B", "bump_vector3", "float3", *lines)
    surface = """
        uniform token info:id = "UsdPreviewSurface"
        int inputs:useSpecularWorkflow = 1
        color3f inputs:specularColor = (0, 0, 0)
        normal3f inputs:normal.connect = </M/B.outputs:out>
        """
    text = SHOWN.format(gprim=sheet, nodes=nodes, width=20)
    start, end = text.index('uniform token info:id = "ND_surface_unlit"'), text.index("token outputs:out\n")
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(text[:start] + surface + text[end:])
    found = warp_rt.render(stage, camera="/Eye", width=4, height=4, device="cpu")["color"]
    assert np.ptp(found) < 1e-5
    return float(found.mean())


def test_a_bump_of_the_place_tilts_the_normal() -> None:
    """A sheet whose height grows along x at one in four is lit as the sheet tilted."""
    normal, light = np.array((-0.25, 0, 1)) / np.hypot(0.25, 1), np.array((0.5, 0, np.sqrt(0.75)))
    assert tilted("(0.25, 0, 0)") / tilted("(0, 0, 0)") == pytest.approx(normal @ light / light[2], rel=1e-3)


def test_heights_of_normals_are_told() -> None:
    """How a normal changes beside the point nobody knows."""
    nodes = shader("F", "facingratio_float", "float")
    nodes += shader("N", "heighttonormal_vector3", "float3", "float inputs:in.connect = </M/F.outputs:out>")
    stage = Usd.Stage.CreateInMemory()
    ball = f'def Sphere "Ball" ({BOUND}) {{\nrel material:binding = </M>\n}}'
    stage.GetRootLayer().ImportFromString(SHOWN.format(gprim=ball, nodes=nodes, width=20))
    assert "W303" in {d.code for d in warp_rt.load_scene(stage).diagnostics}
