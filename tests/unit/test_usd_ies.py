# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""IES profiles against LM-63's rules of symmetry, hdEmbree's types A and B, and closed-form powers."""

import numpy as np
import pytest
from pxr import Sdf

from warp_rt.errors import SceneError
from warp_rt.report import Report
from warp_rt.usd.ies import ProfileCache, normalized, parse_profile, profile_power


def ies(vertical, horizontal, rows, *, kind=1, factor=1.0, ballast="1 1 60", tilt="TILT=NONE"):
    """Return the text of a file; a row of intensities for each horizontal angle."""
    lines = ["IESNA:LM-63-2002", "[TEST] none", tilt]
    lines.append(f"1 -1 {factor} {len(vertical)} {len(horizontal)} {kind} 2 0.1 0.1 0")
    lines += [ballast, " ".join(map(str, vertical)), " ".join(map(str, horizontal))]
    return "\n".join([*lines, *(" ".join(map(str, row)) for row in rows)]) + "\n"


def planes(text):
    """Return horizontal angle [degree] to intensities."""
    profile = parse_profile(text)
    angles = np.round(np.degrees(profile.horizontal), 3).tolist()
    return dict(zip(angles, profile.values.tolist(), strict=True))


UP_AND_DOWN = (0, 180)


def test_one_plane_stands_for_all():
    assert planes(ies(UP_AND_DOWN, [0], [(1, 2)])) == {0: [1, 2], 360: [1, 2]}
    assert planes(ies(UP_AND_DOWN, [90], [(1, 2)])) == {0: [1, 2], 360: [1, 2]}


def test_a_quadrant_is_mirrored_twice():
    found = planes(ies(UP_AND_DOWN, [0, 30, 90], [(1, 0), (2, 0), (3, 0)]))
    assert {angle: row[0] for angle, row in found.items()} == {
        0: 1, 30: 2, 90: 3, 150: 2, 180: 1, 210: 2, 270: 3, 330: 2, 360: 1,
    }  # fmt: skip


def test_a_half_is_mirrored_at_its_plane():
    found = planes(ies(UP_AND_DOWN, [0, 90, 180], [(1, 0), (2, 0), (3, 0)]))
    assert {angle: row[0] for angle, row in found.items()} == {0: 1, 90: 2, 180: 3, 270: 2, 360: 1}


def test_the_half_from_90_to_270_is_mirrored_at_that_plane():
    """What is at 180 - h, and so at 540 - h, is what is at h."""
    found = planes(ies(UP_AND_DOWN, [90, 120, 180, 270], [(1, 0), (2, 0), (3, 0), (4, 0)]))
    expected = {0: 3, 60: 2, 90: 1, 120: 2, 180: 3, 270: 4, 360: 3}
    assert {angle: row[0] for angle, row in found.items()} == expected
    without = planes(ies(UP_AND_DOWN, [90, 270], [(1, 0), (4, 0)]))
    assert {angle: row[0] for angle, row in without.items()} == {0: 2.5, 90: 1, 180: 2.5, 270: 4, 360: 2.5}


def test_a_whole_turn_is_taken_as_it_is_or_closed():
    rows = [(1, 0), (2, 0), (3, 0), (4, 0)]
    closed = {0: [1, 0], 90: [2, 0], 180: [3, 0], 270: [4, 0], 360: [1, 0]}
    assert planes(ies(UP_AND_DOWN, [0, 90, 180, 270], rows)) == closed
    assert planes(ies(UP_AND_DOWN, [0, 90, 180, 270, 360], [*rows, rows[0]])) == closed
    # A gap that is no step stays one.
    assert list(planes(ies(UP_AND_DOWN, [0, 10, 20], rows[:3]))) == [0, 10, 20]


def test_type_b_exchanges_its_angles():
    """hdEmbree: vertical angles plus 90 become horizontal ones, horizontal ones plus 90 vertical ones."""
    profile = parse_profile(ies((-90, 0, 90), (-90, 90), [(1, 2, 3), (4, 5, 6)], kind=2))
    np.testing.assert_allclose(np.degrees(profile.vertical), [0, 180], rtol=1e-6)
    np.testing.assert_allclose(np.degrees(profile.horizontal), [0, 90, 180], rtol=1e-6)
    np.testing.assert_array_equal(profile.values, [(1, 4), (2, 5), (3, 6)])
    # Angles from 0 on hold for both signs.
    profile = parse_profile(ies((0, 90), (0, 90), [(1, 2), (3, 4)], kind=2))
    np.testing.assert_allclose(np.degrees(profile.vertical), [0, 90, 180], rtol=1e-6)
    np.testing.assert_array_equal(profile.values, [(4, 2, 4), (3, 1, 3), (4, 2, 4)])


def test_type_a_is_counted_from_below():
    """hdEmbree: vertical angles plus 90; horizontal ones from 90 to -90 become 90 to 270."""
    profile = parse_profile(ies((-90, 0, 90), (-90, 0, 45), [(1, 2, 3), (4, 5, 6), (7, 8, 9)], kind=3))
    np.testing.assert_allclose(np.degrees(profile.vertical), [0, 90, 180], rtol=1e-6)
    np.testing.assert_allclose(np.degrees(profile.horizontal), [135, 180, 270], rtol=1e-6)
    np.testing.assert_array_equal(profile.values, [(7, 8, 9), (4, 5, 6), (1, 2, 3)])
    # Horizontal angles from 0 on hold for both signs; vertical ones do not.
    profile = parse_profile(ies((0, 90), (0, 30, 90), [(1, 2), (3, 4), (5, 6)], kind=3))
    np.testing.assert_allclose(np.degrees(profile.vertical), [90, 180], rtol=1e-6)
    np.testing.assert_allclose(np.degrees(profile.horizontal), [90, 150, 180, 210, 270], rtol=1e-6)
    np.testing.assert_array_equal(profile.values, [(5, 6), (3, 4), (1, 2), (3, 4), (5, 6)])


def test_factors_multiply_the_candela():
    assert planes(ies(UP_AND_DOWN, [0], [(1, 2)], factor=3, ballast="0.5 2 60"))[0] == [3, 6]


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace(" ", ", "),
        lambda text: text.replace("1 2", "1\n\n 2"),
        lambda text: text.replace("TILT=NONE", "TILT=INCLUDE\n1\n3\n0 45 90\n1 0.9 0.8"),
        lambda text: text.replace("TILT=NONE", "TILT = INCLUDE\n2\n1 0\n1"),
        lambda text: text.replace("TILT=NONE", "TILT=lamp.tlt"),
        lambda text: text.replace("IESNA:LM-63-2002\n[TEST] none\n", ""),
        lambda text: text + "9 9 9\n",
        lambda text: text + "\x1a",
        lambda text: text.rstrip() + "\x1a\x00",
        lambda text: text + "[END]\nthanks for nan lamps\n",
    ],
)
def test_layouts_that_occur(change):
    assert planes(change(ies(UP_AND_DOWN, [0], [(1, 2)])))[0] == [1, 2]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "TILT"),
        ("IESNA91\nTILT=NONE\n1 -1 1", "ends"),
        ("IESNA91\nTILT=NONE\n1 -1 1 0 1 1 2 0 0 0 1 1 1\n", "number of vertical angles is 0"),
        ("IESNA91\nTILT=NONE\n1 -1 1 1e9 1 1 2 0 0 0 1 1 1\n", "1000000000"),
        (ies(UP_AND_DOWN, [0], [(1,)]), "announces"),
        (ies(UP_AND_DOWN, [0], [("x", 1)]), "16 of the 18 .*'x'"),
        (ies(UP_AND_DOWN, [0], [("nan", 1)]), "'nan' is no finite"),
        (ies(UP_AND_DOWN, [0], [(-1, 1)]), "negative"),
        (ies((0,), [0], [(1,)]), "one vertical angle"),
        (ies((90, 0), [0], [(1, 1)]), "ascend"),
        (ies(UP_AND_DOWN, [0, 0], [(1, 1), (1, 1)]), "ascend"),
        (ies(UP_AND_DOWN, [0], [(1, 2)], kind=7), "7 is no"),
    ],
)
def test_damaged_files_say_why(text, reason):
    with pytest.raises(SceneError, match=reason):
        parse_profile(text)


def test_power_is_the_mean_over_the_sphere():
    """Of cos^2 it is 1 / 3, of a lamp that shines evenly downwards 1 / 2, of one that has no angles above, 1."""
    angles = np.linspace(0, 180, 361)
    text = ies(angles, [0], [np.cos(np.radians(angles)) ** 2])
    assert profile_power(parse_profile(text)) == pytest.approx(1 / 3, rel=1e-4)
    down = ies((*angles[:181], 90.001, 180), [0], [(*[5] * 181, 0, 0)])
    assert profile_power(parse_profile(down)) == pytest.approx(2.5, rel=1e-4)
    assert profile_power(parse_profile(ies(angles[:181], [0], [[5] * 181]))) == pytest.approx(5, rel=1e-4)
    assert profile_power(normalized(parse_profile(text))) == pytest.approx(1, rel=1e-6)
    with pytest.raises(SceneError, match="power"):
        normalized(parse_profile(ies(angles, [0], [angles * 0])))


def test_a_file_is_read_once(tmp_path):
    path = tmp_path / "lamp.ies"
    path.write_text(ies(UP_AND_DOWN, [0], [(1, 2)]))
    report = Report()
    cache = ProfileCache(report)
    asset = Sdf.AssetPath(str(path), str(path))
    first = cache.load(asset, "/L", is_normalized=False)
    path.unlink()
    assert cache.load(asset, "/M", is_normalized=False) is first
    assert not len(report)


def test_files_that_cannot_be_used_are_named(tmp_path):
    path = tmp_path / "lamp.ies"
    path.write_text("TILT=NONE\n1 2 3")
    report = Report()
    cache = ProfileCache(report)
    for asset in (Sdf.AssetPath(str(path), str(path)), Sdf.AssetPath("gone.ies")):
        assert cache.load(asset, "/L", is_normalized=True) is None
    assert [d.code for d in report] == ["W402", "W402"]
    assert all("uniform" in d.message for d in report)
