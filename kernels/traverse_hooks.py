# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a traversal tells its observer, as ``tree_hooks`` does for a ray tree."""

import warp as wp

from .intersect_packet import packet_triangle_count
from .intersect_shape import packet_shape_count
from .observer import CostCounter, Observer, observed
from .per_type import per_type
from .ray_goal import AnyHit, Goal


@observed
def tell_node(observer: Observer):
    """The boxes of a node are tested."""
    pass


@wp.func
def tell_node(observer: wp.ref[CostCounter]):
    """Count the node."""
    observer.nodes += 1


@observed
def tell_packet(observer: Observer, leaves: wp.array[float], leaf: int):
    """The triangles of a leaf packet are tested."""
    pass


@wp.func
def tell_packet(observer: wp.ref[CostCounter], leaves: wp.array[float], leaf: int):
    """Count the triangles."""
    observer.triangles += packet_triangle_count(leaves, leaf)


@observed
def tell_shapes(observer: Observer, shapes: wp.array[float], leaf: int):
    """The shapes of a leaf packet are tested."""
    pass


@wp.func
def tell_shapes(observer: wp.ref[CostCounter], shapes: wp.array[float], leaf: int):
    """Count them with the triangles."""
    observer.triangles += packet_shape_count(shapes, leaf)


@per_type
def ends_at_hit(goal: Goal) -> bool:
    """Return whether the search ends at the first hit that it finds, however far."""
    return False


@wp.func
def ends_at_hit(goal: wp.ref[AnyHit]) -> bool:
    """Return that it does: one hit is enough."""
    return True
