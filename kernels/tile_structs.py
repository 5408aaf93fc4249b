# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a worker keeps of the ray trees of a tile's pixels, and of the shadow rays that wait.

Apart from the functions, as ``group_structs`` is.
"""

import warp as wp

from .bvh_structs import Stack
from .group_structs import RayGroup
from .ray_structs import RayTask, ShadowRay


@wp.struct
class EyePath:
    """How far an eye ray has come, over what it passed straight through."""

    reach: wp.float32
    """Farthest distance that it sees."""
    travelled: wp.float32
    alpha: wp.float32
    """Share of the pixel that what it met covers."""


@wp.struct
class LitSurfaces:
    """Surfaces of a group's hits that wait for their light."""

    slot: wp.int32
    """Place in the group of the hit at work; -1: it is in none."""
    set: wp.uint32
    """Those that wait: a bit a place."""
    rows: wp.array[wp.float32]
    """Numbers of them, shape [LIT_FLOATS]."""
    depths: wp.array[wp.int32]
    """Of their nodes, shape [GROUP]."""


@wp.struct
class ShadowQueue:
    """Shadow rays that wait, and scratch memory for their way."""

    rays: wp.array[ShadowRay]
    count: wp.int32
    """How many wait: fewer than there is room for."""
    is_cast: wp.int32
    """1: the ray of the next term has been written."""
    node: wp.int32
    """The node at work."""
    sum: wp.int32
    """Number of the sum at work."""
    open_node: wp.int32
    """Node of the sum that terms were last added to; -1: none is open."""
    open_sum: wp.int32
    """Its number; 0: none yet."""
    open_value: wp.vec3
    """What it makes so far."""
    values: wp.array[wp.vec3]
    """I_local of each node, as far as it is settled."""
    is_blocked: wp.array[wp.int32]
    """Of each ray that waits."""
    keys: wp.array[wp.int32]
    """As for ``list_shadow_rays``; so are the next two."""
    order: wp.array[wp.int32]
    ends: wp.array[wp.int32]
    lit: LitSurfaces
    """Surfaces that wait for their light."""
    group: RayGroup
    stack: Stack
    """That of a ray which is traced alone."""


@wp.struct
class TreeNode:
    """Where a node of a tree stands."""

    pixel: wp.int32
    """Root of its tree."""
    children: wp.int32
    """First of its children; -1: it has found no room for them, and waits."""
    end: wp.int32
    """Behind the last of them."""


@wp.struct
class TilePixel:
    """A pixel whose tree grows."""

    eye: EyePath
    near: wp.float32
    """As in ``EyeRay``; so too ``cosine``."""
    cosine: wp.float32
    row: wp.int32
    column: wp.int32
    has_met: wp.int32
    """1 once its eye ray has met something."""


@wp.struct
class TileTrees:
    """Trees that grow together, and scratch memory for it: one a worker."""

    pixels: wp.array[TilePixel]
    """shape [TILE_PIXELS]"""
    size: wp.int32
    """Pixels whose trees may grow together: fewer where there was no room for all of their nodes."""
    tasks: wp.array[RayTask]
    """The nodes' rays: eye rays, then level by level, the children of a node side by side."""
    nodes: wp.array[TreeNode]
    """As many."""
    shadows: ShadowQueue
    """Its values are those of the nodes, and of one more: the one that is walked."""
    keys: wp.array[wp.int32]
    """As for ``list_tasks``; so are the next two."""
    order: wp.array[wp.int32]
    ends: wp.array[wp.int32]
    group: RayGroup
    surfaces: wp.array[float]
    """What the group has met, SURFACE_FLOATS long."""
    walk: wp.array[RayTask]
    """A task stack, ``task_capacity`` long."""
    path: wp.array[wp.int32]
    """A stack of nodes, as long."""
