# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Leaves of the tree over instances: their world boxes, what they cost, and their records."""

import warp as wp

from .bvh_references import xyz
from .bvh_structs import Box, InstanceRecord, Reference
from .constants import INSTANCE_ROUNDING, NODE_FLOATS, WIDTH

wp.set_module_options({"enable_backward": False, "fuse_fp": False, "max_unroll": 0})


@wp.func
def node_corner(nodes: wp.array[float], word: int) -> wp.vec3d:
    """Return a corner of a child's box: the lane of three rows that begin at ``word``."""
    x = wp.float64(nodes[word])
    y = wp.float64(nodes[word + WIDTH])
    z = wp.float64(nodes[word + 2 * WIDTH])
    return wp.vec3d(x, y, z)


@wp.func
def half_area_d(low: wp.vec3, high: wp.vec3) -> wp.float64:
    """Return half the surface area of a box, in float64: the squares of great extents go beyond float32."""
    extent = wp.vec3d(high) - wp.vec3d(low)
    return extent[0] * extent[1] + extent[1] * extent[2] + extent[2] * extent[0]


@wp.kernel
def refer_to_instances(
    tree: wp.array[int],
    roots: wp.array[int],
    boxes: wp.array[Box],
    nodes: wp.array[float],
    world_from_local: wp.array3d[wp.float64],
    block: int,
    first: int,
    references_out: wp.array[Reference],
):
    """Write the reference of an instance of a block of them, which begins at number ``block`` and has the transforms.

    The world box contains all that float32 rays can hit of the instance. It is that of the boxes of the root's
    children, transformed one by one: smaller than the root's own box transformed, where that is turned. One that is
    not finite is the whole space.
    """
    row_of_block = first + wp.tid()
    i = block + row_of_block
    root = roots[tree[i]]
    lanes = wp.int32(WIDTH) if root >= 0 else 1
    world_low = wp.vec3d(wp.float64(wp.inf))
    world_high = wp.vec3d(wp.float64(-wp.inf))
    for lane in range(lanes):
        low = wp.vec3d(boxes[tree[i]].low)
        high = wp.vec3d(boxes[tree[i]].high)
        if root >= 0:
            low = node_corner(nodes, root * NODE_FLOATS + lane)
            high = node_corner(nodes, root * NODE_FLOATS + 3 * WIDTH + lane)
        if low[0] <= high[0]:
            for row in range(3):
                center = world_from_local[row_of_block, row, 3]
                half = wp.float64(0.0)
                for k in range(3):
                    center += world_from_local[row_of_block, row, k] * (low[k] + high[k]) * wp.float64(0.5)
                    half += wp.abs(world_from_local[row_of_block, row, k]) * (high[k] - low[k]) * wp.float64(0.5)
                world_low[row] = wp.min(world_low[row], center - half)
                world_high[row] = wp.max(world_high[row], center + half)
    growth = wp.float64(INSTANCE_ROUNDING) * wp.max(wp.max(wp.abs(world_low)), wp.max(wp.abs(world_high)))
    reference = Reference()
    is_finite = bool(True)
    for axis in range(3):
        reference.low[axis] = wp.float32(world_low[axis] - growth)
        reference.high[axis] = wp.float32(world_high[axis] + growth)
        is_finite = is_finite and wp.isfinite(reference.low[axis]) and wp.isfinite(reference.high[axis])
    if not is_finite:
        reference.low = wp.vec4(-wp.inf)
        reference.high = wp.vec4(wp.inf)
    reference.low[3] = wp.cast(i, wp.float32)
    reference.high[3] = wp.cast(1, wp.float32)
    references_out[i] = reference


@wp.kernel
def cost_instances(
    references: wp.array[Reference],
    tree: wp.array[int],
    boxes: wp.array[Box],
    costs: wp.array[float],
    first: int,
    costs_out: wp.array[wp.float64],
):
    """Write what a tree costs rays that enter it through an instance's box: half areas of that box, by its visits."""
    i = first + wp.tid()
    mesh = half_area_d(boxes[tree[i]].low, boxes[tree[i]].high)
    visits = wp.float64(0.0)
    if mesh > wp.float64(0.0):
        visits = wp.float64(costs[tree[i]]) / mesh
    costs_out[i] = half_area_d(xyz(references[i].low), xyz(references[i].high)) * visits


@wp.kernel
def write_instances(
    local_from_world: wp.array3d[float],
    block: int,
    leaf_of_instance: wp.array[int],
    rows: wp.array[int],
    tree: wp.array[int],
    roots: wp.array[int],
    kinds: wp.array[wp.int16],
    meshes: wp.array[int],
    first: int,
    records_out: wp.array[InstanceRecord],
):
    """Write the record of an instance of a block of them, which begins at number ``block`` and has the transforms."""
    row_of_block = first + wp.tid()
    i = block + row_of_block
    record = InstanceRecord()
    is_identity = bool(True)
    for k in range(4):
        record.row_x[k] = local_from_world[row_of_block, 0, k]
        record.row_y[k] = local_from_world[row_of_block, 1, k]
        record.row_z[k] = local_from_world[row_of_block, 2, k]
        is_identity = is_identity and record.row_x[k] == (1.0 if k == 0 else 0.0)
        is_identity = is_identity and record.row_y[k] == (1.0 if k == 1 else 0.0)
        is_identity = is_identity and record.row_z[k] == (1.0 if k == 2 else 0.0)
    record.root = roots[tree[i]]
    record.instance = rows[i]
    record.is_identity = wp.int16(1 if is_identity else 0)
    record.kind = kinds[tree[i]]
    record.mesh = meshes[tree[i]]
    records_out[leaf_of_instance[i]] = record
