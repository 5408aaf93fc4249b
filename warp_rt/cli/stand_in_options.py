# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What stands in for options of usdrecord, and of others who draw with OpenColorIO, where they are unknown."""

from __future__ import annotations

from collections.abc import Collection

# The last column of docs/usdrecord.md, short.
_OF_USDRECORD = {
    "--colorCorrectionMode": "--tonemap",
    "-color": "--tonemap",
    "--renderer": "--integrator",
    "-r": "--integrator",
    "--disableGpu": "--device",
    "--traceToFile": "--json",
    "--traceFormat": "--json",
    "--memstats": "--json",
    "--disableCameraLight": None,
    "--enableDomeLightVisibility": None,
    "--resolver": None,
}
_OF_COLOR = ("--tonemap", "--colorCorrectionMode")


def stand_in(option: str, known: Collection[str]) -> str:
    """Return what to do about an unknown option, ``; ...``, or nothing.

    Args:
        option: Its spelling.
        known: The options that there are.
    """
    if option.lower().startswith("--ocio"):
        others = [other for other in _OF_COLOR if other in known]
        return f"; there is no OpenColorIO{', only ' if others else ''}{', '.join(others)}"
    if option not in _OF_USDRECORD:
        return ""
    other = _OF_USDRECORD[option]
    return f"; warp-rt record takes it{f', here {other} stands in for it' if other in known else ''}"
