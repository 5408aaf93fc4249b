# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Reader of Radiance pictures (.hdr, RGBE): three 8-bit mantissas that share an exponent.

Reference: Ward (1991), Real Pixels, Graphics Gems II; the file format as documented with Radiance (filefmts).
"""

from __future__ import annotations

import re

import numpy as np

from warp_rt.errors import SceneError

_SIZE = re.compile(rb"([-+])([XY]) (\d+) ([-+])([XY]) (\d+)\s*")
_MIN_RUN_WIDTH, _MAX_RUN_WIDTH = 8, 0x7FFF  # widths that run-length encoding by component can have


def radiance_size(data: bytes) -> tuple[int, int]:
    """Return width and height [pixel].

    Raises:
        SceneError: The header is not that of a Radiance picture.
    """
    _, match, _ = _header(data)
    first, second = int(match[3]), int(match[6])
    return (first, second) if match[2] == b"X" else (second, first)


def read_radiance(data: bytes) -> np.ndarray:
    """Return linear red, green and blue: float32, shape [height, width, 3], top row first.

    Raises:
        SceneError: The data is no Radiance picture, is in CIE XYZ, or ends early.
    """
    exposure, match, position = _header(data)
    line_count, length = int(match[3]), int(match[6])
    # Every scanline takes at least 8 bytes; tested before an array of the announced size is allocated.
    if (len(data) - position) < line_count * min(4 * length, 8):
        raise SceneError("the picture ends early")
    texels = np.empty((line_count, length, 4), np.uint8)
    for line in texels:
        position = _read_scanline(data, position, line)
    # m / 256 * 2^(e - 128). Ward adds half a step to m; image libraries, and so other USD renderers, do not.
    scale = np.where(texels[..., 3:] > 0, np.ldexp(1.0, texels[..., 3:].astype(np.int32) - 136), 0.0) / exposure
    rgb = (texels[..., :3] * scale).astype(np.float32)
    return _upright(rgb, match)


def _header(data: bytes) -> tuple[float, re.Match[bytes], int]:
    """Return the exposure, the match of the resolution line, and where the scanlines begin."""
    end = data.find(b"\n\n")
    if not data.startswith((b"#?RADIANCE", b"#?RGBE")) or end < 0:
        raise SceneError("not a Radiance picture")
    exposure = 1.0
    for line in data[:end].split(b"\n"):
        name, _, value = line.partition(b"=")
        if name == b"FORMAT" and value.strip() != b"32-bit_rle_rgbe":
            raise SceneError(f"the format {value.decode('latin-1')!r} is not supported")
        if name == b"EXPOSURE":
            try:
                exposure *= float(value)
            except ValueError:
                raise SceneError("the EXPOSURE line is no number") from None
    match = _SIZE.match(data, end + 2)
    if not match or match[2] == match[5] or not 0 < exposure < np.inf:
        raise SceneError("the header is damaged")
    return exposure, match, data.index(b"\n", match.start()) + 1


def _read_scanline(data: bytes, position: int, line: np.ndarray) -> int:
    """Fill one scanline, uint8 [length, 4], and return where the next one begins."""
    length = len(line)
    start = data[position : position + 4]
    is_by_component = (
        _MIN_RUN_WIDTH <= length <= _MAX_RUN_WIDTH
        and start[:2] == b"\x02\x02"
        and int.from_bytes(start[2:], "big") == length
    )
    if not is_by_component:
        return _read_flat_scanline(data, position, line)
    position += 4
    for component in range(4):
        values = bytearray()
        while len(values) < length:
            if position + 1 >= len(data):
                raise SceneError("the picture ends early")
            count = data[position]
            if count > 128:
                values += data[position + 1 : position + 2] * (count - 128)
                position += 2
            elif count:
                values += data[position + 1 : position + 1 + count]
                position += 1 + count
            else:
                raise SceneError("a run of length zero")
        if len(values) != length:
            raise SceneError("a run passes the end of its scanline")
        line[:, component] = np.frombuffer(values, np.uint8)
    return position


def _read_flat_scanline(data: bytes, position: int, line: np.ndarray) -> int:
    """Fill a scanline of plain texels, in which (1, 1, 1, n) repeats the one before n times."""
    x, shift = 0, 0
    while x < len(line):
        texel = data[position : position + 4]
        if len(texel) < 4:
            raise SceneError("the picture ends early")
        position += 4
        if texel[:3] == b"\x01\x01\x01" and x:
            # Consecutive repeats are the digits of one count, least significant first.
            count = texel[3] << shift
            line[x : x + count] = line[x - 1]
            x, shift = x + count, shift + 8
        else:
            line[x] = np.frombuffer(texel, np.uint8)
            x, shift = x + 1, 0
    return position


def _upright(rgb: np.ndarray, match: re.Match[bytes]) -> np.ndarray:
    """Return the picture with rows from the top and columns from the left, whatever order the file has."""
    if match[1] == (b"+" if match[2] == b"Y" else b"-"):
        rgb = rgb[::-1]
    if match[4] == (b"+" if match[5] == b"Y" else b"-"):
        rgb = rgb[:, ::-1]
    return rgb.transpose(1, 0, 2) if match[2] == b"X" else rgb
