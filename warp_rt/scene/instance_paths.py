# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Paths of instances, made when they are asked for: a million of them would take a hundred megabytes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import overload

import numpy as np


class _Lazy(Sequence[str]):
    """A sequence of strings that is equal to any other one of the same strings."""

    def _item(self, index: int) -> str:
        raise NotImplementedError

    @overload
    def __getitem__(self, index: int) -> str: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[str]: ...

    def __getitem__(self, index: int | slice) -> str | Sequence[str]:
        if isinstance(index, slice):
            return tuple(self._item(k) for k in range(*index.indices(len(self))))
        if not -len(self) <= index < len(self):
            raise IndexError(f"{index} of {len(self)}")
        return self._item(int(index) % len(self))

    def __iter__(self) -> Iterator[str]:
        return map(self._item, range(len(self)))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Sequence) or isinstance(other, str):
            return NotImplemented
        return len(self) == len(other) and all(a == b for a, b in zip(self, other, strict=True))

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<{len(self)} paths>"


class NumberedPaths(_Lazy):
    """``/Instancer[7]``: a path, and numbers.

    Args:
        path: Of the instancer.
        numbers: Positions in its arrays, shape [n].
    """

    def __init__(self, path: str, numbers: np.ndarray) -> None:
        self._path = path
        self._numbers = numbers.astype(np.int32)

    def __len__(self) -> int:
        return len(self._numbers)

    def _item(self, index: int) -> str:
        return f"{self._path}[{self._numbers[index]}]"


class NestedPaths(_Lazy):
    """Each of some paths with each of some endings: what instances are called that instances hold.

    Args:
        paths: Of the outer ones.
        endings: Of what each of them holds.
    """

    def __init__(self, paths: Sequence[str], endings: Sequence[str]) -> None:
        self._paths = paths
        self._endings = endings

    def __len__(self) -> int:
        return len(self._paths) * len(self._endings)

    def _item(self, index: int) -> str:
        path, ending = divmod(index, len(self._endings))
        return self._paths[path] + self._endings[ending]


class JoinedPaths(_Lazy):
    """Sequences of paths, one after the other.

    Args:
        parts: The sequences.
    """

    def __init__(self, parts: Iterable[Sequence[str]]) -> None:
        self._parts = [part for part in parts if len(part)]
        self._ends = np.cumsum([len(part) for part in self._parts], dtype=np.int64)

    def __len__(self) -> int:
        return int(self._ends[-1]) if self._parts else 0

    def _item(self, index: int) -> str:
        part = int(np.searchsorted(self._ends, index, "right"))
        return self._parts[part][index - int(self._ends[part])]

    def __iter__(self) -> Iterator[str]:
        for part in self._parts:
            yield from part
