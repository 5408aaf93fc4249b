# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``warp-rt record``: OpenUSD's usdrecord, flag by flag, without a GPU or a display.

Differs from ``render`` in what usdrecord does by itself: a light sits in the camera even where the scene has lights,
domes do not show as background, and a stage without ``main_cam`` is framed, whatever other cameras it has.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from warp_rt.cli.parser import Parser, add_json, add_scene, name
from warp_rt.cli.pictures import make_pictures, plan_shots
from warp_rt.cli.products import make_products
from warp_rt.cli.render_arguments import (
    add_aovs,
    add_depth,
    add_frames,
    add_machine,
    add_product,
    add_quality,
    add_view,
    render_options,
)
from warp_rt.cli.strict import add_strict
from warp_rt.cli.terminal import Terminal
from warp_rt.errors import OptionError
from warp_rt.options import INTEGRATORS, RenderOptions

if TYPE_CHECKING:
    from warp_rt.scene import Camera, Scene

_EPILOG = """\
All flags of usdrecord are taken; --renderer knows our own names only. Where there is nothing to do for them, nothing
is done: --disableGpu, --resolver, --traceToFile, --traceFormat, --memstats. Unlike usdrecord's, pictures are in sRGB
with --disableGpu too.

FRAMES is as in warp-rt render. OUT is written, also where the render settings' products have names of their own;
with --product the products are written instead, in the files that they name below the current folder.
"""
_COLOR_MODES = {"sRGB": "srgb", "disabled": "raw"}


def parser() -> Parser:
    """Return the parser of ``warp-rt record``."""
    result = Parser("record", "Render an image from a USD stage, with usdrecord's arguments.", epilog=_EPILOG)
    add_scene(result)
    result.add_argument("output", type=name, metavar="OUT", help="image to write")
    add_frames(add_view(result, as_usdrecord=True))
    usdrecord = result.add_argument_group("usdrecord's")
    usdrecord.add_argument(
        "--disableCameraLight", dest="camera_light", action="store_false", help="no light in the camera"
    )
    usdrecord.add_argument(
        "--enableDomeLightVisibility", dest="show_domes", action="store_true", help="domes are the background"
    )
    usdrecord.add_argument(
        "--colorCorrectionMode",
        "-color",
        dest="color_mode",
        choices=(*_COLOR_MODES, "openColorIO"),
        default="sRGB",
        help="of PNG and JPEG (default: %(default)s); there is no openColorIO",
    )
    usdrecord.add_argument(
        "--renderer", "-r", metavar="NAME", help=f"of {', '.join(INTEGRATORS)}, as --integrator says"
    )
    for flag in ("--disableGpu", "--memstats"):
        usdrecord.add_argument(flag, action="store_true", help=argparse.SUPPRESS)
    for flag in ("--resolver", "--traceToFile", "--traceFormat"):
        usdrecord.add_argument(flag, help=argparse.SUPPRESS)
    quality = result.add_argument_group("how it is traced")
    add_depth(quality)
    add_quality(quality)
    picture = result.add_argument_group("what is written")
    add_product(picture)
    add_aovs(picture)
    picture.add_argument("--exposure", type=float, default=0.0, metavar="STOPS", help="brighten PNG and JPEG")
    add_machine(result)
    add_strict(result)
    add_json(result, "what was done, with times and exact ray counts,")
    return result


def run(args: argparse.Namespace, terminal: Terminal) -> int:
    """Render, write, and tell; return the exit code."""
    if args.color_mode not in _COLOR_MODES:
        raise OptionError(
            f"--colorCorrectionMode: {args.color_mode} is not supported; there are {', '.join(_COLOR_MODES)}"
        )
    if args.renderer is not None:
        if args.renderer.lower() not in INTEGRATORS:
            raise OptionError(f"--renderer: there is no {args.renderer!r}, only {', '.join(INTEGRATORS)}; leave it out")
        args.integrator = args.renderer.lower()
    args.tonemap = _COLOR_MODES[args.color_mode]
    output = Path(args.output)
    if args.frames is not None and "#" not in output.name and args.product is None:
        raise OptionError(f"{output}: with --frames, the file name needs a placeholder, such as name.####.png")
    options = render_options(args, depth=args.depth, aovs=args.aov or ("color",))

    def view(scene: Scene) -> tuple[Scene, Camera]:
        camera = _camera(scene, args.camera, options)
        if not args.show_domes:
            scene = replace(scene, domes=tuple(replace(dome, is_visible=False) for dome in scene.domes))
        from warp_rt.rendering.headlight import headlight

        light = headlight(camera)
        if args.camera_light:
            scene = replace(scene, lights=(*scene.lights, light))
        elif not scene.lights and not scene.domes:  # the light is there, but out: so no other steps in
            scene = replace(scene, lights=(replace(light, radiance=(0.0, 0.0, 0.0)),))
        return scene, camera

    told: set[str] = set()

    def announce(scene: Scene) -> None:
        camera = _camera(scene, args.camera, options)
        is_framed = camera.path not in [own.path for own in scene.cameras]
        for line in (f"Camera: {'framed' if is_framed else camera.path}", f"Renderer plugin: {options.integrator}"):
            if line not in told:  # once, as usdrecord does
                terminal.info(line)
            told.add(line)
        terminal.info(f"Recording time code: {'DEFAULT' if scene.time is None else f'{scene.time:g}'}")

    if args.product is not None:
        # Products have sizes of their own, which --imageWidth leaves as they are.
        return make_products(args, terminal, replace(options, width=None, height=None), view, announce)
    shots = plan_shots(args.frames, output, args.aov or ("color",))
    return make_pictures(args, terminal, options, shots, view, announce)


def _camera(scene: Scene, name: str | None, options: RenderOptions) -> Camera:
    """Return usdrecord's camera: the one asked for, the render settings', ``main_cam``, or one that frames it all."""
    from warp_rt.rendering.film_camera import choose_camera, frame_camera

    chosen = choose_camera(scene, name, as_usdrecord=True)
    return chosen or frame_camera(scene, options, as_usdrecord=True)
