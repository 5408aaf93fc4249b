# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The oracle's scenes, read from USD: pictures, first hits and ray counts of a float64 tracer at every depth."""

from __future__ import annotations

import csv
import functools
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenEXR
import pytest

from warp_rt import Film, Renderer, RenderOptions, Scene, load_scene, render_series
from warp_rt.options import BUILDERS, INTERSECTORS

from .oracle_scenes import PIXEL_FRACTION, assert_near, assert_same_counts, assert_same_image, oracle_folder

SIZE = {"mirror_teapot": (320, 240), "random_1": (160, 160), "random_2": (160, 160)}
CASES = [("mirror_teapot", depth, 0.0) for depth in range(1, 8)] + [("mirror_teapot", 7, 0.05)]
CASES += [(name, *limits) for name in ("random_1", "random_2") for limits in ((1, 0.0), (7, 0.0), (9, 0.05))]


@functools.cache
def scene_of(name: str) -> Scene:
    return load_scene(oracle_folder() / "scenes" / f"{name}.usda")


def render(name: str, **options: object) -> Film:
    width, height = SIZE[name]
    return Renderer(scene_of(name), RenderOptions(width=width, height=height, **options), device="cpu").render()


def expected_image(name: str, depth: int, threshold: float) -> np.ndarray:
    suffix = f"_threshold{threshold}" if threshold else ""
    return np.load(oracle_folder() / "expected" / f"{name}_depth{depth}{suffix}.npz")["img"]


def expected_counts(name: str, depth: int, threshold: float) -> dict[str, float]:
    with (oracle_folder() / "expected" / "ray_counts.tsv").open(newline="") as table:
        for row in csv.DictReader(table, delimiter="\t"):
            if (row["scene"], int(row["depth"]), float(row["threshold"])) == (name, depth, threshold):
                return {key: float(value) for key, value in row.items() if key != "scene"}
    raise AssertionError(f"no row for {name}, depth {depth}, threshold {threshold}")


@pytest.mark.parametrize(("name", "depth", "threshold"), CASES)
def test_image_and_counts(name: str, depth: int, threshold: float) -> None:
    film = render(name, depth=depth, threshold=threshold)
    assert_same_image(film.color, expected_image(name, depth, threshold))
    assert_same_counts(film, expected_counts(name, depth, threshold))


def test_counts_of_each_depth() -> None:
    """What depth d adds to the oracle's totals at depth d - 1 is level d; what is dropped at depth d is level d + 1."""
    rays = render("mirror_teapot", depth=7, threshold=0.0).rays
    totals = [expected_counts("mirror_teapot", depth, 0.0) for depth in range(1, 8)]
    for level, total, before in zip(rays.per_depth, totals, [dict.fromkeys(totals[0], 0.0), *totals[:-1]], strict=True):
        for kind in ("reflection", "refraction", "shadow", "nodes"):
            assert_near(getattr(level, kind), total[kind] - before[kind], f"depth {level.depth}: {kind}")
        dropped = rays.per_depth[level.depth].nodes if level.depth < 7 else rays.dropped_by_depth
        assert_near(dropped, total["pruned_depth"], f"depth {level.depth}: dropped")


def test_series_of_depths() -> None:
    """One scene prepared once gives the oracle's picture and counts at each depth, and its share of changing pixels."""
    width, height = SIZE["mirror_teapot"]
    series = render_series(scene_of("mirror_teapot"), width=width, height=height, threshold=0.0, device="cpu")
    before = None
    for step in series.steps:
        expected = expected_image("mirror_teapot", step.depth, 0.0)
        assert_same_image(step.image.linear, expected)
        assert_same_counts(step.image.film, expected_counts("mirror_teapot", step.depth, 0.0))
        if before is not None:
            assert step.change.share == pytest.approx((expected != before).any(axis=-1).mean(), abs=1 - PIXEL_FRACTION)
        before = expected


@pytest.mark.parametrize("intersector", INTERSECTORS)
@pytest.mark.parametrize("bvh", BUILDERS)
def test_every_builder_and_intersector(bvh: str, intersector: str) -> None:
    film = render("mirror_teapot", depth=7, threshold=0.0, bvh=bvh, intersector=intersector)
    assert_same_image(film.color, expected_image("mirror_teapot", 7, 0.0))
    assert_same_counts(film, expected_counts("mirror_teapot", 7, 0.0))


@pytest.mark.parametrize("name", SIZE)
def test_first_hits(name: str) -> None:
    """Distance and triangle behind every pixel. A ray along an edge may take either triangle: 1 pixel in 1000."""
    film = render(name, depth=1, aovs=("color", "distance", "primId", "elementId"))
    folder = oracle_folder()
    expected = np.load(folder / "expected" / f"{name}_first_hit.npz")
    shape = (film.height, film.width)
    distance, triangle = expected["t"].reshape(shape), expected["tri"].reshape(shape)
    body = np.load(folder / "scenes" / f"{name}.npz")["obj"]

    found = np.full(shape, -1)
    for prim, path in enumerate(film.prims):
        label = path.rsplit("/", 1)[-1]
        if label.startswith("o") and label[1:].isdigit():
            here = film.aovs["primId"] == prim
            found[here] = np.flatnonzero(body == int(label[1:]))[film.aovs["elementId"][here]]
    assert np.mean(found == triangle) >= 0.999
    same = (found == triangle) & (triangle >= 0)
    # float32 places a ray's meeting with a plane to a few units in the last place of the lengths at hand, measured
    # across the plane; along the ray that is the more the more it grazes.
    error = np.abs(film.aovs["distance"][same].astype(float) - distance[same])
    assert (error * facing(name, triangle)[same]).max() <= 8 * np.spacing(distance[same].max())
    assert np.isinf(film.aovs["distance"][found < 0]).all()


def facing(name: str, triangle: np.ndarray) -> np.ndarray:
    """Return the cosine between each pixel's ray and the normal of the triangle behind it: shape of ``triangle``."""
    arrays = np.load(oracle_folder() / "scenes" / f"{name}.npz")
    camera = json.loads((oracle_folder() / "scenes" / f"{name}.json").read_text())["camera"]
    height, width = triangle.shape
    x, y = np.meshgrid((np.arange(width) + 0.5) / width - 0.5, 0.5 - (np.arange(height) + 0.5) / height)
    ray = np.array(camera["dir"]) + x[..., None] * camera["right"] + y[..., None] * camera["up"]
    corner = arrays["v"][arrays["f"][triangle]]
    normal = np.cross(corner[..., 1, :] - corner[..., 0, :], corner[..., 2, :] - corner[..., 0, :])
    length = np.linalg.norm(ray, axis=-1) * np.linalg.norm(normal, axis=-1)
    return np.abs((ray * normal).sum(axis=-1)) / length


def test_command_line_gives_the_same(tmp_path: Path) -> None:
    out = tmp_path / "picture.exr"
    stage = oracle_folder() / "scenes" / "mirror_teapot.usda"
    command = [sys.executable, "-m", "warp_rt", "render", stage, "-o", out, "--json", "--device", "cpu"]
    command += ["--width", "320", "--height", "240", "--depth", "7", "--threshold", "0.05"]
    result = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=True)
    rays = json.loads(result.stdout)["rays"]
    expected = expected_counts("mirror_teapot", 7, 0.05)
    assert rays["reflection"] == pytest.approx(expected["reflection"], rel=1e-3)
    assert rays["shadow"] == pytest.approx(expected["shadow"], rel=1e-3)
    with OpenEXR.File(str(out), separate_channels=True) as file:
        color = np.stack([file.channels()[name].pixels for name in "RGB"], axis=-1)
    assert_same_image(color, expected_image("mirror_teapot", 7, 0.05))
