# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Diagnostics: everything about a scene that was ignored, repaired or replaced, as coded records with prim paths."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

# Code families. One code is one rule; docs/diagnostics.md lists them all.
#   W1xx geometry repaired or dropped     W2xx assets and textures     W3xx materials
#   W4xx lights and cameras               W5xx stage and settings      N9xx notes: defaults that stepped in


@dataclass(frozen=True)
class Diagnostic:
    """One thing that the picture does not show as the stage says it."""

    code: str
    """Rule, such as ``W102``; codes that begin with N are notes, which ``--strict`` lets pass."""
    prim: str
    """Path of the prim, or the file path where no prim is to blame."""
    message: str
    """What was done about it, one line without the prim path."""

    @property
    def is_warning(self) -> bool:
        """Whether ``--strict`` turns it into an error."""
        return self.code.startswith("W")

    def __str__(self) -> str:
        return f"{self.code} {self.prim}: {self.message}"


class Report:
    """Collects diagnostics while a scene is read; the same record is kept once."""

    def __init__(self) -> None:
        self._records: dict[Diagnostic, None] = {}

    def warn(self, code: str, prim: object, message: str) -> None:
        """Record ``message`` about ``prim`` (anything whose ``str`` is its path) under ``code``."""
        self._records.setdefault(Diagnostic(code, str(prim), message))

    def __iter__(self) -> Iterator[Diagnostic]:
        return iter(self._records)

    def __len__(self) -> int:
        return len(self._records)


GROUP_LIMIT = 20
"""More diagnostics of one code than this are cut short where people read them."""
_SHOWN_OF_GROUP = 3


def abridged(records: Iterable[Diagnostic]) -> Iterator[tuple[Diagnostic, int]]:
    """Yield the diagnostics that are worth a line, each with 0; after the first ones of a long group its next, with the
    number of those that are left. Notes that say the same of several prims are one, in the place of the first."""
    records = tuple(_folded(tuple(records)))
    counts = Counter(record.code for record in records)
    shown: Counter[str] = Counter()
    for record in records:
        shown[record.code] += 1
        if counts[record.code] <= GROUP_LIMIT or shown[record.code] <= _SHOWN_OF_GROUP:
            yield record, 0
        elif shown[record.code] == _SHOWN_OF_GROUP + 1:
            yield record, counts[record.code] - _SHOWN_OF_GROUP


def _folded(records: tuple[Diagnostic, ...]) -> Iterator[Diagnostic]:
    alike = Counter((record.code, record.message) for record in records if not record.is_warning)
    told = set()
    for record in records:
        words = (record.code, record.message)
        if alike[words] > 1:
            if words not in told:
                told.add(words)
                yield replace(record, message=f"{record.message} (and {alike[words] - 1} more of these words)")
        else:
            yield record


def counted(count: int, noun: str) -> str:
    """Return a number with its noun, which takes an s but for one."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


def first_of(names: Sequence[str], noun: str = "prim") -> str:
    """Return the first name, and how many more there are."""
    return f"{names[0]} and {counted(len(names) - 1, f'more {noun}')}" if len(names) > 1 else names[0]


def one_line(message: object) -> str:
    """Return a message as one line: control characters, which file and prim names may hold, become escapes."""
    text = str(message)
    return "".join(char if char.isprintable() else repr(char)[1:-1] for char in text)
