# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The terms of one render: options, settings and camera, packed for the kernels."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from warp_rt.kernels import frame_structs
from warp_rt.kernels.codes import SHADOW_AUTO, SHADOW_OPAQUE, SHADOW_TRANSMIT
from warp_rt.options import DEFAULT_DEPTH, DEFAULT_THRESHOLD, RenderOptions
from warp_rt.scene import Scene, Settings

_BLACK = (0.0, 0.0, 0.0)
_LARGEST = float(np.finfo(np.float32).max)  # stands for an infinite threshold: no weight reaches it


def resolve_options(options: RenderOptions, settings: Settings) -> RenderOptions:
    """Return the options with every term that they leave open taken from the stage's settings, else its default.

    A background that nobody asks for stays open: it is black, and transparent.
    """

    def first(*values: Any) -> Any:
        return next((value for value in values if value is not None), None)

    return dataclasses.replace(
        options,
        depth=first(options.depth, settings.depth, DEFAULT_DEPTH),
        threshold=first(options.threshold, settings.threshold, DEFAULT_THRESHOLD),
        light_samples=first(options.light_samples, settings.light_samples, 0),
        ambient=first(options.ambient, settings.ambient, _BLACK),
        background=first(options.background, settings.background),
    )


def frame_data(options: RenderOptions, scene: Scene, camera: Any) -> Any:
    """Return ``kernels.frame_structs.FrameData``.

    Args:
        options: Resolved.
        scene: Its materials decide what shadow rays have to look at.
        camera: ``kernels.frame_structs.CameraData``.
    """
    frame = frame_structs.FrameData()
    frame.camera = camera
    frame.depth = options.depth
    frame.threshold = min(options.threshold or 0.0, _LARGEST)
    to_rendered = np.eye(3) if scene.rendering_from_rec709 is None else scene.rendering_from_rec709
    frame.ambient = (to_rendered @ np.array(options.ambient or _BLACK)).tolist()
    frame.background = (to_rendered @ np.array(options.background or _BLACK)).tolist()
    frame.background_alpha = 0.0 if options.background is None else 1.0
    frame.shadow_mode = shadow_mode(options.shadows, scene)
    frame.sample_count = options.spp
    frame.light_samples = options.light_samples or 0
    frame.lights_visible = options.lights_visible
    frame.seed = options.seed
    return frame


def shadow_mode(shadows: str, scene: Scene) -> int:
    """Return the cheapest mode that gives the wanted shadows: where no material lets light through, any hit will do."""
    if shadows == "opaque":
        return int(SHADOW_OPAQUE)
    if not any(material.lets_light_through(with_whitted=shadows == "transmit") for material in scene.materials):
        return int(SHADOW_OPAQUE)
    return int(SHADOW_TRANSMIT if shadows == "transmit" else SHADOW_AUTO)
