# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Memory of the host that has been freed, but not given back."""

from __future__ import annotations

import ctypes
import platform

LARGE = 1 << 26  # bytes: of an array that it is worth while to make room for, which takes milliseconds


def give_back_freed() -> None:
    """Give what has been freed back to the system, where the C library keeps it: glibc's heap ends at what is in use.

    Building a hierarchy over a million instances leaves 40 MB free between what it keeps, where a large array finds no
    room. Other C libraries give back by themselves.
    """
    if platform.libc_ver()[0] == "glibc":
        ctypes.CDLL(None).malloc_trim(0)
