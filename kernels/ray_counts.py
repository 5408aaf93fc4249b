# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Exact ray counts: which element of a counter row counts what."""

import warp as wp

PRIMARY = wp.constant(0)
TOTAL_INTERNAL_REFLECTION = wp.constant(1)
DROPPED_BY_DEPTH = wp.constant(2)
PASSED = wp.constant(3)
LEVELS = wp.constant(4)
"""First element of the counts per depth, four each: reflection, refraction, shadow, dropped by threshold."""
PER_LEVEL = wp.constant(4)


@wp.func
def count(counts: wp.array[wp.int64], element: int):
    """Add one. Atomic on CUDA; on a CPU no two concurrent launches share a row."""
    wp.atomic_add(counts, element, wp.int64(1))


@wp.func
def count_reflection(counts: wp.array[wp.int64], depth: int):
    """Count a reflection ray that is traced at ``depth``."""
    count(counts, LEVELS + PER_LEVEL * (depth - 1))


@wp.func
def count_refraction(counts: wp.array[wp.int64], depth: int):
    """Count a refraction ray that is traced at ``depth``."""
    count(counts, LEVELS + PER_LEVEL * (depth - 1) + 1)


@wp.func
def count_shadow(counts: wp.array[wp.int64], depth: int):
    """Count a shadow ray that is cast from a node at ``depth``."""
    count(counts, LEVELS + PER_LEVEL * (depth - 1) + 2)


@wp.func
def count_dropped_by_threshold(counts: wp.array[wp.int64], depth: int):
    """Count a child of a node at ``depth`` whose weight is below the threshold."""
    count(counts, LEVELS + PER_LEVEL * (depth - 1) + 3)
