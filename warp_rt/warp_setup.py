# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The one place that initialises Warp, silently, and resolves device names."""

from __future__ import annotations

import atexit
import contextlib
import logging
import os
import shutil
import stat
import sys
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path

import warp as wp

from warp_rt.errors import DeviceError, OutputError

_logger = logging.getLogger("warp_rt")
_lock = threading.Lock()
_is_ready = False
_has_temporary_cache = False


def init_warp() -> None:
    """Initialise Warp once: no banner, no adjoint code, a kernel cache that can be written.

    ``WARP_CACHE_PATH`` chooses the cache folder. Where neither it nor Warp's own default can be written, the cache
    goes among the temporary files, and a log message says so.

    Raises:
        OutputError: There is no folder at all that can be written.
        DeviceError: Warp cannot start.
    """
    global _has_temporary_cache, _is_ready
    with _lock:
        if _is_ready:
            return
        wp.config.log_level = wp.LOG_WARNING
        wp.config.enable_backward = False
        if wp.config.kernel_cache_dir is None and not _default_is_writable():
            wp.config.kernel_cache_dir = _temporary_cache()
            _has_temporary_cache = True
        try:
            with _muted_stderr():
                wp.init()
        except RuntimeError as error:  # its native part does not fit the machine, or into the memory
            raise DeviceError(f"Warp cannot start: {error}") from error
        _is_ready = True


def has_temporary_cache() -> bool:
    """Return whether kernels are cached among the temporary files, for want of a better place."""
    init_warp()
    return _has_temporary_cache


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


def _default_is_writable() -> bool:
    """Return whether kernels can be kept where ``WARP_CACHE_PATH`` says, else where Warp keeps them by itself."""
    chosen = os.environ.get("WARP_CACHE_PATH")
    if chosen:
        return _is_writable(Path(chosen))
    # Warp keeps its cache below the user's cache folder; the home may be missing, read-only, or somebody else's.
    try:
        home = Path.home()
    except RuntimeError:
        return False
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA", home))
    elif sys.platform == "darwin":
        base = home / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME", home / ".cache"))
    return _is_writable(base / "warp" / wp.config.version)


def _is_writable(folder: Path) -> bool:
    """Return whether files can be made in ``folder``, or in the nearest of its parents that exists."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    try:
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _temporary_cache() -> str:
    """Return a folder among the temporary files to cache kernels in, and say that it is only that.

    It is the user's own and is found again by later runs. Kernels are code that will be run, so where anybody else
    could have put something into it, a new folder is made, which goes away with the process.
    """
    try:
        folder = Path(tempfile.gettempdir(), f"warp_rt_kernels_{_user_id()}")
        is_kept = _is_private(folder)
        if not is_kept:
            folder = Path(tempfile.mkdtemp(prefix="warp_rt_kernels_"))
            atexit.register(shutil.rmtree, folder, ignore_errors=True)
    except OSError as error:
        raise OutputError("no folder for compiled kernels can be written; WARP_CACHE_PATH chooses one") from error
    until = "" if is_kept else " until this run ends"
    _logger.warning(
        "the cache folder cannot be written: compiled kernels are kept in %s%s; WARP_CACHE_PATH chooses a folder",
        folder,
        until,
    )
    return str(folder)  # Warp adds its version


def _user_id() -> str:
    return str(os.getuid()) if hasattr(os, "getuid") else "user"  # Windows: each user has temporary files of their own


def _is_private(folder: Path) -> bool:
    """Return whether ``folder``, made if it is missing, is a true folder that this user alone can change."""
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
    except OSError:
        return False
    found = folder.lstat()
    is_ours = not hasattr(os, "getuid") or (found.st_uid == os.getuid() and not found.st_mode & 0o077)
    return stat.S_ISDIR(found.st_mode) and is_ours and _is_writable(folder)


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
