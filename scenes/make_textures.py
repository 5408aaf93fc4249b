# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write the pictures in textures/ that the feature scenes use; every one is drawn here from nothing.

python scenes/make_textures.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

FOLDER = Path(__file__).with_name("textures")


def main() -> None:
    """Write all pictures."""
    FOLDER.mkdir(exist_ok=True)
    for name, pixels in (
        ("checker", checker()),
        ("orientation", orientation()),
        ("cutout", cutout()),
        ("sky", sky()),
    ):
        Image.fromarray((np.clip(pixels, 0, 1) * 255 + 0.5).astype(np.uint8)).save(
            FOLDER / f"{name}.png", optimize=True
        )


def grid(width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """Return u and v at the texel centres, v = 1 in the top row: two arrays of shape [height, width]."""
    return np.meshgrid((np.arange(width) + 0.5) / width, 1 - (np.arange(height) + 0.5) / height)


def checker() -> np.ndarray:
    """Return two by two squares, one light and one dark pair: shape [64, 64, 3], sRGB."""
    u, v = grid(64, 64)
    dark = (u < 0.5) != (v < 0.5)
    return np.where(dark[..., None], (0.24, 0.38, 0.44), (0.88, 0.86, 0.80))


def orientation() -> np.ndarray:
    """Return a picture that shows every flip, turn and shift: shape [256, 256, 3], sRGB.

    Red grows along u and green along v; the letter F stands upright; the corner at (0, 0) is black, (1, 0) red,
    (0, 1) green, (1, 1) yellow; each edge has a stripe of the colour that it continues with when clamped.
    """
    u, v = grid(256, 256)
    pixels = np.stack([0.25 + 0.5 * u, 0.25 + 0.5 * v, np.full_like(u, 0.55)], axis=-1)
    line = (np.abs((u * 8) % 1 - 0.5) > 0.47) | (np.abs((v * 8) % 1 - 0.5) > 0.47)
    pixels[line] = pixels[line] * 0.7
    stem = (u > 0.32) & (u < 0.44) & (v > 0.18) & (v < 0.82)
    bars = (u > 0.32) & (((v > 0.70) & (v < 0.82) & (u < 0.74)) | ((v > 0.45) & (v < 0.57) & (u < 0.64)))
    pixels[stem | bars] = (0.97, 0.97, 0.95)
    for name, color in (("left", (0.1, 0.1, 0.1)), ("right", (0.9, 0.2, 0.1)), ("top", (0.1, 0.7, 0.2))):
        pixels[{"left": u < 0.03, "right": u > 0.97, "top": v > 0.97}[name]] = color
    pixels[v < 0.03] = (0.15, 0.25, 0.9)
    for corner_u, corner_v in ((0, 0), (1, 0), (0, 1), (1, 1)):
        pixels[(np.abs(u - corner_u) < 0.12) & (np.abs(v - corner_v) < 0.12)] = (corner_u, corner_v, 0)
    return pixels


def cutout() -> np.ndarray:
    """Return a green disc pierced by a star of slits, with alpha 0 outside and in the slits: shape [256, 256, 4]."""
    u, v = grid(256, 256)
    radius, angle = np.hypot(u - 0.5, v - 0.5), np.arctan2(v - 0.5, u - 0.5)
    solid = (radius < 0.48) & ~((np.cos(7 * angle) > 0.3) & (radius > 0.12) & (radius < 0.40))
    color = np.stack([0.25 + 0.3 * radius, 0.62 - 0.4 * radius, np.full_like(u, 0.2)], axis=-1)
    return np.concatenate([color, solid[..., None]], axis=-1)


def sky() -> np.ndarray:
    """Return a latitude-longitude sky that tells all directions apart: shape [256, 512, 3], sRGB.

    The centre column looks along +Z, where a red tower stands; a quarter to the left of it along +X stands a green
    one, a quarter to the right along -X a blue one, and at both ends along -Z a white one. The sun is over the green.
    """
    u, v = grid(512, 256)
    elevation = (v - 0.5) * np.pi
    up = np.clip(elevation / (np.pi / 2), 0, 1)[..., None]
    pixels = (1 - up) * np.array([0.86, 0.88, 0.90]) + up * np.array([0.28, 0.45, 0.75])
    ground = np.array([0.42, 0.38, 0.32]) * (0.7 + 0.3 * np.clip(-elevation, 0, 1)[..., None])
    pixels = np.where((elevation < 0)[..., None], ground, pixels)
    towers = {0.5: (0.85, 0.15, 0.1), 0.25: (0.15, 0.65, 0.2), 0.75: (0.15, 0.25, 0.85), 0.0: (0.97, 0.97, 0.97)}
    for center, color in towers.items():
        away = np.abs((u - center + 0.5) % 1 - 0.5) * 2 * np.pi
        pixels[(away < 0.16) & (elevation > 0) & (elevation < 0.55 - away)] = color
    toward_sun = np.cos(elevation) * np.cos((u - 0.30) * 2 * np.pi) * np.cos(0.9) + np.sin(elevation) * np.sin(0.9)
    pixels[toward_sun > np.cos(0.12)] = (1.0, 0.98, 0.9)
    return pixels


if __name__ == "__main__":
    main()
