# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The records of the bounding volume hierarchy.

A wide node is 128 words of float32: rows low.x low.y low.z high.x high.y high.z of 16 planes each, 16 child codes as
the bits of int32, and the orders in which rays meet the lanes. A lane without a child has low = inf, high = -inf. A
child code c >= 0 is a node; c < 0 is leaf -1 - c: a packet of triangles in a mesh's tree, an instance in the tree over
instances.

Octant o of directions has bit a set where component a is negative. Its order is a list of the 16 lanes, the farthest
first; position p stands in bits 4 (p / 2) to 4 (p / 2) + 3 of word 2 o + p % 2.

A leaf packet is 160 words: 9 rows of 16 coordinates (p0.x p0.y p0.z p1.x ... p2.z), then the 16 triangles' indices in
their mesh as the bits of int32. Lanes without a triangle hold NaN, which fails every comparison, and index -1.

A leaf packet of shapes is 40 words, four lanes of 10: x, y, z and radius of the shape's first control point, the same
of its second one, the caps of a frustum as the bits of int32 (1 for the first, 2 for the last), and the shape's index
as the bits of int32. Of a cubic tube, word 0 of the lane is the word at which the four control points of a piece of it
begin (x, y, z and radius of each), as the bits of int32, words 1 and 2 are the piece's bounds in u. Lanes are filled
from the first on; those without a shape have index -1.
"""

import warp as wp


@wp.struct
class InstanceRecord:
    """A leaf of the tree over instances, 64 bytes."""

    row_x: wp.vec4
    """First row of local_from_world, 3 x 4, acting on points relative to the accel's origin."""
    row_y: wp.vec4
    row_z: wp.vec4
    root: int
    """Child code of the mesh's tree: a node, or the mesh's only leaf packet."""
    instance: int
    """Row of ``Scene.instances``."""
    is_identity: wp.int16
    """1 where local_from_world is the identity: the ray needs no transform."""
    kind: wp.int16
    """TRIANGLES, or the kind of the shapes that the packets hold."""
    mesh: int
    """Row of ``Scene.meshes``."""


@wp.struct
class AccelData:
    """Both levels of the hierarchy: everything that a ray query needs."""

    nodes: wp.array[float]
    """Wide nodes of all trees, 128 words each."""
    leaves: wp.array[float]
    """Leaf packets of all meshes, 160 words each."""
    shapes: wp.array[float]
    """Leaf packets of all sets of shapes, 40 words each, then the pieces of cubic tubes, 16 words each."""
    instances: wp.array[InstanceRecord]
    """In the order of the top-level tree's leaves."""
    root: int
    """Child code at which every query starts."""
    only_instance: int
    """0 where there is a single instance whose transform is the identity: queries then start in its mesh's tree.
    Else -1: they start in the tree over instances."""
    intersector: int
    """WATERTIGHT, MOLLER_TRUMBORE or PLANE_PROJECTION."""


@wp.struct
class Stack:
    """The traversal stack of one ray: children that it has yet to visit."""

    codes: wp.array[int]
    """Child codes, and LEAVE_INSTANCE."""
    distances: wp.array[float]
    """Where the ray enters their boxes."""


@wp.struct
class Stacks:
    """Scratch memory of a launch: traversal stacks, one a row.

    A launch on the CPU is one sequential loop, so that one row serves all its threads; on a GPU each has its own.
    (A stack declared in the kernel would be filled with zeros for each ray: 20 to 40 % of the time of a short ray.)
    """

    codes: wp.array2d[int]
    """shape [rows, stack_size]"""
    distances: wp.array2d[float]
    """shape [rows, stack_size]"""


@wp.struct
class Hit:
    """Where a ray meets a surface, P = origin + t direction. On a triangle P = (1 - u - v) p0 + u p1 + v p2.

    On a shape u runs from its first control point (0) to its last (1); v is the part of a frustum that is met, SIDE,
    FIRST_CAP or LAST_CAP, and 0 on any other shape, as u is on spheres.
    """

    t: float
    """In units of the direction's length, the same in world and local space; t_max for a miss."""
    u: float
    v: float
    triangle: int
    """Row of the mesh's triangles, or of the shapes."""
    instance: int
    """Row of the scene's instances; -1: the ray met nothing."""


@wp.struct
class BinaryNode:
    """A node of the binary tree that builders make, 32 bytes.

    A subtree that one job builds over references [f, f + m) has its root at slot 2 f + 1 and its other nodes from
    2 f + 2 on, two children side by side: at most 2 m - 1 slots, so that jobs need not agree on anything. Slot 2 f is
    free for the one node whose right child begins at reference f, where that node is above all subtrees.
    """

    low: wp.vec3
    left: int
    """Inner node: slot of the left child. Leaf: its first reference."""
    high: wp.vec3
    right: int
    """Inner node: slot of the right child, above 0. Leaf: minus the number of its references."""


@wp.struct
class Reference:
    """A box around a primitive, 32 bytes; builders sort these in place."""

    low: wp.vec4
    """Lower corner; w holds the bits of the primitive's index."""
    high: wp.vec4
    """Upper corner; w holds the bits of the number of primitives that the box stands for: 1, but for a cluster."""


@wp.struct
class Bin:
    """The box of those references whose centroids fall into one slice or cell of a range's centroid box."""

    low: wp.vec4
    """Lower corner; w means nothing."""
    high: wp.vec4


@wp.struct
class BuildRange:
    """References [first, first + count) that become the subtree at slot ``node``."""

    low: wp.vec4
    """Box of the references; w means nothing."""
    high: wp.vec4
    centroid_low: wp.vec4
    """Box of the references' doubled centroids low + high; w means nothing."""
    centroid_high: wp.vec4
    first: int
    count: int
    node: int


@wp.struct
class BinaryTrees:
    """Binary trees over n references, and the best ways to make them wide."""

    nodes: wp.array[BinaryNode]
    """shape [2 n], sparse."""
    ids: wp.array[int]
    """shape [n], the primitives of the leaves' references."""
    costs: wp.array2d[float]
    """shape [2 n, WIDTH], least cost of a subtree shown to its parent as at most k children, in column k - 1; known of
    the roots, and of all nodes where trees are yet to be changed."""
    first_cost: int
    """Slot that row 0 of ``costs`` is of."""
    shares: wp.array2d[wp.int8]
    """shape [2 n, WIDTH], how many of the k children in column k - 1 come from the left; 0: k - 1 do as well."""


@wp.struct
class Box:
    """An axis-aligned box."""

    low: wp.vec3
    high: wp.vec3


@wp.func
def stack_of_thread(stacks: Stacks, thread: int) -> Stack:
    """Return the stack of a thread: its own row where there are enough of them, else the last, shared one."""
    stack = Stack()
    row = wp.min(thread, stacks.codes.shape[0] - 1)
    stack.codes = stacks.codes[row]
    stack.distances = stacks.distances[row]
    return stack
