# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Stages of a few lines, in memory."""

from __future__ import annotations

from pxr import Usd


def stage_of(body: str) -> Usd.Stage:
    """Return a stage of the text of a layer, without its first line."""
    stage = Usd.Stage.CreateInMemory()
    assert stage.GetRootLayer().ImportFromString(f"#usda 1.0\n{body}\n")
    return stage
