# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The lecture's question, what is the complexity?, measured: tests and time a ray by triangles.

    python -m benchmarks hierarchies
    python -m benchmarks hierarchies --triangles 100 1000

Brute force, and the lecture's binary trees of five builders with boxes and with spheres as bounding volumes, in plain
kernels on one thread; beside them warp_rt's own traversal. Eye rays of a picture of a torus of any number of triangles.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

import warp_rt
from warp_rt.options import BUILDERS
from warp_rt.warp_setup import init_warp

from . import results
from .command import make_parser, save_if_asked
from .lecture_tree import Counts, build_tree, corners_of, trace, trace_brute_force
from .meshes import TriangleMesh, noisy_torus
from .ray_sets import Rays, primary_rays
from .timing import significant, time_in_turns

KEYS = ("triangles", "structure", "volume", "order")
SIZES = tuple(10**exponent for exponent in range(2, 8))
MOST_TESTS = 10**8  # of brute force, which traces no more rays than that


def main(arguments: Sequence[str]) -> None:
    """Print the table, and save its rows where asked to."""
    parser = make_parser("hierarchies", __doc__, rounds=3)
    parser.add_argument("--triangles", type=int, nargs="+", default=SIZES)
    parser.add_argument("--size", type=int, default=128, help="pixels a side of the picture")
    options = parser.parse_args(arguments)
    init_warp()
    rows = []
    for count in options.triangles:
        mesh = noisy_torus(count)
        for row in measure(mesh, primary_rays(mesh, options.size), options.rounds):
            rows.append({"triangles": count} | row)
            print_row(rows[-1])
    save_if_asked(options, "hierarchies", rows, KEYS)


def measure(mesh: TriangleMesh, rays: Rays, rounds: int) -> list[results.Row]:
    """Return a row each for brute force, for each tree, volume and order, and for warp_rt."""
    accel = warp_rt.build_accel(warp_rt.Scene.from_arrays(mesh.points, mesh.triangles))
    surfaces = float(warp_rt.count_hits(accel, rays.origins, rays.directions).mean())
    scene: results.Row = {
        "exact_triangles": len(mesh.triangles),
        "vertices": len(mesh.points),
        "surfaces_a_ray": round(surfaces, 4),
    }
    hits, each = timed(partial(warp_rt.closest_hit, accel, rays.origins, rays.directions, threads=1), rounds, len(rays))
    rows = [scene | {"structure": "warp_rt", "volume": "box", "order": "nearer first", "ns_a_ray": each}]
    few = Rays(*(v[:: max(1, len(rays) * len(mesh.triangles) // MOST_TESTS)] for v in (rays.origins, rays.directions)))
    _, each = timed(partial(trace_brute_force, corners_of(mesh), few), rounds, len(few))
    brute: results.Row = {
        "structure": "brute force",
        "volume": "none",
        "order": "none",
        "volume_tests": 0.0,
        "ns_a_ray": each,
    }
    rows.append(scene | brute | {"triangle_tests": float(len(mesh.triangles))})
    for builder in BUILDERS:
        tree = build_tree(mesh, builder)
        for volume in ("box", "sphere"):
            for order in ("as they come", "nearer first"):
                counts, each = timed(partial(trace, tree, rays, volume, order == "nearer first"), rounds, len(rays))
                differing = int(((counts.t < np.inf) != (hits.instance >= 0)).sum())
                row = {"structure": builder, "volume": volume, "order": order, "ns_a_ray": each}
                rows.append(scene | row | describe(counts) | {"hit_differences": differing})
    return rows


def timed(function: partial, rounds: int, ray_count: int) -> tuple[Any, list[float]]:
    """Return a function's result and the CPU nanoseconds a ray of each turn."""
    seconds, found = time_in_turns({"it": function}, rounds, time.process_time)
    return found["it"], significant([s / ray_count * 1e9 for s in seconds["it"]])


def describe(counts: Counts) -> results.Row:
    """Return the mean numbers of tests a ray."""
    names = ("volume_tests", "triangle_tests")
    return {name: round(float(getattr(counts, name).mean()), 3) for name in names}


def print_row(row: results.Row) -> None:
    """Print one row."""
    tests = "".join(f"{row[name]:14,.1f}" if name in row else " " * 14 for name in ("volume_tests", "triangle_tests"))
    kind = f"{row['structure']:<13}{row['volume']:<8}{row['order']:<14}"
    print(f"{row['triangles']:>10,}  {kind}{tests}{min(row['ns_a_ray']):12,.0f} ns a ray", flush=True)
