# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What an interpreter shows of a scene and a film: one line, however large they are."""

import dataclasses

import warp_rt

POINTS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
FACES = [(0, 1, 2), (0, 2, 3)]


def test_scene():
    scene = warp_rt.Scene.from_arrays(POINTS, FACES)
    counts = "meshes 1, triangles 2, instances 1, materials 1, lights 0, cameras 0"
    assert repr(scene) == f"<warp_rt.Scene: {counts}>"
    assert repr(dataclasses.replace(scene, source="a.usda")) == f"<warp_rt.Scene 'a.usda': {counts}>"


def test_a_ball_is_no_mesh(tmp_path):
    path = tmp_path / "ball.usda"
    path.write_text('#usda 1.0\ndef Sphere "Ball" {}\n')
    assert "meshes 0, triangles 0, shapes 1, instances 1," in repr(warp_rt.load_scene(path))


def test_film():
    scene = warp_rt.Scene.from_arrays(POINTS, FACES)
    options = warp_rt.RenderOptions(width=40, height=30, aovs=("color", "depth"), depth=1)
    film = warp_rt.Renderer(scene, options, device="cpu").render()
    # Eye rays alone: a headlight casts no shadows.
    assert repr(film) == "<warp_rt.Film 40 x 30: color, depth, alpha; 1,200 rays>"
