# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Asking for the memory of a hierarchy's parts before they are visited; it changes no result.

CUDA does without: there, other warps run while one waits.
"""

import warp as wp

from .constants import LEAF_FLOATS, NODE_FLOATS
from .native import spell_out

PREFETCH_CHILD = spell_out(
    r"""
#if !defined(__CUDA_ARCH__)
    {
        const float* target = code >= 0 ? (const float*)nodes.data + (size_t)code * NODE_FLOATS
                                        : (const float*)leaves.data + (size_t)(-1 - code) * LEAF_FLOATS;
        for (int word = 0; word < NODE_FLOATS; word += 16)
            __builtin_prefetch(target + word);
    }
#endif
""",
    NODE_FLOATS=NODE_FLOATS,
    LEAF_FLOATS=LEAF_FLOATS,
)
"""For native functions that have ``nodes``, ``leaves`` and a child's ``code``; what ``prefetch_child`` does."""


@wp.func_native(PREFETCH_CHILD)
def prefetch_child(nodes: wp.array[float], leaves: wp.array[float], code: int):
    """Ask for the memory of a child, all but a leaf packet's last lines, and do not wait for it."""
    ...
