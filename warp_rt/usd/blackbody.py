# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The colour of a black body as MaterialX has it: of a luminance of 1.

Reference: Kang, Moon, Hong, Lee, Cho and Kim (2002), Design of Advanced Color Temperature Control System for HDTV
Applications, Journal of the Korean Physical Society 41(6): the cubics.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from warp_rt.usd.signals import Signal, add, apply, choose, join, multiply, steps_of

_COLDEST, _HOTTEST = 800.0, 25000.0  # [K]; others count as the nearer end
_X_COOL = (-0.2661239, -0.2343580, 0.8776956, 0.179910)  # cubics of 1000 K by the temperature
_X_HOT = (-3.0258469, 2.1070379, 0.2226347, 0.240390)
_Y_COLD = (-1.1063814, -1.34811020, 2.18555832, -0.20219683)  # cubics of x
_Y_COOL = (-0.9549476, -1.37418593, 2.09137015, -0.16748867)
_Y_HOT = (3.0817580, -5.87338670, 3.75112997, -0.37001483)
_COLD, _COOL = 2222.0, 4000.0  # where the cubics meet [K]
_RGB_FROM_XYZ = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])


def blackbody(temperature: np.ndarray) -> np.ndarray:
    """Return linear Rec. 709, what lies outside of its gamut cut off.

    Args:
        temperature: In kelvin, shape [n, 1].

    Returns:
        Shape [n, 3].
    """
    kelvin = np.clip(temperature[:, 0], _COLDEST, _HOTTEST)
    x = np.where(kelvin < _COOL, np.polyval(_X_COOL, 1000.0 / kelvin), np.polyval(_X_HOT, 1000.0 / kelvin))
    y = np.select(
        [kelvin < _COLD, kelvin < _COOL], [np.polyval(_Y_COLD, x), np.polyval(_Y_COOL, x)], np.polyval(_Y_HOT, x)
    )
    xyz = np.stack([x / y, np.ones_like(x), (1.0 - x - y) / y], axis=1)
    return np.maximum(xyz @ _RGB_FROM_XYZ.T, 0.0)


@steps_of(blackbody)
def _blackbody_steps(temperature: Signal) -> Signal:
    def cubic(coefficients: Sequence[float], at: Signal) -> Signal:
        total = Signal.constant([0.0])
        for coefficient in coefficients:
            total = add(multiply(total, at), Signal.constant([coefficient]))
        return total

    def is_below(limit: float) -> Signal:
        return apply(np.greater, Signal.constant([limit]), kelvin)

    one = Signal.constant([1.0])
    kelvin = apply(np.clip, temperature, Signal.constant([_COLDEST]), Signal.constant([_HOTTEST]))
    inverse = apply(np.reciprocal, kelvin).map(np.array([[1000.0]]))
    x = choose(is_below(_COOL), cubic(_X_COOL, inverse), cubic(_X_HOT, inverse))
    y = choose(is_below(_COLD), cubic(_Y_COLD, x), choose(is_below(_COOL), cubic(_Y_COOL, x), cubic(_Y_HOT, x)))
    share = apply(np.reciprocal, y)
    xyz = join([multiply(x, share), one, multiply(add(add(one, x, -1.0), y, -1.0), share)])
    return apply(np.maximum, xyz.map(_RGB_FROM_XYZ), Signal.constant([0.0]))
