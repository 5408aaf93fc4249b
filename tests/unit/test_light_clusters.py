# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Clusters of mesh lights against what they hold."""

from __future__ import annotations

import numpy as np
import pytest

from warp_rt.upload.light_clusters import leaf_count, light_clusters


def test_those_of_balls_are_told() -> None:
    corners = np.random.default_rng(0).uniform(-1, 1, (12, 3, 3))
    clusters = light_clusters(corners, np.zeros(12, np.int32), np.arange(12, dtype=np.int32) // 4, 4)
    assert clusters["balls"].tolist() == [0, 2, 2, 2, 1, 1, 1, 1, *[0] * 8]


@pytest.mark.parametrize("count", [1, 2, 3, 5, 8, 13])
def test_each_holds_its_triangles(count: int) -> None:
    corners = np.random.default_rng(count).uniform(-1, 1, (count, 3, 3)) + 100
    if count > 2:
        corners[1, 1:] = corners[1, 0]  # without area
    leaves = leaf_count(count)
    assert leaves / 2 < count <= leaves
    free_sides, bodies = np.arange(count, dtype=np.int32) % 4, np.arange(count, dtype=np.int32) // 3
    clusters = light_clusters(corners, free_sides, bodies)
    assert len(clusters) == leaves
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    for row in range(1, leaves):
        first, last = row, row
        while first < leaves:
            first, last = 2 * first, 2 * last + 1
        held = slice(first - leaves, min(last + 1 - leaves, count))
        cluster, own = clusters[row], normals[held]
        if not np.linalg.norm(own, axis=1).any():
            assert cluster["cos_spread"] > 1
            continue
        np.testing.assert_allclose(cluster["area"], own.sum(axis=0), rtol=1e-5, atol=1e-6)
        assert cluster["size"] == pytest.approx(np.linalg.norm(own, axis=1).sum(), rel=1e-5)
        outer = np.einsum("nj,nk->jk", own, corners[held].mean(axis=1) - cluster["center"])
        np.testing.assert_allclose(cluster["moment"], outer, atol=1e-4)
        assert np.linalg.norm(corners[held] - cluster["center"], axis=2).max() <= cluster["radius"]
        own = own[np.linalg.norm(own, axis=1) > 0]
        cosines = own @ cluster["area"] / (np.linalg.norm(own, axis=1) * np.linalg.norm(cluster["area"]))
        assert cosines.min() == pytest.approx(cluster["cos_spread"], abs=1e-5)
        assert held.start <= cluster["middle"] < held.stop
        assert cluster["free_sides"] == np.bitwise_and.reduce(free_sides[held])
        assert cluster["body"] == (bodies[held][0] if len(set(bodies[held])) == 1 else -1)
