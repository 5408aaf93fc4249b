# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The traversal stack: children pushed in the order in which a ray meets them, and entries dropped behind a hit.

Two of its functions are native on the CPU, all lanes at once, as in intersect_packet.py, and have twins in plain Warp.
"""

import warp as wp

from .bounds import intersect_box
from .bvh_structs import Stack
from .constants import NODE_CHILDREN, NODE_FLOATS, NODE_ORDERS, WIDTH
from .intersect_packet import VECTOR_TYPES, PacketRay
from .native import spell_out


@wp.func
def push(stack: Stack, top: int, code: int, t: float):
    """Write the entry above the topmost one; the caller counts."""
    stack.codes[top] = code
    stack.distances[top] = t


NODE_ROWS = spell_out(
    r"""
    const float* rows = (const float*)nodes.data + (size_t)node * NODE_FLOATS;
    const int* children = (const int*)rows + NODE_CHILDREN;
    const unsigned int* order = (const unsigned int*)rows + NODE_ORDERS + 2 * octant;
    const int flip_x = octant & 1 ? 48 : 0, flip_y = octant & 2 ? 48 : 0, flip_z = octant & 4 ? 48 : 0;
    const float *near_x = rows + flip_x, *near_y = rows + 16 + flip_y, *near_z = rows + 32 + flip_z;
    const float *far_x = rows + 48 - flip_x, *far_y = rows + 64 - flip_y, *far_z = rows + 80 - flip_z;
""",
    NODE_FLOATS=NODE_FLOATS,
    NODE_CHILDREN=NODE_CHILDREN,
    NODE_ORDERS=NODE_ORDERS,
)
"""For native functions that have ``nodes``, a ``node`` and an ``octant``: its children, their order, the planes that
rays of the octant meet first and last."""

LANES_IN_ORDER = r"""
    typedef long long longs __attribute__((ext_vector_type(8)));
    typedef long long long_load __attribute__((aligned(4)));
    const ints shifts = {0, 0, 4, 4, 8, 8, 12, 12, 16, 16, 20, 20, 24, 24, 28, 28};
    const ints lanes = __builtin_bit_cast(ints, (longs)(*(const long_load*)order)) >> shifts;
"""
"""For AVX-512, after NODE_ROWS: the lane at each position of the order, in the low 4 bits."""

# With AVX-512, a packed store writes the lanes of a mask without gaps.
PACKED_STORE = r"""
#define WARP_RT_PACKED_STORE(stack, top, codes_, distances_, mask) { \
    *(ints_load*)((int*)(stack).codes.data + (top)) = \
        __builtin_ia32_compresssi512_mask((codes_), (ints)0, (mask)); \
    *(floats_load*)((float*)(stack).distances.data + (top)) = \
        __builtin_ia32_compresssf512_mask((distances_), (floats)0.0f, (mask)); }
"""

_PUSH_CHILDREN = (
    r"""
    const int octant = ray.octant;
"""
    + NODE_ROWS
    + r"""
#if defined(__CUDA_ARCH__) || !defined(__clang__)
    for (int position = 0; position < 16; ++position) {
        const int lane = order[position & 1] >> (4 * (position >> 1)) & 15;
        float t_enter = wp::max((near_x[lane] - ray.origin[0]) * ray.inverse[0], 0.0f);
        t_enter = wp::max((near_y[lane] - ray.origin[1]) * ray.inverse[1], t_enter);
        t_enter = wp::max((near_z[lane] - ray.origin[2]) * ray.inverse[2], t_enter);
        float t_leave = (far_x[lane] - ray.origin[0]) * ray.far_inverse[0];
        t_leave = wp::min((far_y[lane] - ray.origin[1]) * ray.far_inverse[1], t_leave);
        t_leave = wp::min((far_z[lane] - ray.origin[2]) * ray.far_inverse[2], t_leave);
        if (t_enter <= wp::min(t_leave, t_max)) {
            wp::index(stack.codes, top) = children[lane];
            wp::index(stack.distances, top) = t_enter;
            ++top;
        }
    }
    return top;
#else
"""
    + VECTOR_TYPES
    + PACKED_STORE
    + r"""
    const floats enter_x = (WARP_RT_LOAD(near_x) - ray.origin[0]) * ray.inverse[0];
    const floats enter_y = (WARP_RT_LOAD(near_y) - ray.origin[1]) * ray.inverse[1];
    const floats enter_z = (WARP_RT_LOAD(near_z) - ray.origin[2]) * ray.inverse[2];
    const floats leave_x = (WARP_RT_LOAD(far_x) - ray.origin[0]) * ray.far_inverse[0];
    const floats leave_y = (WARP_RT_LOAD(far_y) - ray.origin[1]) * ray.far_inverse[1];
    const floats leave_z = (WARP_RT_LOAD(far_z) - ray.origin[2]) * ray.far_inverse[2];
    const floats enter_z0 = WARP_RT_MAX(enter_z, (floats)0.0f);
    const floats enter_xy = WARP_RT_MAX(enter_x, enter_y);
    const floats t_enter = WARP_RT_MAX(enter_xy, enter_z0);
    const floats leave_zt = WARP_RT_MIN(leave_z, (floats)t_max);
    const floats leave_xy = WARP_RT_MIN(leave_x, leave_y);
    const floats t_leave = WARP_RT_MIN(leave_xy, leave_zt);
#if defined(__AVX512F__)
"""
    + LANES_IN_ORDER
    + r"""
    const floats entering = __builtin_ia32_permvarsf512(t_enter, lanes);
    const floats leaving = __builtin_ia32_permvarsf512(t_leave, lanes);
    const ints codes = __builtin_ia32_permvarsi512(WARP_RT_LOAD_INTS(children), lanes);
    const unsigned short mask = WARP_RT_MASK(entering <= leaving);
    WARP_RT_PACKED_STORE(stack, top, codes, entering, mask);
    return top + __builtin_popcount(mask);
#else
    const unsigned int mask = WARP_RT_MASK(t_enter <= t_leave);
    if (mask == 0)
        return top;
    int* codes = (int*)stack.codes.data;
    float* distances = (float*)stack.distances.data;
    float entering[16];
    __builtin_memcpy(entering, &t_enter, sizeof(t_enter));
    for (int position = 0; position < 16; ++position) {
        const int lane = order[position & 1] >> (4 * (position >> 1)) & 15;
        codes[top] = children[lane];
        distances[top] = entering[lane];
        top += mask >> lane & 1;
    }
    return top;
#endif
}
#endif
"""
)


@wp.func_native(_PUSH_CHILDREN)
def push_children(
    nodes: wp.array[float], node: int, ray: wp.ref[PacketRay], t_max: float, stack: Stack, top: int
) -> int:
    """Push the children of a node whose boxes a ray meets in [0, t_max]; return the new top of the stack.

    In the node's order for the ray's octant, so that the nearest comes to lie on top. No branch depends on what is
    met: a mispredicted one costs as much as testing the boxes. Conservative, as ``intersect_box`` is.

    Reference: Fuetterling et al. (2017), Accelerated Single Ray Tracing for Wide Vector Units, HPG, section 3.
    """
    ...


@wp.func
def push_children_plain(nodes: wp.array[float], node: int, ray: PacketRay, t_max: float, stack: Stack, top: int) -> int:
    """Return and write what ``push_children`` does, in plain Warp."""
    count = int(top)
    for position in range(wp.int32(WIDTH)):  # a loop, not sixteen copies
        word = node * NODE_FLOATS + NODE_ORDERS + 2 * ray.octant + (position & 1)
        lane = (wp.cast(nodes[word], wp.int32) >> (4 * (position >> 1))) & (WIDTH - 1)
        base = node * NODE_FLOATS + lane
        low = wp.vec3(nodes[base], nodes[base + WIDTH], nodes[base + 2 * WIDTH])
        high = wp.vec3(nodes[base + 3 * WIDTH], nodes[base + 4 * WIDTH], nodes[base + 5 * WIDTH])
        span = intersect_box(ray.origin, ray.inverse, t_max, low, high)
        if span[0] <= span[1]:
            stack.codes[count] = wp.cast(nodes[base + NODE_CHILDREN], wp.int32)
            stack.distances[count] = span[0]
            count += 1
    return count


_CULL_STACK = (
    r"""
    int kept = 0;
#if defined(__AVX512F__) && defined(__clang__) && !defined(__CUDA_ARCH__)
"""
    + VECTOR_TYPES
    + PACKED_STORE
    + r"""
    for (int first = 0; first < top; first += 16) {
        const ints codes = WARP_RT_LOAD_INTS((const int*)stack.codes.data + first);
        const floats distances = WARP_RT_LOAD((const float*)stack.distances.data + first);
        const unsigned int filled = top - first < 16 ? (1u << (top - first)) - 1 : 0xffffu;
        const unsigned short mask = WARP_RT_MASK(distances <= t_max) & filled;
        WARP_RT_PACKED_STORE(stack, kept, codes, distances, mask);
        kept += __builtin_popcount(mask);
    }
}
#else
    for (int entry = 0; entry < top; ++entry) {
        const float distance = wp::index(stack.distances, entry);
        wp::index(stack.codes, kept) = wp::index(stack.codes, entry);
        wp::index(stack.distances, kept) = distance;
        kept += distance <= t_max;
    }
#endif
    return kept;
"""
)


@wp.func_native(_CULL_STACK)
def cull_stack(stack: Stack, top: int, t_max: float) -> int:
    """Drop the stack's entries that begin beyond t_max; return the new top.

    Once a hit, instead of a comparison at each entry that is popped.
    """
    ...


@wp.func
def cull_stack_plain(stack: Stack, top: int, t_max: float) -> int:
    """Return and write what ``cull_stack`` does, in plain Warp."""
    kept = int(0)
    for entry in range(top):
        if stack.distances[entry] <= t_max:
            stack.codes[kept] = stack.codes[entry]
            stack.distances[kept] = stack.distances[entry]
            kept += 1
    return kept


@wp.func_native(
    r"""
#if defined(__CUDA_ARCH__)
    return wp::index(stack.codes, entry);
#else
    return ((const int*)stack.codes.data)[entry];
#endif
"""
)
def stack_code(stack: Stack, entry: int) -> int:
    """Return the code of a stack's entry; on the CPU without the array's stride, for which the next node would wait."""
    ...
