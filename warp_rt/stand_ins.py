# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What people are told in place of the paths of things that no stage has."""

from __future__ import annotations

from warp_rt.report import one_line

_STAND_INS = {
    "/__framing": "(framed)",
    "/__headlight": "(headlight)",
    "/__displayColor": "(displayColor fallback)",
    "/__lightRadiance": "(radiance of the light)",
}


def shown_path(path: str) -> str:
    """Return a prim's or a file's path on one line, or what stands for it where it is one of ours."""
    return _STAND_INS.get(path) or one_line(path)
