# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Who watches a ray tree grow, at no cost where nobody does.

The functions of the ray tree and of traversal take an ``observer`` and tell it what happens by calling hooks
(``tree_hooks``, ``light_hooks``, ``traverse_hooks``). ``observed`` compiles each function once for each type of
observer that a kernel uses. A hook is such a function too, an empty one; an overload of its name says what one type
does. So with ``Unobserved`` no hook leaves an instruction behind, there is one source for rendering, recording and
counting, and what is recorded is what is rendered.
"""

from typing import TypeVar

import warp as wp

from .features import PlainScene
from .per_type import per_type
from .tree_record import CrossingRecord, LightRecord, NodeRecord


@wp.struct
class Unobserved:
    """Nobody watches: a render."""


@wp.struct
class TreeRecorder:
    """Writes down every node of one pixel's tree.

    The last row of each array of records takes what finds no more room; ``counts`` tells how many there would be.
    """

    nodes: wp.array[NodeRecord]
    lights: wp.array[LightRecord]
    crossings: wp.array[CrossingRecord]
    counts: wp.array[wp.int32]
    """Of nodes, lights and crossings."""
    parents: wp.array[wp.int32]
    """Row of the node that pushed the task in each slot of the task stack."""
    kinds: wp.array[wp.int32]
    """Kind of the ray in each slot."""
    limit: wp.int32
    """Nodes after which ``stop`` is set."""
    stop: wp.array[wp.int32]
    """The tree's stop flag."""
    sample: wp.int32
    node: wp.int32
    """Row of the node at work."""
    sampled: LightRecord
    """What the samples of the light at work have told so far."""
    samples: wp.int32
    """How many of them there were; only the first has the surfaces on its way written down."""


@wp.struct
class CostCounter:
    """Adds up what rays cost: those of a tree, or those of a query."""

    nodes: wp.int32
    """Nodes of hierarchies whose boxes were tested."""
    triangles: wp.int32
    """Triangles that were tested."""
    rays: wp.int32
    """Rays of a tree, shadow rays among them."""
    tree_size: wp.int32
    """Nodes of a tree: its rays without shadow rays."""
    deepest: wp.int32
    """Deepest level of a tree; the eye ray's is 1."""


Observer = TypeVar("Observer", Unobserved, TreeRecorder, CostCounter)
"""Stands for each type of observer in the annotations of an ``observed`` function."""


def observed(function):
    """Decorate a function that takes an ``observer``; who watches, watches any scene, through one kernel."""
    return per_type(function, lambda types: PlainScene not in types or Unobserved in types)
