# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""How the seconds of a frame grow with threads, triangles, resolution and depth, and rays per second with instances.

    python -m benchmarks scaling
    python -m benchmarks scaling --of instances

Frames are of scenes/mirror_teapot.usda; where nothing else is said 1024 x 768, 10 thousand triangles, depth 7,
threshold 0, one sample a pixel, all cores. Instances are of a mesh of 1,280 triangles, turned at random and strewn
through a cube; up to ten thousand of them are also traced flattened into one mesh.
"""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import warp_rt
from warp_rt.scene import Instances, Material, MaterialModel, Mesh
from warp_rt.warp_setup import init_warp

from . import results
from .command import make_parser, save_if_asked
from .frame import HEIGHT, WIDTH, write_stage
from .meshes import TriangleMesh, flatten, noisy_icosphere
from .ray_sets import Rays, primary_rays
from .timing import significant, spread, time_in_turns

KEYS = ("of", "value")
TRIANGLES = 10_000
MOST_FLATTENED = 10_000  # instances: 12.8 million triangles


def main(arguments: Sequence[str]) -> None:
    """Print the tables, and save their rows where asked to."""
    parser = make_parser("scaling", __doc__)
    parser.add_argument("--of", nargs="+", choices=TABLES, default=list(TABLES))
    parser.add_argument("--values", type=int, nargs="+", help="instead of the table's own, for one table")
    options = parser.parse_args(arguments)
    if options.values and len(options.of) != 1:
        sys.exit("scaling: --values goes with one --of")
    init_warp()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name in options.of:
            for row in TABLES[name](options.rounds, Path(folder), options.values):
                rows.append({"of": name} | row)
                print_row(rows[-1])
    save_if_asked(options, "scaling", rows, KEYS)


def by_threads(rounds: int, folder: Path, values: Sequence[int] | None) -> Iterator[results.Row]:
    """Yield rows for one thread up to one a core, taking turns."""
    renderers = {
        threads: prepare(folder, TRIANGLES, {"threads": threads}) for threads in values or range(1, core_count() + 1)
    }
    yield from in_turns(renderers, rounds)


def by_triangles(rounds: int, folder: Path, values: Sequence[int] | None) -> Iterator[results.Row]:
    """Yield rows for teapots of a thousand triangles and more, one after the other: they fill the memory."""
    for count in values or (1_000, 10_000, 100_000, 1_000_000):
        yield from in_turns({count: prepare(folder, count, {})}, rounds)


def by_resolution(rounds: int, folder: Path, values: Sequence[int] | None) -> Iterator[results.Row]:
    """Yield rows for pictures of 256 pixels' width and more."""
    sizes = {width: {"width": width, "height": width * 3 // 4} for width in values or (256, 512, 1024, 2048)}
    yield from in_turns({width: prepare(folder, TRIANGLES, size) for width, size in sizes.items()}, rounds)


def by_depth(rounds: int, folder: Path, values: Sequence[int] | None) -> Iterator[results.Row]:
    """Yield rows for ray trees of one level and more."""
    depths = values or (1, 2, 3, 4, 5, 6, 7, 10)
    yield from in_turns({depth: prepare(folder, TRIANGLES, {"depth": depth}) for depth in depths}, rounds)


def prepare(folder: Path, count: int, changes: dict[str, int]) -> warp_rt.Renderer:
    """Return a renderer of the mirror and a teapot of about ``count`` triangles."""
    scene = warp_rt.load_scene(write_stage(count, folder))
    options: dict[str, Any] = {"width": WIDTH, "height": HEIGHT, "depth": 7, "threads": core_count()} | changes
    return warp_rt.Renderer(scene, warp_rt.RenderOptions(threshold=0.0, **options), device="cpu")


def in_turns(renderers: dict[int, warp_rt.Renderer], rounds: int) -> Iterator[results.Row]:
    """Yield a row a renderer."""
    functions = {str(value): renderer.render for value, renderer in renderers.items()}
    seconds, films = time_in_turns(functions, rounds)
    for value, renderer in renderers.items():
        rays = films[str(value)].rays
        yield {
            "value": value,
            "triangles": renderer.scene.triangle_count,
            "rays": rays.primary + rays.reflection + rays.refraction + rays.shadow,
            "seconds": {"frame": significant(seconds[str(value)])},
        }


def by_instances(rounds: int, folder: Path, values: Sequence[int] | None) -> Iterator[results.Row]:
    """Yield rows for a thousand instances up to a million: primary rays, instanced and, while it fits, flattened."""
    del folder
    for count in values or (1_000, 10_000, 100_000, 1_000_000):
        scene = strewn(noisy_icosphere(3), count)
        start = time.perf_counter()
        accel = warp_rt.build_accel(scene)
        build_seconds = time.perf_counter() - start
        low, high = scene.bounds()
        box = TriangleMesh(np.array([low, high], np.float32), np.zeros((0, 3), np.int32))
        rays = primary_rays(box, 512)
        functions: dict[str, Callable[[], object]] = {"instances": partial(query, accel, rays)}
        row: results.Row = {
            "value": count,
            "triangles": count * scene.triangle_count,
            "ray_count": len(rays),
            "build_seconds": float(f"{build_seconds:.4g}"),
            "bytes_per_instance": round(accel.statistics.bytes / count, 1),
        }
        if count <= MOST_FLATTENED:
            flat = flatten(scene)
            flat_accel = warp_rt.build_accel(warp_rt.Scene.from_arrays(flat.points, flat.triangles))
            functions["flattened"] = partial(query, flat_accel, rays)
            row["flattened_bytes_per_instance"] = round(flat_accel.statistics.bytes / count, 1)
        seconds, hits = time_in_turns(functions, rounds)
        row["hit_share"] = round(float(np.mean(hits["instances"].instance >= 0)), 4)
        yield row | {"seconds": {name: significant(turns) for name, turns in seconds.items()}}


def strewn(mesh: TriangleMesh, count: int) -> warp_rt.Scene:
    """Return instances of a mesh of radius one, turned at random, in a cube that has room for 16 radii cubed each."""
    rng = np.random.default_rng(11)
    frames = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    matrices = np.tile(np.eye(4), (count, 1, 1))
    matrices[:, :3, :3] = frames * np.sign(np.linalg.det(frames))[:, None, None]
    side = np.cbrt(16 * count)
    matrices[:, :3, 3] = rng.uniform(0, side, (count, 3))
    zeros = np.zeros(count, np.int32)
    return warp_rt.Scene(
        meshes=(Mesh(mesh.points, mesh.triangles, is_closed=True),),
        instances=Instances(zeros, matrices, zeros, np.zeros(1, np.int32), zeros, zeros),
        prims=("/mesh",),
        instance_paths=("/instances",),
        materials=(Material("/material", MaterialModel.WHITTED),),
    )


def query(accel: warp_rt.Accel, rays: Rays) -> warp_rt.Hits:
    """Return closest hits, traced by one thread."""
    return warp_rt.closest_hit(accel, rays.origins, rays.directions, threads=1)


def core_count() -> int:
    """Return the machine's cores."""
    return os.cpu_count() or 1


TABLES: dict[str, Callable[[int, Path, Sequence[int] | None], Iterator[results.Row]]] = {
    "threads": by_threads,
    "triangles": by_triangles,
    "resolution": by_resolution,
    "depth": by_depth,
    "instances": by_instances,
}


def print_row(row: results.Row) -> None:
    """Print the seconds of a row, and what a ray took."""
    rays = row.get("rays") or row.get("ray_count")
    for name, seconds in row["seconds"].items():
        each = statistics.median(seconds) / rays * 1e9
        print(f"{row['of']:<11}{row['value']:>10,}  {name:<10}{spread(seconds):<38}{each:8.1f} ns a ray", flush=True)
