# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Displacement as stages say it: terminals, networks, subsets, instances and subdivision surfaces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image as PilImage

import warp_rt
from warp_rt.scene import Mesh, Scene
from warp_rt.usd.volumes import encloses_volume

from ..stages import stage_of

QUAD = """
    point3f[] points = [(0,0,0), (1,0,0), (1,1,0), (0,1,0)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
"""
FLAT = QUAD + 'uniform token subdivisionScheme = "none"\n'
CUBE = """
    point3f[] points = [(-1,-1,-1), (-1,-1,1), (-1,1,-1), (-1,1,1), (1,-1,-1), (1,-1,1), (1,1,-1), (1,1,1)]
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0,1,3,2, 4,6,7,5, 0,4,5,1, 2,3,7,6, 0,2,6,4, 1,5,7,3]
"""
BINDING = 'prepend apiSchemas = ["MaterialBindingAPI"]'


def mesh(body: str, *, name: str = "m", material: str = "M", children: str = "") -> str:
    return f'def Mesh "{name}" ({BINDING}) {{\nrel material:binding = </{material}>\n{body}\n{children}\n}}\n'


def material(
    displacement: str, *, name: str = "M", more: str = "", terminal: str = "outputs:displacement", interface: str = ""
) -> str:
    """Return a material whose UsdPreviewSurface has this displacement."""
    connected = f"token {terminal}.connect = </{name}/S.outputs:displacement>" if terminal else ""
    return f"""def Material "{name}" {{
        token outputs:surface.connect = </{name}/S.outputs:surface>
        {connected}
        {interface}
        def Shader "S" {{
            uniform token info:id = "UsdPreviewSurface"
            {displacement}
            token outputs:surface
            token outputs:displacement
        }}
        {more}
    }}
    """


def load(body: str, folder: Path | None = None, **options) -> Scene:
    if folder is not None:
        (folder / "stage.usda").write_text(f"#usda 1.0\n{body}")
        return warp_rt.load_scene(folder / "stage.usda", **options)
    return warp_rt.load_scene(stage_of(body), **options)


def only(scene: Scene) -> Mesh:
    (found,) = scene.meshes
    assert isinstance(found, Mesh)
    return found


def codes(scene: Scene) -> dict[str, str]:
    return {record.prim: record.code for record in scene.diagnostics}


def test_a_constant_moves_along_the_normal() -> None:
    scene = load(mesh(FLAT) + material("float inputs:displacement = 0.25"))
    np.testing.assert_allclose(only(scene).points[:, 2], 0.25)
    assert codes(scene) == {}
    turned = load(
        mesh(FLAT + 'uniform token orientation = "leftHanded"') + material("float inputs:displacement = 0.25")
    )
    np.testing.assert_allclose(only(turned).points[:, 2], -0.25)


@pytest.mark.parametrize("context", ["", "warp_rt:", "ri:"])
def test_every_terminal_is_looked_at(context: str) -> None:
    shader = material("float inputs:displacement = 1", terminal=f"outputs:{context}displacement")
    scene = load(mesh(FLAT) + shader)
    np.testing.assert_allclose(only(scene).points[:, 2], 1)


def test_without_a_terminal_nothing_moves_and_that_is_told() -> None:
    scene = load(mesh(FLAT) + material("float inputs:displacement = 1", terminal=""))
    assert not only(scene).points[:, 2].any()
    assert codes(scene) == {"/M/S": "W305"}


def test_heights_come_through_interfaces_and_node_graphs() -> None:
    graph = """def NodeGraph "G" {
            float outputs:out.connect = </M/G/R.outputs:result>
            def Shader "R" {
                uniform token info:id = "UsdPrimvarReader_float"
                string inputs:varname.connect = </M.inputs:name>
                float outputs:result
            }
        }"""
    scene = load(
        mesh(FLAT + 'float[] primvars:h = [0, 1, 2, 3] (interpolation = "vertex")')
        + material(
            "float inputs:displacement.connect = </M/G.outputs:out>", more=graph, interface='string inputs:name = "h"'
        )
    )
    np.testing.assert_allclose(only(scene).points[:, 2], [0, 1, 2, 3])


def test_materialx_scales() -> None:
    node = """def Shader "D" {
            uniform token info:id = "ND_displacement_float"
            float inputs:displacement = 0.5
            float inputs:scale = 3
            token outputs:out
        }"""
    body = material(
        "", more=node, terminal="", interface="token outputs:mtlx:displacement.connect = </M/D.outputs:out>"
    )
    np.testing.assert_allclose(only(load(mesh(FLAT) + body)).points[:, 2], 1.5)


def test_vector_displacement_is_left_out() -> None:
    node = 'def Shader "D" {\nuniform token info:id = "ND_displacement_vector3"\ntoken outputs:out\n}'
    body = material("", more=node, terminal="", interface="token outputs:displacement.connect = </M/D.outputs:out>")
    scene = load(mesh(FLAT) + body)
    assert not only(scene).points[:, 2].any()
    assert codes(scene) == {"/M": "W305"}


def test_a_material_without_a_surface_still_displaces() -> None:
    node = """def Shader "D" {
            uniform token info:id = "ND_displacement_float"
            float inputs:displacement = 0.5
            token outputs:out
        }"""
    body = f'def Material "M" {{\ntoken outputs:displacement.connect = </M/D.outputs:out>\n{node}\n}}\n'
    plain = f'def Mesh "plain" {{\n{FLAT}\n}}\n'
    scene = load(plain + mesh(FLAT) + body)
    assert [found.points[:, 2].max() for found in scene.meshes] == [0, 0.5]


def test_textures_are_read_at_the_points_of_the_refined_surface(tmp_path: Path) -> None:
    """A ramp from black to white over a quad, raw: height is s but for half a texel at either end."""
    ramp = np.repeat((np.arange(256) / 255 * 255).astype(np.uint8)[None], 4, axis=0)
    PilImage.fromarray(ramp, "L").save(tmp_path / "ramp.png")
    nodes = """
        def Shader "T" {
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @./ramp.png@
            token inputs:wrapS = "clamp"
            token inputs:wrapT = "clamp"
            float4 inputs:scale = (2, 2, 2, 2)
            float4 inputs:bias = (-1, -1, -1, -1)
            float2 inputs:st.connect = </M/R.outputs:result>
            float outputs:r
        }
        def Shader "R" {
            uniform token info:id = "UsdPrimvarReader_float2"
            string inputs:varname = "st"
            float2 outputs:result
        }"""
    body = mesh(
        QUAD
        + 'uniform token subdivisionScheme = "bilinear"\n'
        + 'texCoord2f[] primvars:st = [(0,0), (1,0), (1,1), (0,1)] (interpolation = "faceVarying")'
    ) + material("float inputs:displacement.connect = </M/T.outputs:r>", more=nodes)
    found = only(load(body, tmp_path, complexity="veryhigh"))
    assert len(found.points) == 81
    # Displaced vertices of a flat quad go straight up; texel centres lie half a texel in.
    u = np.clip((found.points[:, 0] * 256 - 0.5) / 255, 0, 1)
    np.testing.assert_allclose(found.points[:, 2], 2 * u - 1, atol=1e-6)


@pytest.mark.parametrize("complexity", ["medium", "veryhigh"])
def test_a_limit_surface_moves_along_its_normal(complexity: str) -> None:
    still = only(load(mesh(CUBE) + material(""), complexity=complexity))
    moved = only(load(mesh(CUBE) + material("float inputs:displacement = 0.5"), complexity=complexity))
    normals = np.zeros_like(still.points)
    normals[still.triangles] = still.normals.values[still.normals.indices]
    np.testing.assert_allclose(moved.points, still.points + 0.5 * normals, atol=1e-6)
    assert moved.is_closed
    assert encloses_volume(moved.points, moved.triangles)


def test_the_cage_alone_is_told() -> None:
    scene = load(mesh(CUBE) + material("float inputs:displacement = 0.5"))
    assert codes(scene) == {"/m": "N914"}
    np.testing.assert_allclose(np.linalg.norm(only(scene).points, axis=1), np.sqrt(3) + 0.5, rtol=1e-6)


def test_subsets_are_displaced_by_their_own_materials() -> None:
    strip = """
        point3f[] points = [(0,0,0), (1,0,0), (2,0,0), (0,1,0), (1,1,0), (2,1,0)]
        int[] faceVertexCounts = [4, 4]
        int[] faceVertexIndices = [0, 1, 4, 3, 1, 2, 5, 4]
        uniform token subdivisionScheme = "none"
    """
    subset = f"""def GeomSubset "half" ({BINDING}) {{
        uniform token familyName = "materialBind"
        int[] indices = [1]
        rel material:binding = </N>
    }}"""
    scene = load(
        mesh(strip, children=subset)
        + material("float inputs:displacement = 1")
        + material("float inputs:displacement = 3", name="N")
    )
    heights = only(scene).points[:, 2]
    np.testing.assert_allclose(heights[[0, 3, 2, 5]], [1, 1, 3, 3])
    assert ((heights[[1, 4]] > 1) & (heights[[1, 4]] < 3)).all()


def test_shapes_that_are_no_meshes_are_told() -> None:
    ball = f'def Sphere "s" ({BINDING}) {{\nrel material:binding = </M>\n}}\n'
    points = f'def Points "p" ({BINDING}) {{\nrel material:binding = </M>\npoint3f[] points = [(0,0,0)]\n}}\n'
    scene = load(ball + points + material("float inputs:displacement = 1"))
    assert {record.prim for record in scene.diagnostics if record.code == "W305"} == {"/s", "/p"}


def test_heights_are_inherited_and_meshes_of_equal_ones_shared() -> None:
    reader = """def Shader "R" {
            uniform token info:id = "UsdPrimvarReader_float"
            string inputs:varname = "h"
            float inputs:fallback = 7
            float outputs:result
        }"""
    shader = material("float inputs:displacement.connect = </M/R.outputs:result>", more=reader)
    above = f'def Xform "x" {{\nfloat primvars:h = 1\n{mesh(FLAT)}}}\n'
    np.testing.assert_allclose(only(load(above + shader)).points[:, 2], 1)
    copies = "".join(
        f'def Xform "{name}" (instanceable = true\ninherits = </asset>) {{\n{says}\n}}\n'
        for name, says in (("a", ""), ("b", "color3f[] primvars:displayColor = [(1, 0, 0)]"))
    )
    scene = load(f'class Xform "asset" {{\n{mesh(FLAT)}}}\n{copies}{shader}')
    np.testing.assert_allclose(only(scene).points[:, 2], 7)
    assert (len(scene.instances), codes(scene)) == (2, {})
    copy = 'def Xform "a" (instanceable = true\ninherits = </asset>) {\nfloat primvars:h = 1\n}\n'
    scene = load(f'class Xform "asset" {{\n{mesh(FLAT)}}}\n{copy}{shader}')
    assert codes(scene) == {"/a/m": "W305"}


def test_heights_may_change_with_time_and_triangles_do_not() -> None:
    body = mesh(FLAT) + material("float inputs:displacement.timeSamples = { 1: 0.5, 2: 1.5 }")
    first, second = (only(load(body, time=time)) for time in (1, 2))
    np.testing.assert_array_equal(first.triangles, second.triangles)
    assert (first.points[0, 2], second.points[0, 2]) == (0.5, 1.5)


HEIGHT = "float inputs:displacement.connect = </M/H.outputs:result>"
READS_HEIGHT = """def Shader "H" {
    uniform token info:id = "UsdPrimvarReader_float"
    string inputs:varname = "height"
    float inputs:fallback = 0.25
    float outputs:result
}"""


def test_a_height_that_nobody_has_is_the_fallback() -> None:
    scene = load(mesh(FLAT) + material(HEIGHT, more=READS_HEIGHT))
    np.testing.assert_allclose(scene.meshes[0].points[:, 2], 0.25)
    assert "W305" not in codes(scene).values()


@pytest.mark.parametrize(("values", "told"), [("[0, 1]", {"/i/m": "W305"}), ("[0.5, 0.5]", {"/i/m": "W305"}), ("", {})])
def test_heights_that_instances_have_of_their_own_are_told(values: str, told: dict[str, str]) -> None:
    of_instances = f'float[] primvars:height = {values} (interpolation = "vertex")' if values else ""
    instancer = f"""def PointInstancer "i" {{
        point3f[] positions = [(0, 0, 0), (4, 0, 0)]
        int[] protoIndices = [0, 0]
        rel prototypes = </i/m>
        {of_instances}
        {mesh(FLAT + "float primvars:height = 0.75")}
    }}"""
    scene = load(f"{instancer}\n{material(HEIGHT, more=READS_HEIGHT)}")
    np.testing.assert_allclose(scene.meshes[0].points[:, 2], 0.75)
    assert {prim: code for prim, code in codes(scene).items() if code == "W305"} == told


def test_a_height_from_above_an_instancer_is_told_once() -> None:
    instancer = f"""def Xform "x" {{
        float primvars:height = 0.5
        def PointInstancer "i" {{
            point3f[] positions = [(0, 0, 0), (4, 0, 0)]
            int[] protoIndices = [0, 0]
            rel prototypes = </x/i/m>
            {mesh(FLAT)}
        }}
    }}"""
    scene = load(f"{instancer}\n{material(HEIGHT, more=READS_HEIGHT)}")
    np.testing.assert_allclose(scene.meshes[0].points[:, 2], 0.25)
    assert [record.prim for record in scene.diagnostics if record.code == "W305"] == ["/x/i/m"]
