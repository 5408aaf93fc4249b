# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Instructions, cycles, cache and branch misses a ray, by Linux's ``perf stat`` where the machine lets it.

    python -m benchmarks counters --mesh bunny ico-1.31M --rays primary random

A process that traces the rays some times is compared with one that traces them more often: what they share, such as
imports and builds, falls away. Virtual machines often hide these counters; the command then says so.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from warp_rt.warp_setup import init_warp

from . import results
from .command import make_parser, save_if_asked
from .contenders import CONTENDERS
from .meshes import MESHES
from .ray_sets import KINDS
from .rays import QUERIES, make_rays

EVENTS = ("instructions:u", "cycles:u", "cache-misses:u", "branch-misses:u")
KEYS = ("mesh", "rays", "query", "contender")
SIZE = 512  # pixels a side of the picture


def main(arguments: Sequence[str]) -> None:
    """Print the table, and save its rows where asked to."""
    parser = make_parser("counters", __doc__, rounds=10)
    parser.add_argument("--mesh", nargs="+", choices=MESHES, default=["bunny", "ico-1.31M"])
    parser.add_argument("--rays", nargs="+", choices=KINDS, default=["primary", "diffuse", "random"])
    parser.add_argument("--query", nargs="+", choices=QUERIES, default=["closest"])
    parser.add_argument("--contenders", nargs="+", choices=CONTENDERS, default=["warp_rt", "embree", "wp.Mesh"])
    parser.add_argument("--events", nargs="+", default=EVENTS, help="as perf calls them")
    parser.add_argument("--alone", type=int, help="trace this many times in this process, and print the number of rays")
    options = parser.parse_args(arguments)
    if options.alone is not None:
        print(trace(options.mesh[0], options.rays[0], options.query[0], options.contenders[0], options.alone))
        return
    if shutil.which("perf") is None:
        sys.exit("counters: no program 'perf' (Debian package linux-perf)")
    rows = []
    for mesh in options.mesh:
        for kind in options.rays:
            for query in options.query:
                for contender in options.contenders:
                    words = ["--mesh", mesh, "--rays", kind, "--query", query, "--contenders", contender]
                    row: results.Row = {"mesh": mesh, "rays": kind, "query": query, "contender": contender}
                    rows.append(row | measure(words, options.events, options.rounds))
                    counts = "".join(f"  {rows[-1][event]:,.4g} {event}" for event in options.events)
                    print(f"{mesh:<12}{kind:<9}{query:<9}{contender:<10}{counts} a ray", flush=True)
    save_if_asked(options, "counters", rows, KEYS)


def trace(mesh_name: str, kind: str, query: str, contender: str, turns: int) -> int:
    """Trace rays so many times, and return how many they are."""
    init_warp()
    mesh = MESHES[mesh_name]()
    rays = make_rays(mesh, [kind], SIZE)[kind]
    function = getattr(CONTENDERS[contender](mesh), query)
    for _ in range(turns):
        function(rays)
    return len(rays)


def measure(words: Sequence[str], events: Sequence[str], rounds: int) -> dict[str, float]:
    """Return each event's number a ray: the difference between ``2 rounds`` and ``rounds`` turns."""
    few, ray_count = run(words, events, rounds)
    many, _ = run(words, events, 2 * rounds)
    return {event: float(f"{(many[event] - few[event]) / (rounds * ray_count):.4g}") for event in events}


def run(words: Sequence[str], events: Sequence[str], turns: int) -> tuple[dict[str, float], int]:
    """Return what perf counts in a process of so many turns, and how many rays a turn has."""
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder, "perf.csv")
        command = ["perf", "stat", "-x,", "-e", ",".join(events), "-o", str(output), "--"]
        command += [sys.executable, "-m", "benchmarks", "counters", *words, "--alone", str(turns)]
        done = subprocess.run(command, cwd=results.ROOT, capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"counters: {(done.stderr or output.read_text(encoding='utf-8')).strip().splitlines()[-1]}")
        return parse(output.read_text(encoding="utf-8"), events), int(done.stdout.splitlines()[-1])


def parse(text: str, events: Sequence[str]) -> dict[str, float]:
    """Return the counts in perf's comma-separated output, of which there must be one for each event."""
    fields = [line.split(",") for line in text.splitlines() if line and not line.startswith("#")]
    counts = {name: value for value, _, name, *_ in fields}
    for event in events:
        if not counts.get(event, "").replace(".", "").isdigit():
            sys.exit(f"counters: perf says {counts.get(event, 'nothing')!r} of {event}: this machine hides it")
    return {event: float(counts[event]) for event in events}
