# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Compiles and loads the kernels, and says so where that takes a while."""

from __future__ import annotations

import importlib
import pkgutil
import threading
from collections.abc import Callable

import warp as wp

import warp_rt.kernels
from warp_rt.warp_setup import init_warp, load_module, resolve_device

_NOTICE_SECONDS = 0.7
"""Loading cached kernels takes a tenth of this; whatever takes longer is being compiled."""


def load_kernels(module: str, *, device: str, on_compile: Callable[[], None] | None = None) -> None:
    """Load the kernels of one file of ``warp_rt.kernels``, compiling them on first use.

    Args:
        module: File's name, such as ``ray_tree``.
        device: Resolved device.
        on_compile: Called once, from another thread, where the kernels are not in the cache.
    """
    init_warp()
    imported = importlib.import_module(f"warp_rt.kernels.{module}")
    timer = threading.Timer(_NOTICE_SECONDS, on_compile) if on_compile else None
    if timer:
        timer.daemon = True
        timer.start()
    try:
        load_module(imported, device)
    finally:
        if timer:
            timer.cancel()


def warmup(device: str = "auto", *, on_compile: Callable[[], None] | None = None) -> None:
    """Compile every kernel for a device, so that no later render waits for it."""
    name = resolve_device(device)
    for info in pkgutil.iter_modules(warp_rt.kernels.__path__):
        file = importlib.import_module(f"warp_rt.kernels.{info.name}")
        kernels = [member for member in vars(file).values() if isinstance(member, wp.Kernel)]
        if any(kernel.func.__module__ == file.__name__ for kernel in kernels):
            load_kernels(info.name, device=name, on_compile=on_compile)
