# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""CPU threads that share a list of jobs; a kernel launch releases the GIL, so Python threads do run side by side."""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from typing import Any, TypeVar

Item = TypeVar("Item")

MAX_THREADS = 4096
WATCH_SECONDS = 0.05  # how soon an interrupt or a time limit is noticed

_executor: ThreadPoolExecutor | None = None
_lock = threading.Lock()


def default_thread_count() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return max(1, len(os.sched_getaffinity(0)))
    return max(1, os.cpu_count() or 1)


class Workers:
    """A number of threads, the calling one among them.

    Further threads come from one pool of the process; it starts them when first needed and keeps them.
    """

    def __init__(self, count: int | None = None) -> None:
        """Args: count: Threads; None: one a core."""
        self.count = default_thread_count() if count is None else count

    def map(
        self,
        job: Callable[[Item, Any], Iterable[Item] | None],
        items: Iterable[Item],
        make_scratch: Callable[[], Any] | None = None,
        *,
        watch: Callable[[], None] | None = None,
        on_stop: Callable[[], None] | None = None,
    ) -> None:
        """Call ``job(item, scratch)`` for each item, first come, first served, and return when all are done.

        Args:
            job: Does one item. It may return further items, which join the end of the queue.
            items: What there is to do.
            make_scratch: Called once in each thread that takes part; its result goes to that thread's jobs, which
                therefore own it while they run. None: jobs get None.
            watch: Called by the calling thread, many times a second, while others do the work: then this thread can be
                interrupted at any time. What it raises ends the work. None: the calling thread works too.
            on_stop: Called where the work is given up, before the jobs that have begun are waited for.

        Raises:
            BaseException: Whatever a job or ``watch`` raised first, KeyboardInterrupt included; items that no thread
                has begun are then left undone.
        """
        queue = _Queue(job, items, make_scratch)
        others = self.count if watch is not None else self.count - 1
        helpers = {_pool().submit(queue.work) for _ in range(others)}
        try:
            if watch is None:
                queue.work()
            else:
                pending = helpers
                while pending:
                    pending = wait(pending, timeout=WATCH_SECONDS, return_when=FIRST_COMPLETED).not_done
                    watch()
        finally:
            if queue.stop_if_unfinished() and on_stop is not None:
                on_stop()
            wait(helpers)
        queue.raise_error()


class _Queue:
    """Items to do, shared by the threads of one ``map``."""

    def __init__(self, job: Callable, items: Iterable, make_scratch: Callable | None) -> None:
        self._job = job
        self._items = deque(items)
        self._make_scratch = make_scratch
        self._changed = threading.Condition()
        self._active = 0
        self._error: BaseException | None = None

    def work(self) -> None:
        """Take items until there are none and no thread is left that could bring more."""
        scratch = None
        is_first = True
        while True:
            with self._changed:
                while not self._items and self._active and self._error is None:
                    self._changed.wait()
                if self._error is not None or not self._items:
                    return
                item = self._items.popleft()
                self._active += 1
            more: Iterable | None = None
            error: BaseException | None = None
            try:
                if is_first and self._make_scratch is not None:
                    scratch = self._make_scratch()
                is_first = False
                more = self._job(item, scratch)
            except BaseException as caught:  # handed to the thread that called map, interrupts included
                error = caught
            with self._changed:
                self._active -= 1
                self._items.extend(more or ())
                self._error = self._error or error
                self._changed.notify_all()

    def stop_if_unfinished(self) -> bool:
        """Make other threads stop after their present item, where this one was interrupted; return if they had to."""
        with self._changed:
            is_unfinished = bool(self._items or self._active)
            if is_unfinished:
                self._error = self._error or KeyboardInterrupt()
                self._changed.notify_all()
            return is_unfinished

    def raise_error(self) -> None:
        """Raise what a job raised first, if any did."""
        if self._error is not None:
            raise self._error


def _pool() -> ThreadPoolExecutor:
    global _executor
    with _lock:
        if _executor is None:
            _executor = ThreadPoolExecutor(MAX_THREADS, thread_name_prefix="warp_rt")
        return _executor


def _forget_pool() -> None:
    """Drop the pool in a forked child: threads do not survive a fork."""
    global _executor, _lock
    _executor = None
    _lock = threading.Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_pool)
