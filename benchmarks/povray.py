# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Pictures and ray counts beside POV-Ray 3.7: of USD stages, of the mirror and the teapot, of random scenes.

    python -m benchmarks povray                              the mirror and the teapot at depth 1 to 7, and random ones
    python -m benchmarks povray SCENE.usda ... --picture out.png
    python -m benchmarks povray SCENE.usda --pov out.pov     also keep the exported file

Every scene is exported triangle by triangle (``povray_export``); what POV-Ray renders otherwise is reported, and then
the figures are no test. A pixel differs if a channel, cut off at 1, does by more than 1e-4. A soft spot is a pixel
whose colour jumps when its ray moves by a hundredth of a pixel: an edge, seen directly, in a mirror, or of a shadow,
where either program's rounding may decide. Without scenes, glass has Kr = 1 - Kt.
"""

from __future__ import annotations

import sys
import tempfile
from argparse import Namespace
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from warp_rt import Film, Renderer, RenderOptions, Scene, load_scene
from warp_rt.rendering.film_camera import choose_camera

from . import povray_run, results
from .command import make_parser, save_if_asked
from .povray_export import Export
from .povray_scenes import random_scene, with_povray_glass

DIFFERENCE = 1e-4
STEP = 0.01  # of a ray that looks for soft spots [pixel]
KEYS = ("scene", "depth", "threshold", "shadows")


def main(arguments: Sequence[str]) -> None:
    """Print a line for each comparison, and what POV-Ray has no equal for."""
    parser = make_parser("povray", __doc__, rounds=1)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help="USD stages; none: our own")
    parser.add_argument("--width", type=int, default=320)
    parser.add_argument("--height", type=int, default=240)
    parser.add_argument("--depth", type=int, default=7)
    parser.add_argument("--threshold", type=float, default=0.0)
    parser.add_argument("--random", type=int, default=6, help="random scenes (default 6)")
    parser.add_argument("--picture", type=Path, help="write the last comparison side by side")
    parser.add_argument("--pov", type=Path, help="write the last exported scene")
    parser.add_argument("--povray", default=povray_run.PROGRAM, help="the program")
    options = parser.parse_args(arguments)
    if not povray_run.is_installed(options.povray):
        sys.exit(f"povray: no program {options.povray!r}: {povray_run.INSTALL}")
    rows = []
    for scene, depth, threshold, shadows in chosen(options):
        row, film, run = compare(scene, options, depth=depth, threshold=threshold, shadows=shadows)
        rows.append(row)
        print_row(row)
        if options.picture:
            side_by_side(film.color, run.color).save(options.picture)
    save_if_asked(options, "povray", rows, KEYS)


def chosen(options: Namespace) -> Iterator[tuple[Scene, int, float, str]]:
    """Yield scene, depth, threshold and kind of shadows of each comparison."""
    for path in options.scenes:
        yield load_scene(path), options.depth, options.threshold, "opaque"
    if not options.scenes:
        base = load_scene(results.ROOT / "scenes" / "mirror_teapot.usda")
        for seed in range(options.random):
            yield random_scene(base, seed), 8, 0.03, ("opaque", "transmit")[seed % 2]
        for depth in range(1, options.depth + 1):
            yield with_povray_glass(base), depth, options.threshold, "opaque"


def compare(
    scene: Scene, options: Namespace, *, depth: int, threshold: float, shadows: str
) -> tuple[results.Row, Film, povray_run.PovrayRun]:
    """Return the figures of a comparison, and both pictures."""
    width, height = options.width, options.height
    transmit = shadows == "transmit"
    export = Export(scene, width=width, height=height, depth=depth, threshold=threshold, transmit=transmit)
    if options.pov:
        options.pov.write_text(export.text, encoding="ascii")
    with tempfile.TemporaryDirectory() as folder:
        run = povray_run.render(export.text, Path(folder), width, height, program=options.povray)
    renderer = Renderer(
        scene,
        RenderOptions(width=width, height=height, depth=depth, threshold=threshold, shadows=shadows),
        device="cpu",
    )
    film = renderer.render()
    difference = np.abs(np.clip(film.color, 0, 1) - run.color).max(axis=-1)
    is_soft = soft_spots(renderer, film.color)
    differs = difference > DIFFERENCE
    rays = film.rays
    traced = sum(level.nodes for level in rays.per_depth) + rays.dropped_by_depth + rays.dropped_by_threshold
    row = {
        "scene": Path(scene.source).name,
        "depth": depth,
        "threshold": threshold,
        "shadows": shadows,
        "pixels": width * height,
        "differ_on_soft_spots": int((differs & is_soft).sum()),
        "differ_elsewhere": int((differs & ~is_soft).sum()),
        "soft_spots": int(is_soft.sum()),
        "largest_difference_elsewhere": float(f"{difference[~is_soft].max(initial=0):.2g}"),
        "tree_rays": [traced, run.rays],
        # POV-Ray counts a shadow ray anew behind each surface of glass that it crosses.
        "shadow_rays": [rays.shadow, run.shadow if not transmit else None],
        "total_internal_reflections": [rays.total_internal_reflection, run.total_internal_reflection],
        "unsupported": export.unsupported,
    }
    return row, film, run


def soft_spots(renderer: Renderer, color: np.ndarray) -> np.ndarray:
    """Return the pixels whose colour jumps when their ray moves a little, along any of four axes: [height, width].

    A jump is told from a slope by the second difference, which is 0 for slopes.
    """
    camera = choose_camera(renderer.scene, None)
    assert camera is not None  # every stage of these has one
    left, right, bottom, top = camera.window
    dx, dy = STEP * (right - left) / color.shape[1], STEP * (top - bottom) / color.shape[0]

    def moved(x: float, y: float) -> np.ndarray:
        window = (left + x * dx, right + x * dx, bottom + y * dy, top + y * dy)
        return renderer.render(camera=replace(camera, window=window)).color

    is_soft = np.zeros(color.shape[:2], bool)
    for x, y in ((1, 0), (0, 1), (1, 1), (1, -1)):
        is_soft |= np.abs(moved(x, y) + moved(-x, -y) - 2 * color).max(axis=-1) > DIFFERENCE
    return is_soft


def print_row(row: results.Row) -> None:
    """Print one comparison."""
    for line in row["unsupported"]:
        print(f"  not the same in POV-Ray: {line}")
    counts = []
    for name in ("tree_rays", "shadow_rays", "total_internal_reflections"):
        ours, theirs = row[name]
        counts.append(f"{name.replace('_', ' ')} {ours:,} / {'-' if theirs is None else f'{theirs:,}'}")
    print(
        f"{row['scene']} depth {row['depth']} threshold {row['threshold']} {row['shadows']}: of {row['pixels']:,} "
        f"pixels {row['differ_on_soft_spots']} differ on {row['soft_spots']} soft spots, {row['differ_elsewhere']} "
        f"elsewhere (at most {row['largest_difference_elsewhere']}); {', '.join(counts)}",
        flush=True,
    )


def side_by_side(ours: np.ndarray, theirs: np.ndarray) -> Image.Image:
    """Return our picture, POV-Ray's, and their difference, from black at 0 to white at 1e-4 or more."""
    difference = np.abs(np.clip(ours, 0, 1) - theirs).max(axis=-1, keepdims=True) / DIFFERENCE
    gap = np.ones((len(ours), 4, 3))
    shown = [ours, gap, theirs, gap, np.repeat(np.clip(difference, 0, 1), 3, axis=-1) ** 2.4]
    linear = np.clip(np.concatenate(shown, axis=1), 0, 1)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)  # IEC 61966-2-1
    return Image.fromarray((encoded * 255 + 0.5).astype(np.uint8))
