# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Where the test data that is not in the repository lie: oracles with known answers, and real stages by others."""

from __future__ import annotations

import os
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
"""The project's root."""


def find_test_data(name: str) -> Path | None:
    """Return the folder ``name`` (``oracles``, ``corpora``) of the test data, or None where it is not at hand.

    The environment variable WARP_RT_TEST_DATA names the folder that holds both; without it, ``shared`` beside the
    project's root is tried.
    """
    folder = Path(os.environ.get("WARP_RT_TEST_DATA") or ROOT.parent / "shared") / name
    return folder if folder.is_dir() else None
