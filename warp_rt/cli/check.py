# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``warp-rt check``: all that ``render`` would ignore, repair or refuse, told without rendering."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import TYPE_CHECKING

from warp_rt.cli.parser import Parser, add_json
from warp_rt.cli.pictures import Shot, unmade_products
from warp_rt.cli.products import product_shots
from warp_rt.cli.request import add_request, request_options, request_output, request_shots
from warp_rt.cli.stage_input import as_product, open_refined_stage, open_stage
from warp_rt.cli.strict import refuse_warnings
from warp_rt.cli.terminal import Terminal, one_line
from warp_rt.options import PRODUCT_PURPOSES, RenderOptions
from warp_rt.report import Diagnostic, counted

if TYPE_CHECKING:
    from warp_rt.scene.source import SceneSource

_EPILOG = """\
Takes the options of warp-rt render, and prints what that would tell of the same pictures, each thing once; all but what
only their pixels tell. Nothing is traced, compiled or written. Of several frames, what does not hold from the first one
on comes with the one from which it does.
"""


def parser() -> Parser:
    """Return the parser of ``warp-rt check``."""
    result = Parser(
        "check", "Name everything in a stage that a picture would not show as the stage says it.", epilog=_EPILOG
    )
    add_request(result)
    add_json(result, "the diagnostics")
    return result


def run(args: argparse.Namespace, terminal: Terminal) -> int:
    """Read the stage as the pictures would and print what is to be told; return the exit code."""
    options = request_options(args)
    found: dict[Diagnostic, float | None] = {}  # and the frame that each was first found in
    if args.product is None:
        shots = request_shots(args)
        source = open_stage(args)
    else:
        source = open_stage(args, PRODUCT_PURPOSES)
        shots, notes = product_shots(source, args.product, args.frames, args.aov, request_output(args))
        found = dict.fromkeys(notes, shots[0].time)
    products = dict.fromkeys(shot.product for shot in shots)
    refined = {product: open_refined_stage(args, options, source, product) for product in products}
    for shot in shots:
        for record in _foreseen(args, options, refined[shot.product], shot):
            found.setdefault(record, shot.time)
    warning_count = sum(record.is_warning for record in found)
    if args.json:
        records = [{**vars(record), "frame": frame} for record, frame in found.items()]
        terminal.json({"scene": args.scene, "warnings": warning_count, "diagnostics": records})
    else:
        for record, frame in found.items():
            terminal.data(one_line(record) + ("" if frame == shots[0].time else f" (from frame {frame:g} on)"))
    if args.strict:
        refuse_warnings(args.scene, found, are_told=True)
    counts = (counted(warning_count, "warning"), counted(len(found) - warning_count, "note"))
    terminal.info(f"{args.scene}: {', '.join(counts)}")
    return 0


def _foreseen(
    args: argparse.Namespace, options: RenderOptions, source: SceneSource, shot: Shot
) -> Iterator[Diagnostic]:
    """Yield what is found on the way to a picture, in the order in which ``render`` tells it."""
    from warp_rt.rendering.rehearsal import rehearse

    scene = source.scene(shot.time)
    yield from scene.diagnostics
    seen = as_product(scene, shot.product)
    if shot.product is None:
        yield from unmade_products(seen)
    picture = rehearse(seen, shot.options(options), args.camera)
    for moment in picture.moments:
        yield from source.scene(moment.time, base_time=scene.time).diagnostics
    yield from picture.notes
