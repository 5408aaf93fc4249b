# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compiles and loads the kernels, on two cores where that takes a while."""

from __future__ import annotations

import pkgutil
import time
from collections.abc import Callable, Sequence
from importlib import import_module
from types import ModuleType

import warp as wp

import warp_rt.kernels
from warp_rt.device.compile_process import CompileProcess
from warp_rt.device.kernel_binaries import load_module
from warp_rt.warp_setup import init_warp, resolve_device


def load_kernels(files: Sequence[tuple[str, str]], *, threads: int = 1) -> None:
    """Load the kernels of files of ``warp_rt.kernels``, compiling them on first use.

    Args:
        files: Names, such as ``render``, each with a resolved device; the one that takes longest to compile first.
            While it is compiled, another process compiles those of the rest that are for the CPU.
        threads: Cores that may be used; with 1 there is no other process.
    """
    init_warp()
    (first, device), *rest = files
    others: list[CompileProcess] = []

    def share() -> None:
        if threads > 1:
            others.append(CompileProcess([name for name, place in rest if place == "cpu"]))

    begin = time.perf_counter()
    try:
        load_module(import_module(f"warp_rt.kernels.{first}"), device, on_slow=share)
        for other in others:
            other.wait(time.perf_counter() - begin)  # it has less to do; whatever holds it up is not waited for
    finally:
        for other in others:
            other.stop()
    for name, place in rest:
        load_module(import_module(f"warp_rt.kernels.{name}"), place)


def warmup(device: str = "auto", on_file: Callable[[str, int, int], None] | None = None) -> None:
    """Compile every kernel for a device, so that no later render waits for it.

    Args:
        device: ``auto``, ``cpu``, ``cuda:0``, ...
        on_file: Called before each file of kernels, with its name, its number from 1 and the number of all.

    Raises:
        DeviceError: There is no such device.
    """
    place = resolve_device(device)
    names = (info.name for info in pkgutil.iter_modules(warp_rt.kernels.__path__))
    files = [file for file in (import_module(f"warp_rt.kernels.{name}") for name in names) if _has_kernels(file)]
    for number, file in enumerate(files, 1):
        if on_file:
            on_file(file.__name__.rpartition(".")[2], number, len(files))
        load_module(file, place)


def _has_kernels(file: ModuleType) -> bool:
    """Return whether a file has kernels of its own, beyond those that it imports."""
    kernels = [member for member in vars(file).values() if isinstance(member, wp.Kernel)]
    return any(kernel.func.__module__ == file.__name__ for kernel in kernels)
