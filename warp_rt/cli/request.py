# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What ``render`` is asked for; ``check`` takes the very same, to tell beforehand how it would go."""

from __future__ import annotations

import argparse
from pathlib import Path

from warp_rt.cli.frames import parse_frames, placeholder
from warp_rt.cli.parser import Parser, add_scene, name
from warp_rt.cli.pictures import Shot, plan_shots
from warp_rt.cli.render_arguments import (
    add_aovs,
    add_depth,
    add_display,
    add_frames,
    add_machine,
    add_product,
    add_quality,
    add_view,
    render_options,
)
from warp_rt.cli.strict import add_strict
from warp_rt.options import RenderOptions


def add_request(parser: Parser) -> None:
    """Add the options of ``render``, all but ``--json``."""
    add_scene(parser)
    parser.add_argument(
        "-o", "--output", type=name, metavar="OUT", help="image to write (default: SCENE's name, .png, here)"
    )
    add_frames(add_view(parser))
    quality = parser.add_argument_group("how it is traced")
    add_depth(quality)
    add_quality(quality)
    picture = parser.add_argument_group("what is written")
    add_product(picture)
    add_aovs(picture)
    add_display(picture)
    add_machine(parser)
    add_strict(parser)


def request_options(args: argparse.Namespace) -> RenderOptions:
    """Return the options of the pictures."""
    return render_options(args, depth=args.depth, aovs=args.aov or ("color",))


def request_output(args: argparse.Namespace) -> Path | None:
    """Return ``--output``."""
    return None if args.output is None else Path(args.output)


def request_shots(args: argparse.Namespace) -> list[Shot]:
    """Return the pictures of a request without ``--product``.

    Raises:
        OptionError: ``--frames`` cannot be read, or does not fit the placeholder in the file's name.
    """
    output = request_output(args)
    if output is None:
        codes = parse_frames(args.frames) if args.frames is not None else ()
        number = f".{placeholder(codes)}" if len(codes) > 1 else ""
        # Absolute, for a folder such as "." has no name of its own; that it is no stage is told where it is opened.
        output = Path(f"{Path(args.scene).absolute().stem}{number}.png")
    return plan_shots(args.frames, output, args.aov or ("color",))
