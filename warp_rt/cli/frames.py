# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Frame specifications and numbered file names, as usdrecord has them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

from warp_rt.errors import OptionError

MAX_FRAMES = 1_000_000
_MAX_FRAME = 2**53  # where doubles, which time codes are, leave out whole numbers

_NUMBER = r"[+-]?(?:\d{1,300}\.?\d{0,300}|\.\d{1,300})"
_SPEC = re.compile(rf"({_NUMBER})(?::({_NUMBER})(?:x({_NUMBER}))?)?")
_PLACEHOLDER = re.compile(r"(#+)(?:\.(#+))?")


def parse_frames(spec: str) -> tuple[Fraction, ...]:
    """Return the time codes of a list of frame specifications, in order and exact.

    ``123`` is one frame, ``101:105`` and ``105:101`` are ranges with both ends, ``101:109x2`` and
    ``101:104x0.5`` have a stride. Commas or blanks separate the specifications; a frame named twice is kept once.

    Raises:
        OptionError: A specification cannot be read, its stride leads away from its end, or there are too many; or a
            frame is so large that a time code cannot tell it from the next.
    """
    frames: dict[Fraction, None] = {}
    for part in spec.replace(",", " ").split():
        match = _SPEC.fullmatch(part)
        if match is None:
            raise OptionError(f"frames: {part!r} is written like none of 123, 101:105, 105:101, 101:109x2, 101:104x0.5")
        start = Fraction(match[1])
        end = Fraction(match[2] or match[1])
        if max(abs(start), abs(end)) > _MAX_FRAME:
            raise OptionError(f"frames: {part!r} is outside -{_MAX_FRAME}..{_MAX_FRAME}")
        stride = Fraction(match[3]) if match[3] else Fraction(1 if end >= start else -1)
        if stride == 0 or (end - start) / stride < 0:
            raise OptionError(f"frames: {part!r}: a stride of {match[3]} does not lead from {match[1]} to {match[2]}")
        count = (end - start) // stride + 1
        if len(frames) + count > MAX_FRAMES:
            raise OptionError(f"frames: {part!r}: more than {MAX_FRAMES} frames")
        frames.update((start + step * stride, None) for step in range(count))
    if not frames:
        raise OptionError("frames: a list of frames is expected, such as 1:24")
    return tuple(frames)


def parse_frame(spec: str | None) -> float | None:
    """Return the time code of a command that makes one frame; None where none is asked for.

    Raises:
        OptionError: The specification cannot be read, or names several.
    """
    if spec is None:
        return None
    frames = parse_frames(spec)
    if len(frames) > 1:
        raise OptionError(f"frames: one frame expected, got {len(frames)}")
    return float(frames[0])


def has_placeholder(path: Path) -> bool:
    """Return whether a file name holds a place for a frame number."""
    return "#" in path.name


def placeholder(frames: Sequence[Fraction]) -> str:
    """Return a placeholder that tells frames apart: ``####``, with as many decimals as they need."""
    decimals = 0
    while any((frame * 10**decimals).denominator != 1 for frame in frames):  # all are decimal numbers
        decimals += 1
    return "####" + ("." + "#" * decimals if decimals else "")


def numbered_files(path: Path, frames: tuple[Fraction, ...]) -> tuple[Path, ...]:
    """Return the file of each frame: its number in place of ``###`` or ``###.##``.

    The placeholder's whole length is the least width, filled with zeros; the part after its point is the number of
    decimals. One single frame needs no placeholder.

    Raises:
        OptionError: There is no placeholder or more than one, or its decimals cannot tell the frames apart.
    """
    places = _PLACEHOLDER.findall(path.name)
    if not places and len(frames) == 1:
        return (path,)
    if len(places) != 1:
        raise OptionError(f"{path}: with frames, the file name needs exactly one placeholder, such as name.####.png")
    decimals = len(places[0][1])
    width = len(places[0][0]) + (decimals + 1 if decimals else 0)
    for frame in frames:
        if (frame * 10**decimals).denominator != 1:
            raise OptionError(
                f"{path}: frame {float(frame):g} needs more decimals than the placeholder has, such as ####.###"
            )
    return tuple(
        path.with_name(_PLACEHOLDER.sub(f"{float(frame):0{width}.{decimals}f}", path.name)) for frame in frames
    )
