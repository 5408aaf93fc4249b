# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The process of the command line ends at once, and yet in order."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

_RUN = """
import atexit, sys, tempfile, threading, time
from warp_rt.cli import program
folder = None
def main():
    global folder
    atexit.register(print, "a handler")
    threading.Thread(target=lambda: (time.sleep(0.2), print("a thread"))).start()
    folder = tempfile.TemporaryDirectory()
    print(folder.name)
    MAIN
program.main = main
program.run()
"""


def _run(body: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", _RUN.replace("MAIN", body)], capture_output=True, text=True)


def test_threads_are_waited_for_and_handlers_run() -> None:
    result = _run("return 3")
    folder, *rest = result.stdout.splitlines()
    assert (result.returncode, rest, result.stderr) == (3, ["a thread", "a handler"], "")
    assert not Path(folder).exists()


def test_exceptions_end_it_as_ever() -> None:
    result = _run("raise ValueError('this')")
    assert result.returncode == 1
    assert result.stderr.endswith("ValueError: this\n")
    assert result.stdout.splitlines()[1:] == ["a thread", "a handler"]


def test_output_that_cannot_be_written_is_told() -> None:
    """As Python does it by itself: exit code 120."""
    command = [sys.executable, "-c", _RUN.replace("MAIN", "return 0")]
    with Path("/dev/full").open("w") as full:
        buffered = os.environ | {"PYTHONUNBUFFERED": ""}
        result = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, env=buffered)
    assert result.returncode == 120
    assert "No space left" in result.stderr
