# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The table of a ray tree: what it holds, and when people get to see it."""

import sys

import pytest

from warp_rt.cli.ray_table import ray_table, tell_rays
from warp_rt.cli.terminal import Terminal

KINDS = ("reflection", "refraction", "shadow", "dropped_by_threshold", "dropped_by_depth")


def counts(*levels, primary=1200, total_internal_reflection=0, passed=0):
    """Return the object ``rays`` of ``--json``; a level is its counts in the order of ``KINDS``."""
    per_depth = [{"depth": depth, **dict(zip(KINDS, level, strict=True))} for depth, level in enumerate(levels, 1)]
    totals = {kind: sum(level[kind] for level in per_depth) for kind in KINDS}
    events = {"total_internal_reflection": total_internal_reflection, "passed": passed}
    return {"primary": primary, **totals, **events, "per_depth": per_depth}


def test_rows_are_depths_and_columns_kinds():
    table = ray_table(counts((0, 0, 2400, 5, 0), (300, 1100, 7, 0, 60), total_internal_reflection=1, passed=20))
    assert table.splitlines() == [
        "                                                 saved by  saved by",
        "depth  primary  reflection  refraction  shadow  threshold     depth",
        "    1    1,200           -           -   2,400          5         -",
        "    2        -         300       1,100       7          -        60",
        "  all    1,200         300       1,100   2,407          5        60",
        "1 total internal reflection, 20 straight pass-throughs",
    ]


@pytest.mark.parametrize(
    ("verbosity", "is_watched", "level", "is_shown"),
    [
        (0, True, (0, 0, 9, 0, 0), False),  # a single level says no more than the line above it
        (0, True, (0, 0, 9, 0, 4), True),
        (0, False, (1, 1, 1, 1, 1), False),
        (1, False, (0, 0, 9, 0, 0), True),
        (-1, True, (1, 1, 1, 1, 1), False),
    ],
)
def test_when_it_is_shown(monkeypatch, capsys, verbosity, is_watched, level, is_shown):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: is_watched)
    tell_rays(Terminal("warp-rt render", verbosity=verbosity), counts(level))
    out, err = capsys.readouterr()
    assert out == ""
    assert ("refraction" in err) == is_shown
