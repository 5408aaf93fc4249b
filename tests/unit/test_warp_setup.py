# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Warp starts silently, finds a place for its kernels, and knows its devices."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from warp_rt.errors import DeviceError
from warp_rt.warp_setup import init_warp, resolve_device

PROGRAM = """
import warp as wp
from warp_rt.warp_setup import init_warp
init_warp()
init_warp()
"""
SHOW_CACHE = PROGRAM + "print(wp.config.kernel_cache_dir)"


def run(program: str, **environment: str) -> subprocess.CompletedProcess:
    inherited = {k: v for k, v in os.environ.items() if k != "WARP_CACHE_PATH"}
    return subprocess.run(
        [sys.executable, "-c", program],
        env=inherited | environment,
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )


def test_nothing_is_printed() -> None:
    result = run(PROGRAM)
    assert (result.stdout, result.stderr) == ("", "")


def test_cache_path_is_honoured(tmp_path: Path) -> None:
    assert run(SHOW_CACHE, WARP_CACHE_PATH=str(tmp_path)).stdout.startswith(str(tmp_path))


@pytest.mark.parametrize("variable", ["WARP_CACHE_PATH", "XDG_CACHE_HOME"])
def test_a_cache_that_cannot_be_written_is_replaced(variable: str, tmp_path: Path) -> None:
    not_a_folder = tmp_path / "file"
    not_a_folder.write_text("")
    folder = run(SHOW_CACHE, **{variable: str(not_a_folder)}).stdout.strip()
    assert "warp_rt_kernels_" in folder
    assert not Path(folder).exists()  # it went with the process


def test_devices() -> None:
    init_warp()
    assert resolve_device("cpu") == "cpu"
    assert resolve_device("auto") in ("cpu", "cuda:0")
    for name in ("gpu", "cuda:99", ""):
        with pytest.raises(DeviceError, match="available: cpu"):
            resolve_device(name)
