# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The files that swept lights read: profiles, and textures of rects and domes. No two parts of one are alike."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image as PillowImage

from .dome_skies import SKIES

PROFILE_VERTICAL = np.array([0.0, 20, 50, 80, 100, 140, 180])
PROFILE_HORIZONTAL = np.array([0.0, 45, 90, 160, 270, 315, 360])
PROFILE_VALUES = np.array(  # no two halves are alike
    [
        [300, 250, 220, 150, 60, 30, 20],
        [300, 220, 180, 120, 50, 20, 20],
        [300, 180, 120, 100, 60, 20, 20],
        [300, 260, 260, 200, 40, 10, 20],
        [300, 320, 300, 180, 80, 40, 20],
        [300, 280, 240, 160, 70, 40, 20],
        [300, 250, 220, 150, 60, 30, 20],
    ],
    float,
)
_STRIPES = np.array([0.0, *(10.0 * k + side for k in range(1, 18) for side in (-0.5, 0.5)), 180.0])
"""Angles between which the second profile, like luxtest's, is bright and dark by turns, over all horizontal angles."""
PROFILES = {
    "profile.ies": (PROFILE_VERTICAL, PROFILE_HORIZONTAL, PROFILE_VALUES),
    "stripes.ies": (_STRIPES, np.array([0.0, 360.0]), np.tile(np.repeat(np.resize([300.0, 30.0], 18), 2), (2, 1))),
}


def write_files(folder: Path) -> dict[str, Path]:
    """Write two profiles, a rect's texture and images of domes into a folder; return their paths by name.

    Those of ``SKIES`` go by the names of their layouts.
    """
    paths = {name: folder / name for name in (*PROFILES, "texture.png", "sky.png")}
    for name, (vertical, horizontal, values) in PROFILES.items():
        numbers = [1, -1, 1, len(vertical), len(horizontal), 1, 2, 0, 0, 0, 1, 1, 0]
        text = "\n".join(" ".join(f"{number:g}" for number in row) for row in (numbers, vertical, horizontal, *values))
        paths[name].write_text(f"IESNA:LM-63-2002\nTILT=NONE\n{text}\n", encoding="ascii")
    PillowImage.fromarray(rect_texture()).save(paths["texture.png"])
    PillowImage.fromarray(sky_image()).save(paths["sky.png"])
    for name, paint in SKIES.items():
        paths[name] = folder / f"{name}.png"
        PillowImage.fromarray(np.round(65535 * paint()).astype(np.uint16)).save(paths[name])
    return paths


def rect_texture() -> np.ndarray:
    """Return 16 bits a pixel, which are not decoded: rows from the top; brighter to the left, and at the top."""
    rows, columns = np.mgrid[0:32, 0:32]
    chequer = 0.4 * ((rows // 8 + columns // 8) % 2)
    return np.round(65535 * np.clip(0.6 - columns / 64 + 0.3 * (rows < 8) + chequer, 0, 1)).astype(np.uint16)


def sky_image() -> np.ndarray:
    rows, columns = np.mgrid[0:32, 0:64]
    return np.round(65535 * np.clip(0.9 - rows / 40 - columns / 160 + 0.1 * (columns == 50), 0, 1)).astype(np.uint16)
