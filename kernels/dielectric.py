# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the index of refraction says: how rays bend at a surface, and what it reflects head on."""

import warp as wp

from .constants import IOR_MIN


@wp.func
def passage_eta(is_closed: int, side: float, ior: float) -> float:
    """Return n_incoming / n_outgoing, vacuum being outside; 1 for a surface that bounds no volume.

    Args:
        is_closed: Whether the mesh bounds a volume.
        side: Positive where the ray enters, negative where it leaves.
        ior: Index of refraction inside; what is not above 0 is none, and bends no ray.
    """
    if is_closed == 0 or ior <= 0.0:
        return 1.0
    if side > 0.0:
        return 1.0 / ior
    return ior


@wp.func
def dielectric_f0(ior: float) -> float:
    """Return the reflectance at normal incidence in vacuum, ((1 - ior) / (1 + ior))^2.

    Textures hold any number: what is not above 0 counts as an index next to it.
    """
    n = wp.max(ior, IOR_MIN)
    r = (1.0 - n) / (1.0 + n)
    return r * r
