# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a log gets to see of a long render; the bar on terminals is tested with the program."""

import time

import pytest

from warp_rt.cli.progress import duration, progress_bar
from warp_rt.cli.terminal import Terminal


@pytest.fixture
def clock(monkeypatch):
    """A clock that stands still until it is set, in a list of one."""
    now = [1000.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    return now


def test_a_log_gets_a_line_every_ten_seconds(clock, capsys):
    with progress_bar(Terminal("warp-rt"), "rendering out.png") as progress:
        for seconds, fraction in [(0, 0.0), (9.9, 0.1), (10, 0.0), (19, 0.2), (43, 0.35), (50, 0.5), (53, 0.9)]:
            clock[0] = 1000 + seconds
            progress(fraction)
    out, err = capsys.readouterr()
    assert out == ""
    assert err.splitlines() == [
        "rendering out.png: 0 %",
        "rendering out.png: 35 %, 1 min 20 s left",  # 43 s / 0.35 * 0.65
        "rendering out.png: 90 %, 6 s left",
    ]


def test_quiet_gets_none(capsys):
    with progress_bar(Terminal("warp-rt", verbosity=-1), "rendering out.png") as progress:
        assert progress is None


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.4, "0 s"), (59.4, "59 s"), (59.6, "1 min 0 s"), (3599, "59 min 59 s"), (7530, "2 h 5 min")],
)
def test_durations(seconds, text):
    assert duration(seconds) == text
