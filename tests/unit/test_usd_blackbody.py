# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The colour of black bodies, against Planck's law seen through the eye's colour matching functions."""

from __future__ import annotations

import numpy as np
import pytest

from warp_rt.usd.blackbody import blackbody


def lobe(wavelength: np.ndarray, mean: float, below: float, above: float) -> np.ndarray:
    width = np.where(wavelength < mean, below, above)
    return np.exp(-0.5 * ((wavelength - mean) / width) ** 2)


def chromaticity(kelvin: float) -> tuple[float, float]:
    """Planck's law through the functions of CIE 1931, which sums of lobes give to about 1 %.

    Reference: Wyman, Sloan and Shirley (2013), Simple Analytic Approximations to the CIE XYZ Color Matching Functions,
    JCGT 2(2), section 2.2.
    """
    w = np.linspace(360.0, 830.0, 2000)  # [nm]
    radiance = w**-5.0 / np.expm1(1.4387769e7 / (w * kelvin))
    x = 1.056 * lobe(w, 599.8, 37.9, 31.0) + 0.362 * lobe(w, 442.0, 16.0, 26.7) - 0.065 * lobe(w, 501.1, 20.4, 26.2)
    y = 0.821 * lobe(w, 568.8, 46.9, 40.5) + 0.286 * lobe(w, 530.9, 16.3, 31.1)
    z = 1.217 * lobe(w, 437.0, 11.8, 36.0) + 0.681 * lobe(w, 459.0, 26.0, 13.8)
    sums = np.array([(radiance * part).sum() for part in (x, y, z)])
    return sums[0] / sums.sum(), sums[1] / sums.sum()


XYZ_FROM_RGB = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


@pytest.mark.parametrize("kelvin", [2300.0, 3500.0, 4500.0, 6500.0, 12000.0, 25000.0])
def test_the_colour_is_that_of_plancks_law(kelvin: float) -> None:
    x, y, z = XYZ_FROM_RGB @ blackbody(np.array([[kelvin]]))[0]
    assert y == pytest.approx(1.0, abs=1e-3)
    np.testing.assert_allclose((x / (x + y + z), y / (x + y + z)), chromaticity(kelvin), atol=0.005)


def test_beyond_what_is_known_the_nearer_end_counts() -> None:
    kelvin = np.array([[0.0], [800.0], [25000.0], [1e6]])
    colors = blackbody(kelvin)
    np.testing.assert_array_equal(colors[0], colors[1])
    np.testing.assert_array_equal(colors[2], colors[3])
    assert (colors >= 0).all()
