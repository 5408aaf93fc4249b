# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Timing in turns: every contender once, then every contender again, in another order."""

from __future__ import annotations

import gc
import random
import statistics
import time
from collections.abc import Callable, Mapping
from typing import Any


def time_in_turns(
    functions: Mapping[str, Callable[[], Any]], rounds: int, clock: Callable[[], float] = time.perf_counter
) -> tuple[dict[str, list[float]], dict[str, Any]]:
    """Run each function ``rounds`` times, in turns, after one turn that warms caches up and is not counted.

    Each round has an order of its own, the same in every run, so that nobody always follows the same neighbour: one
    that gives its memory back to the system leaves page faults to the next, which were two fifths of a build's time.

    Args:
        functions: By the contender's name.
        rounds: Turns that count.
        clock: Seconds: of the wall by default, ``time.process_time`` for those of all threads together.

    Returns:
        Seconds of each turn and the last result, by name.
    """
    results = {name: function() for name, function in functions.items()}
    seconds: dict[str, list[float]] = {name: [] for name in functions}
    gc.collect()
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        for turn in range(rounds):
            for name in random.Random(turn).sample(list(functions), len(functions)):
                function = functions[name]
                results[name] = None  # what is about to be made anew is freed outside of the time
                start = clock()
                results[name] = function()
                seconds[name].append(clock() - start)
    finally:
        if was_enabled:
            gc.enable()
    return seconds, results


def significant(values: list[float]) -> list[float]:
    """Return numbers with the digits that a timing has."""
    return [float(f"{value:.4g}") for value in values]


def spread(values: list[float]) -> str:
    """Return the median of seconds and how far they lie apart, as text."""
    return f"{statistics.median(values):.4g} s ({min(values):.4g} to {max(values):.4g})"
