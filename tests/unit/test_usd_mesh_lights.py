# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""MeshLightAPI: which triangles shine, how brightly, and what their material has to do with it."""

import numpy as np
import pytest
from pxr import Usd

from warp_rt.scene import LightKind
from warp_rt.usd.load import load_stage

QUAD = """
    point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 3, 0), (0, 3, 0)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    uniform token subdivisionScheme = "none"
    float inputs:intensity = 12
    color3f inputs:color = (1, 0.5, 0.25)
"""
GLOWING = """
def Material "Glow"
{
    token outputs:surface.connect = </Glow/surface.outputs:surface>
    def Shader "surface"
    {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:emissiveColor = (0.5, 2, 4)
        token outputs:surface
    }
}
"""


def _scene(body="", more="", bound=False):
    schemas = '"MeshLightAPI", "MaterialBindingAPI"'
    binding = "rel material:binding = </Glow>" if bound else ""
    stage = Usd.Stage.CreateInMemory()
    lamp = f'def Mesh "Lamp" (\n    prepend apiSchemas = [{schemas}]\n)\n{{{QUAD}\n{body}\n{binding}\n}}\n'
    stage.GetRootLayer().ImportFromString(f"#usda 1.0\n{GLOWING}\n{lamp}\n{more}")
    return load_stage(stage)


def test_its_triangles_shine():
    scene = _scene()
    (light,) = scene.lights
    assert (light.path, light.kind, light.is_double_sided) == ("/Lamp", LightKind.MESH, False)
    assert light.radiance == (12, 6, 3)
    corners = light.triangles
    assert corners.shape == (2, 3, 3)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    np.testing.assert_allclose(normal / 2, [(0, 0, 3)] * 2)
    assert len(scene.instances) == 1  # and the mesh is drawn
    assert not [d for d in scene.diagnostics if d.code.startswith("W")]


def test_left_handed_meshes_shine_to_their_own_outside():
    (light,) = _scene('uniform token orientation = "leftHanded"\nuniform bool doubleSided = 1').lights
    corners = light.triangles
    assert np.cross(corners[0, 1] - corners[0, 0], corners[0, 2] - corners[0, 0])[2] < 0
    assert light.is_double_sided


def test_normalize_divides_by_the_area_in_world_space():
    scale = 'double3 xformOp:scale = (2, 5, 1)\nuniform token[] xformOpOrder = ["xformOp:scale"]'
    (light,) = _scene(f"bool inputs:normalize = 1\n{scale}").lights
    assert light.radiance[0] == pytest.approx(12 / 60)


@pytest.mark.parametrize(
    ("mode", "factor", "codes"),
    [
        ("", (0.5, 2, 4), []),  # the schema's fallback is materialGlowTintsLight
        ("materialGlowTintsLight", (0.5, 2, 4), []),
        ("independent", (1, 1, 1), []),
        ("noMaterialResponse", (1, 1, 1), []),
    ],
)
def test_material_sync_mode(mode, factor, codes):
    body = f'uniform token light:materialSyncMode = "{mode}"' if mode else ""
    scene = _scene(body, bound=True)
    assert scene.lights[0].radiance == pytest.approx(np.array([12, 6, 3]) * factor)
    is_black = mode == "noMaterialResponse"
    assert scene.lights[0].glows == (not is_black)
    table = scene.instances.material_table[scene.instances.material_offset[0] :]
    drawn = scene.materials[table[0]]
    assert any(any(term.value) for term in drawn.inputs.values()) == (not is_black)
    assert not _scene(body).lights[0].glows
    assert [d.code for d in scene.diagnostics if d.code.startswith("W")] == codes


def test_each_instance_shines():
    more = """
def PointInstancer "Points"
{
    point3f[] positions = [(0, 0, 5), (9, 0, 5)]
    int[] protoIndices = [0, 0]
    rel prototypes = </Lamp>
}
"""
    lights = _scene(more=more).lights
    assert [light.path for light in lights] == ["/Lamp", "/Points[0]", "/Points[1]"]
    assert lights[2].world_from_light[:3, 3].tolist() == [9, 0, 5]
    assert all(light.triangles is not None for light in lights)
