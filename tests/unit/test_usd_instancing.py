# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Native instances and PointInstancers, against what USD itself computes for the same stage."""

import numpy as np
import pytest
from pxr import Gf, Usd, UsdGeom, Vt

from warp_rt.errors import LimitError
from warp_rt.scene import Scene
from warp_rt.usd.load import load_stage

from ..stages import stage_of

TRIANGLE = """
    point3f[] points = [(0,0,0), (1,0,0), (0,1,0)]
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    uniform token subdivisionScheme = "none"
"""


def translate(x: float, y: float = 0, z: float = 0) -> str:
    return f'double3 xformOp:translate = ({x}, {y}, {z})\nuniform token[] xformOpOrder = ["xformOp:translate"]\n'


def load(body: str) -> Scene:
    return load_stage(stage_of(body))


def codes(scene: Scene) -> list[str]:
    return [record.code for record in scene.diagnostics]


def names(scene: Scene) -> list[str]:
    return [scene.instance_paths[row] if row >= 0 else "" for row in scene.instances.instance_id]


def places(scene: Scene) -> dict[str, list[float]]:
    """Translation of each instance by its path; the prim's where it is not instanced."""
    keys = [name or scene.prims[prim] for name, prim in zip(names(scene), scene.instances.prim, strict=True)]
    assert len(set(keys)) == len(keys)
    return dict(zip(keys, scene.instances.world_from_local[:, :3, 3].tolist(), strict=True))


# --- native instances

PROTOTYPE = f"""
class Xform "P" {{
    def Mesh "m" {{ {TRIANGLE} {translate(0, 1)} }}
}}
"""


GOLD = """
def Material "Gold" {
    token outputs:surface.connect = </Gold/s.outputs:surface>
    def Shader "s" {
        uniform token info:id = "UsdPreviewSurface"
        token outputs:surface
    }
}
"""


def instance(name: str, x: float, extra: str = "") -> str:
    return f'def Xform "{name}" (instanceable = true\n references = </P>) {{ {translate(x)} {extra}\n }}\n'


def test_native_instances_share_one_mesh_and_have_paths_of_their_own() -> None:
    scene = load(PROTOTYPE + instance("a", 1) + instance("b", 2))
    assert len(scene.meshes) == 1
    assert places(scene) == {"/a": [1, 1, 0], "/b": [2, 1, 0]}
    assert [scene.prims[row] for row in scene.instances.prim] == ["/a/m", "/a/m"]


def test_nested_native_instances_stand_where_usd_puts_their_proxies() -> None:
    body = PROTOTYPE + 'class Xform "Q" {\n' + instance("one", 10) + instance("two", 20) + "}\n"
    body += instance("a", 1).replace("</P>", "</Q>") + instance("b", 2).replace("</P>", "</Q>")
    stage = stage_of(body)
    scene = load_stage(stage)
    assert len(scene.meshes) == 1
    found = places(scene)
    cache = UsdGeom.XformCache(0)
    meshes = [prim for prim in stage.Traverse(Usd.TraverseInstanceProxies()) if prim.IsA(UsdGeom.Mesh)]
    expected = {
        str(prim.GetParent().GetPath()): list(cache.GetLocalToWorldTransform(prim).ExtractTranslation())
        for prim in meshes
    }
    assert len(expected) == 4
    assert found == expected


def test_instances_hand_down_colour_purpose_and_material() -> None:
    red = 'color3f[] primvars:displayColor = [(1, 0, 0)] (interpolation = "constant")\n'
    bound = instance("b", 3, "rel material:binding = </Gold>").replace(
        "instanceable = true", 'prepend apiSchemas = ["MaterialBindingAPI"]\ninstanceable = true'
    )
    scene = load(
        PROTOTYPE
        + instance("a", 1, red)
        + bound
        + instance("c", 4)
        + instance("guide", 5, 'token purpose = "guide"')
        + instance("hidden", 6, 'token visibility = "invisible"')
        + GOLD
    )
    assert set(places(scene)) == {"/a", "/b", "/c"}
    assert len(scene.meshes) == 1
    row = {name: k for k, name in enumerate(names(scene))}
    color = scene.instances.primvars["displayColor"]
    assert color[row["/a"]].tolist() == [1, 0, 0]
    assert np.isnan(color[[row["/b"], row["/c"]]]).all()
    material = scene.instances.material_table[scene.instances.material_offset]
    assert scene.materials[material[row["/b"]]].path == "/Gold"
    assert scene.materials[material[row["/c"]]].path != "/Gold"


def test_what_the_prototype_says_itself_precedes_what_instances_hand_down() -> None:
    red = 'color3f[] primvars:displayColor = [(1, 0, 0)] (interpolation = "constant")\n'
    green = red.replace("(1, 0, 0)", "(0, 1, 0)")
    scene = load(PROTOTYPE.replace('def Mesh "m" {', f'def Mesh "m" {{ {green}') + instance("a", 1, red))
    assert not np.isfinite(scene.instances.primvars.get("displayColor", np.full(3, np.nan))).any()
    assert scene.meshes[0].primvars["displayColor"].values.tolist() == [[0, 1, 0]]


def test_a_reset_stack_in_a_prototype_stands_still_in_every_instance() -> None:
    reset = translate(7, 7, 7).replace('["', '["!resetXformStack!", "')
    body = PROTOTYPE.replace(translate(0, 1), reset) + instance("a", 1) + instance("b", 2)
    body += 'class Xform "Q" {\n' + instance("one", 10) + "}\n" + instance("c", 3).replace("</P>", "</Q>")
    scene = load(body)
    np.testing.assert_allclose(scene.instances.world_from_local[:, :3, 3], np.full((3, 3), 7.0))
    assert len(scene.meshes) == 1


def test_lights_and_cameras_of_instances_are_placed_by_each() -> None:
    scene = load(
        'class Xform "P" {\ndef SphereLight "l" {}\ndef Camera "c" {}\n}\n' + instance("a", 1) + instance("b", 2)
    )
    assert {light.path: light.world_from_light[0, 3] for light in scene.lights} == {"/a/l": 1, "/b/l": 2}
    assert {camera.path: camera.world_from_camera[0, 3] for camera in scene.cameras} == {"/a/c": 1, "/b/c": 2}


def bomb(levels: int, is_instanced: bool = True) -> str:
    flag = "instanceable = true\n" if is_instanced else ""
    body = f'class Xform "L0" {{ def Mesh "m" {{ {TRIANGLE} }}\n }}\n'
    for level in range(1, levels + 1):
        children = "\n".join(f'def Xform "c{k}" ({flag}references = </L{level - 1}>) {{ }}' for k in range(10))
        body += f'class Xform "L{level}" {{ {children}\n }}\n'
    return body + f'def Xform "World" ({flag}references = </L{levels}>) {{ }}\n'


def test_a_hundred_million_nested_instances_are_refused_at_once() -> None:
    with pytest.raises(LimitError, match="10000000 instances"):
        load(bomb(8))
    assert len(load(bomb(3)).instances) == 1000


# --- PointInstancers


def instancer(extra: str, prototypes: str = "") -> str:
    return f"""
    def PointInstancer "I" {{
        rel prototypes = [</I/protos/p>, </I/protos/q>]
        {extra}
        def Scope "protos" {{
            def Mesh "p" {{ {TRIANGLE} {translate(0, 0, 5)} }}
            def Mesh "q" {{ {TRIANGLE} }}
            {prototypes}
        }}
    }}
    """


def test_instances_are_scaled_then_turned_then_moved_with_the_prototypes_own_transform() -> None:
    stage = stage_of(
        instancer(
            """
            int[] protoIndices = [0, 1, 0]
            point3f[] positions = [(1, 0, 0), (2, 0, 0), (3, 0, 0)]
            quath[] orientations = [(1, 0, 0, 0), (0.5, 0.5, 0.5, 0.5), (0.5, -0.5, 0.5, -0.5)]
            float3[] scales = [(1, 2, 3), (2, 2, -2), (1, 1, 4)]
            """
            + translate(100)
        )
    )
    scene = load_stage(stage)
    assert codes(scene) == []
    schema = UsdGeom.PointInstancer(stage.GetPrimAtPath("/I"))
    expected = np.array(schema.ComputeInstanceTransformsAtTime(0, 0)).transpose(0, 2, 1)
    expected[:, 0, 3] += 100
    order = [int(name[3:-1]) for name in names(scene)]
    assert sorted(order) == [0, 1, 2]
    np.testing.assert_allclose(scene.instances.world_from_local, expected[order], atol=1e-6)
    np.testing.assert_allclose(places(scene)["/I[0]"], [101, 0, 15], atol=1e-6)
    assert {scene.prims[row] for row in scene.instances.prim} == {"/I/protos/p", "/I/protos/q"}
    assert len(scene.meshes) == 2


def test_orientations_are_rotations_whatever_their_length() -> None:
    body = "int[] protoIndices = [1, 1]\npoint3f[] positions = [(0, 0, 0), (1, 0, 0)]\n"
    scene = load(instancer(body + "quatf[] orientationsf = [(2, 0, 0, 2), (0, 0, 0, 0)]"))
    quarter_about_z = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    for name, expected in (("/I[0]", quarter_about_z), ("/I[1]", np.eye(3))):
        matrix = scene.instances.world_from_local[names(scene).index(name), :3, :3]
        np.testing.assert_allclose(matrix, expected, atol=1e-12)


def test_single_precision_orientations_precede() -> None:
    scene = load(
        instancer(
            """
            int[] protoIndices = [1]
            point3f[] positions = [(0, 0, 0)]
            quath[] orientations = [(1, 0, 0, 0)]
            quatf[] orientationsf = [(0, 0, 0, 1)]
            """
        )
    )
    np.testing.assert_allclose(np.diag(scene.instances.world_from_local[0]), [-1, -1, 1, 1], atol=1e-12)


@pytest.mark.parametrize(("earliest", "angle"), [("[(0, 0, 0, 1)]", 0), ("[]", 180)])
def test_the_earliest_sample_decides_which_orientations_count(earliest: str, angle: float) -> None:
    """Says the schema of ``orientationsf``; where they count and are empty, nothing is turned."""
    body = f"""def PointInstancer "I" {{
        rel prototypes = </I/m>
        int[] protoIndices = [0]
        point3f[] positions = [(0, 0, 0)]
        quath[] orientations = [(0, 0, 0, 1)]
        quatf[] orientationsf.timeSamples = {{ 1: {earliest}, 2: [] }}
        def Mesh "m" {{ {TRIANGLE} }}
    }}"""
    matrix = load_stage(stage_of(body), time=2.0).instances.world_from_local[0]
    assert matrix[0, 0] == pytest.approx(np.cos(np.radians(angle)))


def test_invisible_and_inactive_ids_hide_instances() -> None:
    body = """
        int64[] ids = [10, 20, 30, 40]
        int64[] invisibleIds = [20]
        int[] protoIndices = [0, 0, 1, 1]
        point3f[] positions = [(0,0,0), (1,0,0), (2,0,0), (3,0,0)]
    """
    scene = load(instancer(body).replace('"I" {', '"I" (inactiveIds = [40]) {', 1))
    assert set(names(scene)) == {"/I[0]", "/I[2]"}
    # Without ids the position in the arrays is the id.
    scene = load(instancer(body.replace("int64[] ids = [10, 20, 30, 40]", "").replace("[20]", "[3]")))
    assert set(names(scene)) == {"/I[0]", "/I[1]", "/I[2]"}


def test_primvars_of_the_instancer_differ_by_instance_and_precede_the_prototypes() -> None:
    scene = load(
        instancer(
            """
            int[] protoIndices = [0, 2, 0, 2]
            point3f[] positions = [(0,0,0), (1,0,0), (2,0,0), (3,0,0)]
            color3f[] primvars:displayColor = [(1,0,0), (0,1,0)] (interpolation = "vertex")
            int[] primvars:displayColor:indices = [0, 1, 1, 0]
            float[] primvars:shade = [9] (interpolation = "constant")
            """,
            """def Sphere "s" {
                color3f[] primvars:displayColor = [(0, 0, 1)]
            }""",
        ).replace("</I/protos/q>]", "</I/protos/q>, </I/protos/s>]")
    )
    color = dict(zip(names(scene), scene.instances.primvars["displayColor"].tolist(), strict=True))
    assert color == {"/I[0]": [1, 0, 0], "/I[1]": [0, 1, 0], "/I[2]": [0, 1, 0], "/I[3]": [1, 0, 0]}
    assert (scene.instances.primvars["shade"] == 9).all()


def test_instancers_nest_and_the_inner_ones_primvars_precede() -> None:
    body = f"""
    def PointInstancer "outer" {{
        rel prototypes = </inner>
        int[] protoIndices = [0, 0]
        point3f[] positions = [(0, 0, 0), (100, 0, 0)]
        float[] primvars:a = [1, 2] (interpolation = "vertex")
        float[] primvars:b = [1, 2] (interpolation = "vertex")
    }}
    class PointInstancer "inner" {{
        rel prototypes = </inner/m>
        int[] protoIndices = [0, 0]
        point3f[] positions = [(0, 10, 0), (0, 20, 0)]
        float[] primvars:b = [7, 8] (interpolation = "varying")
        def Mesh "m" {{ {TRIANGLE} {translate(0, 0, 3)} }}
    }}
    """
    scene = load(body)
    assert places(scene) == {
        "/outer[0][0]": [0, 10, 3],
        "/outer[0][1]": [0, 20, 3],
        "/outer[1][0]": [100, 10, 3],
        "/outer[1][1]": [100, 20, 3],
    }
    order = np.argsort(names(scene))
    assert scene.instances.primvars["a"][order, 0].tolist() == [1, 1, 2, 2]
    assert scene.instances.primvars["b"][order, 0].tolist() == [7, 8, 7, 8]


@pytest.mark.parametrize(
    ("above", "own", "color"),
    [
        ("", "", [1, 0, 0]),
        ("color3f[] primvars:displayColor = [(0, 0, 1)]", "", [1, 0, 0]),  # the instance's root is nearer
        ("", "color3f[] primvars:displayColor = [(0, 1, 0)]", None),  # the mesh's own, which no instance changes
    ],
)
@pytest.mark.parametrize("interpolation", ["constant", "uniform"])
def test_constants_of_an_instancer_are_applied_at_the_root_of_instances_wherever_it_is(
    above: str, own: str, color: list[float] | None, interpolation: str
) -> None:
    """The schema's section "Primvars on PointInstancer": constant or uniform, the entire value applies to each."""
    body = f"""
    def PointInstancer "I" {{
        rel prototypes = [</I/m>, </P/m>]
        int[] protoIndices = [0, 1]
        point3f[] positions = [(1, 0, 0), (2, 0, 0)]
        color3f[] primvars:displayColor = [(1, 0, 0)] (interpolation = "{interpolation}")
        def Mesh "m" {{ {TRIANGLE}
            {own}
        }}
    }}
    over "P" {{
        {above}
        def Mesh "m" {{ {TRIANGLE}
            {own}
        }}
    }}
    """
    scene = load(body)
    assert codes(scene) == []
    given = scene.instances.primvars.get("displayColor", np.full((2, 3), np.nan))
    if color is None:
        assert np.isnan(given).all()
        assert all(scene.meshes[row].primvars["displayColor"].values.tolist() == [[0, 1, 0]] for row in (0, 1))
    else:
        assert given.tolist() == [color, color]


@pytest.mark.parametrize(
    ("shelf", "above"),
    [
        ("color3f[] primvars:displayColor = [(0, 1, 0)]", "color3f[] primvars:displayColor = [(0, 0, 1)]"),
        ("color3f[] primvars:displayColor = [(0, 1, 0)]", ""),
        ("", "color3f[] primvars:displayColor = [(0, 0, 1)]"),
        (
            'color3f[] primvars:displayColor = [(0, 1, 0)] (interpolation = "vertex")',
            "color3f[] primvars:displayColor = [(0, 0, 1)]",
        ),
    ],
)
def test_what_stands_between_an_instancer_and_its_prototype_hands_down_as_namespace_does(
    shelf: str, above: str
) -> None:
    stage = stage_of(
        f"""
        def Xform "W" {{
            {above}
            def PointInstancer "I" {{
                rel prototypes = </W/I/shelf/m>
                int[] protoIndices = [0]
                point3f[] positions = [(1, 0, 0)]
                def Scope "shelf" {{
                    {shelf}
                    def Mesh "m" {{ {TRIANGLE} }}
                }}
            }}
        }}
        """
    )
    found = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/W/I/shelf/m")).FindPrimvarWithInheritance("displayColor")
    given = load_stage(stage).instances.primvars.get("displayColor", np.full((1, 3), np.nan))
    np.testing.assert_array_equal(given, found.Get() if found else [[np.nan] * 3])


@pytest.mark.parametrize("outer", ["native", "instancer"])
def test_prototypes_that_stand_elsewhere_inherit_nothing_from_where_they_are_repeated(outer: str) -> None:
    """As without anything around the instancer: USD's inheritance goes by namespace alone."""
    inner = """
        rel prototypes = </P>
        int[] protoIndices = [0]
        point3f[] positions = [(1, 0, 0)]
    """
    around = {
        "native": 'def Xform "a" (instanceable = true\n references = </Asset>) {}',
        "instancer": """def PointInstancer "a" {
            rel prototypes = </W/a/p>
            int[] protoIndices = [0]
            point3f[] positions = [(1, 0, 0)]
            def PointInstancer "p" (references = </Asset/I>) {}
        }""",
    }
    scene = load(
        f"""
        class Xform "Asset" {{
            def PointInstancer "I" {{ {inner} }}
        }}
        def Xform "W" {{
            color3f[] primvars:displayColor = [(0, 0, 1)]
            {around[outer]}
        }}
        class Mesh "P" {{ {TRIANGLE} }}
        """
    )
    assert len(scene.instances) == 1
    assert np.isnan(scene.instances.primvars.get("displayColor", np.full((1, 3), np.nan))).all()


def test_several_uniform_values_of_an_instancer_are_no_values_by_instance() -> None:
    scene = load(
        f"""def PointInstancer "I" {{
            rel prototypes = </I/m>
            int[] protoIndices = [0, 0]
            point3f[] positions = [(1, 0, 0), (2, 0, 0)]
            float[] primvars:a = [7, 8] (interpolation = "uniform")
            def Mesh "m" {{ {TRIANGLE} }}
        }}"""
    )
    assert (scene.instances.primvars["a"].tolist(), codes(scene)) == ([[7], [7]], ["W106"])


@pytest.mark.parametrize(
    ("above", "of_instancer", "is_drawn"),
    [("guide", "", False), ("", "guide", False), ("render", "guide", False), ("default", "guide", True)],
)
def test_purposes_above_a_prototype_elsewhere_precede_that_of_its_instancer(
    above: str, of_instancer: str, is_drawn: bool
) -> None:
    """A prim's purpose comes from its namespace; where nothing says one there, from the instancer."""
    purpose = 'uniform token purpose = "%s"'
    body = f"""
    def PointInstancer "I" {{
        {purpose % of_instancer if of_instancer else ""}
        rel prototypes = </P/Q/m>
        int[] protoIndices = [0]
        point3f[] positions = [(1, 0, 0)]
    }}
    def Scope "P" {{
        {purpose % above if above else ""}
        over "Q" {{ def Mesh "m" {{ {TRIANGLE} }}
        }}
    }}
    """
    assert (names(load(body)) == ["/I[0]"]) is is_drawn
    seen = load_stage(stage_of(body), purposes=(above or of_instancer,))
    assert names(seen) == ["/I[0]"]


def test_prototypes_below_what_is_invisible_are_repeated_with_their_lights() -> None:
    """As geometry is, in Hydra too: their own visibility hides prototypes, and not that of the shelf they stand on."""
    scene = load(
        f"""
        def PointInstancer "I" {{
            rel prototypes = </I/shelf/p>
            int[] protoIndices = [0]
            point3f[] positions = [(10, 0, 0)]
            def Scope "shelf" {{
                token visibility = "invisible"
                def Xform "p" {{
                    def Mesh "m" {{ {TRIANGLE} }}
                    def SphereLight "lamp" {{ {translate(0, 0, 2)} }}
                    def SphereLight "off" {{ token visibility = "invisible"
                    }}
                }}
            }}
        }}
        """
    )
    assert places(scene) == {"/I[0]": [10, 0, 0]}
    assert [(light.path, light.world_from_light[:3, 3].tolist()) for light in scene.lights] == [
        ("/I[0]/lamp", [10, 0, 2])
    ]


def test_prototypes_may_be_native_instances_overs_and_prims_elsewhere() -> None:
    body = (
        PROTOTYPE
        + f"""
    def PointInstancer "I" {{
        rel prototypes = [</native>, </undefined/p>, </visible>]
        int[] protoIndices = [0, 1, 2]
        point3f[] positions = [(10, 0, 0), (20, 0, 0), (30, 0, 0)]
    }}
    over "undefined" {{
        def Xform "p" {{ def Mesh "m" {{ {TRIANGLE} }}
        }}
    }}
    def Mesh "visible" {{ {TRIANGLE} {translate(0, 0, 1)} }}
    """
        + instance("native", 4)
    )
    assert places(load(body)) == {
        "/I[0]": [14, 1, 0],
        "/I[1]": [20, 0, 0],
        "/I[2]": [30, 0, 1],
        "/visible": [0, 0, 1],
        "/native": [4, 1, 0],
    }


def test_what_usd_passes_over_below_instances_is_noted() -> None:
    """Opinions below an instance count in what it refers to alone, of which variants of its own are part."""
    body = (
        PROTOTYPE
        + f"""
    def "plain" (
        instanceable = true
        references = </P>
        variants = {{ string v = "a" }}
        prepend variantSets = "v"
    ) {{
        {translate(1)}
        variantSet "v" = {{
            "a" {{
                over "m" {{ {translate(0, 7)} }}
            }}
        }}
    }}
    def "changed" (
        instanceable = true
        references = </P>
    ) {{
        over "m" {{ {translate(0, 9)} }}
        over "n" {{ }}
    }}
    """
    )
    scene = load(body)
    assert places(scene) == {"/plain": [1, 7, 0], "/changed": [0, 1, 0]}
    assert [(record.code, record.prim) for record in scene.diagnostics] == [("N922", "/changed")]
    assert "about m, n below" in scene.diagnostics[0].message


def test_what_is_below_an_instancer_and_no_prototype_is_noted_once() -> None:
    body = f"""
    def PointInstancer "I" {{
        rel prototypes = [</I/P/m>, </I/Q>]
        int[] protoIndices = [0, 1]
        point3f[] positions = [(1, 0, 0), (2, 0, 0)]
        def Scope "P" {{
            def Mesh "m" {{ {TRIANGLE}
                def Mesh "child" {{ {TRIANGLE} }}
            }}
            def Mesh "spare" {{ {TRIANGLE} }}
            def Scope "empty" {{ }}
        }}
        def Xform "Q" {{
            def Mesh "m" {{ {TRIANGLE} }}
        }}
        over "O" {{
            def Mesh "m" {{ {TRIANGLE} }}
        }}
        def SphereLight "light" {{ }}
    }}
    """
    scene = load(body)
    assert len(scene.instances) == 3
    assert scene.lights == ()
    assert [(record.code, record.prim) for record in scene.diagnostics] == [("N923", "/I")]
    assert scene.diagnostics[0].message.startswith("/I/P/spare and 1 more prim below it")


def test_what_stands_between_an_instancer_and_its_prototypes_and_does_not_count_is_noted() -> None:
    body = f"""
    def PointInstancer "I" {{
        rel prototypes = [</I/P/m>, </I/Still/m>, </I/Wrong/m>]
        int[] protoIndices = [0, 1, 2]
        point3f[] positions = [(1, 0, 0), (2, 0, 0), (3, 0, 0)]
        def Xform "P" {{
            double3 xformOp:translate = (0, 5, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"]
            token visibilty = "invisible"
            rel purpose = </I>
            def Mesh "m" {{ {TRIANGLE} }}
        }}
        def Xform "Still" {{
            double3 xformOp:translate = (0, 0, 0)
            uniform token[] xformOpOrder = ["xformOp:translate"]
            def Mesh "m" {{ {TRIANGLE} }}
        }}
        def Xform "Wrong" {{
            string xformOp:translate = "(0, 5, 0)"
            uniform token[] xformOpOrder = ["xformOp:translate"]
            def Mesh "m" {{ {TRIANGLE} }}
        }}
        def DomeLight "dome" {{ }}
        def DistantLight "sun" {{ }}
    }}
    """
    scene = load(body)
    assert sorted(scene.instances.world_from_local[:, :3, 3].tolist()) == [[1, 0, 0], [2, 0, 0], [3, 0, 0]]
    assert scene.lights == ()
    assert scene.domes == ()
    others = [(record.code, record.prim) for record in scene.diagnostics if record.code != "N923"]
    assert others == [("N942", "/I/P"), ("W513", "/I/P.purpose")]
    assert [record.message for record in scene.diagnostics if record.code == "N923"] == [
        "/I/dome and 1 more prim below it, but of none of its prototypes: not drawn",
        "/I/P does not move its prototypes, whose own transform alone counts",
    ]


@pytest.mark.parametrize("is_plain_first", [True, False])
def test_class_prims_of_an_asset_show_in_prototypes_of_instancers_alone(is_plain_first: bool) -> None:
    """An asset that is instanced plainly and by an instancer is drawn by each as if the other were not there."""
    asset = f'class Xform "P" {{\nclass Mesh "m" {{ {TRIANGLE}\n}}\ndef Mesh "n" {{ {TRIANGLE}\n}}\n}}\n'
    plain = instance("plain", 4)
    repeated = f"""def PointInstancer "I" {{
        rel prototypes = </I/p>
        int[] protoIndices = [0]
        point3f[] positions = [(10, 0, 0)]
        {instance("p", 0)}
    }}
    """
    scene = load(asset + (plain + repeated if is_plain_first else repeated + plain))
    shown = [name.partition("[")[0] for name in names(scene)]
    assert sorted(shown) == ["/I", "/I", "/plain"]


@pytest.mark.parametrize("is_near_first", [True, False])
def test_a_prototype_below_one_instancer_and_elsewhere_to_another(is_near_first: bool) -> None:
    """Constants above the prototype colour it for both: handed down by one, inherited in its own place by the other."""
    arrays = "rel prototypes = </A/P>\nint[] protoIndices = [0]\npoint3f[] positions = [(0, 0, 0)]\n"
    near = f"""def PointInstancer "A" {{ {arrays}
        color3f[] primvars:displayColor = [(1, 0, 0)] (interpolation = "constant")
        def Mesh "P" {{ {TRIANGLE}
        }}
    }}
    """
    far = f'def PointInstancer "B" {{ {arrays} }}\n'
    scene = load(near + far if is_near_first else far + near)
    assert sorted(names(scene)) == ["/A[0]", "/B[0]"]
    assert scene.instances.primvars["displayColor"].tolist() == [[1, 0, 0]] * 2


def test_instancers_that_contain_each_other_are_cut_with_a_code() -> None:
    scene = load(
        f"""
        def PointInstancer "a" {{
            rel prototypes = </a/b>
            int[] protoIndices = [0]
            point3f[] positions = [(1, 0, 0)]
            def Xform "b" {{
                def Mesh "m" {{ {TRIANGLE} }}
                def PointInstancer "c" {{
                    rel prototypes = [</a/b>, </a>]
                    int[] protoIndices = [0, 1]
                    point3f[] positions = [(1, 0, 0), (2, 0, 0)]
                }}
            }}
        }}
        """
    )
    assert "W123" in codes(scene)
    assert "/a[0]" in places(scene)


@pytest.mark.parametrize(
    ("body", "code", "count"),
    [
        ("int[] protoIndices = [0, 5, -1]\npoint3f[] positions = [(0,0,0), (1,0,0), (2,0,0)]", "W121", 1),
        ("int[] protoIndices = [0, 1]\npoint3f[] positions = [(0,0,0)]", "W120", 0),
        ("int[] protoIndices = [0, 1]\npoint3f[] positions = [(0,0,0), (1,0,0), (2,0,0)]", "W120", 2),  # as Storm
        (
            "int[] protoIndices = [0, 1]\npoint3f[] positions = [(0,0,0), (1,0,0)]\nfloat3[] scales = [(1,1,1)]",
            "W120",
            2,
        ),
        ("int[] protoIndices = [0, 1]\npoint3f[] positions = [(0,0,0), (nan,0,0)]", "W122", 1),
        ("int[] protoIndices = [0]\npoint3f[] positions = [(0,0,0)]\nfloat3[] scales = [(1,0,1)]", "W122", 0),
        ("int[] protoIndices = [0, 1]\npoint3f[] positions = [(0,0,0), (1,0,0)]\nint64[] ids = [1]", "W120", 2),
        ("int[] protoIndices = [0]\npoint3f[] positions = [(0,0,0)]\nfloat3 scales = (1, 1, 1)", "W120", 1),
        ('string protoIndices = "x"', "W120", 0),
        ('int[] protoIndices = [0]\npoint3f[] positions = [(0,0,0)]\nstring invisibleIds = "0"', "W120", 1),
        ('int[] protoIndices = [0]\npoint3f[] positions = [(0,0,0)]\nstring ids = "0"', "W120", 1),
        ('int[] protoIndices = [0]\npoint3f[] positions = [(0,0,0)]\nstring velocities = "x"', "W120", 1),
    ],
)
def test_malformed_instances_are_left_out_with_a_code(body: str, code: str, count: int) -> None:
    scene = load(instancer(body))
    assert codes(scene) == [code, *["N905"] * (count == 0)]
    assert len(scene.instances) == count


def test_a_prototype_that_is_missing_is_named_and_an_empty_instancer_is_not() -> None:
    scene = load(
        instancer("int[] protoIndices = [0]\npoint3f[] positions = [(0,0,0)]").replace("</I/protos/p>", "</no>")
    )
    assert codes(scene) == ["N923", "W121", "N905"]
    scene = load(instancer(""))
    assert codes(scene) == ["N905"]
    assert len(scene.instances) == 0


@pytest.mark.parametrize("body", ["int[] scales = [2]", "float3[] orientations = [(1, 0, 0)]"])
def test_arrays_of_the_wrong_type_are_told_where_velocities_move_the_instances_too(body: str) -> None:
    scene = load(
        f"""
        def PointInstancer "I" {{
            rel prototypes = </I/m>
            int[] protoIndices = [0]
            point3f[] positions.timeSamples = {{ 0: [(1, 0, 0)] }}
            vector3f[] velocities.timeSamples = {{ 0: [(1, 0, 0)] }}
            {body}
            def Mesh "m" {{ {TRIANGLE} }}
        }}
        """
    )
    assert (places(scene), codes(scene)) == ({"/I[0]": [1, 0, 0]}, ["W120"])


def test_velocities_move_instances_between_samples() -> None:
    stage = stage_of(
        instancer(
            """
            int[] protoIndices = [1, 1]
            point3f[] positions.timeSamples = { 0: [(0,0,0), (1,0,0)], 10: [(5,5,5), (6,6,6)] }
            vector3f[] velocities.timeSamples = { 0: [(24,0,0), (0,48,0)], 10: [(0,0,0), (0,0,0)] }
            """
        )
    )
    scene = load_stage(stage, time=2.0)  # 24 time codes a second: velocities count for 1/12 s
    np.testing.assert_allclose(sorted(places(scene).values()), [[1, 4, 0], [2, 0, 0]], atol=1e-5)


def test_seventy_thousand_instances_agree_with_usd() -> None:
    rng = np.random.default_rng(7)
    count = 70_000
    stage = Usd.Stage.CreateInMemory()
    schema = UsdGeom.PointInstancer.Define(stage, "/I")
    UsdGeom.Sphere.Define(stage, "/I/a")
    UsdGeom.Cube.Define(stage, "/I/b")
    schema.CreatePrototypesRel().SetTargets(["/I/a", "/I/b"])
    kind = rng.integers(0, 2, count).astype(np.int32)
    schema.CreateProtoIndicesAttr(Vt.IntArray.FromNumpy(kind))
    schema.CreatePositionsAttr(Vt.Vec3fArray.FromNumpy(rng.normal(size=(count, 3)).astype(np.float32)))
    schema.CreateScalesAttr(Vt.Vec3fArray.FromNumpy(rng.uniform(0.5, 2, (count, 3)).astype(np.float32)))
    quaternions = [Gf.Quatf(*map(float, q)).GetNormalized() for q in rng.normal(size=(100, 4))]
    schema.CreateOrientationsfAttr(Vt.QuatfArray(quaternions * (count // 100)))
    scene = load_stage(stage)
    assert len(scene.instances) == count
    expected = np.array(schema.ComputeInstanceTransformsAtTime(0, 0)).transpose(0, 2, 1)
    order = np.array([int(name[3:-1]) for name in names(scene)])
    # The unit shapes have radius 1 and size 2, USD's defaults, so that their own scale is one.
    np.testing.assert_allclose(scene.instances.world_from_local, expected[order], atol=1e-5)


@pytest.mark.parametrize(
    ("interpolation", "value", "inherited"), [("uniform", "[(0, 1, 0)]", None), ("constant", "None", 1)]
)
def test_a_primvar_of_its_own_elements_hides_what_instances_would_hand_down(
    interpolation: str, value: str, inherited: float | None
) -> None:
    """As USD's FindPrimvarWithInheritance has it; a blocked value hides nothing."""
    stage = Usd.Stage.CreateInMemory()
    assert stage.GetRootLayer().ImportFromString(
        f"""#usda 1.0
        class Xform "asset" {{
            def Xform "part" {{
                color3f[] primvars:displayColor = {value} (interpolation = "{interpolation}")
                def Sphere "ball" {{}}
            }}
        }}
        def Xform "i" (inherits = </asset>
            instanceable = true) {{
            color3f[] primvars:displayColor = [(1, 0, 0)] (interpolation = "constant")
        }}
        """
    )
    ball = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath("/i/part/ball")).FindPrimvarWithInheritance("displayColor")
    assert bool(ball and ball.Get()) == (inherited is not None)
    scene = load_stage(stage)
    found = scene.instances.primvars.get("displayColor")
    assert (None if found is None else found[0, 0]) == inherited


ASSET = f"""
class "Asset" (prepend apiSchemas = ["MaterialBindingAPI", "CollectionAPI:c"])
{{
    rel material:binding = </Asset/Looks/Red>
    rel material:binding:collection:c = [</Asset.collection:c>, </Asset/Looks/Red>]
    rel collection:c:includes = </Asset/Leaf>
    def Mesh "Leaf" {{{TRIANGLE}}}
    def Scope "Looks"
    {{
        def Material "Red"
        {{
            token outputs:surface.connect = </Asset/Looks/Red/S.outputs:surface>
            def Shader "S"
            {{
                uniform token info:id = "UsdPreviewSurface"
                token outputs:surface
            }}
        }}
    }}
}}
"""


def test_assets_that_bind_their_own_materials_share_one_copy():
    """What is said at their root names each instance's own path, and means the same in all of them."""
    copies = "".join(f'def "I{k}" (instanceable = true\nreferences = </Asset>) {{\n}}\n' for k in range(4))
    scene = load(ASSET + copies)
    assert (len(scene.instances), len(scene.meshes), len(scene.materials)) == (4, 1, 1)
    assert not [code for code in codes(scene) if code[0] == "W"]


def test_an_asset_that_is_bound_otherwise_where_it_stands_has_a_copy_of_its_own():
    own = 'rel material:binding = </Blue> (bindMaterialAs = "strongerThanDescendants")\n'
    blue = ASSET[ASSET.index("        def Material") : ASSET.rindex("    }\n}")].replace("Red", "Blue")
    blue = blue.replace("/Asset/Looks", "")
    copies = "".join(
        f'def "I{k}" (instanceable = true\nreferences = </Asset>) {{\n{own if k == 2 else ""}}}\n' for k in range(4)
    )
    scene = load(ASSET.replace("rel material:binding:collection:c", "rel unused") + copies + blue)
    table = scene.instances.material_table[scene.instances.material_offset]
    bound = {name: scene.materials[row].path for name, row in zip(names(scene), table, strict=True)}
    assert bound == {"/I0": "/I0/Looks/Red", "/I1": "/I0/Looks/Red", "/I2": "/Blue", "/I3": "/I0/Looks/Red"}
