# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The numbers of ``kernels.meridian``: sums of shaping and profile from a light's axis to each angle."""

from __future__ import annotations

from typing import Any

import numpy as np

from warp_rt.kernels.constants import MERIDIAN_CELLS
from warp_rt.scene import Light, Profile
from warp_rt.upload.profile_scales import profile_scales

_FINER = 8  # places between two of the table's angles over which the factor is summed
_STEPS = 0.01, 0.15  # [rad], least and greatest, between two places of an outline
_CONE_STEPS = 8  # by the half angle of a cone


def meridian_record(light: Light, *, is_even: bool) -> tuple[dict[str, Any], np.ndarray] | None:
    """Return the fields of ``kernels.light_structs.MeridianData`` but for the offset, and its numbers.

    None for a light that is not shaped, and for one whose factor depends on more than the direction: on a texture, or
    on directions in a space of its own that is more than turned.

    Args:
        light: A light.
        is_even: Whether its transform scales all directions alike.

    Returns:
        The fields, and float32, shape [n, 4]: for each factor, each end of the axis, each plane, and each angle.
    """
    has_shape = light.focus > 0 or light.cone_angle < np.pi
    if not (has_shape or light.profile) or light.image >= 0 or (light.profile and not is_even):
        return None
    scales = profile_scales(light.profile, light.profile_angle_scale) if light.profile else {}
    first, last = (scales.get(name, -1.0) for name in ("first_end", "last_end"))
    begin, end = max(first, 0.0), min(light.cone_angle, last if last > 0 else np.pi)
    if not begin < end:  # the cone leaves nothing of the profile
        begin, end = 0.0, np.pi
    profile = _merged(light.profile) if light.profile else None
    has_open = light.focus > 0 and any(light.focus_tint)
    numbers = [
        _sums(light, profile, focus, begin, end, is_back=is_back)
        for focus in ((light.focus, 0.0) if has_open else (light.focus,))
        for is_back in (False, True)
    ]
    widths = [scales.get("vertical_cell", np.inf), 0.5 / np.sqrt(light.focus) if light.focus > 0 else np.inf]
    if light.cone_angle < np.pi:
        widths += [light.cone_angle / _CONE_STEPS]
        widths += [light.cone_angle * light.cone_softness / 2] if light.cone_softness > 0 else []
    fields = {
        "planes": len(profile.values) if profile else 1,
        "has_open": has_open,
        "begin": begin,
        "end": end,
        "step": float(np.clip(min(widths), *_STEPS)),
    }
    return fields, np.concatenate([rows.reshape(-1, 4) for rows in numbers]).astype(np.float32)


def _merged(profile: Profile) -> Profile:
    """Return a profile with one plane where all of a whole turn's are alike."""
    is_whole = np.isclose(profile.horizontal[[0, -1]], (0.0, 2 * np.pi), atol=1e-5).all()
    if is_whole and (profile.values == profile.values[0]).all():
        return Profile(profile.vertical, profile.horizontal[:1], profile.values[:1])
    return profile


def _sums(
    light: Light, profile: Profile | None, focus: float, begin: float, end: float, *, is_back: bool
) -> np.ndarray:
    """Return F1 and F2 of each plane, and their derivatives: float64, shape [planes, cells + 1, 4]."""
    rows = (np.arange(MERIDIAN_CELLS * _FINER + 1) / (MERIDIAN_CELLS * _FINER)) ** 2
    theta = (np.pi - end if is_back else begin) + (end - begin) * rows
    middle = (theta[1:] + theta[:-1]) / 2
    factor = _factor(light, profile, focus, np.pi - middle if is_back else middle)
    cos_sin = np.sin(np.diff(theta)) * np.sin(theta[1:] + theta[:-1]) / 2
    sums = np.zeros((len(factor), MERIDIAN_CELLS + 1, 4))
    for k, weight in enumerate((cos_sin, np.diff(_lune(theta)) / 2)):
        sums[:, 1:, k] = np.cumsum(factor * weight, axis=1)[:, _FINER - 1 :: _FINER]
    nodes = theta[::_FINER]
    # At either end the limit from within counts.
    within = np.clip(nodes, nodes[0] + 1e-7 * (end - begin), nodes[-1] - 1e-7 * (end - begin))
    here = _factor(light, profile, focus, np.pi - within if is_back else within)
    sums[..., 2] = here * np.cos(nodes) * np.sin(nodes)
    sums[..., 3] = here * np.sin(nodes) ** 2
    return sums


def _lune(theta: np.ndarray) -> np.ndarray:
    """Return theta - sin cos, twice the integral of sin^2, in full digits."""
    t2 = theta * theta
    series = theta * t2 * (2 / 3 - t2 * (2 / 15 - t2 * (4 / 315 - t2 * 2 / 2835)))
    return np.where(theta < 0.05, series, theta - np.sin(theta) * np.cos(theta))


def _factor(light: Light, profile: Profile | None, focus: float, theta: np.ndarray) -> np.ndarray:
    """Return what shaping and each plane of a profile make of radiance 1 at angles to the axis: shape [planes, n]."""
    factor = np.abs(np.cos(theta)) ** focus
    if light.cone_angle < np.pi:
        rim = light.cone_angle * (1 - min(light.cone_softness, 1.0))
        x = np.clip((theta - rim) / max(light.cone_angle - rim, 1e-9), 0, 1)
        factor = factor * np.where(theta <= light.cone_angle, 1 - x * x * (3 - 2 * x), 0)
    if profile is None:
        return factor[None]
    scale = light.profile_angle_scale
    read = theta / scale if scale > 0 else (theta - np.pi) / -scale + np.pi if scale < 0 else theta
    vertical = profile.vertical.astype(float)
    rows = np.stack([np.interp(read, vertical, row, left=0, right=0) for row in profile.values.astype(float)])
    return factor * rows
