# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""JPEG: no alpha, so the picture stands over black."""

from __future__ import annotations

import io
from collections.abc import Mapping

import numpy as np
from PIL import Image as PillowImage

QUALITY = 95
MAX_SIDE = 65535  # of the format: sizes are 16-bit
_MAX_COMMENT = 65533  # bytes that one COM segment holds

_EXIF_SOFTWARE = 0x0131


def encode_jpeg(rgb: np.ndarray, *, software: str, metadata: Mapping[str, object]) -> bytes:
    """Return a JPEG file, quality 95 without chroma subsampling, which smears the edges of saturated colours.

    Args:
        rgb: Display values, uint8, shape [height, width, 3], row 0 on top.
        software: Who made it, kept as Exif's Software.
        metadata: Facts by name, kept as the file's comment, one a line.
    """
    picture = PillowImage.fromarray(rgb, "RGB")
    exif = picture.getexif()
    exif[_EXIF_SOFTWARE] = software
    comment = "\n".join(f"{name}: {value}" for name, value in metadata.items())
    file = io.BytesIO()
    picture.save(
        file,
        "JPEG",
        quality=QUALITY,
        subsampling=0,
        exif=exif,
        comment=comment.encode("utf-8", "backslashreplace")[:_MAX_COMMENT],
    )
    return file.getvalue()
