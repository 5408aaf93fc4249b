# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``warp-rt render``: an image from a stage, or one a frame."""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from warp_rt.cli.frames import has_placeholder, numbered_files, parse_frames
from warp_rt.cli.parser import Parser, add_json, add_scene, names
from warp_rt.cli.process import peak_memory, seconds_since_start
from warp_rt.cli.progress import progress_bar
from warp_rt.cli.ray_table import tell_rays
from warp_rt.cli.render_arguments import add_display, add_machine, add_quality, add_view, render_options
from warp_rt.cli.render_summary import frame_summary, summary_line, whole_run
from warp_rt.cli.stage_input import read_stage
from warp_rt.cli.strict import add_strict
from warp_rt.cli.terminal import Terminal
from warp_rt.cli.voice import Voice
from warp_rt.errors import OptionError
from warp_rt.image.outputs import check_writable, planned_files
from warp_rt.image.tone import check_display
from warp_rt.options import AOVS, RenderOptions

_EPILOG = """\
OUT decides by its extension: .exr holds every AOV as linear float; .png (straight alpha) and .jpg (over black) hold
colour for display, and every further AOV is written beside it, exact, as NAME.AOV.npy. Wherever there are ids,
NAME.ids.json says which prim each number stands for. No file is ever left half written.

FRAMES is a list of 123, 101:105, 105:101, 101:109x2 or 101:104x0.5; write --frames=-3:-1 where
it begins with a minus. OUT then holds one placeholder for the frame's number, ### or ###.## where there are fractions.
Without --frames, the stage's start time is rendered.
"""


def parser() -> Parser:
    """Return the parser of ``warp-rt render``."""
    result = Parser("render", "Render an image from a USD stage by Whitted ray tracing.", epilog=_EPILOG)
    add_scene(result)
    result.add_argument("-o", "--output", metavar="OUT", help="image to write (default: SCENE's name, .png, here)")
    when = add_view(result)
    when.add_argument("--frames", "-f", metavar="FRAMES", help="time codes to render: 1:24, or --frames=-3:-1")
    quality = result.add_argument_group("how it is traced")
    quality.add_argument(
        "--depth", type=int, metavar="N", help="levels of the ray tree, the eye ray's is 1 (default: 7)"
    )
    add_quality(quality)
    picture = result.add_argument_group("what is written")
    picture.add_argument(
        "--aov", type=names, default=("color",), metavar="LIST", help=f"of {', '.join(AOVS)} (default: color)"
    )
    add_display(picture)
    add_machine(result)
    add_strict(result)
    add_json(result, "what was done, with times and exact ray counts,")
    return result


@dataclass(frozen=True)
class _Shot:
    """One picture to make."""

    time: float | None
    """Time code; None: the stage's start, or its default time."""
    output: Path


def run(args: argparse.Namespace, terminal: Terminal) -> int:
    """Render, write, and tell; return the exit code."""
    options = render_options(args, depth=args.depth, aovs=args.aov)
    shots = _shots(args)
    _check_outputs(args, shots)
    import warp_rt.renderer  # noqa: F401  (loading Warp belongs to the start, not to a frame)

    start = seconds_since_start()
    voice = Voice(terminal)
    frames = []
    for index, shot in enumerate(shots):
        file = shot.output.name + (f" ({index + 1} of {len(shots)})" if len(shots) > 1 else "")
        frames.append(_render(args, options, shot, voice, f"rendering {file}"))
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


def _shots(args: argparse.Namespace) -> list[_Shot]:
    frames = parse_frames(args.frames) if args.frames is not None else ()
    if args.output is not None:
        output = Path(args.output)
    else:
        output = Path(f"{Path(args.scene).stem}{'.####' if len(frames) > 1 else ''}.png")
    if frames:
        return [_Shot(float(frame), path) for frame, path in zip(frames, numbered_files(output, frames), strict=True)]
    if has_placeholder(output):
        raise OptionError(f"{output}: a placeholder for frames needs --frames")
    return [_Shot(None, output)]


def _check_outputs(args: argparse.Namespace, shots: Sequence[_Shot]) -> None:
    """Find out before any work whether its results could be kept."""
    check_display(args.exposure, args.tonemap)
    for shot in shots:
        for path in planned_files(shot.output, args.aov).values():
            check_writable(path)


def _render(args: argparse.Namespace, options: RenderOptions, shot: _Shot, voice: Voice, label: str) -> dict[str, Any]:
    """Make one picture and return its JSON object."""
    from warp_rt.image.image import Image
    from warp_rt.renderer import Renderer

    begin = time.perf_counter()
    files = planned_files(shot.output, args.aov).values()
    scene = read_stage(args, voice, time=shot.time, outputs=files)
    load = time.perf_counter() - begin
    renderer = Renderer(scene, options, device=args.device, on_compile=voice.compiling)
    with progress_bar(voice.terminal, label) as progress:
        film = renderer.render(camera=args.camera, progress=progress)
    voice.diagnostics(renderer.diagnostics)

    write = time.perf_counter()
    outputs = Image(film, exposure=args.exposure, tonemap=args.tonemap).save(shot.output)
    end = time.perf_counter()
    seconds = {"start": 0.0, "load": load, **renderer.seconds, "write": end - write, "total": end - begin}
    return frame_summary(renderer, film, outputs, seconds, [*scene.diagnostics, *renderer.diagnostics])
