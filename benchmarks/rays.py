# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Rays per second of warp_rt, Embree (embreex) and wp.Mesh, side by side in one process, one thread.

    python benchmarks/rays.py                    # the table
    python benchmarks/rays.py --json rays.json   # and a file
    python benchmarks/rays.py --quick            # smaller meshes, fewer rays

Every contender traces the same rays, in turn, several times; the median counts. Times include what each API does
besides tracing, such as making its output arrays.
"""

from __future__ import annotations

import argparse
import json
import platform
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import warp as wp

import warp_rt
from warp_rt.warp_setup import init_warp

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "scenes"))

from make_teapot import tessellate  # noqa: E402

wp.set_module_options({"enable_backward": False})


@dataclass(frozen=True)
class Rays:
    name: str
    origins: np.ndarray
    directions: np.ndarray


@wp.kernel
def mesh_closest(
    mesh: wp.uint64,
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    face_out: wp.array[int],
    t_out: wp.array[float],
    uv_out: wp.array[wp.vec2],
):
    i = wp.tid()
    query = wp.mesh_query_ray(mesh, origins[i], directions[i], 1.0e30)
    face_out[i] = wp.where(query.result, query.face, -1)
    t_out[i] = query.t
    uv_out[i] = wp.vec2(query.u, query.v)


@wp.kernel
def mesh_any(
    mesh: wp.uint64, origins: wp.array[wp.vec3], directions: wp.array[wp.vec3], blocked_out: wp.array[wp.bool]
):
    i = wp.tid()
    blocked_out[i] = wp.mesh_query_ray_anyhit(mesh, origins[i], directions[i], 1.0e30)


# --- meshes


def teapot(segments: int) -> tuple[np.ndarray, np.ndarray]:
    points, polygons, _ = tessellate(segments)
    triangles = [(p[0], p[i], p[i + 1]) for p in polygons for i in range(1, len(p) - 1)]
    return points, np.array(triangles, np.int32)


def noisy_icosphere(levels: int) -> tuple[np.ndarray, np.ndarray]:
    """Return an icosphere of 20 * 4^levels triangles whose vertices are moved in and out by up to 2 %."""
    g = (1 + 5**0.5) / 2
    points = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g)]
    points += [(0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    faces = "0b5 051 017 07a 0ab 159 5b4 ba2 a76 718 394 342 326 368 389 495 24b 62a 867 981"
    triangles = np.array([[int(c, 16) for c in face] for face in faces.split()])
    vertices = np.array(points, float)
    for _ in range(levels):
        edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
        edges, inverse = np.unique(edges, axis=0, return_inverse=True)
        ab, bc, ca = inverse.reshape(3, -1) + len(vertices)
        a, b, c = triangles.T
        vertices = np.concatenate([vertices, vertices[edges].mean(axis=1)])
        faces = ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))
        triangles = np.concatenate([np.stack(corners, axis=1) for corners in faces])
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    vertices *= np.random.default_rng(7).uniform(0.98, 1.02, (len(vertices), 1))
    return vertices.astype(np.float32), triangles.astype(np.int32)


# --- rays


def primary_rays(points: np.ndarray, size: int) -> Rays:
    """Return the eye rays of a picture that shows the mesh, line by line."""
    low, high = points.min(axis=0), points.max(axis=0)
    center, radius = (low + high) / 2, np.linalg.norm(high - low) / 2
    eye = center + radius * np.array([1.2, 1.6, 1.4])
    z = (center - eye) / np.linalg.norm(center - eye)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    y = np.cross(x, z)
    s = (np.arange(size) + 0.5) / size * 2 - 1
    directions = z + 0.42 * (s[None, :, None] * x - s[:, None, None] * y)
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    directions = directions.reshape(-1, 3).astype(np.float32)
    return Rays("primary", np.broadcast_to(eye.astype(np.float32), directions.shape).copy(), directions)


def cosine_directions(normals: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    directions = rng.normal(size=normals.shape)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    directions += normals
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def diffuse_rays(points: np.ndarray, triangles: np.ndarray, count: int) -> Rays:
    """Return rays from random points all over the surface in random order: the worst case for memory."""
    rng = np.random.default_rng(1)
    corners = points[triangles[rng.integers(len(triangles), size=count)]].astype(float)
    weights = rng.dirichlet((1.0, 1.0, 1.0), count)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    size = np.linalg.norm(np.ptp(points, axis=0))
    origins = (corners * weights[:, :, None]).sum(axis=1) + 1e-5 * size * normals
    return Rays("diffuse", origins.astype(np.float32), cosine_directions(normals, rng).astype(np.float32))


def secondary_rays(points: np.ndarray, triangles: np.ndarray, primary: Rays, hits: warp_rt.Hits) -> list[Rays]:
    """Return mirror, shadow and ambient occlusion rays from the points that primary rays hit."""
    hit = hits.instance >= 0
    corners = points[triangles[hits.triangle[hit]]].astype(float)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    incoming = primary.directions[hit]
    normals *= -np.sign((normals * incoming).sum(axis=1, keepdims=True))
    size = np.linalg.norm(np.ptp(points, axis=0))
    origins = primary.origins[hit] + hits.t[hit, None] * incoming + 1e-5 * size * normals
    light = points.mean(axis=0) + size * np.array([0.5, -1.0, 2.0])
    rng = np.random.default_rng(2)
    directions = {
        "mirror": incoming - 2 * (normals * incoming).sum(axis=1, keepdims=True) * normals,
        "shadow": (light - origins) / np.linalg.norm(light - origins, axis=1, keepdims=True),
        "ambient": cosine_directions(normals, rng),
    }
    return [Rays(n, origins.astype(np.float32), np.ascontiguousarray(d, np.float32)) for n, d in directions.items()]


# --- contenders: each returns two functions of rays, closest hit (primitive ids) and any hit (booleans)

Query = Callable[[Rays], np.ndarray]


def contend_warp_rt(points: np.ndarray, triangles: np.ndarray) -> tuple[Query, Query, float]:
    start = time.perf_counter()
    accel = warp_rt.build_accel(warp_rt.Scene.from_arrays(points, triangles), threads=1)
    seconds = time.perf_counter() - start
    return (
        lambda rays: warp_rt.closest_hit(accel, rays.origins, rays.directions, threads=1).triangle,
        lambda rays: warp_rt.any_hit(accel, rays.origins, rays.directions, threads=1),
        seconds,
    )


def contend_embree(points: np.ndarray, triangles: np.ndarray) -> tuple[Query, Query, float]:
    from embreex import rtcore_scene
    from embreex.mesh_construction import TriangleMesh

    start = time.perf_counter()
    scene = rtcore_scene.EmbreeScene(robust=True)
    TriangleMesh(scene, points, triangles)
    one = np.zeros((1, 3), np.float32)
    scene.run(one, one + 1)  # commits
    seconds = time.perf_counter() - start
    return (
        lambda rays: scene.run(rays.origins, rays.directions),
        lambda rays: scene.run(rays.origins, rays.directions, query="OCCLUDED") >= 0,
        seconds,
    )


def contend_wp_mesh(points: np.ndarray, triangles: np.ndarray) -> tuple[Query, Query, float]:
    start = time.perf_counter()
    mesh = wp.Mesh(
        wp.array(points, dtype=wp.vec3, device="cpu"), wp.array(triangles.reshape(-1), dtype=int, device="cpu")
    )
    seconds = time.perf_counter() - start

    def arrays(rays: Rays) -> list[wp.array]:
        vectors = (rays.origins, rays.directions)
        return [wp.array(v, dtype=wp.vec3, device="cpu", copy=False) for v in vectors]

    def closest(rays: Rays) -> np.ndarray:
        outputs = [wp.empty(len(rays.origins), dtype=d, device="cpu") for d in (int, float, wp.vec2)]
        wp.launch(mesh_closest, len(rays.origins), inputs=[mesh.id, *arrays(rays)], outputs=outputs, device="cpu")
        return outputs[0].numpy()

    def blocked(rays: Rays) -> np.ndarray:
        output = wp.empty(len(rays.origins), dtype=wp.bool, device="cpu")
        wp.launch(mesh_any, len(rays.origins), inputs=[mesh.id, *arrays(rays)], outputs=[output], device="cpu")
        return output.numpy()

    return closest, blocked, seconds


CONTENDERS = {"warp_rt": contend_warp_rt, "embree": contend_embree, "wp.Mesh": contend_wp_mesh}


def measure(name: str, points: np.ndarray, triangles: np.ndarray, image: int, rounds: int) -> list[dict]:
    """Return one row a ray kind and query."""
    accel = warp_rt.build_accel(warp_rt.Scene.from_arrays(points, triangles), threads=1)
    primary = primary_rays(points, image)
    hits = warp_rt.closest_hit(accel, primary.origins, primary.directions)
    sets = [primary, *secondary_rays(points, triangles, primary, hits), diffuse_rays(points, triangles, image**2)]
    queries = {}
    for contender, make in CONTENDERS.items():
        try:
            queries[contender] = make(points, triangles)
        except ImportError:
            print(f"{contender} is not installed", file=sys.stderr)
    rows = []
    for rays in sets:
        for index, query in enumerate(("closest", "any")):
            seconds: dict[str, list[float]] = {contender: [] for contender in queries}
            results = {}
            for _ in range(rounds):
                for contender, functions in queries.items():
                    start = time.perf_counter()
                    results[contender] = functions[index](rays)
                    seconds[contender].append(time.perf_counter() - start)
            row = {"mesh": name, "triangles": len(triangles), "rays": rays.name, "query": query}
            row |= {"ray_count": len(rays.origins)}
            for contender, times in seconds.items():
                rate = len(rays.origins) / 1e6
                row[contender] = rate / statistics.median(times)
                row[f"{contender} spread"] = [rate / max(times), rate / min(times)]
            hit = {c: np.asarray(r) >= 0 if query == "closest" else np.asarray(r) for c, r in results.items()}
            row["hit_differences"] = {c: int((hit[c] != hit["warp_rt"]).sum()) for c in hit if c != "warp_rt"}
            rows.append(row)
            print_row(row)
    rows.append({"mesh": name, "build_seconds": {c: functions[2] for c, functions in queries.items()}})
    return rows


def print_row(row: dict) -> None:
    rates = "".join(f"{row.get(c, float('nan')):9.2f}" for c in CONTENDERS)
    ratios = "".join(f"{row['warp_rt'] / row[c]:9.2f}" if c in row else "        -" for c in list(CONTENDERS)[1:])
    print(f"{row['mesh']:<14}{row['rays']:<9}{row['query']:<8}{rates}{ratios}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path, help="file to write the results to")
    parser.add_argument("--quick", action="store_true", help="smaller meshes, fewer rays")
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    init_warp()
    image = 256 if options.quick else 1024
    meshes = {"teapot 9k": teapot(12), "teapot 65k": teapot(32), "ico 82k": noisy_icosphere(6)}
    if not options.quick:
        meshes["ico 1.31M"] = noisy_icosphere(8)
    heads = "".join(f"{c:>9}" for c in CONTENDERS) + "".join(f"{'/ ' + c:>9}" for c in list(CONTENDERS)[1:])
    print(f"{'mesh':<14}{'rays':<9}{'query':<8}{heads}   (Mrays/s, ratios)")
    rows = [row for name, mesh in meshes.items() for row in measure(name, *mesh, image, options.rounds)]
    if options.json:
        machine = {"platform": platform.platform(), "processor": platform.processor(), "warp": wp.config.version}
        options.json.write_text(json.dumps({"machine": machine, "rows": rows}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
