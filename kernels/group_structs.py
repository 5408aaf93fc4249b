# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a worker keeps of rays that go through the hierarchy in a group.

Apart from the functions, for the host fills them in and launches what is compiled without importing those.
"""

import warp as wp

from .bvh_structs import Stack


@wp.struct
class GroupStack:
    """The traversal stack of a group: children that some of its rays have yet to visit."""

    codes: wp.array[int]
    """Child codes, and LEAVE_INSTANCE."""
    distances: wp.array[float]
    """Before these no ray enters their boxes."""
    rays: wp.array[wp.uint32]
    """The rays that meet their boxes."""


@wp.struct
class RayGroup:
    """The rays that go together, and scratch memory for their way: one a worker."""

    rays: wp.array[float]
    """Groups, shape [2 GROUP_FLOATS]: the rays in world space, then in that of an instance."""
    ends: wp.array[float]
    """t_max, then t of the closest hit, shape [GROUP]; -1 for a ray that needs no more."""
    u: wp.array[float]
    v: wp.array[float]
    words: wp.array[int]
    """Word of the leaves, or of the shapes, at which the triangle's or the shape's index is found; -1: no hit."""
    records: wp.array[int]
    """Instance record of the hit."""
    senders: wp.array[int]
    """Instance that each ray starts on; -1: anywhere."""
    triangles: wp.array[int]
    """Triangle, or shape, of it."""
    skips: wp.array[int]
    """That of the instance at work which each ray starts on and cannot meet, or NO_TRIANGLE."""
    stack: GroupStack
    single_stack: Stack
    """That of a ray which is traced alone."""
