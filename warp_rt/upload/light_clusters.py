# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Clusters of a mesh light's triangles: a complete binary tree over their order along a curve."""

from __future__ import annotations

import numpy as np

from warp_rt.kernels.light_structs import LightCluster

_EMPTY = 2.0  # no cosine
# What rounding to float32 may take of a radius, whose centre is rounded too.
_ROUNDING = 1e-5


def leaf_count(triangles: int) -> int:
    """Return the leaves of the complete tree over a number of triangles: that, rounded up to a power of two."""
    return 1 << (triangles - 1).bit_length()


def light_clusters(corners: np.ndarray, free_sides: np.ndarray, bodies: np.ndarray, ball_leaves: int = 0) -> np.ndarray:
    """Return the clusters of a mesh light: of ``LightCluster``, shape [``leaf_count``], the root at 1, none at 0.

    Args:
        corners: Of its triangles, wound as seen from outside, neighbours in order: float64, shape [n, 3, 3], n > 0.
        free_sides: ``LightTriangle.free_sides`` of each: int32, shape [n].
        bodies: ``LightTriangle.body``, likewise.
        ball_leaves: So many triangles in a row, a power of two, stand for a ball; 0: they do not.
    """
    leaves = leaf_count(len(corners))
    table = np.zeros(leaves, LightCluster.numpy_dtype())
    padding = leaves - len(corners)
    corners = np.concatenate([corners, np.repeat(corners[-1:], padding, axis=0)])
    free_sides, bodies = (np.concatenate([of, np.repeat(of[-1:], padding)]) for of in (free_sides, bodies))
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    areas[leaves - padding :] = 0
    sizes = np.linalg.norm(areas, axis=1)
    normals = areas / np.where(sizes > 0, sizes, 1)[:, None]
    middles = corners.mean(axis=1)
    moments = middles * sizes[:, None]
    products = areas[:, :, None] * middles[:, None, :]
    count = 1
    while count < leaves:
        area, size, moment, product = (
            of.reshape(count, -1, *of.shape[1:]).sum(axis=1) for of in (areas, sizes, moments, products)
        )
        points = corners.reshape(count, -1, 3)
        center = np.where(size[:, None] > 0, moment / np.where(size > 0, size, 1)[:, None], points[:, 0])
        axis = area / np.maximum(np.linalg.norm(area, axis=1), 1e-300)[:, None]
        cosines = np.einsum("nkc,nc->nk", normals.reshape(count, -1, 3), axis)
        lowest = np.where(sizes.reshape(count, -1) > 0, cosines, 1).min(axis=1)
        rows = table[count : 2 * count]
        rows["center"], rows["area"], rows["size"] = center, area, size
        rows["moment"] = product - area[:, :, None] * center[:, None, :]
        reach = np.linalg.norm(points - center[:, None], axis=2).max(axis=1)
        rows["radius"] = reach + _ROUNDING * (reach + np.abs(center).max(axis=1))
        rows["cos_spread"] = np.where(size > 0, lowest, _EMPTY)
        span = leaves // count
        rows["free_sides"] = np.bitwise_and.reduce(free_sides.reshape(count, -1), axis=1)
        own = bodies.reshape(count, -1)
        rows["body"] = np.where((own == own[:, :1]).all(axis=1), own[:, 0], -1)
        if ball_leaves and span >= ball_leaves:
            rows["balls"] = 1 if span == ball_leaves else 2
        rows["middle"] = np.minimum(np.arange(count) * span + span // 2, leaves - padding - 1)
        count *= 2
    return table
