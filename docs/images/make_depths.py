# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Make depths.jpg, the lecture's figure: its test scene at growing depth of the ray tree.

Run from anywhere: ``python docs/images/make_depths.py``.
"""

from __future__ import annotations

from pathlib import Path

from PIL import Image

import warp_rt

HERE = Path(__file__).resolve().parent
SCENE = HERE.parents[1] / "scenes" / "mirror_teapot.usda"
DEPTHS = (1, 2, 3, 7)
_COLUMNS = 2


def contact_sheet(width: int) -> Image.Image:
    """Return the pictures of ``DEPTHS`` row by row, each ``width`` pixels wide."""
    scene = warp_rt.load_scene(SCENE)
    pictures = []
    for depth in DEPTHS:
        film = warp_rt.render(scene, width=width, depth=depth, spp=16)
        pictures.append(Image.fromarray(film.to_srgb8()).convert("RGB"))
    cell_width, cell_height = pictures[0].size
    sheet = Image.new("RGB", (cell_width * _COLUMNS, cell_height * len(pictures) // _COLUMNS))
    for index, picture in enumerate(pictures):
        sheet.paste(picture, (index % _COLUMNS * cell_width, index // _COLUMNS * cell_height))
    return sheet


if __name__ == "__main__":
    contact_sheet(480).save(HERE / "depths.jpg", quality=88)
