# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""MeshLightAPI: which triangles shine, how brightly, and what their material has to do with it."""

import numpy as np
import PIL.Image
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


def _material(scene):
    """Return the material that the first thing that is drawn has."""
    table = scene.instances.material_table[scene.instances.material_offset[0] :]
    return scene.materials[table[0]]


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
    is_lamp = mode == "noMaterialResponse"
    assert scene.lights[0].glows
    assert _scene(body).lights[0].glows == is_lamp
    drawn = _material(scene)
    emitted = tuple(scene.lights[0].radiance) if is_lamp else (0.5, 2, 4)
    assert drawn.inputs["emissiveColor"].value[:3] == pytest.approx(emitted)
    if is_lamp:  # the light is all that is seen of it
        assert not any(drawn.inputs[name].value[:3] != (0, 0, 0) for name in ("diffuseColor", "specularColor"))
        assert drawn.use_specular_workflow
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


def test_lights_know_what_draws_them():
    """Rows of instances, of a prim that is drawn several times, and of others beside it."""
    more = """
def PointInstancer "Points"
{
    point3f[] positions = [(0, 0, 5), (9, 0, 5)]
    int[] protoIndices = [0, 0]
    rel prototypes = </Lamp>
}
def Plane "Other" (prepend apiSchemas = ["MeshLightAPI"]) {}
def Plane "Last" {}
"""
    scene = _scene(more=more)
    for light in scene.lights:
        paths = {scene.prims[scene.instances.prim[row]] for row in light.drawn_by}
        assert paths == {"/Other" if light.path == "/Other" else "/Lamp"}
        assert len(light.drawn_by) == (1 if light.path == "/Other" else 3)


def test_shaped_lamps_are_black():
    """What a material emits is the same in all directions."""
    body = 'uniform token light:materialSyncMode = "noMaterialResponse"\nfloat inputs:shaping:focus = 2'
    scene = _scene(body, bound=True)
    assert not scene.lights[0].glows
    assert not any(_material(scene).inputs["emissiveColor"].value[:3])


# --- other geometry

SHAPES = [
    ("Cube", "double size = 3", 54),
    ("Plane", "double width = 2\ndouble length = 5", 10),
    ("Sphere", "double radius = 2", 16 * np.pi),
    ("Cylinder", "double radius = 2\ndouble height = 5", 28 * np.pi),
    ("Cone", "double radius = 3\ndouble height = 4", 24 * np.pi),
    ("Capsule", "double radius = 2\ndouble height = 5", 36 * np.pi),
    ("Points", "point3f[] points = [(0, 0, 0), (9, 0, 0)]\nfloat[] widths = [4, 2]", 20 * np.pi),
]


def _area(light):
    corners = light.triangles.astype(float)
    return np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2


def _shape(kind, body, api="LightAPI"):
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(f'#usda 1.0\ndef {kind} "L" (prepend apiSchemas = ["{api}"]) {{\n{body}\n}}')
    return load_stage(stage)


@pytest.mark.parametrize(("kind", "body", "area"), SHAPES, ids=[kind for kind, *_ in SHAPES])
def test_other_geometry_shines_with_its_own_power(kind, body, area):
    """Triangles lie outside of curved shapes, so that these do not shadow them; what is too much is taken back."""
    for normalize in (0, 1):
        scene = _shape(kind, f"{body}\nfloat inputs:intensity = 7\nbool inputs:normalize = {normalize}")
        (light,) = scene.lights
        assert not [d for d in scene.diagnostics if d.code.startswith("W")]
        assert light.kind == LightKind.MESH
        assert light.radiance[0] * _area(light) == pytest.approx(7 if normalize else 7 * area, rel=2e-4)
        assert light.glows  # LightAPI's materialSyncMode is noMaterialResponse
        assert light.is_double_sided == (kind == "Plane")  # the schema's own doubleSided


@pytest.mark.parametrize(("kind", "body"), [shape[:2] for shape in SHAPES[2:]], ids=[kind for kind, *_ in SHAPES[2:]])
def test_triangles_lie_outside_of_curved_shapes(kind, body):
    """Points all over them are in front of the shape as seen from outside, or on its flat faces."""
    corners = _shape(kind, body).lights[0].triangles.astype(float)
    weights = np.random.default_rng(1).dirichlet((1, 1, 1), 20)
    x, y, z = np.einsum("wc,nck->knw", weights, corners).reshape(3, -1)
    around = np.hypot(x, y)
    tiny = 1e-5
    if kind == "Sphere":
        assert (np.sqrt(around**2 + z**2) >= 2 - tiny).all()
    elif kind == "Points":
        assert (np.minimum(np.sqrt(around**2 + z**2) - 2, np.sqrt((x - 9) ** 2 + y**2 + z**2) - 1) >= -tiny).all()
    elif kind == "Capsule":
        assert (np.hypot(around, np.maximum(np.abs(z) - 2.5, 0)) >= 2 - tiny).all()
    elif kind == "Cylinder":
        assert (np.maximum(around - 2, np.abs(z) - 2.5) >= -tiny).all()
    else:
        assert (np.maximum(around - 3 * (2 - z) / 4, -z - 2) >= -tiny).all()


def test_curves_give_no_light():
    body = 'point3f[] points = [(0, 0, 0), (1, 0, 0)]\nint[] curveVertexCounts = [2]\nuniform token type = "linear"'
    scene = _shape("BasisCurves", body + "\nfloat[] widths = [0.1]")
    assert not scene.lights
    assert "a BasisCurves as a light is not supported" in next(d.message for d in scene.diagnostics if d.code == "W401")


def test_a_geometry_light_shines_where_its_geometry_is():
    """Shaped about its own axis, of its own intensity; in the space of the geometry, mirrored or not."""
    place = "double3 xformOp:translate = (0, 0, 5)\ndouble3 xformOp:scale = (-1, 2, 1)"
    order = 'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]'
    turned = 'float xformOp:rotateX = 90\nuniform token[] xformOpOrder = ["xformOp:rotateX"]'
    inputs = "rel geometry = </Quad>\nfloat inputs:intensity = 3\nbool inputs:normalize = 1"
    lamp = f'def GeometryLight "L" {{\n{inputs}\n{turned}\n}}'
    text = QUAD.replace("float inputs:intensity = 12\n    color3f inputs:color = (1, 0.5, 0.25)", f"{place}\n{order}")
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(f'#usda 1.0\ndef Mesh "Quad" {{{text}}}\n{lamp}')
    scene = load_stage(stage)
    (light,) = scene.lights
    assert light.radiance[0] == pytest.approx(3 / 12)
    matrix = light.world_from_light
    world = light.triangles @ matrix[:3, :3].T + matrix[:3, 3]
    np.testing.assert_allclose(sorted(world.reshape(-1, 3)[:, 2]), 5)
    normals = np.cross(world[:, 1] - world[:, 0], world[:, 2] - world[:, 0])
    np.testing.assert_allclose(normals / 2, [(0, 0, 6)] * 2, atol=1e-5)  # a mirrored mesh keeps its outside
    assert _material(scene).inputs["emissiveColor"].value[0] == pytest.approx(3 / 12)
    assert not [d for d in scene.diagnostics if d.code.startswith("W")]


# --- what materials emit, part by part

FOUR = """
    point3f[] points = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (1, 1, 0), (2, 1, 0),
        (0, 2, 0), (1, 2, 0), (2, 2, 0)]
    int[] faceVertexCounts = [4, 4, 4, 4]
    int[] faceVertexIndices = [0, 1, 4, 3, 1, 2, 5, 4, 3, 4, 7, 6, 4, 5, 8, 7]
    uniform token subdivisionScheme = "none"
    float inputs:intensity = 2
"""
READER = """
def Material "Read"
{
    token outputs:surface.connect = </Read/surface.outputs:surface>
    def Shader "surface"
    {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:emissiveColor.connect = </Read/glow.outputs:result>
        token outputs:surface
    }
    def Shader "glow"
    {
        uniform token info:id = "UsdPrimvarReader_float3"
        string inputs:varname = "glow"
        float3 inputs:fallback = (3, 2, 1)
        float3 outputs:result
    }
}
"""


def _parts(body, material="Read", kind="Mesh", more=""):
    """Return radiance by the centres of the triangles that have it, and the codes of the diagnostics."""
    stage = Usd.Stage.CreateInMemory()
    schemas = 'prepend apiSchemas = ["MeshLightAPI", "MaterialBindingAPI"]'
    lamp = f'def {kind} "Lamp" ({schemas}) {{{body}\nrel material:binding = </{material}>\n}}'
    stage.GetRootLayer().ImportFromString(f"#usda 1.0\n{GLOWING}{READER}{lamp}\n{more}")
    scene = load_stage(stage)
    found = [
        (light.radiance, {tuple(np.floor(place).astype(int)[:2].tolist()) for place in light.triangles.mean(axis=1)})
        for light in scene.lights
    ]
    return found, [d.code for d in scene.diagnostics if d.code[0] == "W" or d.code == "N918"]


def test_faces_that_emit_nothing_give_no_light():
    """The light's colour is what the material emits, times inputs:color: here nothing but on one subset."""
    subset = 'def GeomSubset "s" (prepend apiSchemas = ["MaterialBindingAPI"]) {\nuniform token elementType = "face"\n'
    subset += 'uniform token familyName = "materialBind"\nint[] indices = [0, 1, 2]\nrel material:binding = </Dark>\n}'
    dark = GLOWING.replace("Glow", "Dark").replace("(0.5, 2, 4)", "(0, 0, 0)")
    found, codes = _parts(f"{FOUR}\nbool inputs:normalize = 1\n{subset}", "Glow", more=dark)
    assert found == [(pytest.approx((0.25, 1, 2)), {(1, 1)})]  # normalised by the area of all of it
    assert codes == []


@pytest.mark.parametrize(
    ("primvar", "expected"),
    [
        ("", [((6, 4, 2), {(0, 0), (1, 0), (0, 1), (1, 1)})]),
        ('color3f[] primvars:glow = [(1, 0, 4)] (interpolation = "constant")', [((2, 0, 8), ...)]),
        (
            'color3f[] primvars:glow = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 0, 0)] (interpolation = "uniform")',
            [((0, 2, 0), {(0, 1)}), ((2, 0, 0), {(1, 0), (1, 1)})],
        ),
    ],
)
def test_faces_of_different_colours_are_lights_of_their_own(primvar, expected):
    found, codes = _parts(f"{FOUR}\n{primvar}")
    assert [radiance for radiance, _ in found] == [pytest.approx(radiance) for radiance, _ in expected]
    for (_, faces), (_, wanted) in zip(found, expected, strict=True):
        assert wanted is ... or faces == wanted
    assert codes == []


def test_what_varies_over_a_face_is_its_mean_over_the_faces_that_shine():
    values = ", ".join(f"({k}, {k}, 0)" for k in (0, 0, 3, 0, 0, 3, 0, 0, 3))
    found, codes = _parts(f'{FOUR}\ncolor3f[] primvars:glow = [{values}] (interpolation = "vertex")')
    assert found == [(pytest.approx((3, 3, 0)), {(1, 0), (1, 1)})]
    assert codes == ["N918"]


@pytest.mark.parametrize(("output", "radiance"), [("rgb", (2, 0, 2)), ("a", (128 / 255,) * 3)])
def test_a_texture_shines_by_what_the_faces_show_of_it(tmp_path, output, radiance):
    texels = np.zeros((2, 2, 4), np.uint8)
    texels[:, 1] = 255, 0, 255, 64
    PIL.Image.fromarray(texels).save(tmp_path / "half.png")
    right = ", ".join(f"(0.9, {v})" for v in (0, 0, 0, 0.5, 0.5, 0.5, 1, 1, 1))
    textured = GLOWING.replace("Glow", "Textured").replace(
        " = (0.5, 2, 4)", f".connect = </Textured/t.outputs:{output}>"
    )
    nodes = f"""    def Shader "t"
    {{
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @{tmp_path}/half.png@
        token inputs:wrapS = "clamp"
        token inputs:wrapT = "clamp"
        float2 inputs:st.connect = </Textured/st.outputs:result>
        float3 outputs:{output}
    }}
    def Shader "st"
    {{
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "st"
        float2 outputs:result
    }}
}}
"""
    place = f'texCoord2f[] primvars:st = [{right}] (interpolation = "vertex")'
    found, codes = _parts(f"{FOUR}\n{place}", "Textured", more=textured.rstrip()[:-1] + nodes)
    assert [radiance for radiance, _ in found] == [pytest.approx(radiance)]
    assert codes == []


def test_copies_that_have_their_own_glow_shine_by_it():
    more = """
def PointInstancer "Points"
{
    point3f[] positions = [(0, 0, 5), (9, 0, 5)]
    int[] protoIndices = [0, 0]
    rel prototypes = </Lamp>
    color3f[] primvars:glow = [(1, 0, 0), (0, 1, 0)] (interpolation = "vertex")
}
"""
    found, codes = _parts(f'{FOUR}\ntoken purpose = "default"', more=more)
    assert [radiance for radiance, _ in found] == [(6, 4, 2), (2, 0, 0), (0, 2, 0)]
    assert codes == []


@pytest.mark.parametrize(
    ("primvar", "radiance", "codes"),
    [
        ('[(1, 0, 0)] (interpolation = "constant")', (2, 0, 0), []),
        ('[(1, 0, 0), (0, 1, 0)] (interpolation = "vertex")', (0.4, 1.6, 0), ["N918"]),
    ],
)
def test_points_shine_by_the_mean_over_their_area(primvar, radiance, codes):
    points = "point3f[] points = [(0, 0, 0), (5, 0, 0)]\nfloat[] widths = [1, 2]\nfloat inputs:intensity = 2"
    found, told = _parts(f"{points}\ncolor3f[] primvars:glow = {primvar}", kind="Points")
    assert found[0][0] == pytest.approx(radiance, rel=0.01)  # of triangles that stand out of the balls
    assert told == codes


def test_emission_that_is_computed_where_rays_hit_tints_no_light():
    """It has inputs:intensity alone, which is 2."""
    placed = GLOWING.replace("Glow", "Placed").replace(" = (0.5, 2, 4)", ".connect = </Placed/p.outputs:out>")
    node = """    def Shader "p"
    {
        uniform token info:id = "ND_position_vector3"
        float3 outputs:out
    }
}
"""
    found, codes = _parts(FOUR, "Placed", more=placed.rstrip().removesuffix("}") + node)
    assert [color for color, _ in found] == [pytest.approx((2, 2, 2))]
    assert codes == ["N918"]
