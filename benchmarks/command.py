# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the benchmarks' command lines have in common."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from . import results


def make_parser(name: str, description: str | None, rounds: int = 5) -> argparse.ArgumentParser:
    """Return a parser that knows ``--rounds`` and ``--save``."""
    parser = argparse.ArgumentParser(
        prog=f"python -m benchmarks {name}",
        description=description,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--rounds", type=int, default=rounds, help=f"turns that count (default {rounds})")
    parser.add_argument("--save", action="store_true", help=f"put the rows into benchmarks/results/{name}.json")
    return parser


def save_if_asked(options: argparse.Namespace, name: str, rows: Sequence[results.Row], keys: Sequence[str]) -> None:
    """Save rows and say where, if the command line asks for it."""
    if options.save:
        print(results.save(name, rows, keys).relative_to(results.ROOT))
