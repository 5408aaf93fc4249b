# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Threads that share a list of jobs."""

import os
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable

import pytest

from warp_rt.device import workers
from warp_rt.device.workers import Workers, default_thread_count


@pytest.mark.parametrize("count", [1, 2, 5, None])
def test_each_item_is_done_once(count: int | None) -> None:
    done: list[int] = []
    Workers(count).map(lambda item, _: done.append(item), range(100))
    assert sorted(done) == list(range(100))
    assert default_thread_count() >= 1


def test_no_items_are_no_work() -> None:
    Workers(3).map(lambda item, _: pytest.fail("called"), [])


@pytest.mark.parametrize("count", [1, 4])
def test_jobs_may_bring_items(count: int) -> None:
    done: list[int] = []

    def halve(item: int, _: None) -> list[int] | None:
        done.append(item)
        return [item // 2, item - item // 2] if item > 1 else None

    Workers(count).map(halve, [37])
    assert done.count(1) == 37
    assert len(done) == 2 * 37 - 1


def test_scratch_belongs_to_one_thread_at_a_time() -> None:
    scratches: list[set] = []

    def make() -> set:
        scratches.append(set())
        return scratches[-1]

    def use(item: int, scratch: set) -> None:
        scratch.add(threading.get_ident())
        time.sleep(0.001)

    Workers(3).map(use, range(30), make)
    assert 1 <= len(scratches) <= 3
    assert all(len(threads) == 1 for threads in scratches)


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
@pytest.mark.parametrize("count", [1, 3])
def test_the_first_error_ends_the_work(error: type[BaseException], count: int) -> None:
    done: list[int] = []

    def job(item: int, _: None) -> None:
        if item == 5:
            raise error("five")
        done.append(item)
        time.sleep(0.001)

    with pytest.raises(error):
        Workers(count).map(job, range(1000))
    assert len(done) < 100


def test_idle_threads_are_used_again() -> None:
    Workers(4).map(lambda item, _: time.sleep(0.001), range(8))
    before = threading.active_count()
    for _ in range(50):
        Workers(4).map(lambda item, _: None, range(8))
    assert threading.active_count() == before


@pytest.mark.parametrize("count", [1, 2, 5])
def test_a_job_is_repeated_until_nothing_is_left(count: int) -> None:
    left = deque(range(200))
    done: list[tuple[int, int]] = []

    def take(thread: int) -> bool:
        try:
            done.append((left.pop(), thread))
        except IndexError:
            return False
        return True

    Workers(count).repeat(take)
    assert sorted(item for item, _ in done) == list(range(200))
    assert {thread for _, thread in done} <= set(range(count))


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
@pytest.mark.parametrize("raising", [0, 2])
def test_an_error_ends_what_is_repeated(error: type[BaseException], raising: int) -> None:
    calls = [0, 0, 0]

    def work(thread: int) -> bool:
        calls[thread] += 1
        time.sleep(0.001)
        if thread == raising and calls[thread] == 3:
            raise error("stop")
        return True

    with pytest.raises(error, match="stop"):
        Workers(3).repeat(work)
    assert calls[raising] == 3
    ended = list(calls)
    time.sleep(0.01)
    assert calls == ended


def test_no_thread_is_left_working_where_repeat_is_interrupted_as_it_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: deque[int] = deque()
    finish = workers._Order.finish
    interrupts = iter([KeyboardInterrupt()])

    def finish_when_not_interrupted(order: workers._Order, *is_done: Callable[[], bool]) -> None:
        for interrupt in interrupts:
            raise interrupt
        finish(order, *is_done)

    def work(thread: int) -> bool:
        calls.append(thread)
        time.sleep(0.001)
        return thread > 0

    monkeypatch.setattr(workers._Order, "finish", finish_when_not_interrupted)
    with pytest.raises(KeyboardInterrupt):
        Workers(3).repeat(work)
    _assert_no_more_come(calls)


def test_threads_that_are_about_to_end_are_not_waited_for() -> None:
    """They are used again all the same, for what comes when they have ended."""
    gate = threading.Event()
    has_begun = threading.Event()
    order: list[str] = []

    def work(thread: int) -> bool:
        if thread == 0:
            return not has_begun.wait(10)
        has_begun.set()
        gate.wait(10)
        order.append("first")
        return False

    Workers(2).repeat(work, is_done=lambda: True)
    assert order == []
    before = threading.active_count()
    threading.Timer(0.01, gate.set).start()

    def work_later(thread: int) -> bool:
        if thread == 0:
            return not gate.wait(10) or len(order) < 2
        order.append("second")
        return False

    Workers(2).repeat(work_later)
    assert order == ["first", "second"]
    assert threading.active_count() <= before


@pytest.mark.parametrize("call", ["map", "repeat"])
def test_no_thread_is_left_working_where_no_further_one_can_be_had(call: str, monkeypatch: pytest.MonkeyPatch) -> None:
    calls: deque[int] = deque()
    start = workers._start

    def start_one(work: Callable[[], None]) -> workers._Order:
        monkeypatch.setattr(workers, "_start", refuse)
        order = start(work)
        while not calls:
            time.sleep(0.001)
        return order

    def refuse(_: object) -> workers._Order:
        raise RuntimeError("can't start new thread")

    def work(number: int, _: object = None) -> bool:
        calls.append(number)
        time.sleep(0.001)
        return True

    monkeypatch.setattr(workers, "_start", start_one)
    run = {
        "map": lambda: Workers(4).map(lambda item, _: [item] * work(item), range(4)),
        "repeat": lambda: Workers(4).repeat(work),
    }
    with pytest.raises(RuntimeError, match="can't start new thread"):
        run[call]()
    _assert_no_more_come(calls)


def test_an_order_is_called_off_as_often_as_one_likes() -> None:
    """Who was interrupted while he called off some calls them off again."""
    gate = threading.Event()
    busy = workers._start(lambda: bool(gate.wait()))
    late = workers._Order(lambda: pytest.fail("called"), busy._helper)
    busy._helper.orders.put(late)
    late.finish()
    gate.set()
    assert late.wait(10)
    late.finish()
    busy.finish()


def _assert_no_more_come(calls: deque) -> None:
    count = len(calls)
    time.sleep(0.05)
    assert count == len(calls) > 0


def test_threads_of_many_short_calls_are_few() -> None:
    """A helper whose order was called off, for nothing was left to do when it woke up, serves the next call."""
    before = threading.active_count()
    for _ in range(300):
        Workers(3).repeat(lambda thread: False)
    assert threading.active_count() <= before + 2


def test_jobs_may_share_their_work_as_well() -> None:
    done: list[int] = []
    Workers(3).map(lambda item, _: Workers(2).map(lambda inner, _: done.append(10 * item + inner), range(10)), range(6))
    assert sorted(done) == list(range(60))


def test_calls_of_several_threads_end_each_by_itself() -> None:
    done: list[list[int]] = [[] for _ in range(4)]

    def call(caller: int) -> None:
        for _ in range(20):
            Workers(3).map(lambda item, _: done[caller].append(item), range(5))

    callers = [threading.Thread(target=call, args=(caller,)) for caller in range(4)]
    for thread in callers:
        thread.start()
    for thread in callers:
        thread.join()
    assert [sorted(items) for items in done] == [sorted(list(range(5)) * 20)] * 4


@pytest.mark.parametrize("count", [1, 2])
def test_who_watches_is_asked_until_the_work_is_done(count: int) -> None:
    seen: list[int] = []
    done: list[int] = []

    def job(item: int, _: None) -> None:
        time.sleep(0.12)
        done.append(item)

    Workers(count).map(job, range(2), watch=lambda: seen.append(0))
    assert sorted(done) == [0, 1]
    assert len(seen) >= 2


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system cannot fork")
def test_a_forked_child_has_threads_of_its_own() -> None:
    """In a process with no other threads than these: some of a test run's may hold locks."""
    code = """
import os
from warp_rt.device.workers import Workers
done = []
Workers(3).map(lambda item, _: done.append(item), range(30))
child = os.fork()
Workers(3).map(lambda item, _: done.append(item), range(30))
if child == 0:
    os._exit(7 if len(done) == 60 else 1)
assert len(done) == 60 and os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7
"""
    subprocess.run([sys.executable, "-W", "ignore", "-c", code], check=True, timeout=60)
