# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The collections of a RenderPass, pixel by pixel: two walls, a mirror behind the eye, and a lamp."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Usd

import warp_rt
from warp_rt.usd.load import load_stage

WALL = """
def Mesh "{name}" (prepend apiSchemas = ["MaterialBindingAPI"])
{{
    point3f[] points = [({x}, -4, {z}), (4, -4, {z}), (4, 4, {z}), ({x}, 4, {z})]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    uniform token subdivisionScheme = "none"
    rel material:binding = </{material}>
}}
"""
MATERIAL = """
def Material "{name}"
{{
    token outputs:warp_rt:surface.connect = </{name}/S.outputs:surface>
    def Shader "S"
    {{
        uniform token info:id = "WhittedSurface"
        color3f inputs:ambient = ({ambient}, {ambient}, {ambient})
        color3f inputs:diffuse = ({diffuse}, {diffuse}, {diffuse})
        color3f inputs:reflection = ({mirror}, {mirror}, {mirror})
        token outputs:surface
    }}
}}
"""
# Seen along -Z, 4 x 4 pixels: a wall over the right half at distance 2, one over everything at distance 4.
STAGE = (
    '#usda 1.0\n(renderSettingsPrimPath = "/S"\n)\n'
    'def RenderSettings "S"\n{\n    color3f warp_rt:ambient = (1, 1, 1)\n    rel camera = </c>\n}\n'
    'def Camera "c"\n{\n    token projection = "orthographic"\n    float horizontalAperture = 40\n'
    "    float verticalAperture = 40\n}\n"
    'def Scope "walls"\n{'
    + WALL.format(name="near", x=0, z=-2, material="bright")
    + WALL.format(name="far", x=-4, z=-4, material="dark")
    + "}\n"
    + MATERIAL.format(name="bright", ambient=1, diffuse=0, mirror=0)
    + MATERIAL.format(name="dark", ambient=0.25, diffuse=0, mirror=0)
    + MATERIAL.format(name="mirror", ambient=0, diffuse=0, mirror=1)
    + MATERIAL.format(name="white", ambient=0, diffuse=1, mirror=0)
)
LAMP = 'def SphereLight "lamp"\n{\n    bool treatAsPoint = 1\n    token warp_rt:falloff = "none"\n}\n'


def stage(collections: str, more: str = "", text: str = STAGE) -> Usd.Stage:
    made = Usd.Stage.CreateInMemory()
    render_pass = f'def RenderPass "P"\n{{\n    rel renderSource = </S>\n{collections}\n}}\n'
    assert made.GetRootLayer().ImportFromString(text + more + render_pass)
    return made


def picture(made: Usd.Stage) -> warp_rt.Film:
    scene = load_stage(made, pass_path="/P")
    assert {record.code for record in scene.diagnostics} <= {"N905"}  # where nothing is left
    options = warp_rt.RenderOptions(width=4, height=4, aovs=("color", "depth"))
    return warp_rt.Renderer(scene, options, device="cpu").render()


def halves(left: float, right: float) -> np.ndarray:
    return np.tile([left, left, right, right], (4, 1))


@pytest.mark.parametrize(
    ("collections", "color", "alpha", "depth"),
    [
        ("", halves(0.25, 1), halves(1, 1), halves(4, 2)),
        ("rel collection:prune:includes = </walls/near>", halves(0.25, 0.25), halves(1, 1), halves(4, 4)),
        ("rel collection:prune:includes = </walls>", halves(0, 0), halves(0, 0), halves(np.inf, np.inf)),
        ("rel collection:renderVisibility:excludes = </walls/far>", halves(0, 1), halves(0, 1), halves(np.inf, 2)),
        (
            "uniform bool collection:renderVisibility:includeRoot = 0\n"
            "rel collection:renderVisibility:includes = </walls/far>",
            *(halves(0.25, 0.25), halves(1, 1), halves(4, 4)),
        ),
        (
            "uniform bool collection:renderVisibility:includeRoot = 0\n"
            'uniform pathExpression collection:renderVisibility:membershipExpression = "//near"',
            *(halves(0, 1), halves(0, 1), halves(np.inf, 2)),
        ),
        ("rel collection:cameraVisibility:excludes = </walls/near>", halves(0.25, 0.25), halves(1, 1), halves(4, 4)),
        # What holds out hides what is behind it, and is there for the depth.
        ("rel collection:matte:includes = </walls/near>", halves(0.25, 0), halves(1, 0), halves(4, 2)),
        ("rel collection:matte:includes = </walls/far>", halves(0, 1), halves(0, 1), halves(4, 2)),
        ("uniform bool collection:matte:includeRoot = 1", halves(0, 0), halves(0, 0), halves(4, 2)),
    ],
)
def test_collections_of_a_pass(collections, color, alpha, depth) -> None:
    film = picture(stage(collections))
    np.testing.assert_allclose(film.color[..., 0], color, atol=1e-6)
    np.testing.assert_array_equal(film.alpha, alpha)
    np.testing.assert_allclose(film.aovs["depth"], depth, rtol=1e-6)


def test_mirrors_show_what_the_camera_does_not_see_and_what_is_matte() -> None:
    """The far wall is a mirror, the near one hangs between it and the eye: its back is reflected on the right."""
    mirrored = STAGE.replace("</dark>", "</mirror>")
    hidden = picture(stage("rel collection:cameraVisibility:excludes = </walls/near>", text=mirrored))
    np.testing.assert_allclose(hidden.color[..., 0], halves(0, 1), atol=1e-6)
    # A matte wall beside the eye's view is light to the mirror like any other.
    behind = WALL.format(name="behind", x=-4, z=3, material="bright")
    matte = picture(stage("rel collection:matte:includes = </behind>", more=behind, text=mirrored))
    np.testing.assert_allclose(matte.color[..., 0], halves(1, 1), atol=1e-6)


def test_what_the_camera_does_not_see_casts_shadows() -> None:
    lit = STAGE.replace("</dark>", "</white>").replace("warp_rt:ambient = (1, 1, 1)", "warp_rt:ambient = (0, 0, 0)")
    film = picture(stage("rel collection:cameraVisibility:excludes = </walls/near>", more=LAMP, text=lit))
    # From the origin the near wall, x > 0, shadows the right half of the far one.
    assert (film.color[:, :2, 0] > 0.5).all()
    assert (film.color[:, 2:, 0] == 0).all()
    assert (film.alpha == 1).all()


def test_lights_and_domes_take_part() -> None:
    dome = 'def DomeLight "sky"\n{\n}\n'
    everything = load_stage(stage("", more=LAMP + dome), pass_path="/P")
    assert (len(everything.lights), [one.is_visible for one in everything.domes]) == (1, [True])
    for collection in ("prune:includes", "renderVisibility:excludes"):
        scene = load_stage(stage(f"rel collection:{collection} = [</lamp>, </sky>]", more=LAMP + dome), pass_path="/P")
        assert (scene.lights, scene.domes) == ((), ())
    unseen = load_stage(stage("rel collection:cameraVisibility:excludes = </sky>", more=LAMP + dome), pass_path="/P")
    assert (len(unseen.lights), [one.is_visible for one in unseen.domes]) == (1, [False])


@pytest.mark.parametrize(
    ("path", "left"),
    [("/set/post/lamp", 1), ("/shelf/lamp", 1), ("/set", 0), ("/set/post", 1), ("/shelf", 1), ("/walls", 2)],
)
def test_lights_of_copies_count_by_their_prototypes_and_instancers(path: str, left: int) -> None:
    lamps = f"""def PointInstancer "set"
        {{
            point3f[] positions = [(0, 0, 0), (1, 0, 0)]
            int[] protoIndices = [0, 1]
            rel prototypes = [</set/post>, </shelf>]
            def Xform "post"
            {{
                {LAMP}
            }}
        }}
        class Xform "shelf"
        {{
            {LAMP}
        }}
        """
    for collection in ("prune:includes", "renderVisibility:excludes"):
        scene = load_stage(stage(f"rel collection:{collection} = <{path}>", more=lamps), pass_path="/P")
        assert len(scene.lights) == left


def test_a_light_that_is_visible_is_hidden_from_the_eye_alone() -> None:
    """A rect light fills the view at distance 1; seen in the mirror behind it, it shines the other way, on to that."""
    more = (
        'def RectLight "panel"\n{\n    float inputs:width = 8\n    float inputs:height = 8\n'
        "    double3 xformOp:translate = (0, 0, -1)\n    double3 xformOp:rotateXYZ = (0, 180, 0)\n"
        '    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]\n}\n'
    )
    mirror = "rel collection:prune:includes = </walls/near>\n"
    for text, collections, color in (
        (more, "", 1.0),
        (more, "rel collection:cameraVisibility:excludes = </panel>", 0.0),
        # Behind the eye, shining away from it: what is reflected is met, not what is looked at.
        (more.replace("-1)", "1)").replace("180", "0"), "rel collection:cameraVisibility:excludes = </panel>", 1.0),
    ):
        made = stage(mirror + collections, more=text, text=STAGE.replace("</dark>", "</mirror>"))
        options = warp_rt.RenderOptions(width=4, height=4, lights_visible=True)
        film = warp_rt.Renderer(load_stage(made, pass_path="/P"), options, device="cpu").render()
        np.testing.assert_allclose(film.color[..., 0], color, atol=1e-5)


def test_pruned_meshes_take_no_memory_and_links_still_hold() -> None:
    linked = LAMP.replace("{\n", "{\n    rel collection:lightLink:excludes = </walls/far>\n", 1)
    scene = load_stage(stage("rel collection:prune:includes = </walls/near>", more=linked), pass_path="/P")
    assert (len(scene.meshes), len(scene.instances)) == (1, 1)
    assert scene.lights[0].receivers.tolist() == [False]


def test_without_the_pass_its_collections_do_not_count() -> None:
    scene = load_stage(stage("rel collection:prune:includes = </walls>"))
    assert len(scene.instances) == 2
    assert [record.code for record in scene.diagnostics] == ["N903"]


def test_a_collection_that_includes_itself_is_told_by_its_own_code() -> None:
    collection = "rel collection:prune:includes = [</walls/far>, </P.collection:prune>]"
    scene = load_stage(stage(collection), pass_path="/P")
    told = [(record.code, record.prim) for record in scene.diagnostics if record.is_warning]
    assert told == [("W527", "/P")]
