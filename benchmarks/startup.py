# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Seconds of whole processes, from the command to the finished file: warm, and cold with kernels to compile.

    python -m benchmarks startup

Python's bytecode is there, as in every installed package, whatever the environment says of writing it.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from . import results
from .command import make_parser, save_if_asked
from .timing import significant, spread, time_in_turns

RENDER = ("-m", "warp_rt", "render", str(results.ROOT / "scenes" / "mirror_teapot.usda"), "-w", "160", "-o")
COMMANDS = {
    "render a small picture": RENDER,
    "warp-rt --help": ("-m", "warp_rt", "--help"),
    "import warp_rt": ("-c", "import warp_rt"),
    "import warp, numpy and pxr.Usd": ("-c", "import warp, numpy, pxr.Usd"),
    "start Python": ("-c", ""),
}
KEYS = ("command",)


def main(arguments: Sequence[str]) -> None:
    """Print the table, and save its rows where asked to."""
    options = make_parser("startup", __doc__).parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        picture = str(Path(folder, "picture.png"))
        commands = {name: [*words, picture] if words is RENDER else list(words) for name, words in COMMANDS.items()}
        bytecode = {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": str(Path(folder, "bytecode"))}
        timed = {name: partial(run, words, bytecode) for name, words in commands.items()}
        seconds, _ = time_in_turns(timed, options.rounds)
        cold = []
        for turn in range(min(3, options.rounds)):
            cache = Path(folder, f"kernels-{turn}")
            start = time.perf_counter()
            run(commands["render a small picture"], bytecode | {"WARP_CACHE_PATH": str(cache)})
            cold.append(time.perf_counter() - start)
        seconds["render a small picture, kernels to compile"] = cold
    for name, turns in seconds.items():
        print(f"{name:<45}{spread(turns)}")
    rows: list[results.Row] = [{"command": name, "seconds": significant(turns)} for name, turns in seconds.items()]
    save_if_asked(options, "startup", rows, KEYS)


def run(words: Sequence[str], environment: dict[str, str]) -> None:
    """Run Python with some words, and see that it does well."""
    subprocess.run(
        [sys.executable, *words],
        check=True,
        capture_output=True,
        env=os.environ | environment,
        cwd=results.ROOT,
    )
