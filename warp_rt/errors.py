# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The exceptions of warp_rt, each with the exit code that the command line gives it."""


class WarpRtError(Exception):
    """Base of every error that warp_rt raises on purpose. Its text is one line, naming file and prim where it can."""

    exit_code = 1


class OptionError(WarpRtError):
    """An option is unknown, malformed, out of range, or contradicts another one."""

    exit_code = 2


class SceneError(WarpRtError):
    """The scene cannot be read, is invalid, or lacks what was asked of it (a camera, a prim)."""

    exit_code = 3


class DeviceError(WarpRtError):
    """The device that was asked for is unknown, absent or unusable."""

    exit_code = 4


class LimitError(WarpRtError):
    """A limit on memory, time or the number of instances was hit."""

    exit_code = 5


class OutputError(WarpRtError):
    """A result could not be written; what was at its place before is untouched."""

    exit_code = 6
