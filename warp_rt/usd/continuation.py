# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""How a field of texture coordinates goes on beyond the image that is made of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from warp_rt.scene import Wrap
from warp_rt.usd.signals import CHANNELS

Span = tuple[float, float]

UNIT: Span = (0.0, 1.0)
FARTHEST = 1000.0  # units that a field is asked away from the unit square

ACCURACY = 1 / 2048  # of a field's range, an eighth of the step of eight bits: what is nearer is the same
CLOSE = 1e-9  # units from an edge: a step on it does not belong to the image

_NEAR = 256  # places in the unit square and next to it, where wrap modes show
_FEW = 64
_FAR = 1024  # places farther out, 200 for each power of ten
_PERIODS = (*0.5 ** np.arange(6, -1, -1), *range(2, 17))  # units after which a field is asked whether it repeats itself
_REACH = 16.0  # units that an image may reach either way, so that it has at least 64 texels in each

Field = Callable[[np.ndarray], np.ndarray]
"""Gives the values at places, shape [n, 2]: float64, shape [n, 4]."""
Fold = Callable[[np.ndarray], np.ndarray]
"""Moves places on an axis, shape [n]."""


@dataclass(frozen=True)
class Continuation:
    """Where an image of a field has to lie, and what shows the field beyond."""

    wraps: tuple[Wrap, Wrap]
    """Across and upwards."""
    spans: tuple[Span, Span]
    """From where to where the image lies, across and upwards."""
    border: np.ndarray
    """The field's value beyond where a wrap mode is black, shape [4]."""
    fits: tuple[bool, bool]
    """Whether that is so at all places at which the field was asked, across and upwards."""


def continuation(field: Field, *, is_of_images: bool) -> Continuation:
    """Return the wrap modes by which a field goes on beyond the unit square, or beyond a wider image.

    It is asked in the square, and farther and farther out, up to ``FARTHEST``, more thinly: a change that is narrower
    than a hundredth of its distance may be missed. Where no mode fits, the unit square is repeated.

    Args:
        field: What is asked.
        is_of_images: Whether it reads images, whose square is kept; else the image is as narrow as what repeats itself,
            or as wide as it takes until the field is constant.
    """
    wraps: list[Wrap] = []
    spans: list[Span] = []
    fits: list[bool] = []
    border = None
    for axis in (0, 1):
        probes = _Probes.of(field, axis)
        span, wrap = UNIT, next((mode for mode, fold in _FOLDS.items() if probes.agree(fold)), None)
        if wrap is None:
            # Of an image, nearer, the outermost texels show between texels.
            far = probes.values[np.abs(probes.along - 0.5) > (1.0 if is_of_images else 0.5)]
            edge = far[0] if border is None else border
            if (np.abs(far - edge) <= probes.slack).all():
                border, wrap = edge, Wrap.BLACK
        if wrap is None and not is_of_images:
            wider = _span(probes)
            if wider is not None:
                span, wrap = wider, Wrap.CLAMP
        if wrap in (None, Wrap.REPEAT) and not is_of_images:
            period = next((period for period in _PERIODS if probes.agree(_folded_to(period))), None)
            if period is not None:
                span, wrap = (0.0, float(period)), Wrap.REPEAT
        fits.append(wrap is not None)
        wraps.append(Wrap.REPEAT if wrap is None else wrap)
        spans.append(span)
    outside = np.zeros(CHANNELS) if border is None else border
    return Continuation((wraps[0], wraps[1]), (spans[0], spans[1]), outside, (fits[0], fits[1]))


def onto_unit(spans: tuple[Span, Span]) -> np.ndarray:
    """Return the matrix that takes a window to the unit square: float64, shape [3, 3]."""
    matrix = np.eye(3)
    for axis, (low, high) in enumerate(spans):
        matrix[axis, axis], matrix[axis, 2] = 1.0 / (high - low), -low / (high - low)
    return matrix


@dataclass(frozen=True)
class _Probes:
    """Places at which a field was asked, and what it gave."""

    field: Field
    axis: int
    places: np.ndarray
    """Shape [n, 2]."""
    values: np.ndarray
    """Shape [n, 4]."""

    @staticmethod
    def of(field: Field, axis: int) -> _Probes:
        """Ask a field all along one axis."""
        places = _places(axis)
        return _Probes(field, axis, places, field(places))

    @property
    def along(self) -> np.ndarray:
        """Where the places lie on the axis, shape [n]."""
        return np.asarray(self.places[:, self.axis])

    @cached_property
    def slack(self) -> np.ndarray:
        """To within this two values are one, by component: shape [4]."""
        return np.asarray(np.ptp(self.values, axis=0) * ACCURACY + CLOSE * max(1.0, float(np.abs(self.values).max())))

    def agree(self, fold: Fold, chosen: np.ndarray | None = None) -> bool:
        """Return whether the field is the same at places that are moved along the axis.

        Args:
            fold: Where they are moved to.
            chosen: Places that are asked about, bool, shape [n]; None: all.
        """
        rows = np.arange(len(self.places)) if chosen is None else np.flatnonzero(chosen)
        # Most folds that do not fit show it at the first few places.
        for some in (rows[:_FEW], rows[_FEW:]):
            moved = self.places[some]
            moved[:, self.axis] = fold(moved[:, self.axis])
            if (np.abs(self.field(moved) - self.values[some]) > self.slack).any():
                return False
        return True


def _places(axis: int) -> np.ndarray:
    """Return where a field is asked, shape [n, 2]: along one axis everywhere, along the other inside and far out."""
    rng = np.random.default_rng(axis)
    along = np.concatenate([rng.uniform(-1, 3, _NEAR), _far(rng)])
    across = np.where(rng.uniform(size=len(along)) < 0.5, rng.uniform(0.02, 0.98, len(along)), _far(rng, len(along)))
    return np.stack([along, across] if axis == 0 else [across, along], axis=1)


def _far(rng: np.random.Generator, count: int = _FAR) -> np.ndarray:
    """Return places out to the farthest, either way, in no order: of each power of ten as many."""
    exponents = np.linspace(-2.0, np.log10(FARTHEST), count) + rng.uniform(0, 1 / count, count)
    return rng.permutation(10.0**exponents * rng.choice((-1.0, 1.0), count))


def _span(probes: _Probes) -> Span | None:
    """Return the least window, by powers of two, beyond which a field is as at its edges; None: there is none."""
    edges = 2.0 ** np.arange(np.log2(_REACH) + 1)
    high = next((x for x in edges if probes.agree(_held_below(x), probes.along > x)), None)
    low = next((x for x in (0.0, *-edges) if probes.agree(_held_above(x), probes.along < x)), None)
    return None if low is None or high is None else (float(low), float(high))


def _folded_to(period: float) -> Fold:
    return lambda s: s - period * np.floor(s / period)


def _held_below(edge: float) -> Fold:
    return lambda s: np.minimum(s, edge - CLOSE)


def _held_above(edge: float) -> Fold:
    return lambda s: np.maximum(s, edge + CLOSE)


def _clamped(s: np.ndarray) -> np.ndarray:
    return np.clip(s, CLOSE, 1.0 - CLOSE)


def _mirrored(s: np.ndarray) -> np.ndarray:
    return 1.0 - np.abs(s - 2.0 * np.floor(s / 2.0) - 1.0)


_FOLDS = {Wrap.CLAMP: _clamped, Wrap.REPEAT: _folded_to(1.0), Wrap.MIRROR: _mirrored}
"""Where in the unit square the value of a place is found; of what is constant all fit, and the first counts."""
