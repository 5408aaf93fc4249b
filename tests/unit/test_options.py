# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Options of a wrong type or name are refused by name, in one line, before anything is loaded."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import warp_rt
from warp_rt.errors import OptionError, SceneError, WarpRtError
from warp_rt.options import PURPOSES, RenderOptions


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"aovs": "color"}, "aovs: a sequence expected, such as ('color',)"),
        ({"aovs": 5}, "aovs: a sequence expected, got 5"),
        ({"aovs": None}, "aovs: a sequence expected, got None"),
        ({"lights_visible": "yes"}, "lights_visible: True or False expected, got 'yes'"),
        ({"aovs": (5,)}, "aov: 5 is none of color, depth"),
        ({"width": "640"}, "width: a whole number expected, got '640'"),
        ({"width": 640.0}, "width: a whole number expected, got 640.0"),
        ({"height": True}, "height: a whole number expected, got True"),
        ({"spp": None}, "spp: a whole number expected, got None"),
        ({"seed": None}, "seed: a whole number expected, got None"),
        ({"depth": 2.5}, "depth: a whole number expected, got 2.5"),
        ({"threshold": "0"}, "threshold: a number expected, got '0'"),
        ({"time_limit": "1"}, "time_limit: a number expected, got '1'"),
        ({"ambient": 0.5}, "ambient: a sequence expected, got 0.5"),
        ({"ambient": ("1", "1", "1")}, "ambient: three finite numbers expected"),
        ({"background": "red"}, "background: a sequence expected"),
        ({"crop": (0, 0, 4)}, "crop: whole numbers x, y >= 0"),
        ({"crop": (0.0, 0, 4, 4)}, "crop: whole numbers x, y >= 0"),
        ({"bvh": ["sah"]}, "bvh: ['sah'] is none of sah, median"),
        ({"widht": 640}, "widht: unknown option; did you mean width?"),
        ({"rays": 4}, "rays: unknown option; there are width, height, spp"),
        ({"camra": "Front"}, "camra: unknown option; did you mean camera?"),
        ({"mask": ("/World",)}, "mask: load_scene takes it, and render takes the scene that it returns"),
    ],
)
def test_wrong_options_are_named(options: dict[str, Any], said: str) -> None:
    with pytest.raises(OptionError) as raised:
        warp_rt.render("no such file.usda", **options)
    assert str(raised.value).startswith(said)
    assert "\n" not in str(raised.value)


def test_numpys_numbers_and_lists_are_as_good() -> None:
    options = RenderOptions(
        width=np.int64(4), threshold=np.float32(0.5), aovs=["depth"], crop=[0, 0, 1, 1], background=np.zeros(3)
    )
    assert (options.aovs, options.crop, options.background) == (("depth",), (0, 0, 1, 1), (0.0, 0.0, 0.0))


@pytest.mark.parametrize("purposes", [("foo",), ("render", ""), (), "render"])
def test_purposes_are_from_a_list(purposes: Any) -> None:
    with pytest.raises(OptionError, match=r"^purposes: ") as raised:
        warp_rt.load_scene("no such file.usda", purposes=purposes)
    assert isinstance(purposes, str) or ", ".join(PURPOSES) in str(raised.value)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"mask": "/World"}, "mask: a sequence expected, such as ('/World',)"),
        ({"mask": (5,)}, "mask: paths expected, got 5"),
        ({"render_settings": 5}, "render_settings: the path of a prim expected, got 5"),
        ({"render_pass": b"/Pass"}, "render_pass: the path of a prim expected, got b'/Pass'"),
    ],
)
def test_what_is_no_path_of_a_prim_is_refused(options: dict[str, Any], said: str) -> None:
    with pytest.raises(OptionError) as raised:
        warp_rt.load_scene("no such file.usda", **options)
    assert str(raised.value) == said


def test_what_is_neither_a_camera_nor_options_nor_an_exposure_is_refused() -> None:
    scene = warp_rt.Scene.from_arrays(np.eye(3), [[0, 1, 2]])
    for camera in (5, b"Camera", np.eye(4)):
        with pytest.raises(OptionError, match="camera: a Camera, or the path or name of one expected, got "):
            warp_rt.render(scene, width=4, camera=camera)
    with pytest.raises(OptionError, match="options: RenderOptions expected, got dict"):
        warp_rt.Renderer(scene, {"width": 4})  # type: ignore[arg-type]
    with pytest.raises(OptionError, match="exposure: a number expected, got 'bright'"):
        warp_rt.render(scene, width=4, exposure="bright")


@pytest.mark.parametrize("scene", [5, None, b"a.usda"])
def test_what_is_no_scene_is_refused(scene: Any) -> None:
    with pytest.raises(SceneError, match=r"^a path or an open Usd\.Stage expected, got "):
        warp_rt.load_scene(scene)
    with pytest.raises(WarpRtError):
        warp_rt.render(scene)
