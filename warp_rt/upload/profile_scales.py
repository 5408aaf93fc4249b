# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""How fine the structure of an IES profile is: cells of directions within which its middle stands for its mean."""

from __future__ import annotations

import numpy as np

from warp_rt.kernels.constants import POLE
from warp_rt.scene import Profile

_WIDEST = 0.1  # [rad]; the steps of most files are 5 degrees
_WIDTHS = _WIDEST * 2.0 ** -np.arange(0.0, 2.5, 0.25)
_BEND = 0.02  # of the profile's greatest value, by which the middle of a cell may differ from its mean
_NONE = -100.0  # an end that no angle is near


def profile_scales(profile: Profile, angle_scale: float) -> dict[str, float]:
    """Return what ``kernels.light_structs.ProfileData`` tells of a profile's ends and of the width of its cells.

    Args:
        profile: The profile.
        angle_scale: UsdLux's ``shaping:ies:angleScale``.
    """
    scale = abs(angle_scale) or 1.0
    first, last = (_angle_to_axis(float(angle), angle_scale) for angle in profile.vertical[[0, -1]])
    return {
        "first_end": first if first > POLE else _NONE,
        "last_end": last if last < np.pi - POLE else _NONE,
        "vertical_cell": scale * _cell(profile.vertical, profile.values),
        "horizontal_cell": _cell(profile.horizontal, profile.values.T),
    }


def _angle_to_axis(angle: float, scale: float) -> float:
    """Return the angle to the light's axis that reads the profile at an angle: ``kernels.profile.scaled_angle``."""
    return angle * scale if scale > 0 else (angle - np.pi) * -(scale or -1.0) + np.pi


def _cell(angles: np.ndarray, rows: np.ndarray) -> float:
    """Return the widest cell [rad] whose mean, by Simpson's rule, its middle tells.

    Args:
        angles: Ascending [rad], shape [n].
        rows: Values at them, shape [m, n].
    """
    peak = float(np.abs(rows).max())
    # Only bends matter, and those lie at the angles.
    for width in _WIDTHS:
        low, high = (_read(angles, rows, angles + side * width / 2) for side in (-1, 1))
        if (np.abs(low - 2 * rows + high) <= 6 * _BEND * peak).all():
            return float(width)
    return float(_WIDTHS[-1])


def _read(angles: np.ndarray, rows: np.ndarray, places: np.ndarray) -> np.ndarray:
    return np.array([np.interp(places, angles, row) for row in rows])
