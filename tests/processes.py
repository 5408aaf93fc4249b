# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Processes that tests start."""

import signal


def hear_interrupts() -> None:
    """Let a new process hear SIGINT, which a shell has its background jobs ignore; for ``preexec_fn``."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def complaints(stderr: str) -> list[str]:
    """Return the lines of stderr, but for the one that an empty cache of kernels is told by."""
    return [line for line in stderr.splitlines() if not line.startswith("compiling kernels ")]
