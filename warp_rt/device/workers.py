# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""CPU threads that share a list of jobs; a kernel launch releases the GIL, so Python threads do run side by side."""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable, Iterable
from functools import partial
from queue import SimpleQueue
from typing import Any, TypeVar

Item = TypeVar("Item")

WATCH_SECONDS = 0.05  # how soon an interrupt or a time limit is noticed


def default_thread_count() -> int:
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return max(1, len(os.sched_getaffinity(0)))
    return max(1, os.cpu_count() or 1)


class Workers:
    """A number of threads, the calling one among them.

    Further threads are started when first needed and then wait for the next to do.
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
        helpers: list[_Order] = []
        try:
            for _ in range(others):
                helpers.append(_start(queue.work))
            if watch is None:
                queue.work()
            else:
                for helper in helpers:
                    while not helper.wait(WATCH_SECONDS):
                        watch()
                watch()
        finally:
            if queue.stop_if_unfinished() and on_stop is not None:
                on_stop()
            _finish(helpers)
        queue.raise_error()

    def repeat(self, job: Callable[[int], bool], is_done: Callable[[], bool] = lambda: False) -> None:
        """Have each thread k call ``job(k)`` until that returns False, and return when all have.

        What ``map`` does where the job itself knows what is left, in a third of the time.

        Args:
            job: What there is to do.
            is_done: Asked when the calling thread's own calls have ended. Where it returns True the others are not
                waited for: they have nothing left to do but to end.

        Raises:
            BaseException: Whatever a job raised first, KeyboardInterrupt included; the other threads end with their
                present call, which is waited for.
        """
        turns = _Turns(job)
        helpers: list[_Order] = []
        try:
            for k in range(1, self.count):
                helpers.append(_start(partial(turns.take, k)))
            turns.take(0)
            _finish(helpers, is_done)
        except BaseException as caught:  # an interrupt outside the job, or no further thread to be had
            turns.error = turns.error or caught
            _finish(helpers)
        if turns.error is not None:
            raise turns.error


class _Turns:
    """Calls of one ``repeat``."""

    def __init__(self, job: Callable[[int], bool]) -> None:
        self._job = job
        self.error: BaseException | None = None

    def take(self, thread: int) -> None:
        """Call the job until it has nothing left to do."""
        try:
            while self.error is None and self._job(thread):
                pass
        except BaseException as caught:  # handed to the thread that called repeat, interrupts included
            self.error = self.error or caught


class _Queue:
    """Items to do, shared by the threads of one ``map``."""

    def __init__(self, job: Callable, items: Iterable, make_scratch: Callable | None) -> None:
        self._job = job
        self._items = deque(items)
        self._make_scratch = make_scratch
        self._changed = threading.Condition(threading.Lock())
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


class _Order:
    """Something that a helper is to do."""

    def __init__(self, work: Callable[[], None], helper: _Helper) -> None:
        self._work = work
        self._helper = helper
        self._is_taken = threading.Lock()  # by the helper that begins it, or by who calls it off
        self._is_returned = threading.Lock()  # the helper, to the idle ones
        self._is_done = False
        self._gate = threading.Lock()
        self._gate.acquire()

    def carry_out(self) -> None:
        """Do it, which raises nothing, unless it has been called off, and wake up who waits for it."""
        if self._is_taken.acquire(blocking=False):
            self._work()
            self._return_helper()
        self._is_done = True  # where it was called off, too: who was interrupted in that may ask again
        self._gate.release()

    def wait(self, seconds: float = -1) -> bool:
        """Wait until it is done, or some seconds; return if it is. An interrupt may come at any time."""
        return self._is_done or self._gate.acquire(timeout=seconds)

    def finish(self, is_done: Callable[[], bool] = lambda: False) -> None:
        """Wait until it is done, or call it off if it has not begun, for nothing is left to do. May be repeated.

        Args:
            is_done: Where this returns True it is about to end, and is not waited for.
        """
        if self._is_taken.acquire(blocking=False) or is_done():
            self._return_helper()
        else:
            self.wait()

    def _return_helper(self) -> None:
        """Let others have the helper; what they order begins when it is done with this."""
        if self._is_returned.acquire(blocking=False):
            _idle.append(self._helper)


class _Helper(threading.Thread):
    """A thread that carries out orders for as long as the process lives.

    To give one to it and to learn that it is done takes 8 microseconds; a pool of concurrent.futures takes 80.
    """

    def __init__(self) -> None:
        super().__init__(name="warp_rt", daemon=True)
        self.orders: SimpleQueue[_Order] = SimpleQueue()

    def run(self) -> None:
        """Carry out one order after the other."""
        while True:
            order = self.orders.get()
            order.carry_out()
            del order  # nothing of it lives on with the helper


_idle: deque[_Helper] = deque()  # an end is taken or put back by one step of the interpreter: it needs no lock


def _start(work: Callable[[], None]) -> _Order:
    """Make another thread do some work."""
    try:
        helper = _idle.pop()
    except IndexError:
        helper = _Helper()
        helper.start()
    order = _Order(work, helper)
    helper.orders.put(order)
    return order


def _finish(orders: Iterable[_Order], is_done: Callable[[], bool] = lambda: False) -> None:
    """Wait for what has begun, unless it is about to end, and call off the rest."""
    for order in orders:
        order.finish(is_done)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_idle.clear)  # threads do not survive a fork
