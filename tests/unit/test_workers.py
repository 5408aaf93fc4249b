# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Threads that share a list of jobs."""

import threading
import time

import pytest

from warp_rt.workers import Workers, default_thread_count


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
