# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""From time codes to files: the run that ``render`` and ``record`` have in common."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from warp_rt.cli.frames import has_placeholder, numbered_files, parse_frames
from warp_rt.cli.process import peak_memory, seconds_since_start
from warp_rt.cli.progress import progress_bar
from warp_rt.cli.ray_table import tell_rays
from warp_rt.cli.render_summary import frame_summary, summary_line, whole_run
from warp_rt.cli.stage_input import read_stage
from warp_rt.cli.terminal import Terminal
from warp_rt.cli.voice import Voice
from warp_rt.errors import OptionError
from warp_rt.image.outputs import check_writable, planned_files
from warp_rt.image.tone import check_display
from warp_rt.options import RenderOptions

if TYPE_CHECKING:
    from warp_rt.renderer import Renderer
    from warp_rt.scene import Camera, Scene

View = tuple["Scene", "str | Camera | None"]
"""A scene, and the camera that sees it: its name, one of the command's own, or None for the scene's."""


@dataclass(frozen=True)
class Shot:
    """One picture to make."""

    time: float | None
    """Time code; None: the stage's start, or its default time."""
    output: Path


def plan_shots(frames: str | None, output: Path) -> list[Shot]:
    """Return a shot for each frame of a list such as ``1:24``, or the one of the stage's start.

    Raises:
        OptionError: The list cannot be read, or it does not fit the placeholder in the file's name.
    """
    if frames is not None:
        codes = parse_frames(frames)
        return [Shot(float(code), path) for code, path in zip(codes, numbered_files(output, codes), strict=True)]
    if has_placeholder(output):
        raise OptionError(f"{output}: a placeholder for frames needs --frames")
    return [Shot(None, output)]


def make_pictures(
    args: argparse.Namespace,
    terminal: Terminal,
    options: RenderOptions,
    shots: Sequence[Shot],
    view: Callable[[Scene], View],
) -> int:
    """Render the shots, write them, and tell; return the exit code.

    Args:
        args: Of a parser that has ``render_arguments``.
        terminal: Takes what is told.
        options: How.
        shots: What.
        view: Says what of a scene is seen.
    """
    check_display(args.exposure, args.tonemap)
    for shot in shots:
        for path in planned_files(shot.output, args.aov).values():
            check_writable(path)  # before any work whose result could not be kept
    import warp_rt.renderer  # noqa: F401  (loading Warp belongs to the start, not to a frame)

    start = seconds_since_start()
    voice = Voice(terminal)
    frames = []
    previous = None
    for index, shot in enumerate(shots):
        file = shot.output.name + (f" ({index + 1} of {len(shots)})" if len(shots) > 1 else "")
        frame, previous = _make_picture(args, options, shot, view, voice, f"rendering {file}", previous)
        frames.append(frame)
        if len(shots) > 1 and not terminal.is_interactive:
            terminal.info(f"{file}: {frames[-1]['seconds']['total']:.2f} s")
    result = whole_run(frames, [shot.time for shot in shots])
    result["seconds"] |= {"start": start, "total": seconds_since_start()}
    result["memory"]["peak_bytes"] = peak_memory()
    terminal.info(summary_line(result))
    tell_rays(terminal, result["rays"])
    terminal.detail(", ".join(f"{stage} {value:.2f} s" for stage, value in result["seconds"].items()))
    if args.json:
        terminal.json(result)
    return 0


def _make_picture(
    args: argparse.Namespace,
    options: RenderOptions,
    shot: Shot,
    view: Callable[[Scene], View],
    voice: Voice,
    label: str,
    previous: Renderer | None,
) -> tuple[dict[str, Any], Renderer]:
    """Make one picture and return its JSON object and renderer, whose hierarchy the next frame may refit."""
    from warp_rt.image.image import Image
    from warp_rt.renderer import Renderer

    begin = time.perf_counter()
    files = planned_files(shot.output, args.aov).values()
    scene, camera = view(read_stage(args, voice, time=shot.time, outputs=files))
    load = time.perf_counter() - begin
    renderer = Renderer(scene, options, device=args.device, on_compile=voice.compiling, previous=previous)
    with progress_bar(voice.terminal, label) as progress:
        film = renderer.render(camera=camera, progress=progress)
    voice.diagnostics(renderer.diagnostics)

    write = time.perf_counter()
    outputs = Image(film, exposure=args.exposure, tonemap=args.tonemap).save(shot.output, aovs=args.aov)
    end = time.perf_counter()
    seconds = {"start": 0.0, "load": load, **renderer.seconds, "write": end - write, "total": end - begin}
    summary = frame_summary(renderer, film, outputs, seconds, [*scene.diagnostics, *renderer.diagnostics])
    return summary, renderer
