# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``warp-rt warmup``: compile the kernels ahead of the first render."""

from __future__ import annotations

import argparse
import time

from warp_rt.cli.parser import Parser
from warp_rt.cli.terminal import Terminal


def parser() -> Parser:
    """Return the parser of ``warp-rt warmup``."""
    result = Parser("warmup", "Compile every kernel for a device, so that no render has to wait for it.")
    result.add_argument(
        "--device", default="auto", metavar="DEVICE", help="auto, cpu, cuda:0, ... (default: %(default)s)"
    )
    return result


def run(args: argparse.Namespace, terminal: Terminal) -> int:
    """Compile and tell how long it took; return the exit code."""
    from warp_rt.device.compile import warmup

    begin = time.perf_counter()
    warmup(args.device, lambda name, number, count: terminal.info(f"kernels {number} of {count}: {name}"))
    terminal.info(f"kernels are ready for {args.device} ({time.perf_counter() - begin:.1f} s)")
    return 0
