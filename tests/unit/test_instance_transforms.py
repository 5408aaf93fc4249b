# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Transforms that are made as they are asked for are the arrays that they stand for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from warp_rt.errors import SceneError
from warp_rt.scene import Instances
from warp_rt.scene.instance_transforms import (
    JoinedTransforms,
    LazyTransforms,
    NestedTransforms,
    ScatteredTransforms,
    choose,
    join,
    nest,
)

COUNT = 5000  # more than are computed at a time
RNG = np.random.default_rng(3)
POSITIONS = RNG.normal(size=(COUNT, 3)).astype(np.float32)
QUATERNIONS = RNG.normal(size=(COUNT, 4)).astype(np.float16)
SCALES = RNG.uniform(-2, 2, (COUNT, 3)).astype(np.float32)
PLACES = RNG.normal(size=(4, 4, 4))
PLACES[:, 3] = 0, 0, 0, 1


def hamilton(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return products of quaternions i, j, k, real, shape [n, 4]."""
    v, w, u, t = a[:, :3], a[:, 3:], b[:, :3], b[:, 3:]
    return np.concatenate([w * u + t * v + np.cross(v, u), w * t - (v * u).sum(axis=1, keepdims=True)], axis=1)


def scattered() -> ScatteredTransforms:
    return ScatteredTransforms(POSITIONS, QUATERNIONS, SCALES)


def test_points_are_scaled_then_turned_then_moved() -> None:
    point = np.array([0.3, -0.7, 1.1])
    unit = QUATERNIONS.astype(float) / np.linalg.norm(QUATERNIONS.astype(float), axis=1, keepdims=True)
    scaled = np.concatenate([SCALES * point, np.zeros((COUNT, 1))], axis=1)
    turned = hamilton(hamilton(unit, scaled), unit * (-1, -1, -1, 1))[:, :3]
    found = scattered()[:] @ np.array([*point, 1.0])
    np.testing.assert_allclose(found[:, :3], turned + POSITIONS, atol=1e-13)
    np.testing.assert_array_equal(found[:, 3], 1)


@pytest.mark.parametrize(("orientations", "scales"), [(None, SCALES), (np.zeros((COUNT, 4)), SCALES), (None, None)])
def test_what_is_absent_or_has_no_length_changes_nothing(
    orientations: np.ndarray | None, scales: np.ndarray | None
) -> None:
    found = ScatteredTransforms(POSITIONS, orientations, scales)[:]
    expected = np.tile(np.eye(4), (COUNT, 1, 1))
    expected[:, [0, 1, 2], [0, 1, 2]] = 1 if scales is None else scales
    expected[:, :3, 3] = POSITIONS
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize(
    "key",
    [
        *(
            7,
            -1,
            slice(None),
            slice(4090, 4100),
            slice(None, None, -3),
            np.array([3, -2, 3]),
            np.arange(COUNT) % 7 == 0,
        ),
        *((2, slice(3), 3), (slice(5), slice(3), slice(3)), (np.array([1, 4999]), 0), np.zeros(0, np.int32)),
        *(np.array([[0, 1], [2, -1]]), ([5, 3], [0, 1]), ([5, 3], slice(3), [0, 1]), (7, [0, 1], [1, 2]), (3, None)),
        *(True, np.False_, np.arange(COUNT * 16).reshape(COUNT, 4, 4) % 5 == 0),
    ],
)
@pytest.mark.parametrize(
    "made",
    [
        scattered(),
        nest(PLACES[:1], scattered()),
        nest(scattered(), PLACES[:1]),
        nest(choose(scattered(), np.arange(1250)), PLACES),
        join([choose(scattered(), np.arange(COUNT - 4)), PLACES]),
    ],
    ids=["scattered", "outer", "inner", "nested", "joined"],
)
def test_they_are_read_as_the_array(made: LazyTransforms, key: object) -> None:
    assert isinstance(made, LazyTransforms)
    whole = np.asarray(made)
    assert whole.shape == made.shape == (COUNT, 4, 4)
    np.testing.assert_array_equal(made[key], whole[key])


def test_rows_beyond_the_end_are_refused() -> None:
    with pytest.raises(IndexError):
        scattered()[COUNT]
    with pytest.raises(IndexError):
        scattered()[np.array([0, -COUNT - 1])]


@pytest.mark.parametrize("key", [np.ones(7, bool), 1.5, np.zeros(2)])
def test_what_is_no_row_is_refused(key: object) -> None:
    with pytest.raises(IndexError):
        scattered()[key]


def test_what_arrays_can_do_they_can() -> None:
    lazy, array = scattered(), np.asarray(scattered())
    for made, expected in [
        (lazy.copy(), array),
        (lazy.reshape(-1, 16), array.reshape(-1, 16)),
        (lazy + 1, array + 1),
        (2 * lazy, 2 * array),
        (np.abs(lazy), np.abs(array)),
        (array @ lazy, array @ array),
        (lazy[...], array),
        (lazy[None], array[None]),
        (lazy == array, np.ones(array.shape, bool)),
    ]:
        np.testing.assert_array_equal(made, expected)
    assert lazy.size == array.size
    assert len({lazy, scattered()}) == 2


def test_one_is_visited_after_the_other() -> None:
    np.testing.assert_array_equal(np.array(list(scattered())), scattered()[:])


def test_nested_ones_are_products() -> None:
    few = choose(scattered(), np.array([4, 2, 0]))
    expected = [outer @ inner for outer in few[:] for inner in PLACES]
    for outer, inner in ((few, PLACES), (few[:], PLACES), (few, NestedTransforms(PLACES[:1], np.eye(4)[None]))):
        wanted = expected if len(inner) > 1 else [one @ PLACES[0] for one in few[:]]
        np.testing.assert_allclose(np.asarray(nest(outer, inner)), wanted, rtol=1e-12, atol=1e-13)


def test_arrays_stay_arrays_and_what_unmoved_holds_stays_itself() -> None:
    held = scattered()
    assert nest(np.eye(4)[None], held) is held
    assert nest(held, np.eye(4)[None]) is held
    assert isinstance(join([PLACES, PLACES]), np.ndarray)
    assert isinstance(nest(PLACES, PLACES), np.ndarray)
    assert isinstance(choose(PLACES, np.array([1])), np.ndarray)
    assert isinstance(join([PLACES, held]), JoinedTransforms)


def test_they_take_what_they_are_made_of() -> None:
    assert scattered().nbytes == COUNT * (12 + 8 + 12)


def test_what_cannot_be_inverted_is_known() -> None:
    positions, quaternions, scales = POSITIONS[:5].copy(), QUATERNIONS[:5].copy(), SCALES[:5].copy()
    positions[0, 1], quaternions[1, 2], scales[2, 0], scales[3, 1] = np.nan, np.inf, np.inf, 0
    made = ScatteredTransforms(positions, quaternions, scales)
    assert made.are_regular().tolist() == [False] * 4 + [True]


def test_instances_refuse_what_is_not_finite_and_choose_without_computing() -> None:
    rows = np.zeros(COUNT, np.int32)
    instances = Instances(rows, scattered(), rows, rows[:1], rows, rows)
    chosen = instances[np.array([5, 3])]
    assert isinstance(chosen.world_from_local, LazyTransforms)
    np.testing.assert_array_equal(chosen.world_from_local[:], scattered()[[5, 3]])
    positions = POSITIONS.copy()
    positions[-1] = np.inf
    with pytest.raises(SceneError, match="finite"):
        replace(instances, world_from_local=ScatteredTransforms(positions, None, None))
