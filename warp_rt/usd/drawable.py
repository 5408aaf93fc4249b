# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Which of the placed gprims can be drawn: those whose transform, with all above it, leaves them a size."""

from __future__ import annotations

import numpy as np

from warp_rt.report import Report, counted
from warp_rt.scene import Instances, local_boxes
from warp_rt.scene.instance_transforms import choose
from warp_rt.usd.gprims import Gprims
from warp_rt.usd.placement import Group
from warp_rt.usd.polygons import MAX_COORDINATE
from warp_rt.usd.transforms import BAD_TRANSFORM, is_regular

_BLOCK = 1 << 14  # instances at a time: what is computed on the way takes little memory
_LEAST_SIZE = 1e-12  # world space; products of three coordinates leave float32's range below


def drawable_instances(group: Group, gprims: Gprims, report: Report) -> Instances:
    """Return the rows of a group that can be drawn, as instances of the scene, in the group's order.

    Args:
        group: All that is placed.
        gprims: What its rows are copies of.
        report: Takes diagnostics, one for each prim whose copies are left out.
    """
    drawable = _drawable(group, gprims, report)
    kept = drawable if len(drawable) < len(group) else slice(None)  # all: without a copy
    gprim = group.gprim[kept]
    sets = gprims.material_sets
    offsets = np.cumsum([0] + [len(materials) for materials in sets], dtype=np.int32)[:-1]
    return Instances(
        mesh=_held_once(gprims.mesh[gprim]),
        world_from_local=group.matrix if len(drawable) == len(group) else choose(group.matrix, drawable),
        material_offset=_held_once(offsets[gprims.materials[gprim]]),
        material_table=np.array([row for materials in sets for row in materials], np.int32),
        prim=_held_once(gprims.prim[gprim]),
        instance_id=group.name[kept],
        primvars={name: values[kept] for name, values in group.values.items()},
    )


def _held_once(rows: np.ndarray) -> np.ndarray:
    """Return rows; where a great many are the same, as of an instancer with one prototype, that one is held once."""
    is_one = len(rows) > _BLOCK and bool((rows == rows[0]).all())
    return np.broadcast_to(rows[:1].copy(), rows.shape) if is_one else rows


def _drawable(group: Group, gprims: Gprims, report: Report) -> np.ndarray:
    """Return the rows whose transform, with all above it, is invertible and leaves a size that float32 has room for."""
    boxes = local_boxes(gprims.meshes)
    reach = np.nan_to_num(np.abs(boxes).max(axis=(1, 2)))
    size = np.nan_to_num((boxes[:, 1] - boxes[:, 0]).max(axis=1))  # 0: points at one place, which are no scale's fault
    mesh = gprims.mesh[group.gprim]
    is_small, is_good = np.empty((2, len(group)), bool)
    with np.errstate(over="ignore", invalid="ignore"):
        for start in range(0, len(group), _BLOCK):
            rows = slice(start, start + _BLOCK)
            matrices, own = group.matrix[rows], mesh[rows]
            scale, offset = np.abs(matrices[:, :3, :3]).sum(axis=(1, 2)), np.abs(matrices[:, :3, 3]).sum(axis=1)
            is_small[rows] = (scale * size[own] < _LEAST_SIZE) & (size[own] > 0)
            is_good[rows] = is_regular(matrices) & (scale * reach[own] + offset <= MAX_COORDINATE)
    for left_out, why in (
        (~is_good, f"singular, or beyond {MAX_COORDINATE:g} with their transform"),
        (is_good & is_small, f"smaller than {_LEAST_SIZE:g}"),
    ):
        prims = gprims.prim[group.gprim[left_out]]
        for prim, count in zip(*np.unique(prims, return_counts=True), strict=True):
            report.warn(BAD_TRANSFORM, gprims.prims[prim], f"{counted(count, 'instance')} left out: {why}")
    return np.flatnonzero(is_good & ~is_small)
