# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Seconds to build a hierarchy by triangles, threads and builder, beside Embree and wp.Mesh; and what it came out as.

    python -m benchmarks build                              two threads (all cores) and one, a thousand to ten million
    python -m benchmarks build --mesh ico-1.31M --threads 2
    python -m benchmarks build --devices cuda:0 --builders sah lbvh ploc

From vertices and indices in NumPy arrays to a hierarchy that answers queries. Embree takes as many threads as the
process has cores, so that with ``--threads 1`` the whole process keeps to one core; wp.Mesh always builds on one. Where
there is a GPU, hierarchies for it are built as well, beside wp.Mesh on it, and one is refitted.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import warp as wp

import warp_rt
from warp_rt.bvh.accel import refit_accel
from warp_rt.options import BUILDERS
from warp_rt.warp_setup import resolve_device

from . import results
from .command import make_parser, save_if_asked
from .meshes import TriangleMesh, noisy_icosphere, noisy_torus
from .timing import significant, spread, time_in_turns

MESHES: dict[str, Callable[[], TriangleMesh]] = {
    "torus-1k": partial(noisy_torus, 1_000),
    "torus-10k": partial(noisy_torus, 10_000),
    "torus-100k": partial(noisy_torus, 100_000),
    "torus-1M": partial(noisy_torus, 1_000_000),
    "ico-1.31M": partial(noisy_icosphere, 8),
    "torus-10M": partial(noisy_torus, 10_000_000),
}
KEYS = ("mesh", "threads", "device")  # rows of the CPU name no device


def main(arguments: Sequence[str]) -> None:
    """Print the table, and save its rows where asked to."""
    parser = make_parser("build", __doc__)
    parser.add_argument("--mesh", nargs="+", choices=MESHES, default=list(MESHES))
    parser.add_argument("--threads", type=int, nargs="+", default=sorted({1, os.cpu_count() or 1}))
    parser.add_argument("--builders", nargs="+", choices=BUILDERS, default=BUILDERS)
    parser.add_argument("--devices", nargs="+", metavar="DEVICE", help="default: the CPU, and the first GPU if any")
    options = parser.parse_args(arguments)
    if len(options.threads) > 1:  # each in a process of its own: thread pools keep the cores that they started with
        for threads in options.threads:
            command = [sys.executable, "-m", "benchmarks", "build", *arguments, "--threads", str(threads)]
            subprocess.run(command, cwd=results.ROOT, check=True)
        return
    threads = options.threads[0]
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:threads])
    devices = [resolve_device(name) for name in options.devices or dict.fromkeys(["cpu", resolve_device("auto")])]
    rows = []
    for name in options.mesh:
        mesh = MESHES[name]()
        for device in devices:
            row = measure(mesh, options.builders, threads, options.rounds, device)
            rows.append({"mesh": name, "threads": threads} | ({} if device == "cpu" else {"device": device}) | row)
            print_row(rows[-1])
    save_if_asked(options, "build", rows, KEYS)


def measure(mesh: TriangleMesh, builders: Sequence[str], threads: int, rounds: int, device: str = "cpu") -> results.Row:
    """Return the seconds of all builders that there are for a device, and what warp_rt's trees came out as."""
    scene = warp_rt.Scene.from_arrays(mesh.points, mesh.triangles)
    functions: dict[str, Callable[[], object]] = {
        f"warp_rt, {bvh}": partial(warp_rt.build_accel, scene, bvh=bvh, device=device, threads=threads)
        for bvh in builders
    }
    if device == "cpu":
        if embree := embree_builder(mesh):
            functions["embree"] = embree
        functions["wp.Mesh"] = partial(build_wp_mesh, mesh)
    else:
        accel = warp_rt.build_accel(scene, bvh=builders[0], device=device, threads=threads)
        functions[f"warp_rt, {builders[0]} refitted"] = partial(refit_accel, accel, scene, threads=threads)
        for constructor in ("sah", "median", "lbvh"):
            functions[f"wp.Mesh, {constructor}"] = partial(build_wp_mesh, mesh, device, constructor)
        functions = {name: partial(wait_for, device, function) for name, function in functions.items()}
    seconds, built = time_in_turns(functions, rounds)
    count = len(mesh.triangles)
    trees = {}
    for bvh in builders:
        statistics = built[f"warp_rt, {bvh}"].statistics
        trees[bvh] = {
            "sah_cost": round(statistics.sah_cost, 3),
            "nodes": statistics.nodes,
            "leaves": statistics.leaves,
            "depth": statistics.depth,
            "bytes_per_triangle": round(statistics.bytes / count, 2),
        }
    return {
        "triangles": count,
        "seconds": {name: significant(turns) for name, turns in seconds.items()},
        "trees": trees,
    }


def embree_builder(mesh: TriangleMesh) -> Callable[[], object] | None:
    """Return a function that builds Embree's hierarchy; None where embreex is not installed."""
    try:
        from embreex import rtcore_scene
        from embreex.mesh_construction import TriangleMesh as EmbreeMesh
    except ImportError:
        print("embree is left out: there is no embreex", file=sys.stderr)
        return None
    ray = np.ones((1, 3), np.float32)

    def build() -> object:
        scene = rtcore_scene.EmbreeScene(robust=True)
        EmbreeMesh(scene, mesh.points, mesh.triangles)
        scene.run(ray, ray)  # commits: the first query builds
        return scene

    return build


def build_wp_mesh(mesh: TriangleMesh, device: str = "cpu", constructor: str = "sah") -> wp.Mesh:
    """Return a wp.Mesh."""
    return wp.Mesh(
        wp.array(mesh.points, dtype=wp.vec3, device=device),
        wp.array(mesh.triangles.reshape(-1), dtype=int, device=device),
        bvh_constructor=constructor,
    )


def wait_for(device: str, function: Callable[[], object]) -> object:
    """Return what a function returns, when a GPU has done what it has launched."""
    made = function()
    wp.synchronize_device(device)
    return made


def print_row(row: results.Row) -> None:
    """Print a mesh's seconds and trees."""
    where = f"{row['device']}, " if "device" in row else ""
    print(f"{row['mesh']}: {row['triangles']:,} triangles, {where}{row['threads']} thread(s)")
    for name, seconds in row["seconds"].items():
        tree = row["trees"].get(name.removeprefix("warp_rt, "))
        note = f"  SAH cost {tree['sah_cost']:.2f}, {tree['bytes_per_triangle']:.1f} B a triangle" if tree else ""
        print(f"  {name:<20}{spread(seconds)}{note}", flush=True)
