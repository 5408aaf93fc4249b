# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compiles and loads the kernels, and says so where that takes a while."""

from __future__ import annotations

import pkgutil
import threading
import time
from collections.abc import Callable, Sequence
from importlib import import_module

import warp as wp

import warp_rt.kernels
from warp_rt.device.compile_process import CompileProcess
from warp_rt.device.kernel_binaries import load_module
from warp_rt.warp_setup import init_warp, resolve_device

_NOTICE_SECONDS = 0.7
"""Loading cached kernels takes a tenth of this; whatever takes longer is being compiled."""


def load_kernels(
    files: Sequence[tuple[str, str]],
    *,
    on_compile: Callable[[], None] | None = None,
    threads: int = 1,
) -> None:
    """Load the kernels of files of ``warp_rt.kernels``, compiling them on first use.

    Args:
        files: Names, such as ``ray_tree``, each with a resolved device; the one that takes longest to compile first.
            While it is compiled, another process compiles those of the rest that are for the CPU.
        on_compile: Called, from another thread, where kernels are not in the cache.
        threads: Cores that may be used; with 1 there is no other process.
    """
    init_warp()
    (first, device), *rest = files
    others: list[CompileProcess] = []

    def on_slow() -> None:
        if on_compile:
            on_compile()
        if threads > 1:
            others.append(CompileProcess([name for name, place in rest if place == "cpu"]))

    begin = time.perf_counter()
    try:
        _load(first, device, on_slow)
        for other in others:
            other.wait(time.perf_counter() - begin)  # it has less to do; whatever holds it up is not waited for
    finally:
        for other in others:
            other.stop()
    for name, place in rest:
        _load(name, place, on_compile)


def _load(module: str, device: str, on_slow: Callable[[], None] | None) -> None:
    """Load the kernels of a file; ``on_slow`` is called while they are being compiled."""
    imported = import_module(f"warp_rt.kernels.{module}")
    timer = threading.Timer(_NOTICE_SECONDS, on_slow) if on_slow else None
    if timer:
        timer.daemon = True
        timer.start()
    try:
        load_module(imported, device)
    finally:
        if timer:
            timer.cancel()
            timer.join()


def warmup(device: str = "auto", *, on_compile: Callable[[], None] | None = None) -> None:
    """Compile every kernel for a device, so that no later render waits for it."""
    name = resolve_device(device)
    for info in pkgutil.iter_modules(warp_rt.kernels.__path__):
        file = import_module(f"warp_rt.kernels.{info.name}")
        kernels = [member for member in vars(file).values() if isinstance(member, wp.Kernel)]
        if any(kernel.func.__module__ == file.__name__ for kernel in kernels):
            _load(info.name, name, on_compile)
