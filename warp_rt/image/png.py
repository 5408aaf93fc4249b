# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""PNG: 8 bits a channel, straight alpha, with text that says how the picture was made."""

from __future__ import annotations

import io
from collections.abc import Mapping

import numpy as np
from PIL import Image as PillowImage
from PIL.PngImagePlugin import PngInfo

SOFTWARE = "Software"  # the keywords that the PNG specification registers, section 11.3.4
SOURCE = "Source"


def opaque(rgb: np.ndarray) -> np.ndarray:
    """Return colours with an alpha that covers: uint8, shape [height, width, 4]."""
    return np.dstack([rgb, np.full(rgb.shape[:2], 255, np.uint8)])


def encode_png(rgba: np.ndarray, *, software: str, metadata: Mapping[str, object], is_srgb: bool) -> bytes:
    """Return a PNG file.

    Args:
        rgba: Straight alpha, uint8, shape [height, width, 4], row 0 on top.
        software: Who made it.
        metadata: Facts by name; ``source`` becomes the registered keyword Source, others ``warp_rt:NAME``.
        is_srgb: Whether the colours are sRGB-encoded (the sRGB chunk says so); else linear (gamma 1).

    Reference: W3C (2003), Portable Network Graphics, sections 11.3.3 and 11.3.4.
    """
    info = PngInfo()
    if is_srgb:
        info.add(b"sRGB", b"\0")  # rendering intent: perceptual
    else:
        info.add(b"gAMA", (100_000).to_bytes(4, "big"))
    info.add_text(SOFTWARE, software)
    for name, value in metadata.items():
        # What Latin-1 cannot hold goes into an iTXt chunk; file names need not even be valid Unicode.
        text = str(value).encode("utf-8", "backslashreplace").decode()
        info.add_text(SOURCE if name == "source" else f"warp_rt:{name}", text)
    file = io.BytesIO()
    PillowImage.fromarray(rgba, "RGBA").save(file, "PNG", pnginfo=info)
    return file.getvalue()
