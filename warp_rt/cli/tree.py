# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``warp-rt tree``: the ray tree of one pixel."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from warp_rt.cli.frames import parse_frame
from warp_rt.cli.parser import Parser, add_json, add_scene
from warp_rt.cli.render_arguments import (
    add_depth,
    add_display,
    add_frame,
    add_machine,
    add_quality,
    add_view,
    render_options,
)
from warp_rt.cli.stage_input import open_refined_stage, read_stage
from warp_rt.cli.strict import add_strict
from warp_rt.cli.terminal import Terminal
from warp_rt.cli.voice import Voice
from warp_rt.errors import OptionError
from warp_rt.image.outputs import check_writable
from warp_rt.image.tone import check_display

_EPILOG = """\
Every node says what its ray meets, I_local term by term, which light is shadowed by what, Kr and Kt, and why the
branch ends; the nested equation sums them to the pixel's linear value, the very number that render writes to an EXR
file. X and Y count from the top left of the picture that render makes with the same options; --exposure and
--tonemap change its 8-bit value alone.

Large trees are cut short: the nodes that lead to most of the light are told of, the rest is counted and summed up.
--levels draws whole levels instead, and --json has every node.

    warp-rt tree shot.usda 320 200 --dot | dot -Tsvg -o tree.svg
    warp-rt tree shot.usda 320 200 --usd rays.usda && usdview rays.usda
"""


def parser() -> Parser:
    """Return the parser of ``warp-rt tree``."""
    result = Parser("tree", "Explain one pixel: every ray, light and shadow behind its colour.", epilog=_EPILOG)
    add_scene(result)
    result.add_argument("x", metavar="X", type=int, help="column of the pixel, 0 on the left")
    result.add_argument("y", metavar="Y", type=int, help="row of the pixel, 0 at the top")
    form = result.add_argument_group("how it is told")
    form.add_argument("--levels", type=int, metavar="N", help="draw the first N levels in full (default: what counts)")
    form.add_argument("--sample", type=int, metavar="N", help="of --spp samples, counted from 0 (default: all)")
    form.add_argument("--dot", action="store_true", help="print a graph in Graphviz's language on stdout")
    form.add_argument(
        "--usd", metavar="OUT", type=Path, help="write a USD layer over the scene: the rays as curves, coloured by kind"
    )
    add_frame(add_view(result))
    quality = result.add_argument_group("how it is traced")
    add_depth(quality)
    add_quality(quality)
    add_display(result.add_argument_group("how the value is shown"))
    add_machine(result)
    add_strict(result)
    add_json(result, "the whole tree")
    return result


def run(args: argparse.Namespace, terminal: Terminal) -> int:
    """Trace the pixel and tell; return the exit code."""
    options = render_options(args, depth=args.depth)
    check_display(args.exposure, args.tonemap)
    _check_form(args)
    frame = parse_frame(args.frames)
    from warp_rt.rendering.renderer import Renderer
    from warp_rt.rendering.tree_pixel import check_pixel_of, check_request

    pixel, samples = (args.x, args.y), None if args.sample is None else (args.sample,)
    check_request(pixel, samples, options)
    voice = Voice(terminal)
    scene = read_stage(
        open_refined_stage(args, options), args, voice, time=frame, outputs=[args.usd] if args.usd else []
    )
    check_pixel_of(scene, pixel, options, args.camera)
    renderer = Renderer(scene, options, device=args.device)
    tree = renderer.trace_tree(*pixel, camera=args.camera, samples=samples)
    tree = replace(tree, exposure=args.exposure, tonemap=args.tonemap)
    voice.diagnostics(renderer.diagnostics)
    if args.usd:
        tree.save_usd(args.usd)
        terminal.info(f"{args.usd}: the rays over {scene.source}")
    if args.json:
        records = [*scene.diagnostics, *renderer.diagnostics]
        warnings = [vars(record) for record in records if record.is_warning]
        notes = [vars(record) for record in records if not record.is_warning]
        terminal.json({**tree.to_json(), "warnings": warnings, "notes": notes})
    elif args.dot:
        terminal.data(tree.to_dot(levels=args.levels))
    else:
        from warp_rt.tree.lines import STYLES
        from warp_rt.tree.text import tree_rows

        rows = tree_rows(tree, width=terminal.data_width, levels=args.levels, folds_heading=terminal.has_columns)
        terminal.rows(rows, STYLES)
    return 0


def _check_form(args: argparse.Namespace) -> None:
    """Find out before any work whether its result could be told."""
    if args.json and args.dot:
        raise OptionError("--json and --dot: stdout holds one of them")
    if args.levels is not None and args.levels < 1:
        raise OptionError(f"levels: {args.levels} is less than 1")
    if args.usd is not None:
        from warp_rt.tree.layer import check_layer_name

        check_layer_name(args.usd)
        check_writable(args.usd)
