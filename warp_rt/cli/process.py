# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the system knows about this process: its age and its memory."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path


def seconds_since_start() -> float:
    """Return the wall-clock age of this process [s]; its processor time where the system does not tell the age."""
    try:
        # proc(5): field 22, starttime, in clock ticks after boot; the name in field 2 may itself hold blanks.
        fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
        born = int(fields[19]) / os.sysconf("SC_CLK_TCK")
        return max(time.clock_gettime(time.CLOCK_BOOTTIME) - born, 0.0)
    except (OSError, AttributeError, ValueError, IndexError):
        return time.process_time()


def peak_memory() -> int | None:
    """Return the most memory that this process ever had resident [byte]; None where the system does not tell."""
    try:
        # Not getrusage here: on Linux its maximum covers what the process was before exec, thus the parent's size.
        status = Path("/proc/self/status").read_text()
        return 1024 * int(status.partition("VmHWM:")[2].split()[0])
    except (OSError, ValueError, IndexError):
        pass
    try:
        import resource
    except ImportError:  # Windows
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak
