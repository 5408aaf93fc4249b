# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""CPU seconds of a whole frame beside POV-Ray 3.7 and, where it is installed, Mitsuba 3.

    python -m benchmarks frame                                 10 thousand and a million triangles
    python -m benchmarks frame --triangles 10000 --ball triangles

The scene is scenes/mirror_teapot.usda at the wanted tessellation, its ball an exact one or of triangles as well,
1024 x 768, depth 7, threshold 0, one sample a pixel. warp_rt and POV-Ray take one thread each and trace the same rays.
Mitsuba's path tracer does not: it follows one path a pixel and one light a hit, so that its figure is no more than a
neighbour's. Loading, parsing, building and compiling are left out on all sides. Needs ``povray``.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from argparse import Namespace
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from warp_rt import Film, Renderer, RenderOptions, load_scene

from . import povray_run, results
from .command import make_parser, save_if_asked
from .oracle_scene import describe
from .povray_export import Export
from .timing import significant, spread

WIDTH, HEIGHT, DEPTH, THRESHOLD = 1024, 768, 7, 0.0
KEYS = ("triangles_wanted", "ball")
BALLS = {"exact": 0, "triangles": 48}
"""How many steps a ball has from pole to pole."""


def main(arguments: Sequence[str]) -> None:
    """Print the table, and save its rows where asked to."""
    parser = make_parser("frame", __doc__)
    parser.add_argument("--triangles", type=int, nargs="+", default=[10_000, 1_000_000], help="sizes of the teapot")
    parser.add_argument("--ball", choices=BALLS, nargs="+", default=list(BALLS), help="kinds of it")
    parser.add_argument("--povray", default="povray", help="the program")
    options = parser.parse_args(arguments)
    if not povray_run.is_installed(options.povray):
        sys.exit(f"frame: no program {options.povray!r}: {povray_run.INSTALL}")
    rows = []
    for ball in options.ball:
        for count in options.triangles:
            with tempfile.TemporaryDirectory() as folder:
                figures = measure(count, ball, options, Path(folder))
            rows.append({"triangles_wanted": count, "ball": ball} | figures)
            print_row(rows[-1])
    save_if_asked(options, "frame", rows, KEYS)


def measure(count: int, ball: str, options: Namespace, folder: Path) -> results.Row:
    """Return the figures for a teapot of about ``count`` triangles and a ball of one of BALLS' kinds."""
    scene = load_scene(write_stage(count, folder, BALLS[ball]))
    description, arrays = describe(scene, WIDTH, HEIGHT)
    frame_options = RenderOptions(width=WIDTH, height=HEIGHT, depth=DEPTH, threshold=THRESHOLD, threads=1)
    renderer = Renderer(scene, frame_options, device="cpu")
    exported = Export(scene, width=WIDTH, height=HEIGHT, depth=DEPTH, threshold=THRESHOLD).text
    mitsuba = mitsuba_renderer(description, arrays)
    seconds: dict[str, list[float]] = {name: [] for name in ("warp_rt", "povray", *(["mitsuba"] if mitsuba else []))}
    film = renderer.render()  # warms caches up
    for _ in range(options.rounds):
        start = time.process_time()
        film = renderer.render()
        seconds["warp_rt"].append(time.process_time() - start)
        run = povray_run.render(exported, folder, WIDTH, HEIGHT, program=options.povray)
        seconds["povray"].append(run.cpu_seconds)
        if mitsuba:
            start = time.process_time()
            mitsuba()
            seconds["mitsuba"].append(time.process_time() - start)
    return {
        "triangles": scene.triangle_count,
        "seconds": {name: significant(turns) for name, turns in seconds.items()},
        "ratio_to_povray": round(statistics.median(seconds["warp_rt"]) / statistics.median(seconds["povray"]), 4),
        "pixels_alike": pixels_alike(film, run.color),
        "tree_rays": film.rays.primary + film.rays.reflection + film.rays.refraction,
        "shadow_rays": film.rays.shadow,
    }


def write_stage(count: int, folder: Path, ball_segments: int = 0) -> Path:
    """Write the mirror and a teapot of about ``count`` triangles, and return the file.

    Args:
        count: Of triangles.
        folder: For the file.
        ball_segments: Steps of the ball from pole to pole; 0: an exact ball.
    """
    path = folder / "scene.usdc"
    segments = round(np.sqrt(count / 64 + 1 / 256) + 1 / 16)  # inverse of 64 n^2 - 8 n
    script = results.ROOT / "scenes" / "make_mirror_teapot.py"
    steps = ["--segments", str(segments), "--ball-segments", str(ball_segments)]
    subprocess.run([sys.executable, str(script), str(path), *steps], check=True)
    return path


def pixels_alike(film: Film, other: np.ndarray) -> float:
    """Return the fraction of pixels within 1e-3; POV-Ray weighs total internal reflection by 1, we by Kr + Kt."""
    return round(float((np.abs(np.clip(film.color, 0, 1) - other).max(axis=-1) <= 1e-3).mean()), 6)


def mitsuba_renderer(description: dict, arrays: dict[str, np.ndarray]) -> Callable[[], object] | None:
    """Return a function that renders the scene with Mitsuba's path tracer; None where it is not installed."""
    try:
        import mitsuba
    except ImportError:
        print("mitsuba is left out: it is not installed", file=sys.stderr)
        return None
    mitsuba.set_variant("scalar_rgb")
    parts: dict[str, object] = {"type": "scene", "integrator": {"type": "path", "max_depth": DEPTH + 1}}
    for row, material in enumerate(description["materials"]):
        chosen = np.flatnonzero(arrays["mat"] == row)
        if len(chosen):
            parts[f"mesh{row}"] = mitsuba_mesh(mitsuba, f"mesh{row}", arrays, chosen, material)
    for row, light in enumerate(description["lights"]):
        if light["type"] == "point":
            fields = {"type": "point", "position": light["position"]}
            parts[f"light{row}"] = fields | {"intensity": {"type": "rgb", "value": light["color"]}}
        else:
            fields = {"type": "directional", "direction": light["direction"]}
            parts[f"light{row}"] = fields | {"irradiance": {"type": "rgb", "value": light["color"]}}
    camera = description["camera"]
    eye, forward, up = (np.array(camera[key]) for key in ("eye", "dir", "up"))
    parts["sensor"] = {
        "type": "perspective",
        "fov": float(2 * np.degrees(np.arctan(np.linalg.norm(up) / 2 / np.linalg.norm(forward)))),
        "fov_axis": "y",
        "to_world": mitsuba.ScalarTransform4f().look_at(eye.tolist(), (eye + forward).tolist(), up.tolist()),
        "film": {"type": "hdrfilm", "width": WIDTH, "height": HEIGHT, "rfilter": {"type": "box"}},
        "sampler": {"type": "independent", "sample_count": 1},
    }
    scene = mitsuba.load_dict(parts)
    return lambda: np.array(mitsuba.render(scene, spp=1))


def mitsuba_mesh(
    mitsuba: Any, name: str, arrays: dict[str, np.ndarray], chosen: np.ndarray, material: dict[str, Any]
) -> Any:
    """Return triangles as Mitsuba's mesh: glass, mirror or diffuse, whichever the material has most of."""
    if max(material["kt"]) > 0:
        surface = {"type": "dielectric", "int_ior": material["ior"]}
    elif max(material["kr"]) > 0:
        surface = {"type": "conductor", "specular_reflectance": {"type": "rgb", "value": material["kr"]}}
    else:
        surface = {
            "type": "twosided",
            "b": {"type": "diffuse", "reflectance": {"type": "rgb", "value": material["kd"]}},
        }
    properties = mitsuba.Properties()
    properties["mesh_bsdf"] = mitsuba.load_dict(surface)
    points = arrays["v"][arrays["f"][chosen]].reshape(-1, 3)  # one vertex a corner keeps each corner's normal
    mesh = mitsuba.Mesh(name, len(points), len(chosen), has_vertex_normals=True, props=properties)
    values = mitsuba.traverse(mesh)
    values["vertex_positions"] = np.ascontiguousarray(points, np.float32).ravel()
    values["vertex_normals"] = np.ascontiguousarray(arrays["n"][chosen], np.float32).ravel()
    values["faces"] = np.arange(len(points), dtype=np.uint32)
    values.update()
    return mesh


def print_row(row: results.Row) -> None:
    """Print the seconds of each program."""
    ball = "an exact ball" if row["ball"] == "exact" else "the ball among them"
    print(f"{row['triangles']:,} triangles, {ball}, {row['tree_rays']:,} + {row['shadow_rays']:,} rays")
    for name, seconds in row["seconds"].items():
        print(f"  {name:<10}{spread(seconds)}")
    print(
        f"  {row['ratio_to_povray']:.3f} of POV-Ray's time, {row['pixels_alike']:.2%} of the pixels alike", flush=True
    )
