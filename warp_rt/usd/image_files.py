# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Image files to texels: PNG, JPEG, TGA, BMP, TIFF and WebP by Pillow, .exr by OpenEXR, .hdr by our own reader.

Files are opened through USD's asset resolver, so members of .usdz packages are files like any other.
"""

from __future__ import annotations

import io
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from PIL import Image as PilImage
from PIL import ImageFile as PilImageFile

from warp_rt.errors import SceneError
from warp_rt.usd.assets import read_asset
from warp_rt.usd.exr_chroma import LUMINANCE_CHROMA, from_chroma
from warp_rt.usd.radiance_hdr import radiance_size, read_radiance
from warp_rt.usd.wide_tiff import read_wide_tiff, wide_tiff

MAX_TEXELS = 1 << 27  # 16384 x 8192, the largest sky in common use; 512 MiB of 8-bit texels
_PILLOW_FORMATS = ("PNG", "JPEG", "TGA", "BMP", "TIFF", "WEBP")
# Unpackers of 16-bit PNG: each keeps one byte of two; its partner keeps the other, or all (grey with alpha).
_OTHER_BYTES = {"RGB;16B": "RGB;16L", "RGBA;16B": "RGBA;16L", "LA;16B": "RGBA"}
_EXR_PICTURES = (
    ("R", "G", "B", "A"),
    ("R", "G", "B"),
    (*LUMINANCE_CHROMA, "A"),
    LUMINANCE_CHROMA,
    ("Y", "A"),
    ("Y",),
    ("R", "G"),
    ("R",),
)
NO_WRAPS = ("black", "black")
"""What lies beyond an image whose file says nothing of it: OpenEXR, standard attribute ``wrapmodes``."""
_TIFF_WRAP_MODES = 33303  # Pixar's tag, libtiff's TIFFTAG_PIXAR_WRAPMODES
_MAX_HALF = 65504.0  # largest finite half float: what infinite texels of skies become


@dataclass(frozen=True)
class ImageFile:
    """Texels of a file, and what decides how they are to be decoded."""

    pixels: np.ndarray
    """uint8 or finite float32, shape [height, width, 4], bottom row first."""
    channel_count: int
    """1 to 4 in the file. One channel stands for red, green and blue; of two, the second is alpha."""
    wraps: tuple[str, str] = NO_WRAPS
    """What EXR and TIFF files may say of what lies beyond, across and upwards: ``black``, ``clamp``, ``periodic`` or
    ``mirror``, or another word."""

    @property
    def is_srgb_by_default(self) -> bool:
        """Whether ``sourceColorSpace = "auto"`` means sRGB: 8 bits a channel and at least three channels."""
        return self.pixels.dtype == np.uint8 and self.channel_count >= 3


def read_image_file(path: str) -> ImageFile:
    """Return the texels of a file.

    Args:
        path: A resolved asset path, as ``Sdf.AssetPath.resolvedPath`` has it; may lie in a package.

    Raises:
        SceneError: The file is missing, damaged, too large, or of a format that is not supported; the message does
            not hold the path.
    """
    data = read_asset(path)
    if not data:
        raise SceneError("the file is empty")
    try:
        if data.startswith(b"#?"):
            _check_size(*radiance_size(data))
            return _image_file(read_radiance(data))
        if data.startswith(b"\x76\x2f\x31\x01"):
            return _read_exr(data)
        wide = wide_tiff(data)
        if wide is not None:
            _check_size(wide.width, wide.height)
            return _image_file(read_wide_tiff(data, wide), _wraps(wide.tags.get(_TIFF_WRAP_MODES)))
        return _read_with_pillow(data)
    except SceneError:
        raise
    except MemoryError:
        raise SceneError("the image does not fit into memory") from None
    except Exception as error:
        # The decoders raise whatever they meet in a damaged file: OSError, SyntaxError, struct.error, ValueError, ...
        raise SceneError(f"the image is damaged ({' '.join(str(error).split())[:120]})") from None


def _check_size(width: int, height: int) -> None:
    if width < 1 or height < 1 or width * height > MAX_TEXELS:
        raise SceneError(f"{width} x {height} texels; 1 to {MAX_TEXELS} are supported")


def _wraps(text: Any) -> tuple[str, str]:
    """Return what ``wrapmodes`` say: a word for both directions, or two with a comma between."""
    words = [word.strip() for word in text.rstrip("\0").split(",")] if isinstance(text, str) else []
    return (words[0], words[-1]) if words and all(words[:2]) else NO_WRAPS


def _image_file(channels: np.ndarray, wraps: tuple[str, str] = NO_WRAPS) -> ImageFile:
    """Return an image from 1 to 4 channels, shape [height, width, c], top row first."""
    height, width, count = channels.shape
    pixels = np.empty((height, width, 4), channels.dtype)
    pixels[..., :3] = channels[..., :3] if count >= 3 else channels[..., :1]
    pixels[..., 3] = channels[..., count - 1] if count in (2, 4) else (255 if channels.dtype == np.uint8 else 1.0)
    if channels.dtype == np.float32:
        np.nan_to_num(pixels, copy=False, nan=0.0, posinf=_MAX_HALF, neginf=0.0)
    return ImageFile(np.ascontiguousarray(pixels[::-1]), count, wraps)


# --- OpenEXR


def _read_exr(data: bytes) -> ImageFile:
    import OpenEXR  # here, for few scenes hold one and the import costs as much as numpy's

    headers = OpenEXR.File(io.BytesIO(data), separate_channels=True, header_only=True)
    part, names = _exr_picture([[channel.name for channel in part.header["channels"]] for part in headers.parts])
    header = headers.header(part)
    low, high = header["dataWindow"]
    _check_size(int(high[0]) - int(low[0]) + 1, int(high[1]) - int(low[1]) + 1)
    channels = OpenEXR.File(io.BytesIO(data), separate_channels=True).channels(part)
    planes = [channels[name].pixels for name in names]
    if len(names) > 1 and names[1].endswith("RY"):
        luminance, red, blue = planes[:3]
        planes[:3] = from_chroma(luminance, red, blue, header.get("chromaticities"))
    if any(plane is None or plane.shape != planes[0].shape for plane in planes):
        raise SceneError("subsampled channels are not supported")
    return _image_file(np.stack(planes, axis=-1).astype(np.float32), _wraps(header.get("wrapmodes")))


def _exr_picture(parts: Sequence[Sequence[str]]) -> tuple[int, list[str]]:
    """Return the first part that holds a picture, and the channels that make it up; ``parts`` are their names."""
    for part, names in enumerate(parts):
        found = _exr_channel_names(names)
        if found:
            return part, found
    raise SceneError(f"no colour among its channels {', '.join([name for names in parts for name in names][:8])}")


def _exr_channel_names(names: Sequence[str]) -> list[str]:
    """Return the channels that make up the picture: R, G, B, A or Y, RY, BY, A, else those of the first layer."""
    layers = sorted({name.rpartition(".")[0] for name in names}, key=lambda layer: (layer != "", layer))
    for layer in layers:
        prefix = f"{layer}." if layer else ""
        for wanted in _EXR_PICTURES:
            if all(prefix + name in names for name in wanted):
                return [prefix + name for name in wanted]
    return []


# --- Pillow


def _read_with_pillow(data: bytes) -> ImageFile:
    with warnings.catch_warnings():
        # Pillow warns from 2^26 texels on; the limit here is its own, and damaged EXIF data is of no interest.
        warnings.simplefilter("ignore")
        try:
            image = PilImage.open(io.BytesIO(data), formats=_PILLOW_FORMATS)
        except PilImage.UnidentifiedImageError:
            raise SceneError("the format is none of PNG, JPEG, TGA, BMP, TIFF, WebP, EXR, HDR") from None
        except PilImage.DecompressionBombError:
            raise SceneError(f"more than {MAX_TEXELS} texels") from None
        _check_size(*image.size)
        wide = _read_wide(data, image)
        if wide is not None:
            return wide
        rawmode = _rawmode(image.tile[0]) if image.tile else ""
        tags = getattr(image, "tag_v2", {})
        image.load()
    return _image_file(_channels(image, rawmode), _wraps(tags.get(_TIFF_WRAP_MODES)))


def _channels(image: PilImage.Image, rawmode: str) -> np.ndarray:
    """Return a loaded image as channels, shape [height, width, 1 to 4], uint8 or float32.

    Args:
        image: The image.
        rawmode: How its file has it.
    """
    mode = image.mode
    if mode.startswith("I;16"):
        grey = np.asarray(image, np.float32)[..., None]
        return _with_clear(grey / np.float32(65535), grey, image)
    if mode == "I":
        # 32-bit integers have no agreed scale; full range of the unsigned 16-bit data that they usually hold.
        return np.asarray(image, np.float32)[..., None] / np.float32(65535)
    if mode == "F":
        return np.asarray(image, np.float32)[..., None]
    if mode == "L" and rawmode in ("L;2", "L;4") and "transparency" in image.info:
        # Pillow makes 8 bits of a PNG's 2 or 4, but leaves the value that is clear as it is.
        grey = np.asarray(image)[..., None]
        return _with_clear(grey, grey // (255 // (2 ** int(rawmode[2:]) - 1)), image)
    has_alpha = (
        mode in ("LA", "La", "PA", "RGBA", "RGBa")
        or "transparency" in image.info
        or (image.palette is not None and image.palette.mode == "RGBA")
    )
    target = ("L" if mode in ("1", "L", "LA", "La") else "RGB") + ("A" if has_alpha else "")
    channels = np.asarray(image if mode == target else image.convert(target))
    return channels.reshape(*channels.shape[:2], -1)


def _with_clear(channels: np.ndarray, codes: np.ndarray, image: PilImage.Image) -> np.ndarray:
    """Return channels with alpha where a PNG has a colour that is clear, which ``codes`` are compared with."""
    clear = image.info.get("transparency")
    if not isinstance(clear, int | tuple):
        return channels
    opaque = 255 if channels.dtype == np.uint8 else 1
    alpha = np.where((codes == np.array(clear)).all(axis=2, keepdims=True), 0, opaque).astype(channels.dtype)
    return np.concatenate([channels, alpha], axis=2)


def _read_wide(data: bytes, image: PilImageFile.ImageFile) -> ImageFile | None:
    """Return a 16-bit PNG of several channels, or None if it is not one.

    Pillow keeps only the more significant byte of such channels. Decoded a second time by the unpacker of
    ``_OTHER_BYTES`` it gives the rest.
    """
    rawmodes = [_rawmode(tile) for tile in image.tile]
    if not rawmodes or not all(rawmode in _OTHER_BYTES for rawmode in rawmodes):
        return None
    other = PilImage.open(io.BytesIO(data), formats=_PILLOW_FORMATS)
    other.tile = [
        tile._replace(args=(_OTHER_BYTES[mode], *tile.args[1:]) if isinstance(tile.args, tuple) else _OTHER_BYTES[mode])
        for tile, mode in zip(other.tile, rawmodes, strict=True)
    ]
    high, low = np.asarray(image, np.float32), np.asarray(other, np.float32)
    if rawmodes[0] == "LA;16B":
        high, low = low[..., 0::2], low[..., 1::2]
    codes = high * 256 + low
    return _image_file(_with_clear(codes / np.float32(65535), codes, image))


def _rawmode(tile: Any) -> str:
    """Return how a tile of a Pillow image is packed; empty where nothing is said."""
    args = tile.args[:1] if isinstance(tile.args, tuple) else (tile.args,)
    return args[0] if args and isinstance(args[0], str) else ""
