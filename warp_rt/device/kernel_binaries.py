# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Loads kernels: those of rendering without a look at their source where it is known what that compiles to.

Warp names a binary by a hash over every function that its kernels call. To find that of a render kernel, each process
would have to import, parse and resolve six hundred functions, which takes as long as all else that a small picture
takes. A file of kernels that has an ``import_body`` is known by its text instead, and by those of all files that it
imports: there is nothing else that a kernel could depend on, but Warp and its settings. Its binaries lie beside Warp's
own, and are cleared with them.

The text has to be the one that was imported. Where a file has been written to since this process imported the first of
them, nobody knows which of the two a function came from; so that process keeps what it compiles to itself.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import re
import shutil
import tempfile
import threading
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from types import ModuleType

import warp as wp

from warp_rt.device.compile_notice import told_if_slow
from warp_rt.errors import OutputError
from warp_rt.kernels import is_as_imported

_lock = threading.Lock()
_loaded_by_warp: set[tuple[str, str]] = set()
"""Names and devices of the files that Warp has found by its own hash, which it does quickly from then on."""
_CPU_BLOCK, _CUDA_BLOCK = 1, 256  # threads a block of Warp's launches
_HASH_LETTERS = 7  # of Warp's hash in the name of a folder of binaries
_IMPORT = re.compile(rb"^\s*from \.(\w+) import", re.MULTILINE)  # as all kernel files write it
_NOT_COMPILED_IN = {"kernel_cache_dir", "log_level", "print_launches", "verbose_warnings"}
"""Settings of Warp that leave binaries as they are."""
_NAMES_ONLY = "strip_hash"
"""The option of a module that is set as it is loaded, and changes but names."""


def load_module(module: ModuleType, device: str, *, on_slow: Callable[[], None] | None = None) -> None:
    """Load the kernels of a file, unless they are loaded, and compile them if need be, which is told.

    Required before several threads launch them: Warp loads a module when one of its kernels is first launched, without
    a lock, so that two threads that launch at once load it twice, and the loser's code is unloaded while it may still
    be running.

    Args:
        module: A file of ``warp_rt.kernels``.
        device: Resolved.
        on_slow: Called, from another thread, once compiling has taken a while.
    """
    with _lock:
        has_body = hasattr(module, "import_body")
        digest = _source_digest(str(module.__file__)) if has_body else None
        if digest is None:
            if has_body:
                module.import_body()
            name = (module.__name__, device)
            with contextlib.nullcontext() if name in _loaded_by_warp else told_if_slow(on_slow), _failures_told():
                _load_by_hash(module, device)
            _loaded_by_warp.add(name)
            return
        _choose_block(module, device)
        folder = _folder(module, digest)
        if _is_loaded(module, device, folder):
            return
        with told_if_slow(on_slow), _failures_told():
            module.import_body()
            if is_as_imported():
                _compile(module, device, folder)
                _load(module, device, folder)
            else:
                with tempfile.TemporaryDirectory(prefix="warp_rt_", ignore_cleanup_errors=True) as private:
                    _compile(module, device, Path(private, folder.name))
                    _load(module, device, Path(private, folder.name))


@contextlib.contextmanager
def _failures_told() -> Iterator[None]:
    """Say which folder could not be written, as on a full disk; what is unfinished there is removed.

    Raises:
        OutputError: The block met an error of the system.
    """
    folder = wp.config.kernel_cache_dir
    try:
        yield
    except OSError as error:
        remove_unfinished()
        reason = error.strerror or error
        raise OutputError(f"{folder}: cannot write kernels: {reason}; WARP_CACHE_PATH chooses a folder") from error


def remove_unfinished() -> None:
    """Remove from the cache what this process has begun to compile."""
    for folder in Path(str(wp.config.kernel_cache_dir)).glob(f"*_p{os.getpid()}_t*"):  # as Warp names them
        shutil.rmtree(folder, ignore_errors=True)


def _is_loaded(module: ModuleType, device: str, folder: Path) -> bool:
    """Load what a folder has, and return whether that was possible; a folder of damaged files is cleared."""
    try:
        _load(module, device, folder)
    except FileNotFoundError:
        return False
    except Exception:  # Warp raises no narrower one for a file cut short, as by a full disk
        shutil.rmtree(folder, ignore_errors=True)
        return False
    return True


def _load_by_hash(module: ModuleType, device: str) -> None:
    """Have Warp compile a file unless it finds its binaries, and load them; damaged ones are compiled again."""
    try:
        wp.load_module(module, device=device)
    except Exception:  # as above; Warp does not tell which folder it is, only how the names of all begin and end
        for folder in Path(str(wp.config.kernel_cache_dir)).glob(f"wp_{module.__name__}_{'[0-9a-f]' * _HASH_LETTERS}"):
            shutil.rmtree(folder, ignore_errors=True)
        wp.load_module(module, device=device)


def _load(module: ModuleType, device: str, folder: Path) -> None:
    """Load what was compiled for a device into a folder."""
    wp.load_aot_module(module, device, module_dir=folder, strip_hash=True)


def _compile(module: ModuleType, device: str, folder: Path) -> None:
    """Compile a file for a device into a folder, which nobody ever sees half filled."""
    wp.set_module_options({}, module=module)  # has Warp forget a hash without what import_body imports
    level = wp.config.log_level
    # Warp warns of objects that are meant for this machine's processor alone; their names say for which.
    wp.config.log_level = wp.LOG_ERROR
    try:
        wp.compile_aot_module(module, device, module_dir=folder, strip_hash=True)
    finally:
        wp.config.log_level = level


def _choose_block(module: ModuleType, device: str) -> None:
    """Have a file compiled for the number of threads a block that its launches will have."""
    block = _CPU_BLOCK if device == "cpu" else _CUDA_BLOCK
    if wp.get_module_options(module)["block_dim"] != block:  # whatever is set makes Warp forget the module's hash
        wp.set_module_options({"block_dim": block}, module=module)


def _folder(module: ModuleType, source: bytes) -> Path:
    """Return where the binaries of a file are kept, whose texts have a digest."""
    digest = hashlib.sha256(source)
    settings = {name: value for name, value in vars(wp.config).items() if name not in _NOT_COMPILED_IN}
    options = {name: value for name, value in wp.get_module_options(module).items() if name != _NAMES_ONLY}
    for values in settings, options:
        for name, value in sorted(values.items()):
            if not (name.startswith("_") or callable(value) or isinstance(value, ModuleType)):
                digest.update(f"{name}={_text(value)}\n".encode())
    return Path(str(wp.config.kernel_cache_dir), f"wp_{module.__name__}_{digest.hexdigest()[:16]}")


def _text(value: object) -> str:
    """Return a setting as text, in one order whatever order it was made in."""
    if isinstance(value, dict):
        return repr(sorted((repr(key), _text(item)) for key, item in value.items()))
    return repr(sorted(map(repr, value)) if isinstance(value, set | frozenset) else value)


@cache
def _source_digest(path: str) -> bytes | None:
    """Return a digest of what this process has imported from a kernel file and those that it imports.

    Returns:
        None where that is not known: there are no files of text, as in an archive, or they have been written to since.
    """
    try:
        digest = _text_digest(Path(path))
        return digest if is_as_imported() else None
    except OSError:
        return None


def _text_digest(path: Path) -> bytes:
    """Return a digest of the texts of a kernel file and of all those that it imports, directly or not.

    Raises:
        OSError: One of them cannot be read.
    """
    if path.suffix != ".py":
        raise FileNotFoundError(f"{path} is no text")
    waiting = [path]
    texts: dict[Path, bytes] = {}
    while waiting:
        file = waiting.pop()
        if file not in texts:
            texts[file] = file.read_bytes()
            waiting += [file.with_name(f"{name.decode()}.py") for name in _IMPORT.findall(texts[file])]
    digest = hashlib.sha256()
    for file in sorted(texts):
        digest.update(f"{file.name} {len(texts[file])}\n".encode())
        digest.update(texts[file])
    return digest.digest()
