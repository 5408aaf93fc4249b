# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Files that are there whole or not at all."""

from __future__ import annotations

import contextlib
import glob
import os
import secrets
from collections.abc import Iterator
from pathlib import Path

from warp_rt.errors import OutputError

try:
    import fcntl
except ImportError:  # Windows, which itself refuses to delete a file that is open
    fcntl = None  # type: ignore[assignment]


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary file's path; when the block ends well, what it holds takes ``path``'s place in one step.

    The temporary file lies in the same folder, so that the step is a rename, and is on the disk before it is
    renamed. When the block fails, it is gone and what was at ``path`` is untouched. One that a killed process left
    behind is removed by the next write of the same file: a living writer holds a lock on its own.

    Args:
        path: The file to be; symbolic links are followed, so that a link stays one.

    Raises:
        OutputError: The file could not be written, or stands for a folder, a device or the like.
    """
    target = Path(os.path.realpath(path))
    if target.exists() and not target.is_file():
        raise OutputError(f"{path}: is no regular file")
    try:
        _remove_leftovers(target)
        temporary = target.with_name(f".{_stem(target)}.{secrets.token_hex(4)}.part")
        # Opened by hand rather than by tempfile, whose files only their owner may read.
        descriptor = os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_RDWR, 0o666)
    except OSError as error:
        raise OutputError(f"{path}: cannot write: {error.strerror}") from error
    try:
        try:
            with contextlib.suppress(OSError):  # network file systems may know no locks; then leftovers stay
                _lock(descriptor)
            yield temporary
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
        temporary.replace(target)
        _sync_folder(target.parent)
    except OSError as error:
        raise OutputError(f"{path}: cannot write: {error.strerror or error}") from error
    finally:
        temporary.unlink(missing_ok=True)


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file whole or not at all.

    Raises:
        OutputError: The file could not be written.
    """
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def _stem(target: Path) -> str:
    """Return as much of the name as always leaves room for more: file systems allow 255 bytes, letters take up to 4."""
    return target.name[:50]


def _lock(descriptor: int) -> None:
    if fcntl is not None:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


def _remove_leftovers(target: Path) -> None:
    for leftover in target.parent.glob(f".{glob.escape(_stem(target))}.*.part"):
        with contextlib.suppress(OSError), leftover.open("rb") as file:
            _lock(file.fileno())
            leftover.unlink()


def _sync_folder(folder: Path) -> None:
    """Make the rename itself last; where folders cannot be opened (Windows) the system sees to it."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
