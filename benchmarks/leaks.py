# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A hundred million rays from inside closed meshes, aimed at vertices and edges: how many get out.

    python -m benchmarks leaks
    python -m benchmarks leaks --rays 1000000

Each ray is asked for its closest hit and for any hit; either answer of nothing is a leak. Meshes are scaled by 1e-6 to
1e6 and moved away from the origin by up to a million of their sizes, where float32 has to make of them what it can.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Sequence

import warp_rt
from warp_rt.warp_setup import init_warp

from . import results
from .command import make_parser, save_if_asked
from .meshes import load_file, noisy_icosphere, noisy_torus

KEYS = ("mesh", "scale", "center")
CHUNK = 500_000  # rays made and traced at once


def main(arguments: Sequence[str]) -> None:
    """Print the counts, and save them where asked to."""
    parser = make_parser("leaks", __doc__)
    parser.add_argument("--rays", type=int, default=100_000_000, help="over all meshes, scales and offsets together")
    parser.add_argument("--seed", type=int, default=100)
    options = parser.parse_args(arguments)
    init_warp()
    tests = results.ROOT / "tests"
    aimed, shapes = load_file(tests / "aimed_rays.py"), load_file(tests / "meshes.py")
    sphere, torus = noisy_icosphere(6), noisy_torus(100_000)
    meshes = {
        "cube": shapes.cube(),
        "octasphere": shapes.octasphere(4),
        "torus": shapes.torus(48, 24),
        "noisy sphere": (sphere.points.astype(float), sphere.triangles),
        "noisy torus": (torus.points.astype(float), torus.triangles),
    }
    places = list(itertools.product(meshes, aimed.SCALES, aimed.CENTERS))
    share = -(-options.rays // len(places))
    rows = []
    start = time.perf_counter()
    for name, scale, center in places:
        points, triangles = aimed.place(meshes[name], scale, center)
        accel = warp_rt.build_accel(warp_rt.Scene.from_arrays(points, triangles))
        leaks = 0
        for first in range(0, share, CHUNK):
            count = min(CHUNK, share - first)
            rays = aimed.edge_rays(points, triangles, count, options.seed + first // CHUNK, is_ring="torus" in name)
            leaks += aimed.leaks(accel, *rays)
        rows.append({"mesh": name, "scale": scale, "center": center, "rays": share, "leaks": leaks})
        print(f"{name:<13}scale {scale:<6g} center {center:<8g}{share:>10,} rays  {leaks} leaks", flush=True)
    rays, leaks = (sum(row[key] for row in rows) for key in ("rays", "leaks"))
    print(f"{rays:,} rays, closest hit and any hit: {leaks} leaks ({time.perf_counter() - start:.0f} s)")
    save_if_asked(options, "leaks", rows, KEYS)
