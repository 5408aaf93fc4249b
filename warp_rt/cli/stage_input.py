# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The stage that pictures are made from: read, its diagnostics told, ``--strict`` obeyed, its files spared."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from warp_rt.cli.strict import refuse_warnings
from warp_rt.cli.voice import Voice
from warp_rt.errors import OutputError
from warp_rt.options import ADAPTIVE, COMPLEXITIES, RECORD_PURPOSES

if TYPE_CHECKING:
    from warp_rt.options import RenderOptions
    from warp_rt.scene import Camera, Product, Scene
    from warp_rt.scene.source import RefinableSource, SceneSource


def open_refined_stage(
    args: argparse.Namespace,
    options: RenderOptions,
    source: RefinableSource | None = None,
    product: Product | None = None,
    view: Callable[[Scene], tuple[Scene, str | Camera | None]] | None = None,
) -> SceneSource:
    """Return the stage as ``open_stage`` does, its surfaces refined for their size in the picture if that is asked for.

    Args:
        args: Of a parser that has ``render_arguments``.
        options: Of the picture.
        source: The stage where it is open already.
        product: Which picture it is of those that the render settings ask for; None: the command's own.
        view: Says what of a scene is seen; None: all of it, from ``--camera``.
    """
    refinable = source or open_stage(args)
    if args.complexity != ADAPTIVE:
        return refinable
    from warp_rt.rendering.adaptive import AdaptiveSource

    seen = view or (lambda scene: (scene, args.camera))
    return AdaptiveSource(refinable, options, lambda scene: seen(as_product(scene, product)))


def as_product(scene: Scene, product: Product | None) -> Scene:
    """Return the scene with the settings of a product; None: with its own."""
    return scene if product is None else replace(scene, settings=product.settings)


def open_stage(args: argparse.Namespace, default_purposes: tuple[str, ...] = RECORD_PURPOSES) -> RefinableSource:
    """Return the stage that the arguments of ``render_arguments`` name, open.

    Args:
        args: Of a parser that has ``render_arguments``.
        default_purposes: Drawn where neither the arguments nor the stage say which purposes are.

    Raises:
        SceneError: It cannot be read.
    """
    from warp_rt.api import open_scene

    return open_scene(
        args.scene,
        default_time=args.default_time,
        purposes=args.purposes,
        default_purposes=default_purposes,
        complexity=COMPLEXITIES[0] if args.complexity == ADAPTIVE else args.complexity,
        mask=args.mask,
        session_layer=args.session_layer,
        render_settings=args.render_settings,
        render_pass=args.render_pass,
        draw_modes=args.draw_modes,
    )


def read_stage(
    source: SceneSource, args: argparse.Namespace, voice: Voice, *, time: float | None, outputs: Iterable[Path]
) -> Scene:
    """Return the scene at a time code; everything that its picture will not show as the stage says it has been told.

    Args:
        source: The open stage.
        args: Of a parser that has ``render_arguments``.
        voice: Tells the diagnostics.
        time: None: the stage's start, or its default time.
        outputs: Files to be written.

    Raises:
        SceneError: The stage cannot be read, or has warnings under ``--strict``.
        OutputError: An output is one of the stage's own files.
    """
    scene = source.scene(time)
    _tell(scene, args, voice)
    _spare_inputs(scene, outputs)
    return scene


def read_moment(source: SceneSource, args: argparse.Namespace, voice: Voice, *, time: float, frame: Scene) -> Scene:
    """Return the scene at a time while the shutter of a frame is open; what is new to tell about it has been told.

    Raises:
        SceneError: It has warnings under ``--strict``.
    """
    scene = source.scene(time, base_time=frame.time)
    _tell(scene, args, voice)
    return scene


def _tell(scene: Scene, args: argparse.Namespace, voice: Voice) -> None:
    voice.diagnostics(scene.diagnostics)
    if args.strict:
        refuse_warnings(args.scene, scene.diagnostics, are_told=voice.terminal.verbosity >= 0)


def _spare_inputs(scene: Scene, outputs: Iterable[Path]) -> None:
    """Refuse to write over a file that the scene was read from, as a default name beside a texture could.

    Raises:
        OutputError: An output is an input.
    """
    inputs = {os.path.realpath(path) for path in (scene.source, *(image.path for image in scene.images)) if path}
    for output in outputs:
        if os.path.realpath(output) in inputs:
            raise OutputError(f"{output}: the scene reads this file; choose another name")
