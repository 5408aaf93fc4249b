# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Files in the Neutral File Format as scenes: their values, and pictures with a closed form."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from warp_rt import Renderer, RenderOptions, load_scene
from warp_rt.cli.main import main
from warp_rt.errors import OptionError
from warp_rt.nff.load import light_strength
from warp_rt.scene import LightKind, Mesh, ShapeKind, Shapes

from ..data import ROOT

STILL_LIFE = ROOT / "scenes" / "still_life.nff"
VIEW = "v from 0 0 10 at 0 0 0 up 0 1 0 angle 40 resolution 101 101\n"
WALL = "p 4 -50 -50 -5 50 -50 -5 50 50 -5 -50 50 -5\n"


def write(folder: Path, text: str) -> Path:
    path = folder / "scene.nff"
    path.write_text(text)
    return path


def picture(folder: Path, text: str, **options: object) -> np.ndarray:
    """Return the linear colours of a file's picture."""
    chosen = RenderOptions(**({"threshold": 0.0} | options))
    return Renderer(load_scene(write(folder, text)), chosen, device="cpu").render().color


def test_nothing_to_draw_is_told(tmp_path: Path) -> None:
    assert [note.code for note in load_scene(write(tmp_path, VIEW)).diagnostics] == ["N905"]


def test_what_a_file_becomes() -> None:
    scene = load_scene(STILL_LIFE)
    assert scene.prims == (
        "/Fill1/Polygons",
        "/Fill2/Spheres",
        "/Fill3/Spheres",
        "/Fill4/Cones",
        "/Fill5/Patches",
    )
    table, glass, _, cup, pyramid = scene.meshes
    assert isinstance(table, Mesh)
    assert (len(table.points), len(table.triangles), table.normals, table.is_closed) == (4, 2, None, False)
    assert isinstance(glass, Shapes)
    assert (glass.kind, glass.is_closed) == (ShapeKind.SPHERE, True)
    np.testing.assert_allclose(glass.points, [[(-1.1, -1, 0.9)]])
    assert isinstance(cup, Shapes)
    assert (cup.kind, cup.caps, cup.is_closed) == (ShapeKind.FRUSTUM, (False, False), False)
    np.testing.assert_allclose(cup.radii, [[0.35, 0.6]])
    assert isinstance(pyramid, Mesh)
    np.testing.assert_array_equal(pyramid.face_ids, range(4))
    np.testing.assert_allclose(pyramid.normals.values[pyramid.normals.indices[0]][0], (-0.6, -0.6, 0.3))
    white, tinted = scene.lights
    assert (white.kind, white.has_falloff, white.radiance) == (LightKind.POINT, False, (light_strength(2),) * 3)
    assert tinted.radiance == (0.4, 0.35, 0.3)
    assert scene.settings.resolution == (512, 384)
    assert scene.diagnostics == ()


@pytest.mark.parametrize(("count", "strength"), [(0, 0.5), (1, 0.5), (4, 0.25), (9, 1 / 6)])
def test_lights_share_their_strength(count: int, strength: float) -> None:
    assert light_strength(count) == pytest.approx(strength)


@pytest.mark.parametrize("size", [(101, 101), (80, 60)])
def test_the_angle_lies_between_the_middles_of_the_outer_rows(size: tuple[int, int], tmp_path: Path) -> None:
    view = VIEW.replace("101 101", f"{size[0]} {size[1]}")
    path = write(tmp_path, f"{view}f 1 1 1 1 0 1 0 0\n{WALL}")
    options = RenderOptions(aovs=("position",))
    position = Renderer(load_scene(path), options, device="cpu").render().aovs["position"]
    assert position.shape[:2] == size[::-1]
    toward = (position - (0, 0, 10))[[0, -1], size[0] // 2]
    angle = np.degrees(np.arctan2(toward[:, 1], -toward[:, 2]))
    assert angle[0] - angle[1] == pytest.approx(40, abs=1e-4)
    across = np.diff(position[size[1] // 2, :, 0])
    np.testing.assert_allclose(across, -np.diff(position[:, 0, 1]).mean(), rtol=1e-4)  # square pixels


def test_local_illumination_and_background(tmp_path: Path) -> None:
    """A ball seen along z, lit from the eye: at its middle N.L = R.V = 1."""
    color = picture(tmp_path, f"{VIEW}b 0.1 0.2 0.3\nl 0 0 10\nf 1 0.5 0.25 0.8 0.1 7 0 0\ns 0 0 0 2\n")
    body = 0.8 * np.array((1, 0.5, 0.25))
    # Ambient, diffuse, highlight; and the background mirrored, with the weight Ks.
    expected = 0.5 * body + 0.5 * (body + 0.1) + 0.1 * np.array((0.1, 0.2, 0.3))
    np.testing.assert_allclose(color[50, 50], expected, atol=1e-5)
    np.testing.assert_allclose(color[0, 0], (0.1, 0.2, 0.3), atol=1e-6)


def test_spheres_and_cones_are_exact(tmp_path: Path) -> None:
    """The areas of their outlines: a disk's and a trapezium's."""
    view = "v from 0 0 1000 at 0 0 0 up 0 1 0 angle 0.3 resolution 400 400\n"
    pixel = 2 * 1000 * np.tan(np.radians(0.15)) / 399
    fill = f"{view}b 0 0 0 f 1 1 1 1 0 1 0 0\n"
    disk = picture(tmp_path, f"{fill}s 0.1 0 0 1.5\n", ambient=(1.0, 1.0, 1.0))[..., 0] > 0.5
    assert disk.sum() * pixel**2 == pytest.approx(np.pi * 1.5**2, rel=2e-3)
    cone = picture(tmp_path, f"{fill}c 0 -1 0 1 0 1.5 0 0.5\n", ambient=(1.0, 1.0, 1.0))[..., 0] > 0.5
    assert cone.sum() * pixel**2 == pytest.approx(2.5 * 1.5, rel=4e-3)


def test_a_cone_has_no_end_caps_and_both_sides(tmp_path: Path) -> None:
    """Along its axis one looks through to the wall."""
    view = VIEW.replace("from 0 0 10", "from 0 0.3 10").replace("at 0 0 0", "at 0 0.3 0")
    text = f"{view}l 0 0 30\nf 1 0 0 1 0 1 0 0\nc 0 0 -2 1 0 0 2 1\nf 0 1 0 1 0 1 0 0\n{WALL}"
    color = picture(tmp_path, text)
    assert color[50, 50, 0] == 0
    assert color[50, 50, 1] > 0
    assert color[40, 50, 0] > 0  # its inside


@pytest.mark.parametrize("index", [1.0, 1.5, 2.4])
def test_light_bends_at_polygons_that_transmit(index: float, tmp_path: Path) -> None:
    """A ray that meets a slab of two polygons at 45 degrees leaves it shifted; an edge behind it tells by how much."""
    slab = f"f 1 1 1 0 0 1 1 {index}\np 4 -9 -9 0 9 -9 0 9 9 0 -9 9 0\np 4 -9 -9 -2 -9 9 -2 9 9 -2 9 -9 -2\n"
    view = "v from 4 0 4 at 0 0 0 up 0 1 0 angle 1 resolution 1 1\nb 0 0 0\nl 0 0 50\n"
    x = -2 * np.tan(np.arcsin(np.sin(np.pi / 4) / index)) - 3
    for edge, is_met in ((x - 0.001, True), (x + 0.001, False)):
        wall = f"f 1 1 1 1 0 1 0 0\np 4 {edge} -9 -5 50 -9 -5 50 9 -5 {edge} 9 -5\n"
        assert bool(picture(tmp_path, f"{view}{slab}{wall}")[0, 0, 0] > 0) is is_met


def test_insides_seen_and_what_has_no_extent(tmp_path: Path) -> None:
    text = "f 1 1 1 1 0 1 0.5 1.5\ns 0 0 0 -2 s 0 0 0 0 s 1 1 1 1\n"
    text += "c 0 0 0 -1 0 0 1 -2 c 1 1 1 1 1 1 1 2\np 2 0 0 0 1 1 1\n"
    scene = load_scene(write(tmp_path, text))
    assert scene.prims == ("/Fill1/Spheres", "/Fill1/SpheresInsideOut", "/Fill1/ConesInsideOut")
    assert [mesh.is_inside_out for mesh in scene.meshes] == [False, True, True]
    assert [mesh.radii.min() for mesh in scene.meshes] == [1, 2, 1]
    assert [mesh.face_ids.tolist() for mesh in scene.meshes] == [[2], [0], [0]]
    assert [(record.code, record.prim) for record in scene.diagnostics] == [
        ("W150", "/Fill1/Polygons"),
        ("W150", "/Fill1/Spheres"),
        ("W150", "/Fill1/Cones"),
    ]


def test_concave_polygons(tmp_path: Path) -> None:
    """An L of area 3, seen from above."""
    text = f"{VIEW}b 0 0 0 f 1 1 1 1 0 1 0 0\np 6 0 0 0 2 0 0 2 1 0 1 1 0 1 2 0 0 2 0\n"
    path = write(tmp_path, text)
    scene = load_scene(path)
    corner = scene.meshes[0].points[scene.meshes[0].triangles].astype(float)
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert normal[:, 2].sum() / 2 == pytest.approx(3)
    assert (normal[:, 2] >= 0).all()


@pytest.mark.parametrize(
    "options",
    [
        {"time": 0.0},
        {"default_time": True},
        {"purposes": ("render",)},
        {"mask": ("/Fill1",)},
        {"session_layer": "a.usda"},
        {"render_settings": "/Render"},
        {"render_pass": "/Pass"},
        {"draw_modes": False},
    ],
)
def test_options_of_usd_stages_are_refused(options: dict[str, object]) -> None:
    name = next(iter(options))
    option = {"time": "", "draw_modes": r" \(--disable-draw-mode\)"}.get(name, rf" \(--{name.replace('_', '-')}\)")
    with pytest.raises(OptionError, match=rf"still_life\.nff: {name}{option}: only of USD stages"):
        load_scene(STILL_LIFE, **options)


def test_command_line(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "still.png"
    assert main(["render", str(STILL_LIFE), "-o", str(out), "-w", "64", "--strict", "--device", "cpu"]) == 0
    assert out.stat().st_size > 0
    capfd.readouterr()
    assert main(["info", str(STILL_LIFE), "--json"]) == 0
    facts = json.loads(capfd.readouterr().out)
    assert facts["picture"] == {"camera": "/Camera", "width": 512, "height": 384}
    assert main(["check", str(STILL_LIFE), "--strict"]) == 0
    assert main(["tree", str(STILL_LIFE), "150", "200", "--usd", str(tmp_path / "rays.usda")]) == 3
    assert "cannot be read as a USD layer" in capfd.readouterr().err
    bad = write(tmp_path, "b 1 1 one")
    assert main(["render", str(bad), "-o", str(out)]) == 3
    assert f"{bad}:1: b: a number expected, got 'one'" in capfd.readouterr().err
