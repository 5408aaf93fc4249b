# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Ends and cells of IES profiles, against profiles whose bends and ends are known."""

import numpy as np
import pytest

from warp_rt.scene import Profile
from warp_rt.upload.profile_scales import profile_scales


def profile(vertical, rows, horizontal=(0, 360)):
    """Return a profile from angles in degrees and a row of values for each horizontal one."""
    angles = (np.radians(np.array(a, float)).astype(np.float32) for a in (vertical, horizontal))
    return Profile(*angles, np.array(rows, np.float32))


def degrees(scales, name):
    return float(np.degrees(scales[name]))


def test_ends_at_poles_are_none() -> None:
    scales = profile_scales(profile((0, 180), [(1, 2)] * 2), 0.0)
    assert scales["first_end"] < 0
    assert scales["last_end"] < 0


@pytest.mark.parametrize(
    ("scale", "first", "last"),
    [
        (0.0, 30, 120),
        (0.5, 15, 60),  # the schema's: the profile is read at theta / 0.5
        (-0.5, 105, 150),  # it is read at (theta - 180) / 0.5 + 180
    ],
)
def test_ends_are_where_the_scaled_angle_meets_them(scale: float, first: float, last: float) -> None:
    scales = profile_scales(profile((30, 90, 120), [(1, 2, 3)] * 2), scale)
    assert degrees(scales, "first_end") == pytest.approx(first, abs=1e-4)
    assert degrees(scales, "last_end") == pytest.approx(last, abs=1e-4)


def test_straight_profiles_have_the_widest_cells() -> None:
    """A straight line's mean over a cell is its middle; one that bends has cells of which that nearly holds."""
    straight = profile_scales(profile((0, 90, 180), [(0, 1, 2)] * 2), 0.0)
    bent = profile_scales(profile((0, 88, 90, 92, 180), [(0, 0, 1, 0, 0)] * 2), 0.0)
    assert bent["vertical_cell"] < straight["vertical_cell"] == straight["horizontal_cell"] == bent["horizontal_cell"]


@pytest.mark.parametrize("bend", [0.5, 1.0, 2.0])
def test_cells_are_within_two_percent_of_their_middle(bend: float) -> None:
    """At a bend of slope ``bend`` per radian a cell of width w has ends bend w / 2 above its middle."""
    angles = np.degrees([0, 1, 2, np.pi])
    rows = [(2 * bend, bend, 2 * bend, 2 * bend)] * 2
    width = profile_scales(profile(angles, rows), 0.0)["vertical_cell"]
    # Simpson's rule at the bend, which is what the cells are chosen by: a third of the rise at either end.
    assert bend * width / 2 / 3 <= 0.02 * 2 * bend * (1 + 1e-6)


def test_scaled_profiles_have_scaled_cells() -> None:
    stripes = profile((0, 88, 90, 92, 180), [(0, 0, 1, 0, 0)] * 2)
    plain, scaled = (profile_scales(stripes, scale)["vertical_cell"] for scale in (0.0, -0.25))
    assert scaled == pytest.approx(plain / 4)


def test_planes_that_differ_have_narrow_cells() -> None:
    turn = (0, 89, 91, 360)
    same = profile_scales(profile((0, 180), [(1, 1)] * 4, turn), 0.0)
    step = profile_scales(profile((0, 180), [(0, 0), (0, 0), (1, 1), (1, 1)], turn), 0.0)
    assert step["horizontal_cell"] < same["horizontal_cell"]
