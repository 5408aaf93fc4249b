# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Ray trees that can be worked out on paper: mirrors, a glass slab, shadows, what is missing of a surface."""

from __future__ import annotations

import numpy as np
import pytest

from warp_rt import LimitError, OptionError, RayTree, Renderer, RenderOptions, Scene
from warp_rt.scene import Camera, Dome, LightKind
from warp_rt.tree.nodes import Fate, RayKind, TreeNode

from .scenes import box, distant, lamp, looking, parallel, preview, scene_of, square, whitted

RTOL = 2e-6
DOWN = parallel((0.0, 0.0, 5.0))


def trace(scene: Scene, camera: Camera, **options: object) -> RayTree:
    """Return the tree of the one pixel of a picture."""
    chosen = RenderOptions(width=1, height=1, **({"threshold": 0.0} | options))
    return Renderer(scene, chosen, device="cpu").trace_tree(0, 0, camera=camera)


def chain(tree: RayTree) -> list[TreeNode]:
    """Return the nodes of a tree that does not branch."""
    nodes = list(tree)
    assert [len(node.children) for node in nodes] == [1] * (len(nodes) - 1) + [0]
    return nodes


# --- mirrors


def test_mirror_facing_mirror() -> None:
    kr, depth = np.array([0.9, 0.5, 0.25]), 4
    mirror = whitted(ambient=0.25, reflection=kr)
    scene = scene_of(square(mirror, z=-1.0), square(mirror, z=1.0), ambient=(1, 1, 1))
    tree = trace(scene, parallel((0.3, 0.1, 0.0)), depth=depth)
    nodes = chain(tree)
    assert [node.kind for node in nodes] == [RayKind.EYE] + [RayKind.REFLECTION] * 3
    assert [node.depth for node in nodes] == [1, 2, 3, 4]
    assert [node.place.prim for node in nodes] == ["/body0", "/body1", "/body0", "/body1"]
    assert [node.reflection for node in nodes] == [Fate.TRACED] * 3 + [Fate.DEPTH]
    assert {node.refraction for node in nodes} == {Fate.NOT_ASKED}
    for k, node in enumerate(nodes):
        np.testing.assert_allclose(node.weight, 0.9**k, rtol=RTOL)
        np.testing.assert_allclose(node.coefficient, kr**k, rtol=RTOL)
        np.testing.assert_allclose(node.local, 0.25, rtol=RTOL)
        np.testing.assert_allclose(node.contribution, 0.25 * kr**k, rtol=RTOL)
        np.testing.assert_allclose(node.value, 0.25 * (1 - kr ** (depth - k)) / (1 - kr), rtol=RTOL)
        np.testing.assert_allclose(node.position, (0.3, 0.1, -1.0 if k % 2 == 0 else 1.0), atol=1e-5)
        np.testing.assert_allclose(node.normal, (0, 0, 1.0 if k % 2 == 0 else -1.0), atol=1e-7)
    np.testing.assert_allclose([node.distance for node in nodes], [1, 2, 2, 2], rtol=1e-5)
    assert nodes[-1].end == "reflection deeper than the tree may be"
    assert "0.25 + 0.5 (0.25 + 0.5 (0.25 + 0.5 (0.25 + 0.5 (0))))" in tree.to_text(width=120)


def test_a_branch_that_the_threshold_ends_says_its_weight() -> None:
    mirror = whitted(ambient=0.25, reflection=0.5)
    scene = scene_of(square(mirror, z=-1.0), square(mirror, z=1.0), ambient=(1, 1, 1))
    last = chain(trace(scene, parallel((0.3, 0.1, 0.0)), depth=9, threshold=0.2))[-1]
    assert (last.depth, last.reflection) == (3, Fate.THRESHOLD)
    assert last.end == "reflection below the threshold (weight 0.125)"


# --- glass


@pytest.mark.parametrize("depth", [1, 2, 3, 4, 9])
def test_glass_slab_met_head_on(depth: int) -> None:
    """Each pass through a face sends kr back and kt on; what leaves sees the background B, outside on both sides."""
    kr, kt, behind = 0.1, np.array([0.8, 0.7, 0.6]), np.array([0.2, 0.4, 0.8])
    slab = box(whitted(reflection=kr, transmission=kt, ior=1.5), (-9, -9, 0), (9, 9, 1))
    tree = trace(scene_of(slab, background=behind), DOWN, depth=depth)

    def inside(level: int) -> np.ndarray:
        """A ray in the glass that meets a face at this level."""
        return kr * inside(level + 1) + kt * behind if level < depth else np.zeros(3)

    expected = kr * behind + kt * inside(2) if depth > 1 else np.zeros(3)
    np.testing.assert_allclose(tree.value, expected, rtol=RTOL)
    np.testing.assert_allclose(tree.root.value, expected, rtol=RTOL)
    # One node, then two a level: one in the glass and one out of it.
    assert len(tree) == 2 * depth - 1
    assert tree.counts["dropped_by_depth"] == 2
    assert tree.root.deepest == depth
    faces = [node for node in tree if not node.has_left]
    assert [node.eta for node in faces] == pytest.approx([1 / 1.5] + [1.5] * (len(faces) - 1), rel=1e-6)
    left = [node for node in tree if node.has_left]
    assert {node.kind for node in left if node.depth > 2} <= {RayKind.REFRACTION}
    for node in left:
        assert node.end == "the ray left the scene"
        np.testing.assert_allclose(node.local, behind, rtol=RTOL)


def test_total_internal_reflection() -> None:
    """From inside a cube of index 1.5, 45 degrees are beyond the critical 41.8: R is weighted by Kr + Kt."""
    kr, kt = np.array([0.1, 0.2, 0.3]), np.array([0.5, 0.4, 0.3])
    cube = box(whitted(ambient=0.25, reflection=kr, transmission=kt, ior=1.5), (-1, -1, -1), (1, 1, 1))
    camera = parallel((0.1, 0.0, 0.0), (1.0, 0.0, 1.0))
    tree = trace(scene_of(cube, ambient=(1, 1, 1)), camera, depth=3)
    nodes = chain(tree)
    assert [node.is_totally_reflected for node in nodes] == [True] * 3
    assert [node.reflection for node in nodes] == [Fate.TRACED, Fate.TRACED, Fate.DEPTH]
    np.testing.assert_allclose(nodes[0].reflection_coefficient, kr + kt, rtol=RTOL)
    np.testing.assert_allclose(tree.value, 0.25 * (1 + 0.6 + 0.36), rtol=RTOL)
    assert tree.counts["total_internal_reflection"] == 3
    assert "total internal reflection: 45.0° is beyond the critical 41.8°" in tree.to_text()


def test_snell_is_told_in_degrees() -> None:
    """sin 30 / 1.5 = sin 19.47."""
    slab = box(whitted(transmission=0.5, ior=1.5), (-9, -9, 0), (9, 9, 1))
    camera = parallel((-2.0, 0.0, 2.0), (0.5, 0.0, -np.sqrt(0.75)))
    text = trace(scene_of(slab), camera).to_text()
    assert "enters, n 1 to 1.5, 30.0° to 19.5°" in text
    assert "leaves, n 1.5 to 1, 19.5° to 30.0°" in text


def test_fresnel_of_a_preview_surface() -> None:
    """F0 = ((1.5 - 1) / (1.5 + 1))^2 = 0.04, which a smooth surface met head-on mirrors."""
    scene = scene_of(square(preview(roughness=0.0, diffuseColor=0.5)), background=(1, 1, 1))
    root = trace(scene, DOWN).root
    np.testing.assert_allclose(root.fresnel, 0.04, rtol=1e-5)
    np.testing.assert_allclose(root.kr, 0.04, rtol=1e-5)
    rough = trace(scene_of(square(preview(roughness=0.9))), DOWN).root
    # Of a rough one what its lobe sends up of light from all around: the facet's normal halves the angle.
    theta = (np.arange(4000) + 0.5) / 4000 * np.pi / 2
    a2, c, h = 0.81**2, np.cos(theta), np.cos(theta / 2)
    distribution = a2 / (np.pi * (h * h * (a2 - 1) + 1) ** 2)
    lobe = distribution * (c / (c * (1 - 0.405) + 0.405)) * (0.04 + 0.96 * (1 - h) ** 5) / 4
    # To the promise of ALBEDO_COLUMNS, 0.001 of what a white lobe reflects.
    expected = 2 * np.pi * (lobe * np.sin(theta)).sum() * np.pi / 8000
    np.testing.assert_allclose(rough.fresnel, expected, atol=1e-3 * 0.04)
    assert rough.kr == (0.0, 0.0, 0.0)


# --- lights and shadows

FLOOR = whitted(ambient=(0.1, 0.2, 0.3), diffuse=0.5, specular=0.25, shininess=3)


def test_two_lights_one_of_them_shadowed() -> None:
    """One light straight above, one from the side at cosine 0.8 behind a screen, one from below."""
    sun = distant((0, 0, -1), (1.0, 0.5, 0.25))
    side = lamp(LightKind.POINT, (6.0, 0.0, 8.0), 2.0, has_falloff=False)
    below = distant((0, 0, 1), 1.0)
    screen = square(whitted(), half=1.0, z=4.0, world_from_local=looking((0, 0, -1), (3.0, 0.0, 0.0)))
    scene = scene_of(square(FLOOR), screen, lights=[sun, side, below], ambient=(1, 1, 1))
    tree = trace(scene, parallel((0.0, 0.0, 1.0)))
    (root,) = tree
    np.testing.assert_allclose(root.ambient, (0.1, 0.2, 0.3), rtol=RTOL)
    lit, dark, behind = root.lights
    # kd N.L + ks (R.V)^n with N = L = V.
    np.testing.assert_allclose(lit.diffuse, 0.5 * np.array([1.0, 0.5, 0.25]), rtol=RTOL)
    np.testing.assert_allclose(lit.specular, 0.25 * np.array([1.0, 0.5, 0.25]), rtol=RTOL)
    assert (lit.visible, lit.occluder, lit.crossings) == ((1.0, 1.0, 1.0), None, ())

    assert dark.visible == dark.total == dark.diffuse == (0.0, 0.0, 0.0)
    assert dark.has_shadow_ray
    np.testing.assert_allclose(dark.cosine, 0.8, rtol=RTOL)
    np.testing.assert_allclose(dark.direction, (0.6, 0.0, 0.8), rtol=RTOL, atol=1e-7)
    np.testing.assert_allclose(dark.distance, 10.0, rtol=1e-5)
    np.testing.assert_allclose(dark.color, 2.0, rtol=RTOL)
    np.testing.assert_allclose(dark.unshadowed_diffuse, 2.0 * 0.5 * 0.8, rtol=RTOL)
    np.testing.assert_allclose(dark.unshadowed_specular, 2.0 * 0.25 * 0.8**3, rtol=RTOL)
    assert dark.occluder.prim == "/body1"
    np.testing.assert_allclose(dark.crossings[0].distance, 5.0, rtol=1e-5)  # where the plane z = 4 is met

    assert not behind.is_facing
    np.testing.assert_allclose(behind.cosine, -1.0, rtol=RTOL)
    assert not behind.has_shadow_ray
    assert tree.counts["shadow"] == 2
    np.testing.assert_allclose(tree.value, np.array([0.1, 0.2, 0.3]) + 0.75 * np.array([1.0, 0.5, 0.25]), rtol=RTOL)
    text = tree.to_text()
    assert "shadowed by /body1 face " in text
    assert "without it 1.056" in text
    assert "is behind the surface, N.L = -1" in text


def test_the_nearest_of_several_blockers_is_named() -> None:
    panes = [square(whitted(), z=z) for z in (3.0, 1.0, 2.0)]
    scene = scene_of(square(FLOOR), *panes, lights=[distant((0, 0, -1))])
    tree = trace(scene, parallel((-3.0, 0.0, 0.5), (3.0, 0.0, -0.5)))
    assert tree.root.lights[0].occluder.prim == "/body2"


def test_surfaces_that_a_shadow_ray_crosses() -> None:
    """Two panes of coloured glass, and what they let through together."""
    kt = np.array([[0.9, 0.5, 0.25], [0.5, 1.0, 0.25]])
    panes = [square(whitted(transmission=k), z=z) for k, z in zip(kt, (2.0, 3.0), strict=True)]
    scene = scene_of(square(whitted(diffuse=0.5)), *panes, lights=[distant((0, 0, -1))])
    tree = trace(scene, parallel((-3.0, 0.0, 0.5), (3.0, 0.0, -0.5)), shadows="transmit")
    (light,) = tree.root.lights
    assert [crossing.place.prim for crossing in light.crossings] == ["/body1", "/body2"]
    np.testing.assert_allclose([crossing.factor for crossing in light.crossings], kt, rtol=RTOL)
    np.testing.assert_allclose([crossing.distance for crossing in light.crossings], [2.0, 3.0], rtol=1e-5)
    np.testing.assert_allclose(light.visible, kt.prod(axis=0), rtol=RTOL)
    assert light.occluder is None
    np.testing.assert_allclose(light.total, 0.5 * kt.prod(axis=0), rtol=RTOL)
    assert "through /body1 (0.9 0.5 0.25), /body2 (0.5 1 0.25)" in tree.to_text(width=120)


def test_an_opaque_surface_ends_a_transmitted_shadow_ray() -> None:
    panes = [square(whitted(transmission=0.5), z=2.0), square(whitted(), z=3.0)]
    scene = scene_of(square(whitted(diffuse=0.5)), *panes, lights=[distant((0, 0, -1))])
    (light,) = trace(scene, parallel((-3.0, 0.0, 0.5), (3.0, 0.0, -0.5)), shadows="transmit").root.lights
    assert light.occluder.prim == "/body2"
    assert len(light.crossings) == 2


def test_a_dome_has_terms_and_no_direction() -> None:
    """A white furnace: a diffuse surface of albedo 1/2 sends half of the dome's radiance back."""
    dome = Dome("/dome", np.eye(4), (1.0, 2.0, 4.0))
    tree = trace(scene_of(square(whitted(diffuse=0.5)), domes=[dome]), DOWN)
    (light,) = tree.root.lights
    assert (light.light, light.kind, light.cosine, light.has_shadow_ray) == ("/dome", "dome", None, False)
    np.testing.assert_allclose(light.total, (0.5, 1.0, 2.0), rtol=1e-4)
    assert "/dome all around" in tree.to_text()


def test_no_light_is_asked_where_none_could_add() -> None:
    (root,) = trace(scene_of(square(whitted(ambient=0.5)), ambient=(1, 1, 1)), DOWN)
    assert root.lights == ()
    assert root.end == "neither reflects nor transmits"


def test_a_headlight_is_named() -> None:
    scene = Scene.from_arrays([(-9, -9, 0), (9, -9, 0), (0, 9, 0)], [(0, 1, 2)])
    tree = trace(scene, DOWN)
    assert [light.light for light in tree.root.lights] == ["/__headlight"]
    assert "(headlight) casts no shadow" in tree.to_text()


# --- what is missing of a surface


def test_presence_splits_the_ray() -> None:
    """A quarter of the veil is there: I = 1/4 ka Ia + 3/4 of the wall behind it."""
    veil = square(preview(diffuseColor=0.4, roughness=0.9, opacity=0.25, presence=True), z=1.0)
    wall = square(whitted(ambient=0.8))
    tree = trace(scene_of(wall, veil, ambient=(1, 1, 1)), DOWN)
    first, second = tree
    assert (first.presence, first.passage, second.kind, second.depth) == (0.25, Fate.TRACED, RayKind.PASSAGE, 1)
    np.testing.assert_allclose(second.coefficient, 0.75, rtol=RTOL)
    np.testing.assert_allclose(tree.value, 0.25 * 0.4 + 0.75 * 0.8, rtol=RTOL)
    assert tree.counts["passage"] == 1


def test_a_ray_that_meets_nothing() -> None:
    tree = trace(scene_of(square(FLOOR), background=(0.1, 0.2, 0.3)), parallel((0, 0, 5), (0, 0, 1)))
    (root,) = tree
    assert root.has_left
    assert root.place is None
    np.testing.assert_allclose(tree.value, (0.1, 0.2, 0.3), rtol=RTOL)


# --- what is asked for


@pytest.mark.parametrize(
    ("arguments", "more", "message"),
    [
        ((0.5, 0), {}, r"pixel \(0.5, 0\): whole numbers expected"),
        ((1, 0), {}, r"pixel \(1, 0\) lies outside the picture of 1 x 1 pixels"),
        ((0, 0), {"samples": ()}, "samples: at least one expected"),
        ((0, 0), {"samples": (0, 4)}, r"sample: 4 is outside 0\.\.3"),
    ],
)
def test_pixels_and_samples_that_are_not_there(arguments: tuple, more: dict, message: str) -> None:
    renderer = Renderer(scene_of(square(FLOOR)), RenderOptions(width=1, height=1, spp=4), device="cpu")
    with pytest.raises(OptionError, match=message):
        renderer.trace_tree(*arguments, camera=DOWN, **more)


def test_some_samples_of_a_pixel() -> None:
    renderer = Renderer(scene_of(square(FLOOR)), RenderOptions(width=1, height=1, spp=4), device="cpu")
    tree = renderer.trace_tree(np.int64(0), 0, camera=parallel((0, 0, 5), half=2.0), samples=(3, 1))
    whole = renderer.trace_tree(0, 0, camera=parallel((0, 0, 5), half=2.0))
    assert (tree.samples, tree.is_whole, whole.is_whole) == ((3, 1), False, True)
    assert [root.position for root in tree.roots] == [whole.roots[k].position for k in (3, 1)]


def test_time_limit() -> None:
    renderer = Renderer(scene_of(square(FLOOR)), RenderOptions(width=1, height=1, time_limit=0.0), device="cpu")
    with pytest.raises(LimitError, match="time limit of 0 s reached"):
        renderer.trace_tree(0, 0, camera=DOWN)


# --- the picture's terms


def test_camera_exposure_scales_the_value() -> None:
    scene = scene_of(square(whitted(ambient=0.5)), ambient=(1, 1, 1))
    tree = trace(scene, parallel((0, 0, 5), exposure_scale=4.0))
    np.testing.assert_allclose(tree.value, 2.0, rtol=RTOL)
    np.testing.assert_allclose(tree.root.value, 0.5, rtol=RTOL)
    assert "the eye ray's I times the camera's exposure 4" in tree.to_text()


def test_coordinates_far_from_the_origin_are_the_worlds() -> None:
    center = np.array([1e6, -2e6, 3e6])
    place = np.eye(4)
    place[:3, 3] = center
    scene = scene_of(square(FLOOR, world_from_local=place), ambient=(1, 1, 1))
    root = trace(scene, parallel(tuple(center + np.array([0.5, 0.25, 5.0])))).root
    np.testing.assert_allclose(root.position - center, (0.5, 0.25, 0.0), atol=1e-3)
    np.testing.assert_allclose(root.origin - center, (0.5, 0.25, 5.0), atol=1e-3)
