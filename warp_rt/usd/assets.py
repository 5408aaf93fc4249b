# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The bytes of files that a stage names, through USD's asset resolver, which finds members of packages too."""

from __future__ import annotations

import stat
from pathlib import Path

from pxr import Ar

from warp_rt.errors import SceneError


def is_device(path: str) -> bool:
    """Return whether a path is that of a pipe, a device or the like: opening it may wait, and reading it never end."""
    try:
        mode = Path(path).stat().st_mode
    except (OSError, ValueError):
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def read_asset(path: str, max_bytes: int | None = None) -> bytes:
    """Return what a file holds.

    Args:
        path: A resolved asset path, as ``Sdf.AssetPath.resolvedPath`` has it; may lie in a package.
        max_bytes: Larger files are refused.

    Raises:
        SceneError: The file is missing, none that can be read, or too large; the message does not hold the path.
    """
    if is_device(path):
        raise SceneError("it is no regular file")
    asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(path))
    if not asset:
        raise SceneError("the file cannot be opened")
    with asset as opened:
        if max_bytes is not None and opened.GetSize() > max_bytes:
            raise SceneError(f"it has more than {max_bytes} bytes")
        return bytes(opened.GetBuffer() or b"")  # None for an empty file
