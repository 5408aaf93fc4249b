# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""How many texels the image of a field of texture coordinates needs, so that what is read between them is the field."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warp_rt.scene import Wrap
from warp_rt.usd.continuation import ACCURACY, CLOSE, Continuation, Field, Span
from warp_rt.usd.signals import CHANNELS

TEXELS_A_UNIT = 1024  # the most, of a field that is finer
MIN_LIMIT, MAX_LIMIT = 256, 2048  # of the most texels of an axis, however long it is

_LINES = 32  # along which a field is asked; what is farther across than that part of the image is met by one
_COARSE = 1 / 64  # of the field's range: so much is seen
_EDGES = 1 / 8  # of the intervals between texels: more that are coarse are no edges of something larger


@dataclass(frozen=True)
class Axis:
    """The texels of an image along one axis."""

    count: int
    span: Span
    """From where to where they lie, of the coordinates."""
    is_fine: bool
    """Whether the field is no finer than they are, but for edges, which are then as wide as a texel."""


def texel_axis(field: Field, beyond: Continuation, axis: int) -> Axis:
    """Return the fewest texels along an axis between which linear interpolation gives the field to 1/2048 of its range.

    The outermost texels lie on the edges of an image beyond which the field is constant, so that a ramp takes two. The
    field is asked along 32 lines, as densely as twice the most texels that an image may have.

    Args:
        field: What is asked.
        beyond: Where its image lies, and how it goes on.
        axis: 0: across, 1: upwards.
    """
    low, high = beyond.spans[axis]
    wrap = beyond.wraps[axis]
    limit = int(np.clip(TEXELS_A_UNIT * (high - low), MIN_LIMIT, MAX_LIMIT))
    values = _along_lines(field, beyond.spans, axis, 2 * limit + 1)
    extent = values.max(axis=(0, 1)) - values.min(axis=(0, 1))
    slack = extent * ACCURACY + CLOSE * max(1.0, float(np.abs(values).max()))
    if wrap != Wrap.BLACK and (np.ptp(values, axis=1) <= slack).all():
        return Axis(1, (low, high), True)
    on_edges = wrap == Wrap.CLAMP or not beyond.fits[axis]  # nothing from beyond comes in between texels on edges
    places = np.arange(2 * limit + 1)
    for intervals in (2 ** np.arange(0 if on_edges else 1, int(np.log2(limit)) + 1)).tolist():
        step = 2 * limit // intervals
        first = 0 if on_edges else step // 2
        at = values[:, first::step]
        # Halfway between texels first, where most fields that do not fit show it.
        for chosen in (places[step // 2 :: step], places):
            found = _between(at, (chosen - first) / step, wrap, beyond.border)
            errors = np.abs(found - values[:, chosen])
            if (errors > slack).any():
                break
        else:
            half = 0.5 * (high - low) / intervals if on_edges else 0.0
            return Axis(intervals + on_edges, (low - half, high + half), True)
    is_coarse = (errors > extent * _COARSE + slack).any(axis=2)
    return Axis(limit, (low, high), bool(is_coarse.mean() <= _EDGES))


def _along_lines(field: Field, spans: tuple[Span, Span], axis: int, count: int) -> np.ndarray:
    """Return a field at places from edge to edge of its image along an axis, on lines: shape [lines, count, 4]."""
    rng = np.random.default_rng(axis)
    (low, high), (bottom, top) = spans[axis], spans[1 - axis]
    along = np.linspace(low + CLOSE, high - CLOSE, count)
    across = bottom + (top - bottom) * (np.arange(_LINES) + rng.uniform(0.01, 0.99, _LINES)) / _LINES
    places = [np.tile(along, _LINES), np.repeat(across, count)]
    found = field(np.stack(places if axis == 0 else places[::-1], axis=1))
    return found.reshape(_LINES, count, CHANNELS)


def _between(texels: np.ndarray, places: np.ndarray, wrap: Wrap, border: np.ndarray) -> np.ndarray:
    """Return what a texture is at places counted in texels, the first of which is at 0: shape [lines, n, 4]."""
    before, after = texels[:, -1:], texels[:, :1]
    if wrap in (Wrap.CLAMP, Wrap.MIRROR):
        before, after = after, before
    elif wrap == Wrap.BLACK:
        before = after = np.broadcast_to(border, after.shape)
    padded = np.concatenate([before, texels, after], axis=1)
    first = np.floor(places).astype(np.int64)
    share = (places - first)[:, None]
    return np.asarray(
        padded.take(first + 1, axis=1) * (1 - share)
        + padded.take(np.minimum(first + 2, padded.shape[1] - 1), axis=1) * share
    )
