# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Loads kernels: those of rendering without a look at their source where it is known what that compiles to.

Warp names a binary by a hash over every function that its kernels call. To find that of a render kernel, each process
would have to import, parse and resolve six hundred functions, which takes as long as all else that a small picture
takes. A file of kernels that has an ``import_body`` is known by its text instead, and by those of all files that it
imports: there is nothing else that a kernel could depend on, but Warp and its settings. Its binaries lie beside Warp's
own, and are cleared with them.
"""

from __future__ import annotations

import hashlib
import re
import threading
from enum import Enum
from functools import cache
from pathlib import Path
from types import ModuleType

import warp as wp

_lock = threading.Lock()
_CPU_BLOCK, _CUDA_BLOCK = 1, 256  # threads a block of Warp's launches
_IMPORT = re.compile(rb"^\s*from \.(\w+) import", re.MULTILINE)  # as all kernel files write it
_NOT_COMPILED_IN = {"kernel_cache_dir", "log_level", "print_launches", "verbose_warnings"}
"""Settings of Warp that leave binaries as they are."""


def load_module(module: ModuleType, device: str) -> None:
    """Load the kernels of a file, unless they are loaded, and compile them if need be.

    Required before several threads launch them: Warp loads a module when one of its kernels is first launched, without
    a lock, so that two threads that launch at once load it twice, and the loser's code is unloaded while it may still
    be running.

    Args:
        module: A file of ``warp_rt.kernels``.
        device: Resolved.
    """
    with _lock:
        if not hasattr(module, "import_body"):
            wp.load_module(module, device=device)
            return
        _choose_block(module, device)
        folder = _folder(module)
        try:
            wp.load_aot_module(module, device, module_dir=folder, strip_hash=True)
        except FileNotFoundError:
            module.import_body()
            _compile(module, device, folder)
            wp.load_aot_module(module, device, module_dir=folder, strip_hash=True)


def _compile(module: ModuleType, device: str, folder: Path) -> None:
    """Compile a file for a device into a folder, which nobody ever sees half filled."""
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


def _folder(module: ModuleType) -> Path:
    """Return where the binaries of a file are kept."""
    digest = hashlib.sha256(_source_digest(str(module.__file__)))
    for name, value in sorted(vars(wp.config).items()):
        is_setting = isinstance(value, str | int | float | Enum | None) and not name.startswith("_")
        if is_setting and name not in _NOT_COMPILED_IN:
            digest.update(f"{name}={value!r}\n".encode())
    return Path(str(wp.config.kernel_cache_dir), f"wp_{module.__name__}_{digest.hexdigest()[:16]}")


@cache
def _source_digest(path: str) -> bytes:
    """Return a digest of the texts of a kernel file and of all those that it imports, directly or not."""
    waiting = [Path(path)]
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
