# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""OpenEXR: linear float, one layer an AOV, everything in one part."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import OpenEXR

from warp_rt.errors import OutputError
from warp_rt.image.atomic import replacing

_REC_709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)  # x, y of red, green, blue and white: ITU-R BT.709-6


def write_exr(
    path: Path,
    channels: Mapping[str, np.ndarray],
    *,
    software: str,
    metadata: Mapping[str, object],
    data_window: tuple[int, int, int, int] | None = None,
    pixel_aspect_ratio: float = 1.0,
) -> None:
    """Write an EXR file, whole or not at all.

    Colour is premultiplied, linear Rec. 709, and has 32 bits unless half is asked for, so that what is written is what
    was computed.

    Args:
        path: The file.
        channels: Planes by name, shape [height, width], row 0 at the top; see ``layers.channels_of``.
        software: Who made it, an attribute.
        metadata: Facts by name, attributes ``warp_rt:NAME`` of the type string, int or float.
        data_window: Where the planes lie: x and y of their top left pixel in a picture, its width and height [pixel].
            None: they are the picture.
        pixel_aspect_ratio: Width by height of a pixel.

    Raises:
        OutputError: The file could not be written.
    """
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "chromaticities": _REC_709,
        "software": software,
        "pixelAspectRatio": float(pixel_aspect_ratio),
    }
    if data_window is not None:
        x, y, width, height = data_window
        rows, columns = next(iter(channels.values())).shape
        header["dataWindow"] = _box(x, y, columns, rows)
        header["displayWindow"] = _box(0, 0, width, height)
    for name, value in metadata.items():
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        text = str(value).encode("utf-8", "backslashreplace").decode()
        header[f"warp_rt:{name}"] = value if is_number else text
    with replacing(path) as temporary:
        try:
            with OpenEXR.File(header, dict(channels)) as file:
                file.write(os.fsencode(temporary))  # bytes: the name need not be valid Unicode
        except RuntimeError as error:  # the library's word for every failure
            reason = str(error).replace(str(temporary), path.name)
            raise OutputError(f"{path}: cannot write: {reason}") from error


def _box(x: int, y: int, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    return np.array([x, y], np.int32), np.array([x + width - 1, y + height - 1], np.int32)
