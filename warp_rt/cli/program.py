# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The command line as all that a process is there for: it starts and ends sooner than it would by itself."""

from __future__ import annotations

import atexit
import gc
import logging
import os
import sys
from typing import NoReturn

from warp_rt.cli.main import main

_OBJECTS_TO_COLLECT = 100_000
"""New objects after which the garbage collector looks for cycles: importing makes half a million that stay."""


def run() -> NoReturn:
    """Run the command line on this process's arguments, and end the process with its exit code.

    Python would look for garbage a thousand times while it imports Warp and USD, and take every module and object apart
    at the end: four tenths of a second together, as long as a small picture otherwise takes. Threads are waited for and
    exit handlers run all the same.
    """
    gc.set_threshold(_OBJECTS_TO_COLLECT)
    codes: list[int] = []
    atexit.register(_leave, codes)  # the first to be registered is the last to run
    codes.append(main())
    sys.exit(codes[0])


def _leave(codes: list[int]) -> None:
    """End the process, unless it ends by an exception, or what it has printed cannot be written."""
    try:
        logging.shutdown()
        sys.stdout.flush()
        sys.stderr.flush()
    except (AttributeError, OSError, ValueError):  # closed, or never there: for the interpreter to handle
        return
    if codes:
        os._exit(codes[0])
