# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Frame specifications and numbered names, with usdrecord's own examples."""

from fractions import Fraction
from pathlib import Path

import pytest

from warp_rt.cli.frames import has_placeholder, numbered_files, parse_frames
from warp_rt.errors import OptionError


@pytest.mark.parametrize(
    ("spec", "frames"),
    [
        ("123", [123]),
        ("101:105", [101, 102, 103, 104, 105]),
        ("105:101", [105, 104, 103, 102, 101]),
        ("101:109x2", [101, 103, 105, 107, 109]),
        ("101:110x2", [101, 103, 105, 107, 109]),
        ("101:104x0.5", [101, 101.5, 102, 102.5, 103, 103.5, 104]),
        ("5:1x-2", [5, 3, 1]),
        ("-2:1", [-2, -1, 0, 1]),
        ("1,5,10", [1, 5, 10]),
        ("1:3 10", [1, 2, 3, 10]),
        ("1:3,2:4", [1, 2, 3, 4]),
        ("7:7", [7]),
        (".5", [0.5]),
    ],
)
def test_specifications(spec, frames):
    assert parse_frames(spec) == tuple(Fraction(frame) for frame in frames)


def test_strides_are_exact():
    assert parse_frames("0:1x0.1")[-1] == 1  # ten steps of the float 0.1 would miss it


@pytest.mark.parametrize(
    "spec", ["", ",", "a", "1-3", "1:3x0", "1:3x-1", "3:1x1", "1:2:3", "1x2", "nan", "inf", "1e3", "9" * 5000]
)
def test_nonsense_is_a_usage_error(spec):
    with pytest.raises(OptionError, match="frames"):
        parse_frames(spec)


def test_frames_that_a_time_code_cannot_tell_apart_are_refused():
    assert parse_frames("9007199254740992") == (Fraction(2) ** 53,)
    with pytest.raises(OptionError, match="is outside"):
        parse_frames("9007199254740993")  # as a double it is the one before
    with pytest.raises(OptionError, match="is outside"):
        parse_frames("0:-" + "9" * 300)


def test_endless_ranges_are_refused_at_once():
    with pytest.raises(OptionError, match="more than 1000000 frames"):
        parse_frames("0:999999999x0.001")


@pytest.mark.parametrize(
    ("name", "frame", "file"),
    [
        ("a.#.png", "7", "a.7.png"),
        ("a.###.png", "7", "a.007.png"),
        ("a.###.png", "12345", "a.12345.png"),
        ("a.####.png", "-7", "a.-007.png"),
        ("a.###.##.png", "7.5", "a.007.50.png"),
        ("a_###.exr", "101", "a_101.exr"),
    ],
)
def test_numbered_names(name, frame, file):
    assert numbered_files(Path("out", name), (Fraction(frame),)) == (Path("out", file),)


def test_one_frame_needs_no_placeholder_but_several_do():
    assert numbered_files(Path("a.png"), (Fraction(1),)) == (Path("a.png"),)
    with pytest.raises(OptionError, match="exactly one placeholder"):
        numbered_files(Path("a.png"), (Fraction(1), Fraction(2)))
    with pytest.raises(OptionError, match="exactly one placeholder"):
        numbered_files(Path("a.#.b.#.png"), (Fraction(1),))


def test_decimals_must_tell_the_frames_apart():
    with pytest.raises(OptionError, match=r"frame 101.5 needs more decimals"):
        numbered_files(Path("a.###.png"), parse_frames("101:102x0.5"))


def test_folders_may_be_called_anything():
    assert not has_placeholder(Path("#1", "a.png"))
    assert numbered_files(Path("#1", "a.##.png"), (Fraction(3),)) == (Path("#1", "a.03.png"),)
