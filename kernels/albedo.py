# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What lobes reflect in all, so that no surface sends out more light than it gets."""

import warp as wp

from .constants import ALBEDO_COLUMNS, ALBEDO_ROWS, DIFFUSE_LOSS, MIRROR_FADE_START


@wp.func
def specular_albedo(table: wp.array[wp.vec2], f0: wp.vec3, f90: wp.vec3, roughness: float, cosine: float) -> wp.vec3:
    """Return the share of light from all around that a GGX lobe reflects towards the viewer.

    Args:
        table: ``SceneData.albedo``.
        f0: Reflectance head on.
        f90: Grazing.
        roughness: At least ``MIRROR_FADE_START``; below, as there.
        cosine: N.V.
    """
    rows = float(ALBEDO_ROWS - 1)
    columns = float(ALBEDO_COLUMNS - 1)
    x = wp.clamp((roughness - MIRROR_FADE_START) / (1.0 - MIRROR_FADE_START), 0.0, 1.0) * rows
    y = wp.cbrt(wp.clamp(cosine, 0.0, 1.0)) * columns
    row = wp.min(int(x), ALBEDO_ROWS - 2)
    column = wp.min(int(y), ALBEDO_COLUMNS - 2)
    s = x - float(row)
    t = y - float(column)
    k = row * ALBEDO_COLUMNS + column
    a = table[k] * (1.0 - t) + table[k + 1] * t
    b = table[k + ALBEDO_COLUMNS] * (1.0 - t) + table[k + ALBEDO_COLUMNS + 1] * t
    e = a * (1.0 - s) + b * s
    return f0 * e[0] + f90 * e[1]


@wp.func
def diffuse_albedo(f0: wp.vec3, f90: wp.vec3, cosine: float) -> wp.vec3:
    """Return the share that a white diffuse layer under a specular one sends to the viewer: the mean of 1 - F(V.H).

    With Schlick's F that is 1 - F0 - (F90 - F0) m, m being the mean of (1 - V.H)^5 over directions by the cosine, which
    depends on N.V alone: 0.028 (1 - N.V)^2.5 to within 0.0005.
    """
    x = wp.clamp(1.0 - cosine, 0.0, 1.0)
    return wp.vec3(1.0, 1.0, 1.0) - f0 - (f90 - f0) * (DIFFUSE_LOSS * x * x * wp.sqrt(x))
