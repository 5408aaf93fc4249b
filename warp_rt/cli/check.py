# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``warp-rt check``: everything in a stage that would be ignored, repaired or refused."""

from __future__ import annotations

import argparse

from warp_rt.cli.parser import Parser, add_json, add_scene
from warp_rt.cli.strict import add_strict, refuse_warnings
from warp_rt.cli.terminal import Terminal, one_line


def parser() -> Parser:
    """Return the parser of ``warp-rt check``."""
    result = Parser("check", "Name everything in a stage that a picture would not show as the stage says it.")
    add_scene(result)
    add_strict(result)
    add_json(result, "the diagnostics")
    return result


def run(args: argparse.Namespace, terminal: Terminal) -> int:
    """Read the stage and print its diagnostics; return the exit code."""
    from warp_rt.api import load_scene

    scene = load_scene(args.scene, purposes=args.purposes)
    warning_count = sum(record.is_warning for record in scene.diagnostics)
    if args.json:
        records = [vars(record) for record in scene.diagnostics]
        terminal.json({"scene": args.scene, "warnings": warning_count, "diagnostics": records})
    else:
        for record in scene.diagnostics:
            terminal.data(one_line(record))
    if args.strict:
        refuse_warnings(args.scene, scene.diagnostics, are_told=True)
    terminal.info(f"{args.scene}: {warning_count} warning{'' if warning_count == 1 else 's'}")
    return 0
