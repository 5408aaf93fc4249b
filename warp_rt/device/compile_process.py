# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A second process that compiles kernels into the cache of the first, on a core that would be idle.

A process and not a thread, for LLVM keeps the options of a compilation in variables of the process. Warp builds a
module in a folder of its own and renames it to its place in the cache when it is complete: nobody ever sees half a
module, and where two processes compile the same one, the first wins. So nothing depends on this process; what it has
not compiled, the one that started it compiles when it loads it.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

import warp as wp

from warp_rt.device.kernel_binaries import load_module, remove_unfinished
from warp_rt.device.workers import default_thread_count
from warp_rt.warp_setup import init_warp

_GRACE = 5.0  # seconds for a process that has been told to end; it takes milliseconds


class CompileProcess:
    """Compiles kernels for the CPU; ends with the process that started it, however that ends.

    Nothing is started where there is one core, or where no Python interpreter is known that could run it: in a program
    that embeds Python, ``sys.executable`` may be that program.
    """

    def __init__(self, modules: Sequence[str]) -> None:
        """Args: modules: Files of ``warp_rt.kernels``, in the order in which they are compiled."""
        self._process: subprocess.Popen[bytes] | None = None
        is_python = Path(sys.executable or "").stem.lower().startswith("python")
        if not modules or not is_python or default_thread_count() == 1:
            return
        # It imports what this process does, and finds the cache that this process has chosen; Warp adds its version.
        environment = os.environ | {
            "PYTHONPATH": os.pathsep.join(path or str(Path.cwd()) for path in sys.path),
            "WARP_CACHE_PATH": str(Path(str(wp.config.kernel_cache_dir)).parent),
        }
        with contextlib.suppress(OSError):
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", __name__, *modules],
                stdin=subprocess.PIPE,  # its end tells the process that this one is gone
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                env=environment,
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            )

    def wait(self, seconds: float) -> None:
        """Return when the process has ended, by itself or, after ``seconds``, by being stopped."""
        if self._process is not None:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(seconds)
            self.stop()

    def stop(self) -> None:
        """End the process if it still runs."""
        if self._process is None or self._process.stdin is None:
            return
        self._process.stdin.close()
        try:
            self._process.wait(_GRACE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def _compile(modules: Sequence[str]) -> None:
    """Compile files of ``warp_rt.kernels`` until all are done or standard input ends; does not return."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal interrupts both; the other process says when to end
    scratch = tempfile.tempdir = tempfile.mkdtemp(prefix="warp_rt_")  # where Warp puts its precompiled header
    threading.Thread(target=_end_with_input, args=(scratch,), daemon=True).start()
    try:
        init_warp()
        for module in modules:
            load_module(import_module(f"warp_rt.kernels.{module}"), "cpu")
    finally:
        _end(scratch)


def _end_with_input(scratch: str) -> None:
    """End this process, even in the middle of a compilation, as soon as the other one has closed the pipe."""
    sys.stdin.buffer.read()
    _end(scratch)


def _end(scratch: str) -> None:
    """End this process and take away what it has not finished."""
    remove_unfinished()
    shutil.rmtree(scratch, ignore_errors=True)
    os._exit(0)


if __name__ == "__main__":
    _compile(sys.argv[1:])
