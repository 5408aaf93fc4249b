# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The kernel for plain scenes draws what the kernel for all scenes draws, and is left where a scene is not plain."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import warp_rt.rendering.kernel_choice
from tests.analytic.scenes import box, chart, distant, preview, scene_of, square, whitted
from warp_rt import Renderer, RenderOptions, Scene, load_scene
from warp_rt.rendering.constant_inputs import with_constant_inputs
from warp_rt.rendering.frame import resolve_options
from warp_rt.rendering.plain import is_plain
from warp_rt.scene import Dome, Image, Input, Light, LightKind, RayMask, Shadow, Texture

ROOT = Path(__file__).parents[2]
SUN = distant((0, 0, -1), 1.0)
LAMP = Light("/lamp", LightKind.SPHERE, np.eye(4), (1.0, 1.0, 1.0))


def plain_scene() -> Scene:
    return scene_of(square(preview()), box(whitted(diffuse=0.5), (-1, -1, 1), (1, 1, 2)), lights=[SUN])


def is_drawn_plainly(scene: Scene, options: RenderOptions | None = None) -> bool:
    return is_plain(with_constant_inputs(scene), resolve_options(options or RenderOptions(), scene.settings))


@pytest.mark.parametrize("name", ["mirror_teapot", "lights", "primvars", "depth_of_field"])
def test_both_kernels_draw_the_same_bits(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = load_scene(ROOT / "scenes" / f"{name}.usda")
    options = RenderOptions(width=96, spp=2, aovs=("depth", "normal", "uv", "primId"))
    assert is_drawn_plainly(scene, options)
    plain = Renderer(scene, options, device="cpu").render()
    monkeypatch.setattr(warp_rt.rendering.kernel_choice, "is_plain", lambda scene, options: False)
    other = Renderer(scene, options, device="cpu").render()
    for aov in plain.aovs:
        np.testing.assert_array_equal(plain.aovs[aov], other.aovs[aov], err_msg=aov)
    assert plain.rays == other.rays


def test_what_is_plain() -> None:
    assert is_drawn_plainly(plain_scene())
    assert is_drawn_plainly(scene_of(chart(), lights=[SUN, LAMP]))
    assert is_drawn_plainly(scene_of(square(whitted(transmission=0.5)), lights=[SUN]))


def _with_material(**inputs: object) -> Scene:
    return scene_of(square(preview(**inputs)), lights=[SUN])


def _with_texture() -> Scene:
    textured = scene_of(square(preview(diffuseColor=Input(texture=0))), lights=[SUN])
    image = Image("white", np.full((1, 1, 4), 255, np.uint8))
    return replace(textured, textures=(Texture(0),), images=(image,))


def _with_instances(**fields: np.ndarray) -> Scene:
    scene = plain_scene()
    return replace(scene, instances=replace(scene.instances, **fields))


@pytest.mark.parametrize(
    ("scene", "options"),
    [
        (_with_texture(), RenderOptions()),
        (_with_material(normal=Input((0.6, 0.0, 0.8, 0.0))), RenderOptions()),
        (_with_material(opacity=0.5), RenderOptions()),
        (scene_of(square(whitted(transmission=0.5)), lights=[SUN]), RenderOptions(shadows="transmit")),
        (scene_of(square(preview()), domes=[Dome("/dome", np.eye(4), (1.0, 1.0, 1.0))]), RenderOptions()),
        (scene_of(square(preview()), lights=[LAMP]), RenderOptions(light_samples=1)),
        (scene_of(square(preview()), lights=[LAMP]), RenderOptions(lights_visible=True)),
        (scene_of(square(preview()), lights=[replace(SUN, receivers=np.array([False]))]), RenderOptions()),
        (scene_of(square(preview()), lights=[replace(SUN, shadow=Shadow(distance=1.0))]), RenderOptions()),
        (_with_instances(seen_by=np.uint8([RayMask.ALL, RayMask.EYE])), RenderOptions()),
        (_with_instances(is_matte=np.array([True, False])), RenderOptions()),
    ],
    ids=["texture", "normal", "opacity", "transmit", "dome", "samples", "visible", "link", "shadow", "hidden", "matte"],
)
def test_what_is_not_plain(scene: Scene, options: RenderOptions) -> None:
    assert not is_drawn_plainly(scene, options)


def test_a_primvar_that_nothing_has_is_a_constant() -> None:
    """scale * fallback + bias, of one channel; a primvar that some mesh has stays one."""
    reader = Input(
        (0.5, 0.25, 0.0, 0.0), primvar="gloss", channel=1, scale=(1.0, 3.0, 1.0, 1.0), bias=(0.0, 0.1, 0.0, 0.0)
    )
    scene = scene_of(square(whitted(diffuse=reader)), lights=[SUN])
    settled = with_constant_inputs(scene).materials[0].inputs["diffuse"]
    assert (settled.primvar, settled.channel) == ("", -1)
    assert settled.value == pytest.approx((0.85,) * 4, rel=1e-7)
    held = with_constant_inputs(scene_of(chart(), lights=[SUN]))
    assert held.materials[0].inputs["ambient"].primvar == "place"
