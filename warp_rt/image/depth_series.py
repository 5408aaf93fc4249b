# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The lecture's figure: one scene at growing depth of the ray tree, and what each further depth changes."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from warp_rt.image.atomic import write_bytes
from warp_rt.image.color import display
from warp_rt.image.contact_sheet import Caption, Cell, contact_sheet
from warp_rt.image.image import FilmLike, Image, software
from warp_rt.image.outputs import check_writable, series_files
from warp_rt.image.png import encode_png, opaque
from warp_rt.image.tone import MAX_EXPOSURE

_BELOW_WHITE = 95.0
"""Percentile of the pixels that change; a few glints would leave the rest dark."""


class Rays(Protocol):
    """How many rays a picture took; ``warp_rt.rendering.film.RayCounts`` is one."""

    @property
    def total(self) -> int:
        """Rays of all kinds."""

    def to_json(self) -> dict[str, Any]:
        """Return them by kind."""


class TracedFilm(FilmLike, Protocol):
    """A film that knows its rays; ``warp_rt.Film`` is one."""

    @property
    def rays(self) -> Rays:
        """What it took."""


@dataclass(frozen=True)
class DepthChange:
    """What one picture of a series differs from the one before by."""

    image: Image
    """The absolute difference of the linear colours. It is shown multiplied by :attr:`scale`, the largest power of two
    that leaves 95 % of the pixels that change below white."""
    share: float
    """Share of the pixels that differ at all, 0 to 1."""
    largest: float
    """Largest difference of a channel, linear Rec. 709."""

    @property
    def scale(self) -> float:
        """By what the difference is multiplied where it is shown."""
        return 2.0**self.image.exposure


@dataclass(frozen=True)
class DepthStep:
    """One picture of a series."""

    depth: int
    image: Image
    rays: Rays
    change: DepthChange | None
    """From the step before; None for the first."""


@dataclass(frozen=True)
class DepthSeries:
    """Pictures of one scene at growing depth. A notebook shows them as a contact sheet."""

    steps: tuple[DepthStep, ...]

    def sheet(self) -> np.ndarray:
        """Return the contact sheet as display values: uint8, shape [height, width, 3], row 0 on top."""
        first = self.steps[0].image
        facts = first.film.facts
        headline = Path(str(facts.get("source", "") or "scene")).name
        told = [f"{first.width} x {first.height} pixels"]
        told += [f"{facts['spp']} sample{'s' * (facts['spp'] != 1)} a pixel"] if "spp" in facts else []
        told += [f"threshold {facts['threshold']:.3g}"] if "threshold" in facts else []
        told += [f"{facts['camera']}"] if "camera" in facts else []
        columns = [_cells(*pair) for pair in zip(self.steps, (None, *self.steps[:-1]), strict=True)]
        return contact_sheet(headline, ", ".join(told), columns)

    def save(self, folder: str | os.PathLike[str], *, extension: str = "png") -> tuple[Path, ...]:
        """Write pictures, differences and contact sheet to a folder that is there; return the files, the sheet first.

        ``series.png`` is the sheet; ``depth_1.png``, ``depth_2.png`` and so on are the pictures, ``change_2.png`` and
        so on the differences, each from the picture before. Each file is written whole or not at all.

        Args:
            folder: Where to.
            extension: ``png``, ``jpg`` or ``exr`` for pictures and differences. EXR has linear values, the differences
                as they are; the sheet is PNG.

        Raises:
            OptionError: The extension is unknown.
            OutputError: A file could not be written.
        """
        files = series_files(Path(folder), [step.depth for step in self.steps], extension)
        for file in files.all():
            check_writable(file)
        for step, file in zip(self.steps, files.pictures, strict=True):
            step.image.save(file)
        changes = [step.change for step in self.steps if step.change]
        for change, file in zip(changes, files.changes, strict=True):
            change.image.save(file)
        write_bytes(files.sheet, self._repr_png_())  # last: where it is, the rest is too
        return files.all()

    def _repr_png_(self) -> bytes:
        """Return the contact sheet as a PNG file: notebooks call this to show it."""
        facts = {**self.steps[0].image.film.facts, "depth": ", ".join(str(step.depth) for step in self.steps)}
        return encode_png(opaque(self.sheet()), software=software(), metadata=facts, is_srgb=True)

    def __repr__(self) -> str:
        first = self.steps[0].image
        depths = ", ".join(str(step.depth) for step in self.steps)
        return f"<warp_rt.DepthSeries {first.width} x {first.height}: depth {depths}>"


def make_series(
    depths: Sequence[int], films: Sequence[TracedFilm], *, exposure: float = 0.0, tonemap: str = "srgb"
) -> DepthSeries:
    """Return the series of some films, each compared with the one before.

    Args:
        depths: Of the films, growing.
        films: Of one size.
        exposure: Stops by which pictures are brightened where they are shown.
        tonemap: As for :class:`Image`.
    """
    steps: list[DepthStep] = []
    for depth, film in zip(depths, films, strict=True):
        change = _change(steps[-1].depth, steps[-1].image.film, film, tonemap) if steps else None
        steps.append(DepthStep(depth, Image(film, exposure=exposure, tonemap=tonemap), film.rays, change))
    return DepthSeries(tuple(steps))


@dataclass(frozen=True)
class _Difference:
    """A film of differences."""

    aovs: Mapping[str, np.ndarray]
    facts: Mapping[str, object]
    prims: tuple[str, ...] = ()
    instance_paths: Sequence[str] = ()
    labels: Mapping[str, Mapping[str, tuple[str, ...]]] = field(default_factory=dict)
    data_window: tuple[int, int, int, int] | None = None
    pixel_aspect_ratio: float = 1.0


def _change(depth_before: int, before: FilmLike, after: FilmLike, tonemap: str) -> DepthChange:
    difference = np.abs(after.aovs["color"] - before.aovs["color"])
    strength = difference.max(axis=-1)
    changed = strength[strength > 0.0]
    film = _Difference(
        {"color": difference, "alpha": np.ones_like(strength)},
        {**after.facts, "difference_from_depth": depth_before},
        data_window=after.data_window,
        pixel_aspect_ratio=after.pixel_aspect_ratio,
    )
    image = Image(film, exposure=_stops(changed), tonemap=tonemap)
    return DepthChange(image, changed.size / strength.size, float(strength.max()))


def _stops(changed: np.ndarray) -> float:
    """Return the exposure at which nearly all of some values stay below 1, in whole stops."""
    finite = changed[np.isfinite(changed)]
    if not finite.size:
        return 0.0
    bright = float(np.percentile(finite, _BELOW_WHITE))
    return float(min(max(math.floor(-math.log2(bright)), -MAX_EXPOSURE), MAX_EXPOSURE))


_LEGEND = (
    "The lower picture is what each depth adds to the one before it: the absolute difference of the linear colours, "
    "brightened as stated, so that at most one changed pixel in twenty is cut off at white."
)


def _cells(step: DepthStep, before: DepthStep | None) -> tuple[Cell, Cell]:
    """Return what the sheet shows of a step: the picture, and below it the change, or in its place what that is."""
    rays = f"{step.rays.total:,} rays"
    if step.change is None or before is None:
        return Cell(_over_black(step.image), Caption(f"Depth {step.depth}", rays)), Cell(None, Caption(body=_LEGEND))
    change, scale = step.change, step.change.scale
    told = (f"{percent(change.share)} of pixels change", f"up to {change.largest:#.3g}")
    if change.share == 0.0:
        told = ("no pixel changes", "")
    times = f"x {scale:g}" if scale >= 1.0 else f"/ {1.0 / scale:g}"
    return (
        Cell(_over_black(step.image), Caption(f"Depth {step.depth}", rays, *told)),
        Cell(_over_black(change.image), Caption(f"Depth {step.depth} minus depth {before.depth}", times)),
    )


def percent(share: float) -> str:
    """Return a share for people: one decimal, more where only they are not 0."""
    value = 100.0 * share
    decimals = 1 if value >= 0.1 or value == 0.0 else 1 - math.floor(math.log10(value))
    return f"{value:.{decimals}f} %"


def _over_black(image: Image) -> np.ndarray:
    return display(image.linear, exposure=image.exposure, tonemap=image.tonemap)
