# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Processes that tests start."""

import signal


def hear_interrupts() -> None:
    """Let a new process hear SIGINT, which a shell has its background jobs ignore; for ``preexec_fn``."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
