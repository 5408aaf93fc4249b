# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``warp-rt render``: an image from a stage, or one a frame."""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from warp_rt.cli.frames import has_placeholder, numbered_files, parse_frames
from warp_rt.cli.parser import Parser, add_json, add_scene, name, names, rgb, whole_numbers
from warp_rt.cli.process import peak_memory, seconds_since_start
from warp_rt.cli.progress import progress_bar
from warp_rt.cli.ray_table import tell_rays
from warp_rt.cli.render_summary import frame_summary, summary_line, whole_run
from warp_rt.cli.strict import add_strict, refuse_warnings
from warp_rt.cli.terminal import Terminal
from warp_rt.errors import OptionError, OutputError
from warp_rt.image.outputs import check_writable, planned_files
from warp_rt.image.tone import TONE_MAPS, check_display
from warp_rt.options import AOVS, BUILDERS, INTEGRATORS, INTERSECTORS, SHADOWS, RenderOptions
from warp_rt.report import Diagnostic

if TYPE_CHECKING:
    from warp_rt.scene import Scene

COMPLEXITIES = ("low", "medium", "high", "veryhigh")

COMPILING = "compiling kernels (some ten seconds, on the first run)..."

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
    _add_view(result)
    _add_quality(result)
    _add_picture(result)
    _add_machine(result)
    add_strict(result)
    add_json(result, "what was done, with times and exact ray counts,")
    return result


def _add_view(result: Parser) -> None:
    view = result.add_argument_group("what is seen")
    view.add_argument(
        "--camera",
        "-cam",
        type=name,
        metavar="CAMERA",
        help="path or name of a camera (default: the render settings' one, main_cam, the first; else framed)",
    )
    view.add_argument("--width", "-w", "--imageWidth", type=int, metavar="PIXELS", help="default: 960")
    view.add_argument("--height", type=int, metavar="PIXELS", help="default: from the camera's aspect ratio")
    view.add_argument(
        "--crop",
        type=whole_numbers("X,Y,W,H"),
        metavar="X,Y,W,H",
        help="render this part, counted from the top left; what lies outside the picture is left off",
    )
    when = view.add_mutually_exclusive_group()
    when.add_argument("--frames", "-f", metavar="FRAMES", help="time codes to render: 1:24, or --frames=-3:-1")
    when.add_argument(
        "--default-time", "-d", "--defaultTime", action="store_true", help="render the values that hold at no time"
    )
    view.add_argument(
        "--complexity",
        "-c",
        choices=COMPLEXITIES,
        default="low",
        help="subdivision; higher than low is not supported yet and warns",
    )


def _add_quality(result: Parser) -> None:
    quality = result.add_argument_group("how it is traced")
    quality.add_argument(
        "--depth", type=int, metavar="N", help="levels of the ray tree, the eye ray's is 1 (default: 7)"
    )
    quality.add_argument(
        "--threshold", type=float, metavar="W", help="drop rays whose weight is below; 0: never (default: 1/255)"
    )
    quality.add_argument("--spp", type=int, default=1, metavar="N", help="samples a pixel (default: %(default)s)")
    quality.add_argument(
        "--seed", type=int, default=0, metavar="N", help="of the sample positions (default: %(default)s)"
    )
    quality.add_argument("--integrator", choices=INTEGRATORS, default=INTEGRATORS[0], help="default: %(default)s")
    quality.add_argument(
        "--shadows", choices=SHADOWS, default=SHADOWS[0], help="of transparent surfaces (default: %(default)s)"
    )
    quality.add_argument("--ambient", type=rgb, metavar="R,G,B", help="ambient light, linear (default: black)")
    quality.add_argument(
        "--background", type=rgb, metavar="R,G,B", help="what rays that leave see, linear (default: black)"
    )
    quality.add_argument(
        "--bvh", choices=BUILDERS, default=BUILDERS[0], help="hierarchy builder (default: %(default)s)"
    )
    quality.add_argument(
        "--intersector", choices=INTERSECTORS, default=INTERSECTORS[0], help="triangle test (default: %(default)s)"
    )


def _add_picture(result: Parser) -> None:
    picture = result.add_argument_group("what is written")
    picture.add_argument(
        "--aov", type=names, default=("color",), metavar="LIST", help=f"of {', '.join(AOVS)} (default: color)"
    )
    picture.add_argument(
        "--exposure", type=float, default=0.0, metavar="STOPS", help="brighten PNG and JPEG by so much (default: 0)"
    )
    picture.add_argument(
        "--tonemap",
        choices=TONE_MAPS,
        default=TONE_MAPS[0],
        help="of PNG and JPEG; raw: no curve (default: %(default)s)",
    )


def _add_machine(result: Parser) -> None:
    machine = result.add_argument_group("the machine")
    machine.add_argument(
        "--device", default="auto", metavar="DEVICE", help="auto, cpu, cuda:0, ... (default: %(default)s)"
    )
    machine.add_argument("--threads", type=int, metavar="N", help="CPU threads (default: one a core)")
    machine.add_argument("--time-limit", type=float, metavar="SECONDS", help="give up rendering after so long")


@dataclass(frozen=True)
class _Shot:
    """One picture to make."""

    time: float | None
    """Time code; None: the stage's start, or its default time."""
    output: Path


def run(args: argparse.Namespace, terminal: Terminal) -> int:
    """Render, write, and tell; return the exit code."""
    options = _options(args)
    shots = _shots(args)
    _check_outputs(args, shots)
    import warp_rt.renderer  # noqa: F401  (loading Warp belongs to the start, not to a frame)

    start = seconds_since_start()
    voice = _Voice(terminal)
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


class _Voice:
    """Tells each thing once, however many frames it holds for."""

    def __init__(self, terminal: Terminal) -> None:
        self.terminal = terminal
        self._told: set[Diagnostic] = set()
        self._has_announced_compiling = False

    def diagnostics(self, records: Iterable[Diagnostic]) -> None:
        """Tell the diagnostics that are new."""
        new = [record for record in records if record not in self._told]
        self.terminal.diagnostics(new)
        self._told.update(new)

    def compiling(self) -> None:
        """Tell why nothing seems to happen."""
        if not self._has_announced_compiling:
            self._has_announced_compiling = True
            self.terminal.info(COMPILING)


def _options(args: argparse.Namespace) -> RenderOptions:
    """Return the options; whatever has no default of its own here stays open for the stage's settings."""
    return RenderOptions(
        width=args.width,
        height=args.height,
        spp=args.spp,
        integrator=args.integrator,
        depth=args.depth,
        threshold=args.threshold,
        shadows=args.shadows,
        ambient=args.ambient,
        background=args.background,
        aovs=args.aov,
        seed=args.seed,
        crop=args.crop,
        bvh=args.bvh,
        intersector=args.intersector,
        threads=args.threads,
        time_limit=args.time_limit,
    )


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


def _render(args: argparse.Namespace, options: RenderOptions, shot: _Shot, voice: _Voice, label: str) -> dict[str, Any]:
    """Make one picture and return its JSON object."""
    from warp_rt.api import load_scene
    from warp_rt.image.image import Image
    from warp_rt.renderer import Renderer

    begin = time.perf_counter()
    scene = load_scene(args.scene, time=shot.time, default_time=args.default_time, purposes=args.purposes)
    load = time.perf_counter() - begin
    diagnostics = [*scene.diagnostics, *_complexity_warning(args)]
    voice.diagnostics(diagnostics)
    if args.strict:
        refuse_warnings(args.scene, diagnostics, are_told=voice.terminal.verbosity >= 0)
    _spare_inputs(scene, planned_files(shot.output, args.aov).values())

    renderer = Renderer(scene, options, device=args.device, on_compile=voice.compiling)
    with progress_bar(voice.terminal, label) as progress:
        film = renderer.render(camera=args.camera, progress=progress)
    voice.diagnostics(renderer.diagnostics)

    write = time.perf_counter()
    outputs = Image(film, exposure=args.exposure, tonemap=args.tonemap).save(shot.output)
    end = time.perf_counter()
    seconds = {"start": 0.0, "load": load, **renderer.seconds, "write": end - write, "total": end - begin}
    return frame_summary(renderer, film, outputs, seconds, [*diagnostics, *renderer.diagnostics])


def _complexity_warning(args: argparse.Namespace) -> list[Diagnostic]:
    if args.complexity == "low":
        return []
    message = (
        f"complexity {args.complexity} is not supported yet: subdivision surfaces are drawn as their control cages"
    )
    return [Diagnostic("W520", args.scene, message)]


def _spare_inputs(scene: Scene, outputs: Iterable[Path]) -> None:
    """Refuse to write over a file that the scene was read from, as a default name beside a texture could.

    Raises:
        OutputError: An output is an input.
    """
    inputs = {os.path.realpath(path) for path in (scene.source, *(image.path for image in scene.images)) if path}
    for output in outputs:
        if os.path.realpath(output) in inputs:
            raise OutputError(f"{output}: the scene reads this file; choose another name with -o")
