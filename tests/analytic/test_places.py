# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Pictures of what networks compute of the place: surfaces that shine by it, seen by a parallel camera."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image as PilImage
from pxr import Gf, Usd, UsdGeom

from warp_rt import Film, Renderer, RenderOptions
from warp_rt.scene import Scene
from warp_rt.usd.load import load_stage
from warp_rt.usd.solid_noise import perlin_solid, worley_solid_vector

OPTIONS = RenderOptions(width=48, height=48, aovs=("position", "normal"))

STAGE = """#usda 1.0
def Camera "Camera" {
    token projection = "orthographic"
    float horizontalAperture = 80
    float verticalAperture = 80
    double3 xformOp:translate = (0, 0, 20)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def DistantLight "None" { float inputs:intensity = 0 }
def Material "M" {
    token outputs:surface.connect = </M/S.outputs:out>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0, 0, 0)
        color3f inputs:specularColor = (0, 0, 0)
        int inputs:useSpecularWorkflow = 1
        color3f inputs:emissiveColor.connect = </M/N.outputs:out>
        token outputs:out
    }
    NODES
}
GEOMETRY
"""

PLACED = """
    double3 xformOp:translate = (0.3, -0.2, 1)
    float3 xformOp:rotateXYZ = (20, 30, 40)
    float3 xformOp:scale = (1.5, 1, 0.8)
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ", "xformOp:scale"]
"""
BOUND = 'prepend apiSchemas = ["MaterialBindingAPI"]'
BINDING = "rel material:binding = </M>"
CORNERS = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
BOX = f"""
    point3f[] points = {CORNERS}
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3]
    uniform token subdivisionScheme = "none"
"""
SHAPES = {
    "mesh": f'def Mesh "G" ({BOUND}) {{ {BINDING}\n{PLACED}\n{BOX} }}',
    "sphere": f'def Sphere "G" ({BOUND}) {{ double radius = 1.7\n{BINDING}\n{PLACED} }}',
    "cylinder": f'def Cylinder "G" ({BOUND}) {{ token axis = "X"\ndouble radius = 0.8\ndouble height = 3\n{BINDING}'
    f"\n{PLACED} }}",
    "cube": f'def Cube "G" ({BOUND}) {{ double size = 2.4\n{BINDING}\n{PLACED} }}',
    "far mesh": f'def Mesh "G" ({BOUND}) {{ {BINDING}\n{PLACED.replace("0.3, -0.2, 1", "-149.7, -0.2, 1")}\n'
    + BOX.replace("(-1,", "(99,").replace("(1,", "(101,").replace("(20, 30, 40)", "(0, 0, 0)")
    + "}",
    "subdivided": f'def Mesh "G" ({BOUND}) {{ {BINDING}\n{PLACED}\n{BOX.replace("none", "catmullClark")} }}',
}
SHAPES["far mesh"] = SHAPES["far mesh"].replace("(20, 30, 40)", "(0, 0, 0)")


def stage_text(nodes: str, geometry: str) -> str:
    """Return the stage, a statement a line."""
    return STAGE.replace("NODES", nodes).replace("GEOMETRY", geometry).replace("{ ", "{\n").replace(" }", "\n}")


def drawn(tmp_path: Path, nodes: str, geometry: str, options: RenderOptions = OPTIONS) -> tuple[Scene, Film]:
    path = tmp_path / "stage.usda"
    path.write_text(stage_text(nodes, geometry), encoding="utf-8")
    scene = load_stage(path)
    assert [d for d in scene.diagnostics if d.code.startswith("W")] == []
    return scene, Renderer(scene, options).render()


def node(name: str, identifier: str, *lines: str) -> str:
    body = "\n".join((f'uniform token info:id = "{identifier}"', *lines, "float outputs:out"))
    return f'def Shader "{name}" {{\n{body}\n}}\n'


def wire(name: str, source: str) -> str:
    return f"float3 inputs:{name}.connect = </M/{source}.outputs:out>"


def world_from(tmp_path: Path, path: str) -> np.ndarray:
    stage = Usd.Stage.Open(str(tmp_path / "stage.usda"))
    matrix = UsdGeom.Xformable(stage.GetPrimAtPath(path)).ComputeLocalToWorldTransform(Usd.TimeCode.Default())
    return np.array(matrix).T


def seen(film: Film) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the colours, places and normals of the pixels that show anything."""
    is_there = film.alpha > 0.5
    assert is_there.sum() > 100
    return film.color[is_there][:, :3], film.aovs["position"][is_there].astype(float), film.aovs["normal"][is_there]


def half(node_name: str) -> str:
    """Return node N, which takes a vector of -5..5 to 0..1."""
    tenth = node("T", "ND_multiply_vector3FA", wire("in1", node_name), "float inputs:in2 = 0.1")
    return tenth + node("N", "ND_add_vector3FA", wire("in1", "T"), "float inputs:in2 = 0.5")


@pytest.mark.parametrize("shape", SHAPES)
def test_the_place_in_the_object_is_in_the_prims_own_space(tmp_path: Path, shape: str) -> None:
    scale = node("P", "ND_position_vector3")
    if shape == "far mesh":  # whose points are 100 away from its origin
        scale = node("Q", "ND_position_vector3") + node(
            "P", "ND_subtract_vector3", wire("in1", "Q"), "float3 inputs:in2 = (100, 0, 0)"
        )
    _, film = drawn(tmp_path, scale + half("P"), SHAPES[shape])
    colors, places, _ = seen(film)
    inverse = np.linalg.inv(world_from(tmp_path, "/G"))
    local = places @ inverse[:3, :3].T + inverse[:3, 3]
    if shape == "far mesh":
        local -= (100, 0, 0)
    np.testing.assert_allclose(colors, 0.1 * local + 0.5, atol=2e-5)


def test_the_place_in_the_world(tmp_path: Path) -> None:
    space = 'string inputs:space = "world"'
    _, film = drawn(tmp_path, node("P", "ND_position_vector3", space) + half("P"), SHAPES["mesh"])
    colors, places, _ = seen(film)
    np.testing.assert_allclose(colors, 0.1 * places + 0.5, atol=1e-5)


COPIES = f"""
def PointInstancer "I" {{
    point3f[] positions = [(-2, 0, 0), (2, 1, 0)]
    quath[] orientations = [(0.7071, 0.7071, 0, 0), (1, 0, 0, 0)]
    int[] protoIndices = [0, 0]
    rel prototypes = </I/G>
    {SHAPES["sphere"]}
}}
"""


def test_copies_have_their_prototypes_space(tmp_path: Path) -> None:
    """Two spheres that show the same, each turned as it is."""
    _, film = drawn(tmp_path, node("P", "ND_position_vector3") + half("P"), COPIES)
    colors, places, _ = seen(film)
    local = (colors - 0.5) * 10.0
    np.testing.assert_allclose(np.linalg.norm(local, axis=1), 1.7, atol=1e-4)
    prototype = (
        Gf.Matrix4d().SetScale(Gf.Vec3d(1.5, 1, 0.8))
        * Gf.Matrix4d().SetRotate(Gf.Rotation((1, 0, 0), 20))
        * Gf.Matrix4d().SetRotate(Gf.Rotation((0, 1, 0), 30))
        * Gf.Matrix4d().SetRotate(Gf.Rotation((0, 0, 1), 40))
        * Gf.Matrix4d().SetTranslate((0.3, -0.2, 1))
    )
    errors = []
    for turn, position in ((90, (-2, 0, 0)), (0, (2, 1, 0))):
        placed = prototype * Gf.Matrix4d().SetRotate(Gf.Rotation((1, 0, 0), turn))
        matrix = np.array(placed * Gf.Matrix4d().SetTranslate(position)).T
        errors.append(np.abs(local @ matrix[:3, :3].T + matrix[:3, 3] - places).max(axis=1))
    is_of = np.array(errors) < 2e-3  # quath: 11 bits
    assert is_of.any(axis=0).all()
    assert (is_of.sum(axis=1) > 100).all()


def test_normals_of_both_spaces(tmp_path: Path) -> None:
    for space in ("object", "world"):
        nodes = node("P", "ND_normal_vector3", f'string inputs:space = "{space}"') + half("P")
        _, film = drawn(tmp_path, nodes, SHAPES["sphere"])
        colors, places, normals = seen(film)
        matrix = world_from(tmp_path, "/G")
        inverse = np.linalg.inv(matrix)
        wanted = normals
        if space == "object":
            local = places @ inverse[:3, :3].T + inverse[:3, 3]
            wanted = local / 1.7  # of a sphere about its origin
        np.testing.assert_allclose(colors, 0.1 * wanted + 0.5, atol=2e-5)


def test_how_a_sphere_faces_the_viewer(tmp_path: Path) -> None:
    sphere = f'def Sphere "G" ({BOUND}) {{ double radius = 3\n{BINDING} }}'
    for inverted in (0, 1):
        _, film = drawn(tmp_path, node("N", "ND_facingratio_float", f"bool inputs:invert = {inverted}"), sphere)
        colors, places, _ = seen(film)
        cosine = np.sqrt(np.maximum(1 - (places[:, :2] ** 2).sum(axis=1) / 9, 0))
        np.testing.assert_allclose(colors[:, 0], 1 - cosine if inverted else cosine, atol=1e-4)


MARBLE = (
    node("P", "ND_position_vector3")
    + node("D", "ND_dotproduct_vector3", wire("in1", "P"), "float3 inputs:in2 = (1, 1, 1)")
    + node("F", "ND_fractal3d_float", wire("position", "P"), "int inputs:octaves = 4")
    + node("A", "ND_multiply_float", "float inputs:in1.connect = </M/F.outputs:out>", "float inputs:in2 = 3")
    + node("B", "ND_add_float", "float inputs:in1.connect = </M/A.outputs:out>",
           "float inputs:in2.connect = </M/D.outputs:out>")
    + node("W", "ND_sin_float", "float inputs:in.connect = </M/B.outputs:out>")
    + node("H", "ND_multiply_float", "float inputs:in1.connect = </M/W.outputs:out>", "float inputs:in2 = 0.5")
    + node("O", "ND_add_float", "float inputs:in1.connect = </M/H.outputs:out>", "float inputs:in2 = 0.5")
    + node("N", "ND_mix_color3", "float inputs:mix.connect = </M/O.outputs:out>",
           "color3f inputs:fg = (0.9, 0.2, 0.1)", "color3f inputs:bg = (0.1, 0.3, 0.8)")
)  # fmt: skip


def test_marble(tmp_path: Path) -> None:
    _, film = drawn(tmp_path, MARBLE, SHAPES["mesh"])
    colors, places, _ = seen(film)
    inverse = np.linalg.inv(world_from(tmp_path, "/G"))
    local = places @ inverse[:3, :3].T + inverse[:3, 3]
    noise = sum(perlin_solid(local * 2.0**k)[:, 0] * 0.5**k for k in range(4))
    share = 0.5 + 0.5 * np.sin(local.sum(axis=1) + 3 * noise)
    wanted = np.outer(share, (0.9, 0.2, 0.1)) + np.outer(1 - share, (0.1, 0.3, 0.8))
    np.testing.assert_allclose(colors, wanted, atol=1e-4)


def test_cells_of_space(tmp_path: Path) -> None:
    _, film = drawn(tmp_path, node("N", "ND_worleynoise3d_vector3"), SHAPES["cube"])
    colors, places, _ = seen(film)
    inverse = np.linalg.inv(world_from(tmp_path, "/G"))
    local = places @ inverse[:3, :3].T + inverse[:3, 3]
    np.testing.assert_allclose(colors, worley_solid_vector(local, np.ones((1, 1))), atol=1e-4)


@pytest.mark.parametrize("up", [0, 1, 2])
def test_images_along_three_axes(tmp_path: Path, up: int) -> None:
    """On a cube each face shows one of them: a ramp across and a ramp up, by the library's own table of axes."""
    ramp = np.linspace(0, 255, 64).round().astype(np.uint8)
    pixels = np.zeros((64, 64, 3), np.uint8)
    pixels[..., 0], pixels[..., 1] = ramp[None], ramp[::-1, None]
    for k, name in enumerate("xyz"):
        pixels[..., 2] = 100 * k
        PilImage.fromarray(pixels).save(tmp_path / f"{name}.png")
    files = [f'asset inputs:file{name} = @{tmp_path.as_posix()}/{name}.png@ (colorSpace = "raw")' for name in "xyz"]
    shift = node("P", "ND_position_vector3") + node(
        "Q", "ND_multiply_vector3FA", wire("in1", "P"), "float inputs:in2 = 0.4"
    )
    shift += node("R", "ND_add_vector3FA", wire("in1", "Q"), "float inputs:in2 = 0.5")
    nodes = shift + node(
        "N", "ND_triplanarprojection_color3", *files, wire("position", "R"), f"int inputs:upaxis = {up}"
    )
    _, film = drawn(tmp_path, nodes, SHAPES["mesh"], replace(OPTIONS, texture_filter="bilinear"))
    colors, places, _ = seen(film)
    inverse = np.linalg.inv(world_from(tmp_path, "/G"))
    local = places @ inverse[:3, :3].T + inverse[:3, 3]
    axis = np.abs(local).argmax(axis=1)
    np.testing.assert_allclose(colors[:, 2] * 255, 100 * axis, atol=0.02)
    x, y, z = 0.5 + 0.4 * local.T
    across = [(z, z, -y), (z, x, x), (y, x, x)][up]
    upwards = [(y, x, x), (y, z, y), (z, z, y)][up]
    for k in range(3):
        for channel, rows in ((0, across), (1, upwards)):
            wanted = ((rows[k][axis == k] % 1.0) * 64 - 0.5) / 63
            np.testing.assert_allclose(colors[axis == k, channel], wanted, atol=0.02)


HALF_THERE = """
def Mesh "G" (BOUND) {
    BINDING
    point3f[] points = [(-3, 1, -3), (-3, 1, 3), (3, 1, 3), (3, 1, -3)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
}
def Mesh "Floor" {
    point3f[] points = [(-3, -1, -3), (-3, -1, 3), (3, -1, 3), (3, -1, -3)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    color3f[] primvars:displayColor = [(1, 1, 1)]
}
""".replace("BOUND", BOUND).replace("BINDING", BINDING)


def test_shadows_of_what_is_opaque_in_places(tmp_path: Path) -> None:
    """A roof that is there where x is above 0, under a light straight above: half of the floor is dark."""
    nodes = node("P", "ND_position_vector3") + node("X", "ND_extract_vector3", wire("in", "P"))
    nodes += node(
        "N", "ND_ifgreater_float", "float inputs:value1.connect = </M/X.outputs:out>", "float inputs:value2 = 0",
        "float inputs:in1 = 1", "float inputs:in2 = 0",
    )  # fmt: skip
    text = stage_text(nodes, HALF_THERE)
    opacity = 'token inputs:opacityMode = "presence"\nfloat inputs:opacity.connect'
    text = text.replace("color3f inputs:emissiveColor.connect", opacity)
    text = text.replace(
        'def DistantLight "None" {\nfloat inputs:intensity = 0\n}',
        """def DistantLight "Sun" {
        float inputs:intensity = 1\nfloat inputs:angle = 0\nfloat3 xformOp:rotateXYZ = (-90, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]\n}""",
    )
    text = text.replace("(0, 0, 20)", "(0, 0.5, 0)\nfloat3 xformOp:rotateXYZ = (-90, 0, 0)")
    text = text.replace('["xformOp:translate"]', '["xformOp:translate", "xformOp:rotateXYZ"]')
    path = tmp_path / "stage.usda"
    path.write_text(text, encoding="utf-8")
    film = Renderer(load_stage(path), OPTIONS).render()
    is_floor = film.alpha > 0.5
    is_lit = film.color[..., 0][is_floor] > 0.1
    np.testing.assert_array_equal(is_lit, film.aovs["position"][is_floor][:, 0] < 0)
