# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Rays per second by mesh and kind of ray, closest hit and any hit, beside Embree and wp.Mesh.

    python -m benchmarks rays                                       the table
    python -m benchmarks rays --mesh bunny --rays diffuse --query closest    one row, in seconds
    python -m benchmarks rays --contenders warp_rt open3d
    python -m benchmarks rays --save                                and benchmarks/results/rays.json

Rates are the best of all turns, in million rays a second; ratios are of these. The file holds the seconds of every
turn. One thread each, unless a column says otherwise: "all cores" is of a thread for each, "processes" of a process for
each, every one of which traces all rays, the most that threads can be measured against. On the right, how many nodes of
warp_rt's hierarchy a ray visits and how many triangles it is tested against, rays taken one by one.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence

import numpy as np

import warp_rt
from warp_rt.warp_setup import init_warp

from . import results
from .command import make_parser, save_if_asked
from .contenders import CONTENDERS, DEFAULT, PROCESSES, SIDE_BY_SIDE, Contender
from .costs import mean_costs
from .meshes import MESHES, MissingMeshError, TriangleMesh
from .ray_sets import KINDS, TILE, Rays, primary_rays, random_rays, secondary_rays
from .timing import significant, time_in_turns

QUERIES = ("closest", "any")
CLOCKS = {"wall": time.perf_counter, "cpu": time.process_time}
KEYS = ("mesh", "rays", "query")


def main(arguments: Sequence[str]) -> None:
    """Print the table, and save its rows where asked to."""
    options = parse(arguments)
    init_warp()
    print_head(options.contenders)
    rows = []
    for name in options.mesh:
        try:
            mesh = MESHES[name]()
        except MissingMeshError as error:
            print(f"{name:<12}skipped: {error}", file=sys.stderr)
            continue
        rows += measure(name, mesh, options)
    save_if_asked(options, "rays", rows, KEYS)


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """Return the options."""
    parser = make_parser("rays", __doc__)
    parser.add_argument("--mesh", nargs="+", choices=MESHES, default=list(MESHES))
    parser.add_argument("--rays", nargs="+", choices=KINDS, default=KINDS)
    parser.add_argument("--query", nargs="+", choices=QUERIES, default=QUERIES)
    parser.add_argument("--contenders", nargs="+", choices=CONTENDERS, default=DEFAULT)
    parser.add_argument("--size", type=int, default=512, help="pixels a side of the picture whose rays are traced")
    parser.add_argument(
        "--clock",
        choices=CLOCKS,
        default="wall",
        help="cpu: seconds of all threads together, which other programs on the machine disturb less",
    )
    return parser.parse_args(arguments)


def measure(name: str, mesh: TriangleMesh, options: argparse.Namespace) -> list[results.Row]:
    """Return one row a kind of rays and query."""
    contenders = build_contenders(mesh, options.contenders)
    accel = warp_rt.build_accel(warp_rt.Scene.from_arrays(mesh.points, mesh.triangles))
    rows = []
    for kind, rays in make_rays(mesh, options.rays, options.size).items():
        for query in options.query:
            row = {"mesh": name, "triangles": len(mesh.triangles), "rays": kind, "query": query}
            row |= compare(rays, query, contenders, options.rounds, options.clock)
            rows.append(row | mean_costs(accel, rays, query))
            print_row(rows[-1], options.contenders)
    return rows


def build_contenders(mesh: TriangleMesh, names: Sequence[str]) -> dict[str, Contender]:
    """Return those contenders that are installed."""
    built = {}
    for name in names:
        try:
            built[name] = CONTENDERS[name](mesh)
        except ImportError as error:
            print(f"{name} is left out: {error}", file=sys.stderr)
    return built


def make_rays(mesh: TriangleMesh, kinds: Sequence[str], size: int) -> dict[str, Rays]:
    """Return about ``size`` squared rays of each kind.

    Rays that hits of primary rays send on come from a picture of as many pixels as bring that many hits.
    """
    sets = {}
    if "primary" in kinds:
        sets["primary"] = primary_rays(mesh, size)
    kinds_after_hits = [kind for kind in kinds if kind not in ("primary", "random")]
    if kinds_after_hits:
        accel = warp_rt.build_accel(warp_rt.Scene.from_arrays(mesh.points, mesh.triangles))
        picture = primary_rays(mesh, size)
        hit_share = np.mean(warp_rt.any_hit(accel, picture.origins, picture.directions))
        picture = primary_rays(mesh, round(size / np.sqrt(max(hit_share, 1 / 16)) / TILE) * TILE)
        hits = warp_rt.closest_hit(accel, picture.origins, picture.directions)
        for kind in kinds_after_hits:
            sets[kind] = secondary_rays(kind, mesh, picture, hits.t, hits.triangle)
    if "random" in kinds:
        sets["random"] = random_rays(mesh, size * size)
    return sets


def compare(rays: Rays, query: str, contenders: dict[str, Contender], rounds: int, clock: str = "wall") -> results.Row:
    """Return the seconds of each contender, and in how many rays they find something where the first finds nothing."""
    functions = {name: lambda c=contender: getattr(c, query)(rays) for name, contender in contenders.items()}
    seconds, found = time_in_turns(functions, rounds, CLOCKS[clock])
    hit = {name: np.asarray(f) >= 0 if query == "closest" else np.asarray(f) for name, f in found.items()}
    first = next(iter(hit.values()))
    return {
        "ray_count": len(rays),
        "clock": clock,
        "seconds": {name: significant(turns) for name, turns in seconds.items()},
        "processes": PROCESSES,
        "hit_differences": {name: int((flags != first).sum()) for name, flags in hit.items()},
    }


def rate(row: results.Row, contender: str) -> float:
    """Return the million rays a second of a contender's best turn; NaN for one that was not there."""
    turns = row["seconds"].get(contender)
    count = row["ray_count"] * (row["processes"] if contender == SIDE_BY_SIDE else 1)
    return count / min(turns) / 1e6 if turns else np.nan


def print_head(contenders: Sequence[str]) -> None:
    """Print the table's head."""
    columns = [*contenders, *(f"/ {name}" for name in contenders[1:])]
    text = "".join(f"{name:>{width(name)}}" for name in columns)
    print(f"{'mesh':<12}{'rays':<9}{'query':<8}{text}{'nodes':>9}{'triangles':>11}")


def print_row(row: results.Row, contenders: Sequence[str]) -> None:
    """Print one row: rates, then how many times as fast the first contender is as each other one."""
    rates = [rate(row, name) for name in contenders]
    text = "".join(f"{value:{width(name)}.2f}" for name, value in zip(contenders, rates, strict=True))
    text += "".join(
        f"{rates[0] / value:{width(f'/ {name}')}.2f}" for name, value in zip(contenders[1:], rates[1:], strict=True)
    )
    differing = {name: count for name, count in row["hit_differences"].items() if count}
    text += f"{row['nodes']:9.2f}{row['triangles_tested']:11.2f}"
    print(f"{row['mesh']:<12}{row['rays']:<9}{row['query']:<8}{text}  {differing or ''}", flush=True)


def width(name: str) -> int:
    """Return the width of a column."""
    return max(9, len(name) + 2)
