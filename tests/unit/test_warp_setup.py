# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Warp starts silently, finds a place for its kernels, and knows its devices."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from warp_rt.errors import DeviceError
from warp_rt.warp_setup import _is_private, init_warp, resolve_device

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


def temporary_cache(tmp_path: Path, variable: str = "WARP_CACHE_PATH") -> tuple[Path, str]:
    """Return the cache folder of a process that can write to temporary files only, and what it printed."""
    not_a_folder = tmp_path / "file"
    not_a_folder.write_text("")
    result = run(SHOW_CACHE, TMPDIR=str(tmp_path), **{variable: str(not_a_folder)})
    return Path(result.stdout.strip()), result.stderr


on_posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows gives each user temporary files of their own")


@pytest.mark.parametrize("variable", ["WARP_CACHE_PATH", "XDG_CACHE_HOME"])
def test_a_cache_that_cannot_be_written_is_replaced_by_one_that_stays(variable: str, tmp_path: Path) -> None:
    folder, said = temporary_cache(tmp_path, variable)
    own = folder.parent
    assert own.parent == tmp_path
    assert folder.is_dir()
    assert said.count("\n") == 1
    assert str(own) in said
    assert "WARP_CACHE_PATH" in said
    if sys.platform != "win32":
        assert own.name == f"warp_rt_kernels_{os.getuid()}"
        assert own.stat().st_mode & 0o777 == 0o700
    (folder / "kept").write_text("")
    assert temporary_cache(tmp_path, variable)[0] == folder
    assert (folder / "kept").exists()


@on_posix
@pytest.mark.parametrize("trick", ["symlink", "open to all", "file"])
def test_a_temporary_cache_that_others_could_fill_is_not_used(trick: str, tmp_path: Path) -> None:
    own = tmp_path / f"warp_rt_kernels_{os.getuid()}"
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir(mode=0o700)
    if trick == "symlink":
        own.symlink_to(elsewhere)
    elif trick == "open to all":
        own.mkdir()
        own.chmod(0o777)
    else:
        own.write_text("")
    folder, said = temporary_cache(tmp_path)
    assert folder.parent != own
    assert folder.parent.name.startswith("warp_rt_kernels_")
    assert not folder.exists()  # it went with the process
    assert "until this run ends" in said
    assert list(elsewhere.iterdir()) == []


@on_posix
def test_a_temporary_cache_of_somebody_else_is_not_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = tmp_path / "own"
    assert _is_private(own)
    monkeypatch.setattr(os, "getuid", lambda: own.stat().st_uid + 1)
    assert not _is_private(own)


def test_devices() -> None:
    init_warp()
    assert resolve_device("cpu") == "cpu"
    assert resolve_device("auto") in ("cpu", "cuda:0")
    for name in ("gpu", "cuda:99", ""):
        with pytest.raises(DeviceError, match="available: cpu"):
            resolve_device(name)
