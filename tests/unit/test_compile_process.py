# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A second process compiles into the same cache, is stopped at any time, and is never needed."""

import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
import warp as wp

from warp_rt.device import compile as kernel_compile
from warp_rt.device.compile import load_kernels
from warp_rt.device.compile_process import CompileProcess
from warp_rt.warp_setup import init_warp

LONG = 60.0  # seconds that nothing here takes


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder for the kernels, and beside it one for temporary files; two cores."""
    init_warp()
    (tmp_path / "temporary").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))
    cache = tmp_path / "cache" / str(wp.config.version)
    monkeypatch.setattr(wp.config, "kernel_cache_dir", str(cache))
    monkeypatch.setattr("warp_rt.device.compile_process.default_thread_count", lambda: 2)
    return cache


def test_kernels_come_into_the_cache_and_nothing_else_stays(folder: Path) -> None:
    process = CompileProcess(["shape_pack"])
    process.wait(LONG)
    (made,) = folder.iterdir()
    assert made.name.startswith("wp_warp_rt.kernels.shape_pack_")
    assert list(made.glob("*.o"))
    assert not list((folder.parents[1] / "temporary").iterdir())


def test_a_process_that_is_stopped_takes_its_files_along(folder: Path) -> None:
    process = CompileProcess(["ray_order"])
    end = time.monotonic() + LONG
    while not list(folder.glob("*_p*_t*")) and time.monotonic() < end:  # it has begun to build
        time.sleep(0.02)
    process.stop()
    assert not list(folder.iterdir())  # nor what it would have made in the end
    assert not list((folder.parents[1] / "temporary").iterdir())
    process.wait(LONG)  # there is nothing to wait for any more
    process.stop()


def test_a_process_that_fails_is_over(folder: Path) -> None:
    begin = time.monotonic()
    CompileProcess(["no_such_file"]).wait(LONG)
    assert time.monotonic() - begin < LONG / 2
    assert not list((folder.parents[1] / "temporary").iterdir())


@pytest.mark.parametrize("program", ["/usr/bin/blender", "", "/no/such/folder/python3"])
def test_without_an_interpreter_there_is_no_process(
    program: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", program)
    process = CompileProcess(["shape_pack"])
    process.wait(LONG)
    process.stop()
    assert not folder.exists()


class _Recorder:
    """Stands for a ``CompileProcess``."""

    def __init__(self, modules: Sequence[str]) -> None:
        self.modules = list(modules)
        self.is_stopped = False
        started.append(self)

    def wait(self, seconds: float) -> None:
        assert seconds > 0.0

    def stop(self) -> None:
        self.is_stopped = True


started: list[_Recorder] = []
loaded: list[tuple[str, str]] = []
FILES = [("render_plain", "cuda:0"), ("bvh_build", "cpu"), ("bvh_refit", "cuda:0"), ("bvh_sah", "cpu")]


@pytest.fixture
def loading(monkeypatch: pytest.MonkeyPatch) -> Callable[[bool, str], None]:
    """Make loading files slow, as where they have to be compiled, or quick; one of a certain name fails."""
    started.clear()
    loaded.clear()
    monkeypatch.setattr(kernel_compile, "CompileProcess", _Recorder)

    def prepare(is_slow: bool, failing: str) -> None:
        def load_module(module: object, device: str, *, on_slow: Callable[[], None] | None = None) -> None:
            name = str(getattr(module, "__name__", "")).rpartition(".")[2]
            if is_slow and on_slow is not None:
                on_slow()
            if name == failing:
                raise RuntimeError(name)
            loaded.append((name, device))

        monkeypatch.setattr(kernel_compile, "load_module", load_module)

    return prepare


@pytest.mark.parametrize(("is_slow", "threads"), [(False, 2), (True, 1)])
def test_there_is_no_process_for_kernels_in_the_cache_or_for_one_thread(
    is_slow: bool, threads: int, loading: Callable[[bool, str], None]
) -> None:
    loading(is_slow, "")
    load_kernels(FILES, threads=threads)
    assert loaded == FILES
    assert not started


def test_another_process_compiles_the_rest_for_the_cpu_and_all_is_loaded_here(
    loading: Callable[[bool, str], None],
) -> None:
    loading(True, "")
    load_kernels(FILES, threads=2)
    assert loaded == FILES
    assert [process.modules for process in started] == [["bvh_build", "bvh_sah"]]
    assert started[0].is_stopped


def test_the_other_process_is_stopped_where_a_kernel_does_not_compile(loading: Callable[[bool, str], None]) -> None:
    loading(True, FILES[0][0])
    with pytest.raises(RuntimeError):
        load_kernels(FILES, threads=2)
    assert [process.is_stopped for process in started] == [True]
