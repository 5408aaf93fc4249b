# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A set of rays of a group: a word, a bit a ray."""

import warp as wp

_FIRST_RAY = r"""
#if defined(__CUDA_ARCH__)
    return __ffs(rays) - 1;
#else
    return __builtin_ctz(rays);
#endif
"""


@wp.func_native(_FIRST_RAY)
def first_ray(rays: wp.uint32) -> int:
    """Return the first ray of a set that is not empty."""
    ...


_COUNT_RAYS = r"""
#if defined(__CUDA_ARCH__)
    return __popc(rays);
#else
    return __builtin_popcount(rays);
#endif
"""


@wp.func_native(_COUNT_RAYS)
def count_rays(rays: wp.uint32) -> int:
    """Return the size of a set of rays."""
    ...


@wp.func
def drop_first(rays: wp.uint32) -> wp.uint32:
    """Return a set of rays without its first one."""
    return rays & (rays - wp.uint32(1))
