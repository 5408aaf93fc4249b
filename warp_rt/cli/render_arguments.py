# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The options by which pictures are asked for, shared by the commands that make some."""

from __future__ import annotations

import argparse
from typing import Any

from warp_rt.cli.parser import Parser, name, rgb, some_names, whole_numbers
from warp_rt.image.tone import TONE_MAPS
from warp_rt.options import (
    ADAPTIVE,
    AOVS,
    BUILDERS,
    COMPLEXITIES,
    DEFAULT_DEPTH,
    INTEGRATORS,
    INTERSECTORS,
    SHADOWS,
    TEXTURE_FILTERS,
    RenderOptions,
)


def add_view(parser: Parser, *, as_usdrecord: bool = False) -> argparse._MutuallyExclusiveGroup:
    """Add what is seen; return the group that holds --default-time, to which belongs whatever else picks a time.

    Args:
        parser: Takes the options.
        as_usdrecord: Whether a camera that nobody names is none but ``main_cam``.
    """
    view = parser.add_argument_group("what is seen")
    _add_camera(view, "" if as_usdrecord else ", the first")
    _add_composition(view)
    when = view.add_mutually_exclusive_group()
    when.add_argument(
        "--default-time", "-d", "--defaultTime", action="store_true", help="render the values that hold at no time"
    )
    return when


def _add_camera(view: argparse._ArgumentGroup, first: str) -> None:
    """Add the camera and its picture; ``first`` is who else is looked through where nobody is named."""
    view.add_argument(
        "--camera",
        "-cam",
        type=name,
        metavar="CAMERA",
        help=f"path or name of a camera (default: the render settings' one, main_cam{first}; else framed)",
    )
    width_help = "default: the settings' resolution, else 960"
    view.add_argument("--width", "-w", "--imageWidth", type=int, metavar="PIXELS", help=width_help)
    view.add_argument("--height", type=int, metavar="PIXELS", help="default: from the camera's aspect ratio")
    view.add_argument(
        "--crop",
        type=whole_numbers("X,Y,W,H"),
        metavar="X,Y,W,H",
        help="render this part, counted from the top left; what lies outside the picture is left off",
    )


def _add_composition(view: argparse._ArgumentGroup) -> None:
    """Add how the stage is composed and read."""
    view.add_argument(
        "--complexity",
        "-c",
        choices=(*COMPLEXITIES, ADAPTIVE),
        default=COMPLEXITIES[0],
        help="subdivision surfaces: the cage, refined 1, 2 or 3 times, or by their size in the picture "
        "(default: %(default)s)",
    )
    view.add_argument(
        "--disable-draw-mode",
        "--disableDrawMode",
        dest="draw_modes",
        action="store_false",
        help="draw models in full, whatever their draw mode",
    )
    view.add_argument(
        "--mask",
        type=some_names,
        default=(),
        metavar="PATH[,PATH]",
        help="compose these prims only, with all below them",
    )
    view.add_argument(
        "--session-layer", "--sessionLayer", type=name, metavar="FILE", help="a layer stronger than the stage's own"
    )
    source = view.add_mutually_exclusive_group()
    source.add_argument(
        "--render-settings",
        "-rs",
        "--renderSettingsPrimPath",
        type=name,
        metavar="PATH",
        help="RenderSettings prim (default: the one that the stage names)",
    )
    source.add_argument(
        "--render-pass",
        "-rp",
        "--renderPassPrimPath",
        type=name,
        metavar="PATH",
        help="RenderPass that names them",
    )


def add_frames(when: argparse._MutuallyExclusiveGroup) -> None:
    """Add --frames, of which there may be many."""
    when.add_argument("--frames", "-f", metavar="FRAMES", help="time codes to render: 1:24, or --frames=-3:-1")


def add_frame(when: argparse._MutuallyExclusiveGroup) -> None:
    """Add --frames to a command that makes one."""
    when.add_argument("--frames", "-f", metavar="FRAME", help="one time code (default: the stage's start)")


def add_product(group: argparse._ArgumentGroup) -> None:
    """Add --product."""
    group.add_argument(
        "--product",
        type=name,
        metavar="PRODUCT",
        help="make this RenderProduct (path or name), or all, in the files that they name",
    )


def add_aovs(group: argparse._ArgumentGroup) -> None:
    """Add --aov."""
    group.add_argument(
        "--aov", type=some_names, metavar="LIST", help=f"of {', '.join(AOVS)}, primvars:NAME (default: color)"
    )


def add_depth(group: argparse._ArgumentGroup) -> None:
    """Add --depth."""
    group.add_argument(
        "--depth",
        type=int,
        metavar="N",
        help=f"levels of the ray tree, the eye ray's is 1 (default: {DEFAULT_DEPTH})",
    )


def add_quality(group: argparse._ArgumentGroup) -> None:
    """Add how it is traced, all but the depth."""
    group.add_argument(
        "--threshold", type=float, metavar="W", help="drop rays whose weight is below; 0: never (default: 1/255)"
    )
    group.add_argument("--spp", type=int, default=1, metavar="N", help="samples a pixel (default: %(default)s)")
    group.add_argument(
        "--light-samples",
        type=int,
        metavar="N",
        help="samples of each dome and area light, for soft shadows; 0: sharp ones, no noise (default: 0)",
    )
    group.add_argument(
        "--lights-visible", action="store_true", help="rays see area lights, whose mirror images replace highlights"
    )
    group.add_argument(
        "--seed", type=int, default=0, metavar="N", help="of the sample positions (default: %(default)s)"
    )
    group.add_argument("--integrator", choices=INTEGRATORS, default=INTEGRATORS[0], help="default: %(default)s")
    group.add_argument(
        "--shadows", choices=SHADOWS, default=SHADOWS[0], help="of transparent surfaces (default: %(default)s)"
    )
    group.add_argument(
        "--texture-filter",
        choices=TEXTURE_FILTERS,
        default=TEXTURE_FILTERS[0],
        help="mean over what a sample sees, or the texels about its ray alone (default: %(default)s)",
    )
    group.add_argument(
        "--ambient", type=rgb, metavar="R,G,B", help="ambient light, linear (default: the settings', else black)"
    )
    group.add_argument(
        "--background",
        type=rgb,
        metavar="R,G,B",
        help="what rays that leave see, linear (default: the settings', else black)",
    )
    group.add_argument("--bvh", choices=BUILDERS, default=BUILDERS[0], help="hierarchy builder (default: %(default)s)")
    group.add_argument(
        "--intersector", choices=INTERSECTORS, default=INTERSECTORS[0], help="triangle test (default: %(default)s)"
    )


def add_display(group: argparse._ArgumentGroup) -> None:
    """Add how linear values are shown."""
    group.add_argument(
        "--exposure", type=float, default=0.0, metavar="STOPS", help="brighten PNG and JPEG by so much (default: 0)"
    )
    group.add_argument(
        "--tonemap",
        choices=TONE_MAPS,
        default=TONE_MAPS[0],
        help="of PNG and JPEG; raw: no curve (default: %(default)s)",
    )


def add_machine(parser: Parser) -> None:
    """Add what it is traced on."""
    machine = parser.add_argument_group("the machine")
    machine.add_argument(
        "--device", default="auto", metavar="DEVICE", help="auto, cpu, cuda:0, ... (default: %(default)s)"
    )
    machine.add_argument("--threads", type=int, metavar="N", help="CPU threads (default: one a core)")
    machine.add_argument(
        "--time-limit",
        type=float,
        metavar="SECONDS",
        help="give up each picture after so long, looked at every 0.05 s; reading, building and compiling do not count",
    )


def render_options(args: argparse.Namespace, **others: Any) -> RenderOptions:
    """Return the options; whatever has no default of its own here stays open for the stage's settings.

    Args:
        args: Of a parser that has the options of this file.
        others: What the command decides by options of its own.
    """
    return RenderOptions(
        width=args.width,
        height=args.height,
        spp=args.spp,
        integrator=args.integrator,
        threshold=args.threshold,
        light_samples=args.light_samples,
        lights_visible=args.lights_visible,
        shadows=args.shadows,
        texture_filter=args.texture_filter,
        ambient=args.ambient,
        background=args.background,
        seed=args.seed,
        crop=args.crop,
        bvh=args.bvh,
        intersector=args.intersector,
        threads=args.threads,
        time_limit=args.time_limit,
        **others,
    )
