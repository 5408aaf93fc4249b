# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``warp-rt series``: the lecture's figure, one image a depth of the ray tree, and a contact sheet."""

from __future__ import annotations

import argparse
import re
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from warp_rt.cli.columns import in_columns
from warp_rt.cli.frames import parse_frame
from warp_rt.cli.parser import Parser, add_json, add_scene, name
from warp_rt.cli.process import peak_memory, seconds_since_start
from warp_rt.cli.progress import progress_bar
from warp_rt.cli.render_arguments import add_display, add_frame, add_machine, add_quality, add_view, render_options
from warp_rt.cli.render_summary import frame_summary, sum_rays, summary_line
from warp_rt.cli.stage_input import open_refined_stage, read_stage
from warp_rt.cli.strict import add_strict
from warp_rt.cli.terminal import Terminal
from warp_rt.cli.voice import Voice
from warp_rt.errors import OptionError, OutputError
from warp_rt.image.outputs import FORMATS, SeriesFiles, check_writable, series_files
from warp_rt.image.tone import check_display
from warp_rt.options import DEFAULT_DEPTH, MAX_DEPTH, check_depths

if TYPE_CHECKING:
    from warp_rt.image.depth_series import DepthSeries

_DEPTHS = re.compile(r"(\d+)(?::(\d+))?")

_EPILOG = """\
DEPTHS is a list of 3 or 1:7, growing, such as 1:4,7. DIR is made where it is missing; it gets

  series.png         the contact sheet: every picture with its rays, the share
                     of pixels that change, and the largest change of a channel;
                     below each, what it differs from the one before by
  depth_1.png, ...   the pictures, each the same as render --depth makes
  change_2.png, ...  the differences: absolute, linear, multiplied by a power of
                     two that the sheet tells; with --format exr not multiplied

The scene is read, uploaded and its hierarchies are built once for all depths. --time-limit holds for each picture.
"""


def parser() -> Parser:
    """Return the parser of ``warp-rt series``."""
    result = Parser("series", "Render a USD stage at growing depth of the ray tree.", epilog=_EPILOG)
    add_scene(result)
    result.add_argument(
        "-o", "--output", type=name, metavar="DIR", help="folder to write to (default: SCENE_series, here)"
    )
    add_frame(add_view(result))
    quality = result.add_argument_group("how it is traced")
    quality.add_argument(
        "--depths",
        type=_depths,
        default=tuple(range(1, DEFAULT_DEPTH + 1)),
        metavar="DEPTHS",
        help=f"levels of the ray tree, picture by picture; the eye ray's is 1 (default: 1:{DEFAULT_DEPTH})",
    )
    add_quality(quality)
    picture = result.add_argument_group("what is written")
    picture.add_argument(
        "--format",
        choices=[extension.lstrip(".") for extension in FORMATS],
        default="png",
        help="of pictures and differences; the sheet is PNG (default: %(default)s)",
    )
    add_display(picture)
    add_machine(result)
    add_strict(result)
    add_json(result, "what was done, with times, exact ray counts and changes,")
    return result


def _depths(text: str) -> tuple[int, ...]:
    """Return the depths of a list such as ``1:4,7``."""
    depths: list[int] = []
    for part in text.split(","):
        match = _DEPTHS.fullmatch(part.strip())
        if match is None:
            raise argparse.ArgumentTypeError(f"a list such as 1:7 or 1,2,4 expected, got {text!r}")
        first, last = int(match[1]), int(match[2] or match[1])
        if last < first:
            raise argparse.ArgumentTypeError(f"{part.strip()!r} leads downwards; write {last}:{first}")
        if last > MAX_DEPTH:
            raise argparse.ArgumentTypeError(f"{last} is outside 1..{MAX_DEPTH}")
        depths += range(first, last + 1)
    try:
        return check_depths(depths)
    except OptionError as error:
        raise argparse.ArgumentTypeError(str(error).partition(": ")[2]) from error


def run(args: argparse.Namespace, terminal: Terminal) -> int:
    """Render, compare, write, and tell; return the exit code."""
    options = render_options(args)
    check_display(args.exposure, args.tonemap)
    frame = parse_frame(args.frames)
    folder = Path(args.output if args.output is not None else f"{Path(args.scene).stem}_series")
    files = series_files(folder, args.depths, args.format)
    _check_folder(folder, files)
    from warp_rt.image.depth_series import make_series
    from warp_rt.rendering.renderer import Renderer

    start = seconds_since_start()
    voice = Voice(terminal)
    begin = time.perf_counter()
    scene = read_stage(open_refined_stage(args, options), args, voice, time=frame, outputs=files.all())
    load = time.perf_counter() - begin
    renderer = Renderer(scene, options, device=args.device)
    films, seconds = [], []
    for index, (depth, file) in enumerate(zip(args.depths, files.pictures, strict=True), start=1):
        begin = time.perf_counter()
        with progress_bar(terminal, f"rendering {file} ({index} of {len(args.depths)})") as progress:
            films.append(renderer.render(camera=args.camera, depth=depth, progress=progress))
        seconds.append(time.perf_counter() - begin)
        voice.diagnostics(renderer.diagnostics)

    write = time.perf_counter()
    series = make_series(args.depths, films, exposure=args.exposure, tonemap=args.tonemap)
    _make_folder(folder)
    outputs = series.save(folder, extension=args.format)
    stages = {"start": start, "load": load, **renderer.seconds, "write": time.perf_counter() - write}
    told = [*scene.diagnostics, *renderer.diagnostics]
    result = frame_summary(renderer, films[-1], outputs, {**stages, "total": seconds_since_start()}, told)
    result |= {"depth": args.depths[-1], "rays": sum_rays([film.rays.to_json() for film in films])}
    result["memory"]["peak_bytes"] = peak_memory()
    result["depths"] = _steps(series, files, seconds)
    terminal.info(summary_line(result))
    if terminal.is_interactive or terminal.verbosity > 0:
        terminal.text(_table(series))
    if args.json:
        terminal.json(result)
    return 0


def _check_folder(folder: Path, files: SeriesFiles) -> None:
    """Find out before any work whether its results could be kept."""
    if not folder.exists():
        check_writable(folder)  # so can be made
        return
    if not folder.is_dir():
        raise OutputError(f"{folder}: is a file, not a folder")
    for file in files.all():
        check_writable(file)


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot make this folder: {error.strerror}") from error


def _steps(series: DepthSeries, files: SeriesFiles, seconds: Sequence[float]) -> list[dict[str, Any]]:
    """Return the JSON object of each picture."""
    changes = (None, *files.changes)
    return [
        {
            "depth": step.depth,
            "picture": str(picture),
            "change": str(change) if change else None,
            "seconds": spent,
            "rays": step.rays.to_json(),
            "changed_share": step.change.share if step.change else None,
            "largest_change": step.change.largest if step.change else None,
            "change_scale": step.change.scale if step.change else None,
        }
        for step, picture, change, spent in zip(series.steps, files.pictures, changes, seconds, strict=True)
    ]


def _table(series: DepthSeries) -> str:
    """Return what the sheet's captions say, for people."""
    from warp_rt.image.depth_series import percent

    rows = [("depth", "rays", "pixels that change", "largest change")]
    for step in series.steps:
        told = (percent(step.change.share), f"{step.change.largest:#.3g}") if step.change else ("-", "-")
        rows.append((str(step.depth), f"{step.rays.total:,}", *told))
    return in_columns(rows)
