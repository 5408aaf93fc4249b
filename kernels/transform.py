# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Points, vectors and normals under affine transforms."""

import warp as wp

from .scene_structs import mat34


@wp.func
def transform_point(m: mat34, p: wp.vec3) -> wp.vec3:
    """Return a point under an affine transform."""
    return wp.vec3(
        m[0, 0] * p[0] + m[0, 1] * p[1] + m[0, 2] * p[2] + m[0, 3],
        m[1, 0] * p[0] + m[1, 1] * p[1] + m[1, 2] * p[2] + m[1, 3],
        m[2, 0] * p[0] + m[2, 1] * p[1] + m[2, 2] * p[2] + m[2, 3],
    )


@wp.func
def transform_vector(m: mat34, v: wp.vec3) -> wp.vec3:
    """Return a vector under the linear part of an affine transform."""
    return wp.vec3(
        m[0, 0] * v[0] + m[0, 1] * v[1] + m[0, 2] * v[2],
        m[1, 0] * v[0] + m[1, 1] * v[1] + m[1, 2] * v[2],
        m[2, 0] * v[0] + m[2, 1] * v[1] + m[2, 2] * v[2],
    )


@wp.func
def transform_normal(inverse: mat34, n: wp.vec3) -> wp.vec3:
    """Return a normal under the transform whose inverse is given: by the inverse's transpose, not unit."""
    return wp.vec3(
        inverse[0, 0] * n[0] + inverse[1, 0] * n[1] + inverse[2, 0] * n[2],
        inverse[0, 1] * n[0] + inverse[1, 1] * n[1] + inverse[2, 1] * n[2],
        inverse[0, 2] * n[0] + inverse[1, 2] * n[1] + inverse[2, 2] * n[2],
    )


@wp.func
def transform_magnitudes(m: mat34, v: wp.vec3) -> wp.vec3:
    """Return the sums of the magnitudes that make up a transformed vector of non-negative components."""
    return wp.vec3(
        wp.abs(m[0, 0]) * v[0] + wp.abs(m[0, 1]) * v[1] + wp.abs(m[0, 2]) * v[2],
        wp.abs(m[1, 0]) * v[0] + wp.abs(m[1, 1]) * v[1] + wp.abs(m[1, 2]) * v[2],
        wp.abs(m[2, 0]) * v[0] + wp.abs(m[2, 1]) * v[1] + wp.abs(m[2, 2]) * v[2],
    )
