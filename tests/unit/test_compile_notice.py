# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Whoever waits for the compiler is told so, once a wait, in programs that have not set up a log too."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from warp_rt.device import compile_notice
from warp_rt.device.compile_notice import told_if_slow


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """A clock that stands still until it is set, and a wait that is long after a hundredth of a second."""
    now = [1000.0]
    monkeypatch.setattr(compile_notice, "_SLOW", 0.01)
    monkeypatch.setattr(compile_notice, "_last_end", 0.0)
    monkeypatch.setattr("warp_rt.device.compile_notice.time.monotonic", lambda: now[0])
    return now


def wait() -> list[str]:
    """Wait until somebody is told, for a slow block; return what else is called then."""
    called: list[str] = []
    with told_if_slow(lambda: called.append("slow")):
        for _ in range(1000):
            if called:
                break
            time.sleep(0.01)
    return called


def test_files_that_are_compiled_in_a_row_are_told_once(clock: list[float], caplog: pytest.LogCaptureFixture) -> None:
    for now, told in [(1000.0, 1), (1000.2, 1), (1001.1, 1), (1003.0, 2)]:  # the fourth begins 1.9 s after the third
        clock[0] = now
        assert wait() == ["slow"]
        assert [record.name for record in caplog.records] == ["warp_rt"] * told
    assert caplog.records[0].getMessage().startswith("compiling kernels ")


def test_what_is_quick_is_not_told(caplog: pytest.LogCaptureFixture) -> None:
    called: list[str] = []
    with told_if_slow(lambda: called.append("slow")):
        pass
    assert called == []
    assert caplog.records == []


COMPILE = """
from warp_rt.warp_setup import init_warp
from warp_rt.device import compile_notice
from warp_rt.device.kernel_binaries import load_module
from warp_rt.kernels import shape_pack

init_warp()
compile_notice._SLOW = 0.0
load_module(shape_pack, "cpu")
compile_notice._last_end -= 10.0
load_module(shape_pack, "cpu")
"""


def test_a_program_without_a_log_tells_it_on_stderr(tmp_path: Path) -> None:
    """And only while something is loaded for the first time."""
    environment = os.environ | {"WARP_CACHE_PATH": str(tmp_path)}
    run = subprocess.run([sys.executable, "-c", COMPILE], capture_output=True, text=True, env=environment, check=False)
    assert (run.returncode, run.stdout) == (0, "")
    assert run.stderr == "compiling kernels that are not in the cache yet (up to a minute; they are kept)...\n"
