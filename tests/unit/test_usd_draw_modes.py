# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Draw modes: which models are replaced, by what, and how cards hold their textures.

Truth is the text of UsdGeomModelAPI, and for what it leaves open, the frame of each card, Hydra's rule.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image as PilImage

from warp_rt import Renderer, RenderOptions
from warp_rt.scene import Mesh, Scene, ShapeKind, Shapes
from warp_rt.usd.draw_modes import LINE_WIDTH
from warp_rt.usd.load import load_stage

from ..stages import stage_of

API = 'prepend apiSchemas = ["GeomModelAPI"]'
EXTENT = "float3[] extentsHint = [(-1, -2, -3), (1, 2, 5)]"
LOW, HIGH = np.array([-1.0, -2, -3]), np.array([1.0, 2, 5])
FACES = ("XPos", "XNeg", "YPos", "YNeg", "ZPos", "ZNeg")
# The way each card faces, and where its texture's s and t grow, seen from there: X and Y cards stand up along Z.
FRAMES = {
    "XPos": ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    "XNeg": ((-1, 0, 0), (0, -1, 0), (0, 0, 1)),
    "YPos": ((0, 1, 0), (-1, 0, 0), (0, 0, 1)),
    "YNeg": ((0, -1, 0), (1, 0, 0), (0, 0, 1)),
    "ZPos": ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
    "ZNeg": ((0, 0, -1), (1, 0, 0), (0, -1, 0)),
}


def load(body: str, folder: Path | None = None, **options) -> Scene:
    if folder is None:
        return load_stage(stage_of(body), **options)
    file = folder / "stage.usda"
    file.write_text(f"#usda 1.0\n{body}\n")
    return load_stage(file, **options)


def model(body: str, *, kind: str = "component", name: str = "m") -> str:
    return f'def Xform "{name}" (kind = "{kind}"\n{API}) {{\n{EXTENT}\n{body}\ndef Sphere "s" {{}}\n}}\n'


def drawn(scene: Scene) -> set[str]:
    return {scene.prims[row] for row in scene.instances.prim}


def codes(scene: Scene) -> set[str]:
    return {record.code for record in scene.diagnostics} - {"N905"}


def only(scene: Scene) -> Mesh | Shapes:
    (row,) = scene.instances.mesh
    return scene.meshes[row]


def cards(scene: Scene) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return the normal, the points [4, 3] and the st [4, 2] of each card."""
    mesh = only(scene)
    assert isinstance(mesh, Mesh)
    st = mesh.primvars["cardsUv"]
    found = []
    for first in range(0, len(mesh.triangles), 2):
        a, b, c = mesh.points[mesh.triangles[first]].astype(float)
        normal = np.cross(b - a, c - a)
        corners = np.unique(mesh.triangles[first : first + 2])
        found.append((normal / np.linalg.norm(normal), mesh.points[corners].astype(float), st.values[corners]))
    return found


def paint(folder: Path, name: str, color: tuple[int, int, int, int] = (255, 0, 0, 255)) -> str:
    PilImage.new("RGBA", (4, 4), color).save(folder / f"{name}.png")
    return f"asset model:cardTexture{name} = @./{name}.png@\n"


# --- which models are replaced


@pytest.mark.parametrize(
    ("kind", "attributes", "is_replaced"),
    [
        ("component", 'uniform token model:drawMode = "bounds"', True),
        ("component", 'uniform token model:drawMode = "bounds"\nuniform bool model:applyDrawMode = false', False),
        ("component", 'uniform token model:drawMode = "default"\nuniform bool model:applyDrawMode = true', False),
        ("component", "uniform bool model:applyDrawMode = true", False),
        ("group", 'uniform token model:drawMode = "bounds"', False),
        ("group", 'uniform token model:drawMode = "bounds"\nuniform bool model:applyDrawMode = true', True),
        ("assembly", 'uniform token model:drawMode = "bounds"', False),
        ("subcomponent", 'uniform token model:drawMode = "bounds"\nuniform bool model:applyDrawMode = true', False),
    ],
)
def test_components_are_replaced_and_others_that_say_so(kind: str, attributes: str, is_replaced: bool) -> None:
    body = model(attributes, kind=kind)
    assert drawn(load(body)) == ({"/m"} if is_replaced else {"/m/s"})
    assert drawn(load(body, draw_modes=False)) == {"/m/s"}


def test_the_mode_is_inherited_by_models_below() -> None:
    scene = load(
        f"""
        def Xform "g" (kind = "group"
            {API}) {{
            uniform token model:drawMode = "origin"
            {model("", name="a")}
            {model('uniform token model:drawMode = "default"', name="b")}
            {model('uniform token model:drawMode = "inherited"', name="c")}
            def Sphere "no_model" {{}}
        }}
        """
    )
    assert drawn(scene) == {"/g/a", "/g/b/s", "/g/c", "/g/no_model"}


def test_an_unknown_mode_is_told() -> None:
    scene = load(model('uniform token model:drawMode = "hologram"'))
    assert (drawn(scene), codes(scene)) == ({"/m/s"}, {"W114"})


@pytest.mark.parametrize(
    "attribute",
    [
        "int model:drawMode = 7",
        'uniform token model:cardVisibility = "half"',
        'uniform token model:drawMode = "bounds"\nuniform string model:applyDrawMode = "yes"',
    ],
)
def test_values_that_are_none_of_the_schemas_are_told(attribute: str) -> None:
    assert codes(load(model(attribute))) == {"W114"}


def test_what_is_replaced_takes_its_lights_with_it_but_may_be_looked_from() -> None:
    """As usdrecord has it, which takes a camera from the stage, not from what is drawn of it."""
    body = 'uniform token model:drawMode = "bounds"\ndef SphereLight "l" {}\ndef Camera "c" {}'
    scene = load(model(body))
    assert (len(scene.lights), [camera.path for camera in scene.cameras]) == (0, ["/m/c"])


def test_the_stand_in_has_the_purpose_and_visibility_of_its_model() -> None:
    bounds = 'uniform token model:drawMode = "bounds"\n'
    assert drawn(load(model(bounds + 'uniform token purpose = "render"'))) == set()
    assert drawn(load(model(bounds + 'uniform token purpose = "render"'), purposes=("render",))) == {"/m"}
    assert drawn(load(model(bounds + 'token visibility = "invisible"'))) == set()


def test_instances_of_one_prototype_may_differ_in_mode() -> None:
    scene = load(
        f"""
        class Xform "asset" (kind = "group") {{
                {model("", name="part")}
        }}
        def "plain" (instanceable = true
            inherits = </asset>) {{}}
        def "boxed" (instanceable = true
            {API}
            inherits = </asset>) {{
                uniform token model:drawMode = "bounds"
            }}
        """
    )
    kinds = {
        scene.instance_paths[instance]: getattr(scene.meshes[mesh], "kind", None)
        for instance, mesh in zip(scene.instances.instance_id, scene.instances.mesh, strict=True)
    }
    assert kinds == {"/plain": ShapeKind.SPHERE, "/boxed": ShapeKind.LINEAR_TUBE}


def test_prototypes_have_the_mode_of_the_namespace_above_them() -> None:
    scene = load(
        f"""
        def PointInstancer "i" (kind = "group"
            {API}) {{
            uniform token model:drawMode = "bounds"
            int[] protoIndices = [0, 0]
            point3f[] positions = [(0,0,0), (9,0,0)]
            rel prototypes = </i/p/m>
            def Scope "p" (kind = "group") {{
                {model("")}
            }}
        }}
        """
    )
    assert drawn(scene) == {"/i/p/m"}
    np.testing.assert_allclose(scene.bounds()[:, 0], [-1, 10], atol=0.1)


def test_models_of_one_size_share_their_geometry() -> None:
    bounds = 'uniform token model:drawMode = "bounds"'
    scene = load(model(bounds, name="a") + model(bounds, name="b"))
    assert len(scene.meshes) == 1
    assert len(scene.instances) == 2


# --- lines


def test_bounds_are_the_twelve_edges_of_the_extent() -> None:
    scene = load(model('uniform token model:drawMode = "bounds"\nuniform float3 model:drawModeColor = (0.2, 0.4, 0.6)'))
    lines = only(scene)
    assert isinstance(lines, Shapes)
    assert lines.kind == ShapeKind.LINEAR_TUBE
    along = lines.points[:, 1] - lines.points[:, 0]
    assert ((along != 0).sum(axis=1) == 1).all()
    assert sorted(np.abs(along).sum(axis=1).tolist()) == [2] * 4 + [4] * 4 + [8] * 4
    corners, counts = np.unique(lines.points.reshape(-1, 3), axis=0, return_counts=True)
    assert counts.tolist() == [3] * 8
    assert {tuple(row) for row in corners.tolist()} == {(x, y, z) for x in (-1, 1) for y in (-2, 2) for z in (-3, 5)}
    np.testing.assert_allclose(2 * lines.radii, LINE_WIDTH * np.linalg.norm(HIGH - LOW), rtol=1e-6)
    np.testing.assert_allclose(scene.instances.primvars["displayColor"], [[0.2, 0.4, 0.6]], rtol=1e-6)


def test_the_extent_of_cards_is_the_earliest_and_of_bounds_that_of_the_frame() -> None:
    """ "For cross and box mode, the extents are calculated [...] at their earliest authored time" (GeomModelAPI)."""
    samples = "float3[] extentsHint.timeSamples = { 1: [(-1, -1, -1), (1, 1, 1)], 2: [(-3, -3, -3), (3, 3, 3)] }"
    box = 'uniform token model:cardGeometry = "box"'
    for mode, reach in (("bounds", 3), ("cards", 1)):
        body = model(f'uniform token model:drawMode = "{mode}"\n{box}').replace(EXTENT, samples)
        assert np.abs(only(load(body, time=2)).points).max() == reach


def test_bounds_of_what_has_no_hint_are_those_of_its_geometry() -> None:
    """Purposes default, proxy and render count, guides do not."""
    scene = load(
        f"""
        def Xform "m" (kind = "component"
            {API}) {{
            uniform token model:drawMode = "bounds"
            def Sphere "a" {{
                double radius = 2
            }}
            def Sphere "b" {{
                uniform token purpose = "render"
                double3 xformOp:translate = (5, 0, 0)
                uniform token[] xformOpOrder = ["xformOp:translate"]
            }}
            def Sphere "c" {{
                uniform token purpose = "guide"
                double radius = 50
            }}
        }}
        """
    )
    points = only(scene).points.reshape(-1, 3)
    np.testing.assert_array_equal([points.min(axis=0), points.max(axis=0)], [(-2, -2, -2), (6, 2, 2)])


def test_a_flat_box_has_no_edges_without_length() -> None:
    body = model('uniform token model:drawMode = "bounds"').replace(EXTENT, "float3[] extentsHint = [(0,0,0), (1,1,0)]")
    assert len(only(load(body)).points) == 8


def test_an_empty_model_is_told() -> None:
    scene = load(f'def Xform "m" (kind = "component"\n{API}) {{\nuniform token model:drawMode = "bounds"\n}}')
    assert (drawn(scene), codes(scene)) == (set(), {"N910"})


def test_origin_is_three_axes_of_length_one() -> None:
    lines = only(load(model('uniform token model:drawMode = "origin"')))
    np.testing.assert_array_equal(lines.points[:, 0], np.zeros((3, 3)))
    np.testing.assert_array_equal(lines.points[:, 1], np.eye(3))


# --- cards


def test_cards_without_textures_are_six_in_the_draw_mode_color() -> None:
    body = 'uniform token model:drawMode = "cards"\nuniform float3 model:drawModeColor = (0, 1, 0)\n'
    scene = load(model(body + 'uniform token model:cardGeometry = "box"'))
    found = {tuple(np.round(normal).astype(int)): points for normal, points, _ in cards(scene)}
    assert set(found) == {frame[0] for frame in FRAMES.values()}
    for normal, points in found.items():
        axis = int(np.flatnonzero(normal)[0])
        side = HIGH if normal[axis] > 0 else LOW
        np.testing.assert_allclose(points[:, axis], side[axis])
        np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], _flattened(axis, side[axis]))
    np.testing.assert_array_equal(scene.instances.primvars["displayColor"], [[0, 1, 0]])


def _flattened(axis: int, value: float) -> np.ndarray:
    box = np.array([LOW, HIGH])
    box[:, axis] = value
    return box


def test_cross_is_the_fallback_and_bisects_the_extent() -> None:
    found = cards(load(model('uniform token model:drawMode = "cards"')))
    assert len(found) == 6
    middle = (LOW + HIGH) / 2
    for normal, points, _ in found:
        axis = int(np.argmax(np.abs(normal)))
        np.testing.assert_allclose(points[:, axis], middle[axis], atol=1e-3)
        # In front of the one that faces the other way, so that a ray from there meets it first.
        assert ((points[:, axis] - middle[axis]) * normal[axis] > 0).all()


@pytest.mark.parametrize("geometry", ["box", "cross"])
def test_each_card_holds_its_texture_upright(geometry: str, tmp_path: Path) -> None:
    textures = "".join(paint(tmp_path, name) for name in FACES)
    body = f'uniform token model:drawMode = "cards"\nuniform token model:cardGeometry = "{geometry}"\n{textures}'
    scene = load(model(body), tmp_path)
    assert codes(scene) <= {"N901"}
    mesh = only(scene)
    names = [scene.materials[row].path for row in scene.instances.material_table]
    for card, (normal, points, st) in enumerate(cards(scene)):
        name = FACES[card]
        facing, s, t = np.array(FRAMES[name], float)
        np.testing.assert_allclose(normal, facing, atol=1e-6)
        share = (points - LOW) / (HIGH - LOW)
        expected = np.column_stack([_along(share, s), _along(share, t)])
        np.testing.assert_allclose(st, expected, atol=1e-6)
        assert names[mesh.material_slots[2 * card]].endswith(name)


def _along(share: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Return how far points are along a direction of the unit cube, from 0 to 1."""
    value = share @ direction
    return value + 1 if direction.sum() < 0 else value


def test_only_axes_with_textures_are_drawn_and_one_texture_serves_both_cards(tmp_path: Path) -> None:
    """The opposite card shows it flipped along s, for X and Y; as if seen through the card, for all three."""
    body = f'uniform token model:drawMode = "cards"\n{paint(tmp_path, "XNeg")}{paint(tmp_path, "ZPos")}'
    scene = load(model(body), tmp_path)
    found = cards(scene)
    assert len(found) == 4
    for (_, points, st), source in zip(found, ("XNeg", "XNeg", "ZPos", "ZPos"), strict=True):
        _, s, t = np.array(FRAMES[source], float)
        share = (points - LOW) / (HIGH - LOW)
        np.testing.assert_allclose(st, np.column_stack([_along(share, s), _along(share, t)]), atol=1e-6)
    # s of the X cards, each seen from its front with Z up: opposite.
    assert len({scene.materials[row].path for row in scene.instances.material_table}) == 2


def test_a_texture_that_cannot_be_read_shows_the_draw_mode_color(tmp_path: Path) -> None:
    body = (
        'uniform token model:drawMode = "cards"\nuniform float3 model:drawModeColor = (0.1, 0.2, 0.3)\n'
        "asset model:cardTextureXPos = @./gone.png@\n"
    )
    scene = load(model(body), tmp_path)
    assert "W201" in codes(scene)
    material = scene.materials[scene.instances.material_table[0]]
    texture = scene.textures[material.inputs["diffuseColor"].texture]
    np.testing.assert_allclose(texture.fallback, (0.1, 0.2, 0.3, 1), rtol=1e-6)


def test_card_textures_may_change_with_time(tmp_path: Path) -> None:
    paint(tmp_path, "a")
    paint(tmp_path, "b")
    samples = "asset model:cardTextureXPos.timeSamples = { 1: @./a.png@, 2: @./b.png@ }\n"
    body = model('uniform token model:drawMode = "cards"\n' + samples)
    for time, name in ((1, "a.png"), (2, "b.png")):
        scene = load(body, tmp_path, time=time)
        assert [Path(image.path).name for image in scene.images] == [name]


@pytest.mark.parametrize(
    ("group", "own", "count"),
    [("", "", 6), ("simple", "", 4), ("simple", "full", 6), ("", "simple", 4), ("simple", "inherited", 4)],
)
def test_card_visibility_simple_leaves_out_those_along_the_up_axis(group: str, own: str, count: int) -> None:
    says = 'uniform token model:cardVisibility = "{}"\n'
    scene = load(
        f"""( upAxis = "Y" )
        def Xform "g" (kind = "group"
            {API}) {{
            {says.format(group) if group else ""}
            {model('uniform token model:drawMode = "cards"' + chr(10) + (says.format(own) if own else ""))}
        }}
        """
    )
    found = cards(scene)
    assert len(found) == count
    assert any(abs(normal[1]) > 0.5 for normal, _, _ in found) == (count == 6)


# --- cards from textures


MATRIX = np.array([[0, 0.5, 0, 0], [0, 0, 2, 0], [0.25, 0, 0, 0], [0.5, -1, 0, 1]])
"""World to screen, for row vectors: clip x = z / 4 + 1 / 2, y = x / 2 - 1, z = 2 y."""


def write_exr(path: Path, **attributes: object) -> None:
    channels = {name: np.ones((2, 2), np.float32) for name in "RGBA"}
    OpenEXR.File({"type": OpenEXR.scanlineimage} | attributes, channels).write(str(path))


@pytest.mark.parametrize("name", ["worldtoscreen", "worldToNDC"])
def test_cards_from_textures_lie_where_their_metadata_say(name: str, tmp_path: Path) -> None:
    write_exr(tmp_path / "card.exr", **{name: MATRIX.astype(np.float32)})
    body = (
        'uniform token model:drawMode = "cards"\nuniform token model:cardGeometry = "fromTexture"\n'
        "asset model:cardTextureYPos = @./card.exr@\n"
    )
    ((normal, points, st),) = cards(load(model(body), tmp_path))
    clip = np.column_stack([points, np.ones(4)]) @ MATRIX
    np.testing.assert_allclose(np.sort(clip[:, :2], axis=0), [[-1, -1], [-1, -1], [1, 1], [1, 1]], atol=1e-6)
    np.testing.assert_allclose(clip[:, 2], 0, atol=1e-6)
    np.testing.assert_allclose(st, np.column_stack([(1 + clip[:, 0]) / 2, (1 - clip[:, 1]) / 2]), atol=1e-6)
    np.testing.assert_allclose(normal, [0, -1, 0], atol=1e-6)  # against clip z, which grows along y


def test_cards_from_textures_read_tiff_metadata(tmp_path: Path) -> None:
    from PIL.TiffImagePlugin import ImageFileDirectory_v2

    tags = ImageFileDirectory_v2()
    tags.tagtype[33305] = 11  # FLOAT
    tags[33305] = tuple(MATRIX.reshape(-1).tolist())
    PilImage.new("RGBA", (2, 2)).save(tmp_path / "card.tif", tiffinfo=tags)
    body = (
        'uniform token model:drawMode = "cards"\nuniform token model:cardGeometry = "fromTexture"\n'
        "asset model:cardTextureYPos = @./card.tif@\n"
    )
    ((_, points, _),) = cards(load(model(body), tmp_path))
    clip = np.column_stack([points, np.ones(4)]) @ MATRIX
    np.testing.assert_allclose(np.abs(clip[:, :2]), 1, atol=1e-6)


@pytest.mark.parametrize("matrix", [None, np.zeros((4, 4), np.float32)])
def test_a_texture_without_a_matrix_makes_no_card(matrix: np.ndarray | None, tmp_path: Path) -> None:
    write_exr(tmp_path / "card.exr", **({} if matrix is None else {"worldtoscreen": matrix}))
    body = (
        'uniform token model:drawMode = "cards"\nuniform token model:cardGeometry = "fromTexture"\n'
        "asset model:cardTextureYPos = @./card.exr@\n"
    )
    scene = load(model(body), tmp_path)
    assert (drawn(scene), codes(scene)) == (set(), {"W132"})


# --- the picture


def test_cards_are_cut_out_and_seen_from_their_front_alone(tmp_path: Path) -> None:
    """A camera on +Z sees the card that faces it; one at the box's middle sees none, for all face outwards."""
    for name in FACES:
        texels = np.zeros((4, 4, 4), np.uint8)
        texels[:, 2:] = (255, 255, 255, 255)  # the half where s > 1/2
        PilImage.fromarray(texels).save(tmp_path / f"{name}.png")
    textures = "".join(f"asset model:cardTexture{name} = @./{name}.png@\n" for name in FACES)
    body = model('uniform token model:drawMode = "cards"\nuniform token model:cardGeometry = "box"\n' + textures)
    cameras = """
        def Camera "front" {
            double3 xformOp:translate = (0, 0, 20)
            uniform token[] xformOpOrder = ["xformOp:translate"]
            float horizontalAperture = 40
            float verticalAperture = 40
            token projection = "orthographic"
        }
        def Camera "inside" {
            double3 xformOp:translate = (0, 0, 1)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
    """
    scene = load(body + cameras, tmp_path)
    renderer = Renderer(scene, RenderOptions(width=32, height=32), device="cpu")
    alpha = renderer.render(camera="front").alpha
    x, y = np.meshgrid((np.arange(32) + 0.5) / 8 - 2, 2 - (np.arange(32) + 0.5) / 8)
    assert (np.abs(y) < 2).all()
    # Bilinear alpha passes the threshold 0.1 at s = 0.4.
    np.testing.assert_array_equal(alpha, (x > -0.2) & (x < 1))
    assert not renderer.render(camera="inside").alpha.any()


@pytest.mark.parametrize("geometry", ["box", "cross"])
@pytest.mark.parametrize("thickness", [0.0, 1e-6])
def test_cards_of_a_flat_model_do_not_hide_one_another(geometry: str, thickness: float, tmp_path: Path) -> None:
    PilImage.new("RGBA", (4, 4), (255, 255, 255, 255)).save(tmp_path / "card.png")
    body = model(
        f'uniform token model:drawMode = "cards"\nuniform token model:cardGeometry = "{geometry}"\n'
        "asset model:cardTextureZPos = @./card.png@"
    ).replace(EXTENT, f"float3[] extentsHint = [(-1, -2, 0.7), (1, 2, {0.7 + thickness})]")
    cameras = "".join(
        f"""
        def Camera "{name}" {{
            double3 xformOp:translate = (0, 0, {place})
            float3 xformOp:rotateXYZ = (0, {turn}, 0)
            uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]
            float horizontalAperture = 20
            float verticalAperture = 40
            token projection = "orthographic"
        }}
        """
        for name, place, turn in (("front", 20, 0), ("back", -20, 180))
    )
    renderer = Renderer(load(body + cameras, tmp_path), RenderOptions(width=32, height=64), device="cpu")
    for camera in ("front", "back"):
        np.testing.assert_array_equal(renderer.render(camera=camera).alpha, 1)
