# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The same query asked by several processes at once: as much as a machine's cores can do that share nothing but memory.

No number of threads can be expected to do better, so that this tells how far the machine itself is from doubling.
"""

from __future__ import annotations

import gc
import os
from collections.abc import Callable
from typing import Any

from .ray_sets import Rays

Query = Callable[[Rays], Any]


class SideBySide:
    """A query as a function that is done when this process and all others have their results.

    The others are copies of this process, made when it is first called with some rays, and end when it is called with
    others or not any more.
    """

    def __init__(self, query: Query, count: int) -> None:
        """Args: query: By one thread. count: Processes, this one included."""
        self._query = query
        self._count = count
        self._rays: Rays | None = None
        self._others: list[_Other] = []

    def __call__(self, rays: Rays) -> Any:
        """Return the result of this process."""
        if rays is not self._rays:
            for other in self._others:
                other.end()
            self._rays = rays
            self._others = [_Other(self._query, rays) for _ in range(self._count - 1)]
        for other in self._others:
            other.begin()
        result = self._query(rays)
        for other in self._others:
            other.wait()
        return result


class _Other:
    """A copy of this process that asks a query as often as it is told to."""

    def __init__(self, query: Query, rays: Rays) -> None:
        orders, self._orders = os.pipe()
        self._reports, reports = os.pipe()
        self._process = os.fork()
        if self._process == 0:
            os.close(self._orders)
            gc.disable()
            try:
                query(rays)
                while os.read(orders, 1) == b".":
                    query(rays)
                    os.write(reports, b".")
            finally:
                os._exit(0)
        os.close(orders)
        os.close(reports)

    def begin(self) -> None:
        """Have it ask once."""
        os.write(self._orders, b".")

    def wait(self) -> None:
        """Wait until it has its result."""
        os.read(self._reports, 1)

    def end(self) -> None:
        """Have it end."""
        os.write(self._orders, b"!")  # closing it says nothing, for later copies of this process have it open, too
        os.waitpid(self._process, 0)
        os.close(self._orders)
        os.close(self._reports)
