# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""IES profiles: files in the IESNA's LM-63 format to Profile.

Reference: ANSI/IES LM-63-19, Standard File Format for the Electronic Transfer of Photometric Data; UsdLux ShapingAPI;
OpenUSD's hdEmbree, the reference implementation of UsdLux, for what neither of these says: where types A and B lie, and
the power.
"""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
from pxr import Sdf

from warp_rt.errors import SceneError
from warp_rt.report import Report
from warp_rt.scene import Profile
from warp_rt.usd.assets import read_asset
from warp_rt.usd.attribute_values import shown

BAD_PROFILE = "W402"

_MAX_BYTES = 1 << 26
_MAX_ANGLES = 1 << 14
_TYPE_C, _TYPE_B, _TYPE_A = 1, 2, 3
_CTRL_Z = "\x1a"
_KEYWORD = re.compile(r"^TILT\s*=\s*(\S*)[^\n]*\n?", re.MULTILINE)
# Angles that differ by less are equal [degree]: some programs write 89.99999.
_SAME_ANGLE = 1e-3
# A profile whose vertical angles cover less than this is one of a hemisphere [rad]: hdEmbree's bound.
_HEMISPHERE = math.pi / 2 + 0.1


class ProfileCache:
    """Reads profiles, each file once."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self._profiles: dict[tuple[str, bool], Profile | str] = {}

    def load(self, asset: Sdf.AssetPath, prim: object, *, is_normalized: bool) -> Profile | None:
        """Return a profile; None, with a diagnostic about ``prim``, where the file cannot be used.

        Args:
            asset: The file.
            prim: The light.
            is_normalized: Whether its mean over all directions is to be 1, as ``shaping:ies:normalize`` asks for.
        """
        key = (asset.resolvedPath, is_normalized)
        if key not in self._profiles:
            try:
                profile = parse_profile(_read(asset.resolvedPath))
                self._profiles[key] = normalized(profile) if is_normalized else profile
            except SceneError as error:
                self._profiles[key] = str(error)
        profile_or_error = self._profiles[key]
        if isinstance(profile_or_error, str):
            message = f"the IES profile @{asset.path}@ cannot be used, the light is uniform: {profile_or_error}"
            self._report.warn(BAD_PROFILE, prim, message)
            return None
        return profile_or_error


def _read(path: str) -> str:
    if not path:
        raise SceneError("the file is not found")
    return read_asset(path, _MAX_BYTES).decode("latin-1")  # ASCII by the standard, but for makers' names


def parse_profile(text: str) -> Profile:
    """Return the profile that a file's text describes: candela, multiplied by the file's own factors.

    Raises:
        SceneError: It is damaged.
    """
    tilt = _KEYWORD.search(text.replace("\r\n", "\n").replace("\r", "\n") + "\n")
    if tilt is None:
        raise SceneError("it has no line that begins with TILT=")
    numbers, rest = _numbers(tilt.string[tilt.end() :])
    end = f"; {shown(rest)} is no finite number" if rest else ""
    if tilt[1] == "INCLUDE":
        # How the lamp's output depends on the luminaire's tilt: UsdLux has no lamps in luminaires.
        count = _count(numbers, 1, "tilt angles")
        numbers = numbers[2 + 2 * count :]
    if len(numbers) < 13:
        raise SceneError(f"it ends before its angles{end}")
    vertical_count, horizontal_count = _count(numbers, 3, "vertical angles"), _count(numbers, 4, "horizontal angles")
    kind = int(numbers[5])
    if kind not in (_TYPE_C, _TYPE_B, _TYPE_A):
        raise SceneError(f"{kind} is no photometric type")
    factor = numbers[2] * numbers[10] * numbers[11]  # candela multiplier, ballast factor, ballast-lamp factor
    needed = 13 + vertical_count + horizontal_count + vertical_count * horizontal_count
    if len(numbers) < needed:
        raise SceneError(f"it has {len(numbers)} of the {needed} numbers that its header announces{end}")
    vertical, horizontal, values = np.split(numbers[13:needed], [vertical_count, vertical_count + horizontal_count])
    if vertical_count < 2:
        raise SceneError("it has one vertical angle alone")
    for angles in (vertical, horizontal):
        if (np.diff(angles) <= 0).any():
            raise SceneError("its angles do not ascend")
    values = values.reshape(horizontal_count, vertical_count) * factor
    if values.min() < 0:
        raise SceneError("an intensity is negative")
    if kind == _TYPE_A:
        horizontal, vertical, values = _from_below(horizontal, vertical, values)
    elif kind == _TYPE_B:
        horizontal, vertical, values = _about_the_vertical(horizontal, vertical, values)
    else:
        horizontal, values = _whole_turn(horizontal, values)
    return Profile(
        np.radians(vertical).astype(np.float32), np.radians(horizontal).astype(np.float32), values.astype(np.float32)
    )


def _numbers(text: str) -> tuple[np.ndarray, str]:
    """Return the finite numbers that a text begins with, and the word that ends them.

    Files go on with what the standard does not know: a Ctrl-Z, which ends files of DOS, or further keywords.
    """
    numbers: list[float] = []
    for word in text.partition(_CTRL_Z)[0].replace(",", " ").split():
        try:
            number = float(word)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            return np.array(numbers), word
        numbers.append(number)
    return np.array(numbers), ""


def _count(numbers: np.ndarray, index: int, name: str) -> int:
    count = int(numbers[index]) if len(numbers) > index else 0
    if not 1 <= count <= _MAX_ANGLES:
        raise SceneError(f"the number of {name} is {count}")
    return count


def _is(angle: float, value: float) -> bool:
    return abs(angle - value) < _SAME_ANGLE


def _whole_turn(horizontal: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the planes of type C from 0 to 360 degrees, symmetry being written out.

    One plane stands for all. 0 to 90 is mirrored at the plane 90 to 270, then, like 0 to 180, at the plane 0 to 180.
    90 to 270 is mirrored at the plane that it ends in. Otherwise, where the plane at 360 is missing and one step would
    close the turn, it is that at 0; any other gap has no light.
    """
    if len(horizontal) == 1:
        return np.array([0.0, 360.0]), np.repeat(values, 2, axis=0)
    first, last = horizontal[0], horizontal[-1]
    if _is(first, 90) and _is(last, 270):
        if 180 not in horizontal:  # whose image the turn begins and ends with
            values = np.stack(
                [np.interp(np.append(horizontal, 180), horizontal, column) for column in values.T], axis=1
            )
            order = np.argsort(np.append(horizontal, 180))
            horizontal, values = np.append(horizontal, 180)[order], values[order]
        before, after = horizontal <= 180, horizontal >= 180
        angles = [180 - horizontal[before][::-1], horizontal[1:-1], 540 - horizontal[after][::-1]]
        return np.concatenate(angles), np.concatenate([values[before][::-1], values[1:-1], values[after][::-1]])
    if _is(first, 0) and _is(last, 90):
        horizontal = np.concatenate([horizontal, 180 - horizontal[-2::-1]])
        values = np.concatenate([values, values[-2::-1]])
        last = horizontal[-1]
    if _is(first, 0) and _is(last, 180):
        return np.concatenate([horizontal, 360 - horizontal[-2::-1]]), np.concatenate([values, values[-2::-1]])
    gap = 360 - last
    if _is(first, 0) and (_is(gap, horizontal[1] - first) or _is(gap, last - horizontal[-2])):
        return np.append(horizontal, 360.0), np.concatenate([values, values[:1]])
    return horizontal, values


def _from_below(
    horizontal: np.ndarray, vertical: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return type A, whose polar axis is vertical as type C's is, by the angles of type C, as hdEmbree means to.

    Elevations from -90 to 90 become 0 to 180, from below; azimuths from 90 to -90 become 90 to 270, those from 0 on
    being mirrored to the other side. The loop by which hdEmbree does so never ends, for its index has no sign; that of
    Cycles, whence it comes, does.
    """
    if _is(horizontal[0], 0):
        horizontal, values = _both_sides(horizontal, values)
    return 180 - horizontal[::-1], vertical + 90, values[::-1]


def _about_the_vertical(
    horizontal: np.ndarray, vertical: np.ndarray, values: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return type B, whose polar axis is horizontal, as planes about the light's axis: hdEmbree's exchange of angles.

    Angles from 0 on are mirrored to the other side, then -90 to 90 becomes 0 to 180.
    """
    values = values.T
    horizontal, vertical = vertical, horizontal
    if _is(horizontal[0], 0):
        horizontal, values = _both_sides(horizontal, values)
    if _is(vertical[0], 0):
        vertical, values = _both_sides(vertical, values.T)
        values = values.T
    return horizontal + 90, vertical + 90, values


def _both_sides(angles: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.concatenate([-angles[:0:-1], angles]), np.concatenate([rows[:0:-1], rows])


def profile_power(profile: Profile) -> float:
    """Return the mean of a profile over the sphere; over a hemisphere where it covers no more than that.

    The sum over patches between neighbouring angles, each with the mean of its corners and the solid angle that its
    middle suggests, as hdEmbree has it.
    """
    values = profile.values.astype(float)
    vertical, horizontal = profile.vertical.astype(float), profile.horizontal.astype(float)
    centers = (values[1:, 1:] + values[1:, :-1] + values[:-1, 1:] + values[:-1, :-1]) / 4
    middle = (vertical[1:] + vertical[:-1]) / 2
    total = float((centers * np.diff(horizontal)[:, None] * np.diff(vertical) * np.sin(middle)).sum())
    is_sphere = vertical[-1] - vertical[0] > _HEMISPHERE
    return total / ((4 if is_sphere else 2) * math.pi)


def normalized(profile: Profile) -> Profile:
    """Return a profile whose power is 1.

    Raises:
        SceneError: It has none.
    """
    power = profile_power(profile)
    if not power > 0:
        raise SceneError("it has no power that it could be normalized by")
    return replace(profile, values=(profile.values / power).astype(np.float32))
