# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Every stage of the corpora renders, or ends with one clear line and the right exit code."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from ..data import find_test_data
from .corpora import CRASH, REFUSED, RENDERED, TRACEBACK, WRONG, judge, run_corpora, summary


@pytest.mark.heavy
@pytest.mark.timeout(3600)
def test_corpora(tmp_path: Path) -> None:
    corpora = find_test_data("corpora")
    if corpora is None:
        pytest.skip("the corpora are not at hand: set WARP_RT_TEST_DATA to the folder that holds corpora/")
    results = run_corpora(corpora, tmp_path, jobs=os.cpu_count() or 1)
    print(summary(results))
    assert [(r.stage, r.outcome, r.message) for r in results if r.is_bad] == []


FAILED = '{"error": {"code": 3, "message": "a/b.usda: cannot be read"}}'


@pytest.mark.parametrize(
    ("code", "stdout", "stderr", "has_picture", "outcome"),
    [
        (0, "{}", "", True, RENDERED),
        (0, "{}", "", False, WRONG),
        (0, "hello", "", True, WRONG),
        (3, FAILED, "warp-rt render: error: a/b.usda: cannot be read", False, REFUSED),
        (3, FAILED, "warp-rt render: error: something is wrong", False, WRONG),
        (3, FAILED, "warp-rt render: error: a/b.usda: cannot be read", True, WRONG),
        (3, "", "warp-rt render: error: a/b.usda: cannot be read", False, WRONG),
        (5, FAILED, "warp-rt render: error: a/b.usda: cannot be read", False, WRONG),
        (1, "", "warp-rt render: error: b.usda: internal error", False, WRONG),
        (1, "", "Traceback (most recent call last):\n  ...\nKeyError: 1", False, TRACEBACK),
        (-11, "", "", False, CRASH),
    ],
)
def test_judge(code: int, stdout: str, stderr: str, has_picture: bool, outcome: str) -> None:
    run = subprocess.CompletedProcess([], code, stdout, stderr)
    assert judge(run, "a/b.usda", has_picture, True)[0] == outcome


def test_judge_expects_an_error_where_usd_cannot_open_the_stage() -> None:
    assert judge(subprocess.CompletedProcess([], 0, "{}", ""), "a/b.usda", True, False)[0] == WRONG
