# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""TIFF files whose samples have more than 8 bits, or lie in planes: what Pillow decompresses, but does not take apart.

The strips or tiles are shown to Pillow once more, as an image of bytes with as many a row as the samples have. So every
compression that its libtiff knows is read, and what is left is to undo the predictor and to put bytes together.

Reference: TIFF Revision 6.0 (1992), sections 7, 8, 14, 18 and 19; Adobe Photoshop TIFF Technical Note 3 (2005), the
floating point predictor; BigTIFF.
"""

from __future__ import annotations

import io
import struct
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from PIL import Image as PilImage
from PIL.TiffImagePlugin import ImageFileDirectory_v2

_WIDTH, _HEIGHT, _BITS, _COMPRESSION, _PHOTOMETRIC = 256, 257, 258, 259, 262
_STRIP_OFFSETS, _SAMPLES, _STRIP_ROWS, _STRIP_BYTES, _PLANAR, _PREDICTOR = 273, 277, 278, 279, 284, 317
_TILE_WIDTH, _TILE_HEIGHT, _TILE_OFFSETS, _TILE_BYTES, _EXTRA, _FORMAT = 322, 323, 324, 325, 338, 339
_FILL_ORDER = 266
_WHITE_IS_ZERO, _BLACK_IS_ZERO, _RGB, _CMYK = 0, 1, 2, 5
_COLORS = {_WHITE_IS_ZERO: 1, _BLACK_IS_ZERO: 1, _RGB: 3, _CMYK: 4}
_UNSIGNED, _SIGNED, _FLOAT = 1, 2, 3
_JPEG = (6, 7)  # compressions that know of samples, and have 8 bits
_HORIZONTAL, _FLOATING = 2, 3  # predictors
_ASSOCIATED = 1  # alpha that colours are multiplied by


@dataclass(frozen=True)
class TiffLayout:
    """How the samples of a file lie."""

    width: int
    height: int
    samples: int
    """A pixel."""
    dtype: np.dtype
    photometric: int
    is_planar: bool
    predictor: int
    compression: int
    is_associated: bool
    """Whether colours are multiplied by alpha."""
    tags: ImageFileDirectory_v2


def wide_tiff(data: bytes) -> TiffLayout | None:
    """Return how the samples of a file lie; None where it is no TIFF, or one that Pillow reads right or nobody does.

    Args:
        data: The file.

    Raises:
        Exception: Of any kind, where it is damaged.
    """
    if data[:4] not in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"):
        return None
    tags = ImageFileDirectory_v2(data[: 16 if b"+" in data[2:4] else 8])
    with io.BytesIO(data) as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # what is cut off is refused where it is missed
        file.seek(tags.next)
        tags.load(file)
    return _layout(tags, data[:2])


def read_wide_tiff(data: bytes, layout: TiffLayout) -> np.ndarray:
    """Return the first picture of a TIFF, uint8 or float32, shape [height, width, 1 to 4], top row first.

    Integers are shares of the greatest value of their type, those of 8 bits as they are; floats are what they are.

    Args:
        data: The file.
        layout: As ``wide_tiff`` gives it.

    Raises:
        Exception: Of any kind, where it is damaged.
    """
    planes = layout.samples if layout.is_planar else 1
    found = [_plane(data, layout, plane, planes) for plane in range(planes)]
    return _channels(np.concatenate(found, axis=2), layout)


def _first(tags: ImageFileDirectory_v2, tag: int, default: int) -> int:
    value: Any = tags.get(tag, default)
    return int(value[0] if isinstance(value, tuple) else value)


def _layout(tags: ImageFileDirectory_v2, order: bytes) -> TiffLayout | None:
    bits, formats = tags.get(_BITS, (1,)), tags.get(_FORMAT, (_UNSIGNED,))
    photometric, compression = _first(tags, _PHOTOMETRIC, -1), _first(tags, _COMPRESSION, 1)
    is_planar = _first(tags, _PLANAR, 1) == 2 and _first(tags, _SAMPLES, 1) > 1
    depth, kind = int(bits[0]), int(formats[0])
    if photometric not in _COLORS or compression in _JPEG or _first(tags, _FILL_ORDER, 1) != 1:
        return None
    if not (depth > 8 or (depth == 8 and is_planar)) or {*bits} != {depth} or {*formats} != {kind}:
        return None
    code = {_UNSIGNED: "u", _SIGNED: "i", _FLOAT: "f"}.get(kind)
    if code is None or depth not in ((16, 32, 64) if kind == _FLOAT else (8, 16, 32)):
        return None
    extra = tags.get(_EXTRA, (0,))
    return TiffLayout(
        width=_first(tags, _WIDTH, 0),
        height=_first(tags, _HEIGHT, 0),
        samples=_first(tags, _SAMPLES, 1),
        dtype=np.dtype(f"{'<' if order == b'II' else '>'}{code}{depth // 8}"),
        photometric=photometric,
        is_planar=is_planar,
        predictor=_first(tags, _PREDICTOR, 1),
        compression=compression,
        is_associated=int((extra if isinstance(extra, tuple) else (extra,))[0]) == _ASSOCIATED,
        tags=tags,
    )


def _plane(data: bytes, layout: TiffLayout, plane: int, planes: int) -> np.ndarray:
    """Return the samples of one plane, shape [height, width, samples]."""
    count, tags = layout.samples // planes, layout.tags
    is_tiled = _TILE_OFFSETS in tags
    tile_width = _first(tags, _TILE_WIDTH, layout.width) if is_tiled else layout.width
    rows = _first(tags, _TILE_HEIGHT if is_tiled else _STRIP_ROWS, layout.height)
    rows = rows if is_tiled else min(rows, layout.height)
    across, down = -(-layout.width // tile_width), -(-layout.height // rows)
    offsets = tags[_TILE_OFFSETS if is_tiled else _STRIP_OFFSETS]
    sizes = tags.get(_TILE_BYTES if is_tiled else _STRIP_BYTES)
    if sizes is None:
        raise ValueError("no sizes of strips")
    first, parts = plane * across * down, []
    pixel = count * layout.dtype.itemsize
    for k in range(first, first + across * down):
        # Each part is shown by itself, for predictors begin anew in it.
        part = data[offsets[k] : offsets[k] + sizes[k]]
        last = (k - first) // across == down - 1
        height = layout.height - (down - 1) * rows if last and not is_tiled else rows
        raw = _decompressed(part, tile_width * pixel, height, layout.compression)
        parts.append(_samples(raw, layout, count))
    lines = [np.concatenate(parts[row * across : (row + 1) * across], axis=1) for row in range(down)]
    return np.concatenate(lines)[: layout.height, : layout.width]


def _decompressed(part: bytes, width: int, height: int, compression: int) -> np.ndarray:
    """Return the bytes of a strip or tile, shape [height, width], by showing it to Pillow as a grey image."""
    if compression == 1:
        return np.frombuffer(part, np.uint8, width * height).reshape(height, width)
    entries = (
        *((_WIDTH, width), (_HEIGHT, height), (_BITS, 8), (_COMPRESSION, compression)),
        *((_PHOTOMETRIC, _BLACK_IS_ZERO), (_STRIP_OFFSETS, 8), (_SAMPLES, 1)),
        *((_STRIP_ROWS, height), (_STRIP_BYTES, len(part))),
    )
    directory = struct.pack("<H", len(entries))
    directory += b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in entries) + struct.pack("<I", 0)
    at = 8 + len(part) + len(part) % 2
    file = struct.pack("<2sHI", b"II", 42, at) + part.ljust(at - 8, b"\0") + directory
    with PilImage.open(io.BytesIO(file), formats=("TIFF",)) as image:
        return np.asarray(image)


def _samples(raw: np.ndarray, layout: TiffLayout, count: int) -> np.ndarray:
    """Return the samples of a strip or tile from its bytes, the predictor undone: shape [height, width, count]."""
    height, size = len(raw), layout.dtype.itemsize
    if layout.predictor == _FLOATING:
        # Rows of bytes, the most significant ones of all samples first, each the difference from its left neighbour.
        differences = raw.reshape(height, -1, count)
        planes = np.cumsum(differences, axis=1, dtype=np.uint8).reshape(height, size, -1)
        big = np.ascontiguousarray(planes.transpose(0, 2, 1)).view(layout.dtype.newbyteorder(">"))
        return big.reshape(height, -1, count)
    samples = np.ascontiguousarray(raw).view(layout.dtype).reshape(height, -1, count)
    if layout.predictor == _HORIZONTAL:
        return np.cumsum(samples, axis=1, dtype=layout.dtype.newbyteorder("="))
    return samples


def _channels(samples: np.ndarray, layout: TiffLayout) -> np.ndarray:
    """Return grey or colour, and alpha if there is any; uint8 or float32."""
    if samples.dtype == np.uint8 and layout.photometric in (_BLACK_IS_ZERO, _RGB) and not layout.is_associated:
        channels = samples
    elif samples.dtype.kind == "f":
        channels = samples.astype(np.float32)
    else:
        channels = (samples / float(np.iinfo(samples.dtype).max)).astype(np.float32)
    colors = _COLORS[layout.photometric]
    color, alpha = channels[..., :colors], channels[..., colors : colors + 1]
    if layout.is_associated and alpha.shape[2]:
        color = np.divide(color, alpha, out=np.zeros_like(color), where=alpha > 0)
    if layout.photometric == _WHITE_IS_ZERO:
        color = 1 - color
    if layout.photometric == _CMYK:
        color = (1 - color[..., :3]) * (1 - color[..., 3:])
    return np.concatenate([color, alpha], axis=2)
