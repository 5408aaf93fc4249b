# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The one place that initialises Warp, silently, and resolves device names."""

from __future__ import annotations

import atexit
import contextlib
import os
import shutil
import sys
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import warp as wp

from warp_rt.errors import DeviceError

_lock = threading.Lock()
_is_ready = False


def init_warp() -> None:
    """Initialise Warp once: no banner, no adjoint code, a kernel cache that can be written.

    ``WARP_CACHE_PATH`` chooses the cache folder. Where neither it nor Warp's own default can be written, the cache
    goes to a private temporary folder.
    """
    global _is_ready
    with _lock:
        if _is_ready:
            return
        wp.config.log_level = wp.LOG_WARNING
        wp.config.enable_backward = False
        if wp.config.kernel_cache_dir is None:
            wp.config.kernel_cache_dir = _writable_cache()
        with _muted_stderr():
            wp.init()
        _is_ready = True


def resolve_device(name: str = "auto") -> str:
    """Return the Warp device that ``name`` stands for: ``cpu`` or ``cuda:N``.

    Args:
        name: ``cpu``, ``cuda`` (the first GPU), ``cuda:N``, or ``auto``: a GPU if there is one, else the CPU.

    Raises:
        DeviceError: There is no such device.
    """
    init_warp()
    if name == "cpu":
        return name
    gpus = [device.alias for device in wp.get_cuda_devices()]
    if name == "auto":
        return gpus[0] if gpus else "cpu"
    alias = "cuda:0" if name == "cuda" else name
    if alias not in gpus:
        raise DeviceError(f"device {name!r} is not available; available: {', '.join(['cpu', *gpus])}")
    return alias


def load_module(module: ModuleType, device: str) -> None:
    """Load the kernels of a file, unless they are loaded; required before several threads launch them.

    Warp loads a module when one of its kernels is first launched, without a lock: two threads that launch at once
    load it twice, and the loser's code is unloaded while it may still be running.
    """
    with _lock:
        wp.load_module(module, device=device)


def _writable_cache() -> str | None:
    """Return a folder to cache kernels in, or None where Warp's own choice can be written."""
    chosen = os.environ.get("WARP_CACHE_PATH")
    if chosen:
        return None if _is_writable(Path(chosen)) else _private_cache()
    # Warp keeps its cache below the user's cache folder; the home may be missing, read-only, or somebody else's.
    try:
        home = Path.home()
    except RuntimeError:
        return _private_cache()
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA", home))
    elif sys.platform == "darwin":
        base = home / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME", home / ".cache"))
    return None if _is_writable(base / "warp" / wp.config.version) else _private_cache()


def _is_writable(folder: Path) -> bool:
    """Return whether files can be made in ``folder``, or in the nearest of its parents that exists."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    try:
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _private_cache() -> str:
    """Return a new temporary folder that goes away with the process."""
    folder = tempfile.mkdtemp(prefix="warp_rt_kernels_")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


@contextlib.contextmanager
def _muted_stderr() -> Iterator[None]:
    """Send file descriptor 2 to nowhere: without a CUDA driver, Warp's native code writes a warning straight to it."""
    try:
        saved = os.dup(2)
    except OSError:  # the process was started with stderr closed
        yield
        return
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 2)
    try:
        yield
    finally:
        os.dup2(saved, 2)
        os.close(saved)
        os.close(null)
