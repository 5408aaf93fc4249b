# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""From time codes to files: the run that ``render`` and ``record`` have in common."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from warp_rt.cli.frames import has_placeholder, numbered_files, parse_frames
from warp_rt.cli.process import peak_memory, seconds_since_start
from warp_rt.cli.progress import progress_bar
from warp_rt.cli.ray_table import tell_rays
from warp_rt.cli.render_summary import frame_summary, summary_line, whole_run
from warp_rt.cli.stage_input import as_product, open_refined_stage, open_stage, read_moment, read_stage
from warp_rt.cli.terminal import Terminal
from warp_rt.cli.voice import Voice
from warp_rt.errors import OptionError
from warp_rt.image.outputs import check_writable, format_of, has_legend, picture_of, planned_files
from warp_rt.image.tone import check_display
from warp_rt.options import RenderOptions
from warp_rt.report import Diagnostic

if TYPE_CHECKING:
    from warp_rt.rendering.renderer import Renderer
    from warp_rt.scene import Camera, Product, Scene
    from warp_rt.scene.source import RefinableSource, SceneSource

View = tuple["Scene", "str | Camera | None"]
"""A scene, and the camera that sees it: its name, one of the command's own, or None for the scene's."""


@dataclass(frozen=True)
class Shot:
    """One picture to make."""

    time: float | None
    """Time code; None: the stage's start, or its default time."""
    output: Path
    aovs: tuple[str, ...]
    product: Product | None = None
    """Which it is of those that the render settings ask for; None: the command asks for it."""

    def options(self, options: RenderOptions) -> RenderOptions:
        """Return how it is rendered: as a command says, but with its AOVs; alpha comes with colour."""
        return replace(options, aovs=tuple(aov for aov in self.aovs if aov != "alpha"))


def plan_shots(frames: str | None, output: Path, aovs: tuple[str, ...]) -> list[Shot]:
    """Return a shot for each frame of a list such as ``1:24``, or the one of the stage's start.

    Raises:
        OptionError: The list cannot be read, or it does not fit the placeholder in the file's name.
    """
    if frames is not None:
        codes = parse_frames(frames)
        return [Shot(float(code), path, aovs) for code, path in zip(codes, numbered_files(output, codes), strict=True)]
    if has_placeholder(output):
        raise OptionError(f"{output}: a placeholder for frames needs --frames")
    return [Shot(None, output, aovs)]


def make_pictures(
    args: argparse.Namespace,
    terminal: Terminal,
    options: RenderOptions,
    shots: Sequence[Shot],
    view: Callable[[Scene], View],
    announce: Callable[[Scene], None] | None = None,
    source: RefinableSource | None = None,
    notes: Sequence[Diagnostic] = (),
) -> int:
    """Render the shots, write them, and tell; return the exit code.

    Args:
        args: Of a parser that has ``render_arguments``.
        terminal: Takes what is told.
        options: How.
        shots: What.
        view: Says what of a scene is seen.
        announce: Tells of a frame, before it is rendered.
        source: The stage where it is open already.
        notes: What there is to tell of the shots themselves.
    """
    check_display(args.exposure, args.tonemap)
    for shot in shots:
        for path in planned_files(shot.output, shot.aovs).values():
            check_writable(path)  # before any work whose result could not be kept
    import warp_rt.rendering.renderer  # noqa: F401  (loading Warp belongs to the start, not to a frame)

    start = seconds_since_start()
    voice = Voice(terminal)
    voice.diagnostics(notes)
    frames = []
    previous = None
    begin = time.perf_counter()
    opened = source or open_stage(args)
    products = dict.fromkeys(shot.product for shot in shots)
    sources = {product: open_refined_stage(args, options, opened, product, view) for product in products}
    run = _Run(args, options, sources, view, announce, voice)
    opening = time.perf_counter() - begin
    for index, shot in enumerate(shots):
        file = str(shot.output) + (f" ({index + 1} of {len(shots)})" if len(shots) > 1 else "")
        frame, previous = _make_picture(run, shot, f"rendering {file}", previous)
        frames.append(frame)
        if len(shots) > 1 and not terminal.is_interactive:
            terminal.info(f"{file}: {frames[-1]['seconds']['total']:.2f} s")
    result = whole_run(frames, [shot.time for shot in shots])
    result["notes"] = [*map(vars, notes), *result["notes"]]
    result["seconds"] |= {"start": start, "total": seconds_since_start()}
    result["seconds"]["load"] += opening
    result["memory"]["peak_bytes"] = peak_memory()
    terminal.info(summary_line(result, has_legend=any(has_legend(shot.output, shot.aovs) for shot in shots)))
    tell_rays(terminal, result["rays"])
    terminal.detail(", ".join(f"{stage} {value:.2f} s" for stage, value in result["seconds"].items()))
    if args.json:
        terminal.json(result)
    return 0


@dataclass(frozen=True)
class _Run:
    """What all pictures of a run have in common."""

    args: argparse.Namespace
    options: RenderOptions
    sources: Mapping[Product | None, SceneSource]
    """The stage, refined for the pictures of each product."""
    view: Callable[[Scene], View]
    announce: Callable[[Scene], None] | None
    voice: Voice


def _make_picture(run: _Run, shot: Shot, label: str, previous: Renderer | None) -> tuple[dict[str, Any], Renderer]:
    """Make one picture and return its JSON object and renderer, whose hierarchy the next frame may refit."""
    from warp_rt.cli.brightness import brightness_note
    from warp_rt.image.image import Image
    from warp_rt.rendering.renderer import Renderer
    from warp_rt.rendering.shutter import render_frame

    begin = time.perf_counter()
    files = planned_files(shot.output, shot.aovs).values()
    args, voice, source = run.args, run.voice, run.sources[shot.product]
    frame = read_stage(source, args, voice, time=shot.time, outputs=files)
    if run.announce is not None:
        run.announce(frame)
    scene, camera = run.view(as_product(frame, shot.product))
    load = time.perf_counter() - begin
    notes = [] if shot.product else unmade_products(scene)
    voice.diagnostics(notes)
    told = dict.fromkeys([*scene.diagnostics, *notes])
    renderer = Renderer(scene, shot.options(run.options), device=args.device, previous=previous)

    def view_at(moment: float) -> View:
        nonlocal load
        begin = time.perf_counter()
        at_moment = read_moment(source, args, voice, time=moment, frame=frame)
        told.update(dict.fromkeys(at_moment.diagnostics))
        seen = run.view(as_product(at_moment, shot.product))
        load += time.perf_counter() - begin
        return seen

    with progress_bar(voice.terminal, label) as progress:
        film, moments = render_frame(renderer, view_at, camera=camera, progress=progress)
    voice.diagnostics(renderer.diagnostics)

    write = time.perf_counter()
    image = Image(film, exposure=args.exposure, tonemap=args.tonemap)
    if format_of(shot.output) != "exr" and picture_of(shot.output, shot.aovs) == "color":
        noted = brightness_note(image)
        voice.diagnostics(noted)
        told.update(dict.fromkeys(noted))
    outputs = image.save(shot.output, aovs=shot.aovs, layers=shot.product.variables if shot.product else ())
    end = time.perf_counter()
    seconds = {"start": 0.0, "load": load, **renderer.seconds, "write": end - write, "total": end - begin}
    summary = frame_summary(renderer, film, outputs, seconds, [*told, *renderer.diagnostics])
    return {**summary, "moments": moments}, renderer


def unmade_products(scene: Scene) -> list[Diagnostic]:
    """Return notes on the products whose names and render vars count for nothing."""
    message = "its productName and orderedVars count with --product only"
    return [Diagnostic("N904", one.path, message) for one in scene.products if one.name or one.names or one.variables]
