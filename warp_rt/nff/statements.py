# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The statements of a file in Haines' Neutral File Format, read word by word.

A file is a sequence of statements: a word that says what comes, and numbers. Where lines end does not matter, but for
comments, which go from ``#`` to the end of their line.

Reference: Haines (1988), Neutral File Format, in the Standard Procedural Databases.
"""

from __future__ import annotations

import gzip
import math
import os
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from warp_rt.errors import LimitError, SceneError

SUFFIXES = (".nff", ".nff.gz")

Vector = tuple[float, ...]

_MAX_BYTES = 1 << 30  # of a file, unpacked
_MAX_NUMBER = 1e12  # as for coordinates of USD stages
_MAX_RESOLUTION = 1 << 16
_VIEW_PARTS = ("from", "at", "up", "angle", "hither", "resolution")


@dataclass(frozen=True)
class View:
    """``v``: where the eye is and what it sees."""

    origin: Vector
    at: Vector
    up: Vector
    angle: float
    """From the middle of the first row of pixels to the middle of the last, and so for columns [degree]."""
    resolution: tuple[int, int]
    """Width and height [pixel]."""


@dataclass(frozen=True)
class LightStatement:
    """``l``: a point light."""

    position: Vector
    color: Vector | None
    """None: of no particular colour and strength."""


@dataclass(frozen=True)
class Fill:
    """``f``: colour and shading parameters of what follows."""

    color: Vector
    kd: float
    ks: float
    shine: float
    """Phong's exponent."""
    transmittance: float
    index: float
    """Of refraction."""


@dataclass
class Primitives:
    """All geometry of one fill, in the order of the file."""

    spheres: list[Vector] = field(default_factory=list)
    """Centre and radius; a negative radius: seen from inside."""
    cones: list[Vector] = field(default_factory=list)
    """Base, its radius, apex, its radius: a frustum without end caps; negative radii: seen from inside."""
    polygons: list[list[Vector]] = field(default_factory=list)
    """Corners, counter-clockwise as one faces the polygon."""
    patches: list[list[Vector]] = field(default_factory=list)
    """Corners, each a point and a normal."""


@dataclass
class NffFile:
    """What a file says."""

    path: str
    view: View | None = None
    background: Vector | None = None
    lights: list[LightStatement] = field(default_factory=list)
    primitives: dict[Fill, Primitives] = field(default_factory=dict)


def is_nff(path: str | os.PathLike[str]) -> bool:
    """Return whether a file is named as one in the Neutral File Format."""
    return os.fspath(path).lower().endswith(SUFFIXES)


def read_nff(path: str | os.PathLike[str]) -> NffFile:
    """Return what a file says, plain or compressed by gzip.

    Raises:
        SceneError: The file cannot be read, or breaks the format; the text names file and line.
        LimitError: It is larger than can be meant.
    """
    name = os.fspath(path)
    reader = _Reader(name, _text(name))
    reader.read()
    return reader.result


def _text(name: str) -> str:
    try:
        if name.lower().endswith(".gz"):
            with gzip.open(name) as file:
                data = file.read(_MAX_BYTES + 1)
        else:
            with Path(name).open("rb") as file:
                data = file.read(_MAX_BYTES + 1)
    except (OSError, EOFError, zlib.error) as error:
        reason = getattr(error, "strerror", None) or error
        raise SceneError(f"{name}: cannot be read: {reason}") from None
    if len(data) > _MAX_BYTES:
        raise LimitError(f"{name}: more than {_MAX_BYTES >> 20} MiB of text")
    return data.decode("ascii", errors="replace")


class _Reader:
    """Reads statements one after the other into ``result``."""

    def __init__(self, name: str, text: str) -> None:
        self.result = NffFile(name)
        self._words = _words(text)
        self._fill: Primitives | None = None
        self._line = 1
        self._next = ""
        self._next_line = 1
        self._step()

    def read(self) -> None:
        statements: dict[str, Callable[[], None]] = {
            "v": self._view,
            "b": self._background,
            "l": self._light,
            "f": self._fill_statement,
            "s": self._sphere,
            "c": self._cone,
            "p": self._polygon,
            "pp": self._patch,
        }
        while self._next:
            word = self._word()
            if word not in statements:
                raise self._error(f"{word[:40]!r} is no statement; there are {', '.join(statements)}")
            statements[word]()

    def _view(self) -> None:
        if self.result.view is not None:
            raise self._error("v: a second viewpoint")
        start = self._line
        parts: dict[str, Vector] = {}
        while self._next in _VIEW_PARTS:
            name = self._word()
            if name in parts:
                raise self._error(f"v: a second {name!r}")
            parts[name] = self._numbers(f"v: {name}", {"angle": 1, "hither": 1, "resolution": 2}.get(name, 3))
        missing = [name for name in _VIEW_PARTS if name not in parts and name != "hither"]
        self._line = start
        if missing:
            raise self._error(f"v: {', '.join(missing)} missing")
        angle, (width, height) = parts["angle"][0], parts["resolution"]
        if not 0 < angle < 180:
            raise self._error(f"v: angle {angle:g} is outside 0..180")
        if not all(1 <= side <= _MAX_RESOLUTION and side == int(side) for side in (width, height)):
            raise self._error(f"v: resolution {width:g} {height:g}: whole numbers from 1 to {_MAX_RESOLUTION} expected")
        view = View(parts["from"], parts["at"], parts["up"], angle, (int(width), int(height)))
        toward = [a - b for a, b in zip(view.at, view.origin, strict=True)]
        if not any(_cross(toward, view.up)):
            raise self._error("v: from, at and up do not span a picture")
        self.result.view = view

    def _background(self) -> None:
        if self.result.background is not None:
            raise self._error("b: a second background")
        self.result.background = self._numbers("b", 3)

    def _light(self) -> None:
        position = self._numbers("l", 3)
        color = self._numbers("l: colour", 3) if _is_number(self._next) else None
        self.result.lights.append(LightStatement(position, color))

    def _fill_statement(self) -> None:
        red, green, blue, *rest = self._numbers("f", 8)
        fill = Fill((red, green, blue), *rest)
        if min(red, green, blue, *rest) < 0:
            raise self._error("f: a number is negative")
        if fill.transmittance > 0 and fill.index == 0:
            raise self._error("f: what transmits light needs an index of refraction above 0")
        self._fill = self.result.primitives.setdefault(fill, Primitives())

    def _sphere(self) -> None:
        self._filled().spheres.append(self._numbers("s", 4))

    def _cone(self) -> None:
        cone = self._numbers("c", 8)
        if cone[3] * cone[7] < 0:
            raise self._error("c: one radius is negative, the other is not")
        self._filled().cones.append(cone)

    def _polygon(self) -> None:
        self._filled().polygons.append(self._corners("p", 3))

    def _patch(self) -> None:
        self._filled().patches.append(self._corners("pp", 6))

    def _corners(self, what: str, size: int) -> list[Vector]:
        count = self._numbers(what, 1)[0]
        if count != int(count) or count < 0:
            raise self._error(f"{what}: a number of corners expected, got {count:g}")
        return [self._numbers(what, size) for _ in range(int(count))]

    def _filled(self) -> Primitives:
        if self._fill is None:
            raise self._error("geometry before the first f, which colours it")
        return self._fill

    def _numbers(self, what: str, count: int) -> Vector:
        return tuple(self._number(what) for _ in range(count))

    def _number(self, what: str) -> float:
        if not self._next:
            raise self._error(f"{what}: the file ends where a number is expected")
        word = self._word()
        if not _is_number(word):
            raise self._error(f"{what}: a number expected, got {word[:40]!r}")
        number = float(word)
        if not abs(number) <= _MAX_NUMBER:
            raise self._error(f"{what}: {word[:40]} is not within {_MAX_NUMBER:g}")
        return number

    def _word(self) -> str:
        word, self._line = self._next, self._next_line
        self._step()
        return word

    def _step(self) -> None:
        self._next, self._next_line = next(self._words, ("", self._next_line))

    def _error(self, message: str) -> SceneError:
        return SceneError(f"{self.result.path}:{self._line}: {message}")


def _words(text: str) -> Iterator[tuple[str, int]]:
    """Yield each word outside of comments, and its line, counted from 1."""
    for number, line in enumerate(text.splitlines(), start=1):
        for word in line.partition("#")[0].split():
            yield word, number


def _is_number(word: str) -> bool:
    try:
        return not math.isnan(float(word))
    except ValueError:
        return False


def _cross(a: list[float], b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
