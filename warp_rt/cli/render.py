# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``warp-rt render``: an image from a stage, or one a frame."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from warp_rt.cli.parser import Parser, add_json
from warp_rt.cli.pictures import View, make_pictures
from warp_rt.cli.products import make_products
from warp_rt.cli.request import add_request, request_options, request_output, request_shots
from warp_rt.cli.terminal import Terminal

if TYPE_CHECKING:
    from warp_rt.scene import Scene

_EPILOG = """\
OUT decides by its extension: .exr holds every AOV as linear float; .png (straight alpha) and .jpg (over black) hold
colour for display, and every further AOV is written beside it, exact, as NAME.AOV.npy. Wherever there are ids,
NAME.ids.json says which prim each number stands for. Costs (nodesVisited, triangleTests, treeSize, deepest, rays) come
beside PNG and JPEG also as NAME.AOV.png, with a colour bar; a cost that is asked for alone is the picture itself. No
file is ever left half written.

FRAMES is a list of 123, 101:105, 105:101, 101:109x2 or 101:104x0.5; write --frames=-3:-1 where
it begins with a minus. OUT then holds one placeholder for the frame's number, ### or ###.## where there are fractions.
Without --frames, the stage's start time is rendered.

--product makes what a RenderProduct of the stage's render settings asks for, or all of them: with the camera, the
resolution and the data window that it says, the AOVs of its render vars (unless --aov says which), in the file that it
names below the current folder, or in OUT. Without --product the first one says how pictures are made, not where.
"""


def parser() -> Parser:
    """Return the parser of ``warp-rt render``."""
    result = Parser("render", "Render an image from a USD stage by Whitted ray tracing.", epilog=_EPILOG)
    add_request(result)
    add_json(result, "what was done, with times and exact ray counts,")
    return result


def run(args: argparse.Namespace, terminal: Terminal) -> int:
    """Render, write, and tell; return the exit code."""
    options = request_options(args)

    def view(scene: Scene) -> View:
        return scene, args.camera

    if args.product is not None:
        return make_products(args, terminal, options, view, output=request_output(args))
    return make_pictures(args, terminal, options, request_shots(args), view)
