# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Running POV-Ray 3.7, an external program: its picture, linear and in 16 bits, and its ray counts."""

from __future__ import annotations

import re
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np

PROGRAM = "povray"
INSTALL = "install POV-Ray 3.7 (Debian package povray)"


@dataclass(frozen=True)
class PovrayRun:
    """What POV-Ray made of a scene."""

    color: np.ndarray
    """float64, shape [height, width, 3], linear, cut off at 1; exact to 0.5 / 65535."""
    rays: int
    """Of the tree, those included that depth or threshold cut short."""
    shadow: int
    total_internal_reflection: int
    cpu_seconds: float
    """Of the trace alone."""


def is_installed(program: str = PROGRAM) -> bool:
    """Return whether the program is there."""
    return shutil.which(program) is not None


def render(text: str, folder: Path, width: int, height: int, *, threads: int = 1, program: str = PROGRAM) -> PovrayRun:
    """Return the picture and the counts of a scene.

    Args:
        text: In POV-Ray's scene language.
        folder: For the files on the way.
        width: Of the picture [pixel].
        height: Likewise.
        threads: Of the trace.
        program: Its name or path.

    Raises:
        SystemExit: POV-Ray failed; its last words are given.
    """
    source, picture = folder / "scene.pov", folder / "picture.ppm"
    source.write_text(text, encoding="ascii")
    command = [program, f"+I{source}", f"+O{picture}", f"+W{width}", f"+H{height}", f"+WT{threads}"]
    command += ["-A", "-D", "-P", "-V", "+FP16", "File_Gamma=1.0", "Dither=off"]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    log = run.stdout + run.stderr
    if run.returncode:
        raise SystemExit(f"{program}: {log[-2000:]}")
    return PovrayRun(
        color=read_ppm(picture.read_bytes()),
        rays=int(number(log, r"^Rays:\s+(\d+)")),
        shadow=int(number(log, r"^Shadow Ray Tests:\s+(\d+)", 0)),
        total_internal_reflection=int(number(log, r"Total Internal:\s+(\d+)", 0)),
        cpu_seconds=trace_cpu_seconds(log),
    )


def number(log: str, pattern: str, missing: float | None = None) -> float:
    """Return a figure of the statistics; those that are 0 are not printed."""
    found = re.search(pattern, log, re.MULTILINE)
    if found is None:
        if missing is None:
            raise SystemExit(f"POV-Ray printed nothing like {pattern}")
        return missing
    return float(found.group(1))


def trace_cpu_seconds(log: str) -> float:
    """Return the CPU seconds that POV-Ray's statistics give for the trace."""
    found = re.search(r"Trace Time:.*?with\s+([\d.]+)\s+CPU-seconds", log, re.DOTALL)
    if found is None:
        raise SystemExit("POV-Ray printed no trace time")
    return float(found.group(1))


def read_ppm(data: bytes) -> np.ndarray:
    """Return the picture of a binary PPM file of 16 bits: float64, 0 to 1, shape [height, width, 3]."""
    head = re.match(rb"P6\s+(?:#[^\n]*\n)*(\d+)\s+(\d+)\s+(\d+)\s", data)
    if head is None:
        raise SystemExit("POV-Ray wrote no PPM file")
    width, height, full = map(int, head.groups())
    return np.frombuffer(data[head.end() :], ">u2").reshape(height, width, 3) / full
