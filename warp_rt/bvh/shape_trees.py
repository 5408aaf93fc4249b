# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Trees over shapes: a box around each, or each piece of a curve, and the packets that rays are tested against."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import warp as wp

from warp_rt.bvh.collapse import Forest, check_words
from warp_rt.bvh.forest import build_forest, measure_references
from warp_rt.device.jobs import Executor, host_array, numpy_type
from warp_rt.kernels import shape_pack
from warp_rt.kernels.bvh_structs import Reference
from warp_rt.kernels.constants import SHAPE_FLOATS, SHAPE_LANES, TUBE_WORDS
from warp_rt.scene import ShapeKind, Shapes, shape_boxes
from warp_rt.scene.placement import relative_points

_MAX_PIECES = 8
_ROUNDING = 2.0**-22
"""Growth of boxes by the coordinates in them: a ray's test is off by a few roundings of these."""


@dataclass(frozen=True)
class ShapeTrees:
    """A tree for each set of shapes."""

    forest: Forest
    packets: wp.array
    """float32: leaf packets, then pieces of cubic tubes."""


@dataclass(frozen=True)
class _Lanes:
    """What is referred to of one set: its shapes, or their pieces."""

    low: np.ndarray
    high: np.ndarray
    words: np.ndarray
    """float32, shape [n, 9]."""
    ids: np.ndarray
    """int32, shape [n], row of the set's shapes."""
    pieces: np.ndarray
    """float32, shape [n, 16], of cubic tubes; else shape [0, 16]."""


def build_shape_trees(
    sets: Sequence[Shapes], origins: np.ndarray, *, builder: str, executor: Executor, node_offset: int
) -> ShapeTrees:
    """Return trees over sets of shapes, none of them empty.

    Args:
        sets: One for each tree.
        origins: Local points that coordinates are relative to, shape [tree_count, 3].
        builder: As for ``build_forest``.
        executor: Where to build.
        node_offset: Number of the trees' first node.

    Raises:
        LimitError: There are more packets than 32-bit indices reach.
    """
    lanes = [_lanes(shapes, origin) for shapes, origin in zip(sets, origins, strict=True)]
    low, high, words, ids, pieces = (
        np.concatenate([getattr(part, name) for part in lanes]) for name in ("low", "high", "words", "ids", "pieces")
    )
    counts = np.array([len(part.ids) for part in lanes], np.int32)
    references = measure_references(_refer_to_boxes(low, high, executor), counts, executor)
    forest = build_forest(
        references, leaf_size=int(SHAPE_LANES), builder=builder, executor=executor, node_offset=node_offset
    )
    leaf_count = forest.layout.leaf_count
    begin = leaf_count * SHAPE_FLOATS
    check_words("words of shapes", begin + pieces.size, 1)
    is_tube = np.repeat([shapes.kind == ShapeKind.CUBIC_TUBE for shapes in sets], counts)
    words[is_tube, 0] = (begin + TUBE_WORDS * np.arange(len(pieces), dtype=np.int32)).astype(np.int32).view(np.float32)
    packets = executor.empty(begin, wp.float32)
    inputs = [forest.trees, executor.upload(words, wp.float32), executor.upload(ids, wp.int32), forest.leaf_slots]
    executor.launch(shape_pack.pack_shapes, leaf_count, inputs, [packets], weight=int(SHAPE_LANES))
    return ShapeTrees(forest, executor.concatenate([packets, executor.upload(pieces.reshape(-1), wp.float32)]))


def _refer_to_boxes(low: np.ndarray, high: np.ndarray, executor: Executor) -> wp.array:
    """Return the references of boxes, each to its row.

    Args:
        low: Lower corners, float32, shape [n, 3].
        high: Upper corners, float32, shape [n, 3].
        executor: Where they are wanted.
    """
    references = host_array(len(low), numpy_type(Reference))
    references["low"][:, :3], references["high"][:, :3] = low, high
    references["low"][:, 3] = np.arange(len(low), dtype=np.int32).view(np.float32)
    references["high"][:, 3] = np.ones(1, np.int32).view(np.float32)
    return executor.upload(references, Reference)


def _lanes(shapes: Shapes, origin: np.ndarray) -> _Lanes:
    """Return what is referred to of a set, relative to its origin."""
    points = relative_points(shapes.points, origin)
    balls = np.concatenate([points, shapes.radii[:, :, None]], axis=2).astype(np.float32)
    count = len(balls)
    ids = np.arange(count, dtype=np.int32)
    words = np.zeros((count, 9), np.float32)
    pieces = np.zeros((0, int(TUBE_WORDS)), np.float32)
    if shapes.kind == ShapeKind.CUBIC_TUBE:
        controls, ids, low_u, high_u = _split_tubes(balls)
        pieces = controls.astype(np.float32).reshape(-1, int(TUBE_WORDS))
        words = np.zeros((len(ids), 9), np.float32)
        words[:, 1], words[:, 2] = low_u, high_u
        reach = controls[:, :, 3:]
        low, high = (controls[:, :, :3] - reach).min(axis=1), (controls[:, :, :3] + reach).max(axis=1)
    else:
        words[:, : 4 * balls.shape[1]] = balls.reshape(count, -1)
        if shapes.kind == ShapeKind.FRUSTUM:
            words[:, 8] = np.array(shapes.cap_bits, np.int32).view(np.float32)
        low, high = shape_boxes(Shapes(shapes.kind, points, shapes.radii))
    growth = _ROUNDING * np.maximum(np.abs(low), np.abs(high)).max(axis=1, keepdims=True)
    return _Lanes(
        np.nextafter((low - growth).astype(np.float32), np.float32(-np.inf)),
        np.nextafter((high + growth).astype(np.float32), np.float32(np.inf)),
        words,
        ids,
        pieces,
    )


def _split_tubes(balls: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return pieces of cubic tubes that are not much longer than thick, nor much bent: their boxes are tight.

    Args:
        balls: Control points with radii, shape [n, 4, 4].

    Returns:
        Control points of the pieces, float64, shape [m, 4, 4], the tube of each, int32, and its bounds in u.
    """
    exact = balls.astype(np.float64)
    radius = np.maximum(exact[:, :, 3].max(axis=1), 1e-30)
    bend = np.abs(np.diff(exact, n=2, axis=1)).max(axis=(1, 2))
    length = np.abs(exact[:, 3, :3] - exact[:, 0, :3]).max(axis=1)
    wanted = np.maximum(np.sqrt(bend / radius), length / (32 * radius))
    count = np.clip(np.ceil(wanted), 1, _MAX_PIECES).astype(np.int64)
    tube = np.repeat(np.arange(len(balls)), count)
    place = np.arange(len(tube)) - np.repeat(np.cumsum(count) - count, count)
    low, high = place / count[tube], (place + 1) / count[tube]
    source = exact[tube]
    points = [_blossom(source, *arguments) for arguments in ((low, low, low), (low, low, high), (low, high, high))]
    points.append(_blossom(source, high, high, high))
    return np.stack(points, axis=1), tube.astype(np.int32), low, high


def _blossom(controls: np.ndarray, *arguments: np.ndarray) -> np.ndarray:
    """Return the polar form of cubics, shape [n, 4], whose control points have shape [n, 4, 4]."""
    for argument in arguments:
        controls = controls[:, :-1] + np.diff(controls, axis=1) * argument[:, None, None]
    return controls[:, 0]
