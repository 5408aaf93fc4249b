# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Regions that loops leave of a rectangle: their areas, which have closed forms, and how their cells meet."""

from __future__ import annotations

import numpy as np
import pytest

from warp_rt.splines.trim import CrossingLoopsError, find_regions, triangulate_regions

LOW, HIGH = np.array([0.0, 0.0]), np.array([4.0, 2.0])
BORDER = np.array([(0, 0), (4, 0), (4, 2), (0, 2)], float)
U_LINES, V_LINES = np.linspace(0, 4, 33), np.linspace(0, 2, 17)
COUNT = 128


def circle(u: float, v: float, radius: float, turn: int = 1) -> np.ndarray:
    angle = turn * 2 * np.pi * np.arange(COUNT) / COUNT
    return np.stack([u + radius * np.cos(angle), v + radius * np.sin(angle)], axis=1)


def disk(radius: float) -> float:
    """Return the area of a regular polygon of so many corners."""
    return COUNT / 2 * radius**2 * np.sin(2 * np.pi / COUNT)


CASES = {
    "all": ([BORDER], 8),
    "hole": ([BORDER, circle(2, 1, 0.5, -1)], 8 - disk(0.5)),
    "hole without a border": ([circle(2, 1, 0.5, -1)], 8 - disk(0.5)),
    "island": ([circle(2.05, 0.97, 0.5)], disk(0.5)),
    "two islands": ([circle(1, 1, 0.5), circle(3, 1, 0.7)], disk(0.5) + disk(0.7)),
    "ring in a ring": (
        [circle(2, 1, 0.9), circle(2, 1, 0.6, -1), circle(2, 1, 0.4), circle(2, 1, 0.2, -1)],
        disk(0.9) - disk(0.6) + disk(0.4) - disk(0.2),
    ),
    "holes touching grid lines": (
        [BORDER, circle(0.75, 1, 0.5, -1), circle(3, 1, 0.75, -1)],
        8 - disk(0.5) - disk(0.75),
    ),
    "hole over the border": ([circle(0, 1, 0.5, -1)], 8 - disk(0.5) / 2),
    "island over two borders": ([circle(4, 2, 0.5)], disk(0.5) / 4),
    "no difference": ([BORDER, circle(2, 1, 0.5), circle(3, 1, 0.2)], 8),
    "triangle": ([np.array([(0.5, 0.5), (3.5, 0.5), (2, 1.5)])], 1.5),
}


@pytest.mark.parametrize("name", CASES)
def test_what_is_left(name: str) -> None:
    loops, area = CASES[name]
    vertices, triangles = triangulate_regions(find_regions(loops, LOW, HIGH), U_LINES, V_LINES)
    corners = vertices[triangles]
    assert _areas(corners).min() > -1e-15
    assert _areas(corners).sum() == pytest.approx(area, rel=1e-12)
    # No triangle reaches over a line.
    for axis, lines in ((0, U_LINES), (1, V_LINES)):
        cell = np.searchsorted(lines, corners[:, :, axis].min(axis=1) + 1e-12)
        assert (corners[:, :, axis].max(axis=1) <= lines[np.minimum(cell, len(lines) - 1)] + 1e-12).all()
    _assert_joined(vertices, triangles, loops)


def _areas(corners: np.ndarray) -> np.ndarray:
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2


def _assert_joined(vertices: np.ndarray, triangles: np.ndarray, loops: list[np.ndarray]) -> None:
    """An edge of one triangle alone lies on a loop or on the border: everywhere else two triangles share it."""
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    single = vertices[unique[count == 1]]
    middle = single.mean(axis=1)
    distance = np.full(len(middle), np.inf)
    for loop in [BORDER, *loops]:
        begin, end = loop, np.roll(loop, -1, axis=0)
        along = end - begin
        share = np.einsum("mki,ki->mk", middle[:, None] - begin, along) / np.square(along).sum(axis=1)
        nearest = begin + np.clip(share, 0, 1)[..., None] * along
        distance = np.minimum(distance, np.linalg.norm(middle[:, None] - nearest, axis=2).min(axis=1))
    assert distance.max(initial=0) < 1e-9


def test_random_holes() -> None:
    rng = np.random.default_rng(8)
    for _ in range(5):
        radii = rng.uniform(0.05, 0.24, 6)
        cells = rng.permutation(8)[:6]
        holes = [
            circle(0.5 + cell % 4 + rng.uniform(-0.2, 0.2), 0.5 + cell // 4 + rng.uniform(-0.2, 0.2), radius, -1)
            for cell, radius in zip(cells, radii, strict=True)
        ]
        vertices, triangles = triangulate_regions(find_regions([BORDER, *holes], LOW, HIGH), U_LINES, V_LINES)
        assert _areas(vertices[triangles]).sum() == pytest.approx(8 - sum(disk(radius) for radius in radii), rel=1e-12)
        _assert_joined(vertices, triangles, holes)


def test_loops_that_cross_are_refused() -> None:
    with pytest.raises(CrossingLoopsError):
        find_regions([np.array([(0, 0), (1, 1), (1, 0), (0, 1.5)])], LOW, HIGH)
    with pytest.raises(CrossingLoopsError):
        find_regions([BORDER, circle(1, 1, 0.5, -1), circle(1.3, 1, 0.5, -1)], LOW, HIGH)
