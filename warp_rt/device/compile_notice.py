# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Says that kernels are being compiled: a wait that nothing else would explain."""

from __future__ import annotations

import contextlib
import logging
import threading
import time
from collections.abc import Callable, Iterator

_logger = logging.getLogger("warp_rt")
_NOTICE = "compiling kernels that are not in the cache yet (up to a minute; they are kept)..."
_SLOW = 0.7
"""Loading cached kernels takes a tenth of this [s]; whatever takes longer is being compiled."""
_PAUSE = 1.0
"""Files that are compiled within this time of one another [s] are one wait, which is told once."""
_last_end = -_PAUSE


@contextlib.contextmanager
def told_if_slow(on_slow: Callable[[], None] | None = None) -> Iterator[None]:
    """Log a line if the block takes so long that kernels are being compiled in it.

    The line is a warning, which goes to stderr in programs that have not said what becomes of their log. Blocks of
    several threads may not overlap.

    Args:
        on_slow: Called then too, from another thread.
    """
    global _last_end
    is_told = time.monotonic() - _last_end < _PAUSE
    has_been_slow = threading.Event()

    def tell() -> None:
        has_been_slow.set()
        if not is_told:
            _logger.warning(_NOTICE)
        if on_slow:
            on_slow()

    timer = threading.Timer(_SLOW, tell)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()
        if has_been_slow.is_set():
            _last_end = time.monotonic()
