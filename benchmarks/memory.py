# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Bytes a triangle of geometry and hierarchy together, as the operating system counts them (Linux).

    python -m benchmarks memory --triangles 10000000

Each program builds in a process of its own. ``kept`` is what the process holds more than before it had the mesh,
``peak`` the most that it held meanwhile. The mesh itself, in NumPy arrays, is 18 bytes a triangle of ``kept``.
"""

from __future__ import annotations

import gc
import json
import re
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import warp_rt
from warp_rt.warp_setup import init_warp

from . import results
from .build import build_wp_mesh, embree_builder
from .command import make_parser, save_if_asked
from .meshes import TriangleMesh, noisy_torus

KEYS = ("triangles",)


def build_warp_rt(mesh: TriangleMesh) -> object:
    """Return a scene with its hierarchy."""
    return warp_rt.build_accel(warp_rt.Scene.from_arrays(mesh.points, mesh.triangles))


def build_embree(mesh: TriangleMesh) -> object:
    """Return an Embree scene."""
    build = embree_builder(mesh)
    return build() if build else None


BUILDERS: dict[str, Callable[[TriangleMesh], object]] = {
    "warp_rt": build_warp_rt,
    "embree": build_embree,
    "wp.Mesh": build_wp_mesh,
}


def main(arguments: Sequence[str]) -> None:
    """Print the table, and save its rows where asked to."""
    parser = make_parser("memory", __doc__)
    parser.add_argument("--triangles", type=int, nargs="+", default=[1_000_000, 10_000_000])
    parser.add_argument("--alone", choices=BUILDERS, help="one program in this process, as JSON")
    options = parser.parse_args(arguments)
    if options.alone:
        print(json.dumps(measure_alone(options.alone, options.triangles[0])))
        return
    rows = []
    for count in options.triangles:
        row: results.Row = {"triangles": count, "programs": {}}
        for name in BUILDERS:
            command = [sys.executable, "-m", "benchmarks", "memory", "--alone", name, "--triangles", str(count)]
            run = subprocess.run(command, cwd=results.ROOT, check=True, stdout=subprocess.PIPE, text=True)
            row["programs"][name] = json.loads(run.stdout.splitlines()[-1])
            print(f"{count:>11,} triangles, {name:<8} {row['programs'][name]}", flush=True)
        rows.append(row)
    save_if_asked(options, "memory", rows, KEYS)


def measure_alone(name: str, count: int) -> dict[str, float]:
    """Return the bytes a triangle that a program keeps, and at most holds, for a torus of about ``count`` triangles."""
    init_warp()
    BUILDERS[name](noisy_torus(1_000))  # loads libraries and kernels
    mesh = noisy_torus(count)
    size = mesh.points.nbytes + mesh.triangles.nbytes
    gc.collect()
    before = resident_bytes("VmRSS") - size
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")  # the peak counts from here on
    built = BUILDERS[name](mesh)
    gc.collect()
    kept, peak = resident_bytes("VmRSS") - before, resident_bytes("VmHWM") - before
    figures = {"kept": round(kept / len(mesh.triangles), 1), "peak": round(peak / len(mesh.triangles), 1)}
    if isinstance(built, warp_rt.Accel):
        figures["hierarchy"] = round(built.statistics.bytes / len(mesh.triangles), 1)
    return figures


def resident_bytes(field: str) -> int:
    """Return a line of the process's status, in bytes."""
    found = re.search(rf"{field}:\s+(\d+) kB", Path("/proc/self/status").read_text(encoding="ascii"))
    if found is None:
        raise SystemExit("memory: this system does not tell how much memory a process holds")
    return int(found.group(1)) * 1024
