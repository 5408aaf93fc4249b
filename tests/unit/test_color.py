# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The sRGB curve against values of IEC 61966-2-1 worked out by hand; a pixel on its way to 8 bits."""

import numpy as np
import pytest

from warp_rt.errors import OptionError
from warp_rt.image.color import display, unpremultiply
from warp_rt.srgb import linear_from_srgb, srgb_from_linear


@pytest.mark.parametrize(
    ("linear", "encoded"),
    [
        (0.0, 0.0),
        (0.001, 0.01292),  # on the line: 12.92 x
        (0.0031308, 0.04045),  # the knee
        (0.18, 0.46135612950044164),  # 1.055 * 0.18^(1/2.4) - 0.055, middle grey
        (0.5, 0.7353569830524495),
        (1.0, 1.0),
    ],
)
def test_curve_has_the_standards_values(linear, encoded):
    assert srgb_from_linear(linear) == pytest.approx(encoded, abs=1e-6)
    assert linear_from_srgb(encoded) == pytest.approx(linear, abs=1e-6)


def test_curve_is_not_a_gamma_of_2_2():
    assert abs(float(srgb_from_linear(0.002)) - 0.002 ** (1 / 2.2)) > 0.03


def test_every_8_bit_value_survives_the_round_trip():
    codes = np.arange(256)
    assert np.array_equal(display(linear_from_srgb(codes / 255.0)), codes)


def test_each_stop_doubles_the_light():
    assert display(np.array([0.25]), exposure=1.0, tonemap="raw") == 128  # 0.5 * 255 = 127.5, to even
    assert display(np.array([0.8]), exposure=-2.0, tonemap="raw") == 51


def test_raw_has_no_curve():
    assert np.array_equal(display(np.array([0.2, 0.4, 1.0]), tonemap="raw"), [51, 102, 255])


def test_values_outside_the_display_are_clamped_and_nan_is_black():
    values = np.array([-1.0, 7.0, np.inf, -np.inf, np.nan], np.float32)
    assert np.array_equal(display(values), [0, 255, 255, 0, 0])


def test_unknown_tone_map_is_named():
    with pytest.raises(OptionError, match="'filmic' is none of srgb, raw"):
        display(np.zeros(1), tonemap="filmic")


def test_unpremultiply_divides_by_alpha_and_leaves_what_has_none():
    color = np.array([[[0.25, 0.5, 0.0], [0.3, 0.2, 0.1]]])
    straight = unpremultiply(color, np.array([[0.5, 0.0]]))
    assert np.allclose(straight, [[[0.5, 1.0, 0.0], [0.3, 0.2, 0.1]]])
