# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Image files of every kind that scenes hold, written here byte by byte or by their own libraries."""

import io
import struct
import zipfile
import zlib

import numpy as np
import OpenEXR
import pytest
from PIL import Image as PilImage

from warp_rt.errors import SceneError
from warp_rt.usd.image_files import read_image_file

RANDOM = np.random.default_rng(7)


def _png(texels, color_type, depth=16):
    """Return a PNG file from integers [h, w, c], unfiltered."""
    rows = b"".join(b"\0" + row.astype(f">u{depth // 8}").tobytes() for row in texels)

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    head = struct.pack(">IIBBBBB", texels.shape[1], texels.shape[0], depth, color_type, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def _tiff16(texels, compress):
    """Return a little-endian RGB TIFF of 16 bits a channel."""
    height, width, count = texels.shape
    strip = texels.astype("<u2").tobytes()
    if compress:
        strip = zlib.compress(strip)
    bits_at, strip_at = 8 + 2 + 9 * 12 + 4, 8 + 2 + 9 * 12 + 4 + 2 * count
    tags = [
        (256, 3, 1, width),
        (257, 3, 1, height),
        (258, 3, count, bits_at),
        (259, 3, 1, 8 if compress else 1),
        (262, 3, 1, 2),
        (273, 4, 1, strip_at),
        (277, 3, 1, count),
        (278, 3, 1, height),
        (279, 4, 1, len(strip)),
    ]
    body = struct.pack("<2sHIH", b"II", 42, 8, len(tags))
    body += b"".join(struct.pack("<HHII", *tag) for tag in tags) + struct.pack("<I", 0)
    return body + struct.pack(f"<{count}H", *[16] * count) + strip


def _read(tmp_path, data, name="image"):
    path = tmp_path / name
    path.write_bytes(data)
    return read_image_file(str(path))


def _read_pillow(tmp_path, image, file_format, **options):
    buffer = io.BytesIO()
    image.save(buffer, file_format, **options)
    return _read(tmp_path, buffer.getvalue())


@pytest.mark.parametrize("file_format", ["PNG", "TGA", "BMP", "TIFF", "WEBP"])
def test_rgb_keeps_every_texel_with_the_bottom_row_first(tmp_path, file_format):
    texels = RANDOM.integers(0, 256, (5, 7, 3), np.uint8)
    options = {"lossless": True} if file_format == "WEBP" else {}
    image = _read_pillow(tmp_path, PilImage.fromarray(texels), file_format, **options)
    assert image.pixels.dtype == np.uint8
    np.testing.assert_array_equal(image.pixels[..., :3], texels[::-1])
    assert (image.pixels[..., 3] == 255).all()
    assert (image.channel_count, image.is_srgb_by_default) == (3, True)


def test_grey_stands_for_all_three_colours_and_is_not_srgb(tmp_path):
    texels = RANDOM.integers(0, 256, (3, 4), np.uint8)
    image = _read_pillow(tmp_path, PilImage.fromarray(texels), "PNG")
    np.testing.assert_array_equal(image.pixels, np.dstack([texels[::-1]] * 3 + [np.full((3, 4), 255)]))
    assert (image.channel_count, image.is_srgb_by_default) == (1, False)


def test_grey_with_alpha(tmp_path):
    texels = RANDOM.integers(0, 256, (3, 4, 2), np.uint8)
    image = _read(tmp_path, _png(texels, 4, 8))
    np.testing.assert_array_equal(image.pixels, texels[::-1, :, [0, 0, 0, 1]])
    assert (image.channel_count, image.is_srgb_by_default) == (2, False)


def test_one_bit_is_black_and_white(tmp_path):
    texels = np.array([[0, 255], [255, 255]], np.uint8)
    image = _read_pillow(tmp_path, PilImage.fromarray(texels).convert("1"), "PNG")
    np.testing.assert_array_equal(image.pixels[..., 0], texels[::-1])
    assert image.channel_count == 1


def test_palette_becomes_its_colours_and_transparency(tmp_path):
    palette = PilImage.fromarray(np.array([[0, 1]], np.uint8), mode="P")
    palette.putpalette([10, 20, 30, 40, 50, 60])
    plain = _read_pillow(tmp_path, palette, "PNG")
    np.testing.assert_array_equal(plain.pixels[0], [[10, 20, 30, 255], [40, 50, 60, 255]])
    clear = _read_pillow(tmp_path, palette, "PNG", transparency=bytes([0, 255]))
    np.testing.assert_array_equal(clear.pixels[0, :, 3], [0, 255])
    assert (plain.channel_count, clear.channel_count) == (3, 4)


def test_cmyk_jpeg_becomes_rgb(tmp_path):
    red = PilImage.new("CMYK", (8, 8), (0, 255, 255, 0))
    image = _read_pillow(tmp_path, red, "JPEG", quality=95)
    assert np.abs(image.pixels[..., :3].astype(int) - [255, 0, 0]).max() <= 4
    assert image.is_srgb_by_default


def test_exif_orientation_is_not_honoured(tmp_path):
    exif = PilImage.Exif()
    exif[0x0112] = 6  # turned by 90 degrees
    image = _read_pillow(tmp_path, PilImage.new("RGB", (6, 2)), "JPEG", exif=exif)
    assert image.pixels.shape == (2, 6, 4)


@pytest.mark.parametrize(("channels", "color_type"), [(1, 0), (2, 4), (3, 2), (4, 6)])
def test_sixteen_bit_png_keeps_every_bit(tmp_path, channels, color_type):
    texels = RANDOM.integers(0, 65536, (5, 7, channels))
    image = _read(tmp_path, _png(texels, color_type))
    assert image.pixels.dtype == np.float32
    assert (image.channel_count, image.is_srgb_by_default) == (channels, False)
    order = {1: [0], 2: [0, 3], 3: [0, 1, 2], 4: [0, 1, 2, 3]}[channels]
    np.testing.assert_array_equal(np.rint(image.pixels[..., order] * 65535.0), texels[::-1])


@pytest.mark.parametrize("compress", [False, True])
def test_sixteen_bit_tiff_keeps_every_bit(tmp_path, compress):
    texels = RANDOM.integers(0, 65536, (5, 7, 3))
    image = _read(tmp_path, _tiff16(texels, compress))
    np.testing.assert_array_equal(np.rint(image.pixels[..., :3] * 65535.0), texels[::-1])


def test_float_tiff_is_kept(tmp_path):
    texels = np.array([[0.25, 3.5], [-1.0, 1e6]], np.float32)
    image = _read_pillow(tmp_path, PilImage.fromarray(texels), "TIFF")
    np.testing.assert_array_equal(image.pixels[..., 0], texels[::-1])


# --- OpenEXR


def _read_exr(tmp_path, channels):
    path = str(tmp_path / "image.exr")
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, channels).write(path)
    return read_image_file(path)


def test_exr_half_and_float_are_exact(tmp_path):
    rgba = (RANDOM.random((4, 3, 4)) * 100).astype(np.float16)
    image = _read_exr(tmp_path, {name: np.ascontiguousarray(rgba[..., i]) for i, name in enumerate("RGBA")})
    np.testing.assert_array_equal(image.pixels, rgba[::-1].astype(np.float32))
    assert (image.channel_count, image.is_srgb_by_default) == (4, False)
    y = RANDOM.random((4, 3)).astype(np.float32)
    np.testing.assert_array_equal(_read_exr(tmp_path, {"Y": y}).pixels[..., 2], y[::-1])


def test_exr_layer_stands_in_where_there_is_no_plain_colour(tmp_path):
    planes = {f"beauty.{name}": np.full((2, 2), i, np.float32) for i, name in enumerate("RGB")}
    image = _read_exr(tmp_path, {**planes, "Z": np.full((2, 2), 9, np.float32)})
    np.testing.assert_array_equal(image.pixels[0, 0], [0, 1, 2, 1])


def test_exr_texels_are_made_finite(tmp_path):
    plane = np.array([[np.nan, np.inf, -np.inf]], np.float32)
    np.testing.assert_array_equal(_read_exr(tmp_path, {"Y": plane}).pixels[0, :, 0], [0.0, 65504.0, 0.0])


def test_exr_without_colour_is_refused(tmp_path):
    with pytest.raises(SceneError, match="no colour"):
        _read_exr(tmp_path, {"Z": np.zeros((2, 2), np.float32)})


# --- Radiance


def _hdr(size, body, header=b""):
    return b"#?RADIANCE\n" + header + b"FORMAT=32-bit_rle_rgbe\n\n" + size + b"\n" + body


def test_radiance_texels_are_mantissa_by_power_of_two(tmp_path):
    # (128, 64, 32) / 256 * 2^(129 - 128) = (1, 1/2, 1/4); exponent zero is black whatever the mantissas
    image = _read(tmp_path, _hdr(b"-Y 2 +X 1", bytes([128, 64, 32, 129, 9, 9, 9, 0])))
    np.testing.assert_array_equal(image.pixels[:, 0], [[0, 0, 0, 1], [1, 0.5, 0.25, 1]])
    assert (image.channel_count, image.is_srgb_by_default) == (3, False)


def test_radiance_exposure_lines_are_divided_out(tmp_path):
    data = _hdr(b"-Y 1 +X 1", bytes([128, 128, 128, 129]), b"EXPOSURE=2\nEXPOSURE=4\n")
    np.testing.assert_array_equal(_read(tmp_path, data).pixels[0, 0, :3], 1 / 8)


def test_radiance_runs_by_component(tmp_path):
    red = bytes([128 + 8, 128])  # eight times 128
    green = bytes([8, *range(8)])  # eight literals
    blue = bytes([128 + 5, 64, 3, 1, 2, 3])  # five times 64, then three literals
    exponent = bytes([128 + 8, 136])  # 2^(136 - 136) = 1
    image = _read(tmp_path, _hdr(b"-Y 1 +X 8", bytes([2, 2, 0, 8]) + red + green + blue + exponent))
    expected = np.stack([np.full(8, 128), np.arange(8), [64] * 5 + [1, 2, 3]], axis=-1)
    np.testing.assert_array_equal(image.pixels[0, :, :3], expected)


def test_radiance_repeats_of_the_old_kind(tmp_path):
    body = bytes([10, 20, 30, 136, 1, 1, 1, 3, 40, 50, 60, 136])
    image = _read(tmp_path, _hdr(b"-Y 1 +X 5", body))
    np.testing.assert_array_equal(image.pixels[0, :, 0], [10, 10, 10, 10, 40])


def test_radiance_orientations(tmp_path):
    texels = bytes([1, 0, 0, 136, 2, 0, 0, 136])
    for size, expected in (
        (b"-Y 1 +X 2", [[1, 2]]),
        (b"-Y 1 -X 2", [[2, 1]]),
        (b"+Y 2 +X 1", [[1], [2]]),  # bottom row first in the file, as in memory
        (b"-Y 2 +X 1", [[2], [1]]),
        (b"+X 2 -Y 1", [[1, 2]]),
        (b"-X 1 +Y 2", [[1], [2]]),
    ):
        np.testing.assert_array_equal(_read(tmp_path, _hdr(size, texels)).pixels[..., 0], expected, str(size))


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (_hdr(b"-Y 4 +X 4", bytes(12)), "ends early"),
        (_hdr(b"-Y 1 +X 8", bytes([2, 2, 0, 8, 128 + 100, 1, 0, 0])), "passes the end"),
        (_hdr(b"-Y 1 +X 8", bytes([2, 2, 0, 8, 0, 1, 1, 1])), "length zero"),
        (_hdr(b"-Y 99999 +X 99999", b""), "texels"),
        (_hdr(b"-Y 1 +Y 1", bytes(4)), "damaged"),
        (_hdr(b"-Y 1 +X 1", bytes(4)).replace(b"rgbe", b"xyze"), "not supported"),
    ],
)
def test_damaged_radiance_is_refused(tmp_path, data, message):
    with pytest.raises(SceneError, match=message):
        _read(tmp_path, data)


# --- hostile and missing files


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "the file is empty"),
        (b"GIF89a" + bytes(100), "format is none of"),
        (_png(np.zeros((4, 4, 3), int), 2, 8)[:48], "damaged"),
        (b"\x76\x2f\x31\x01" + bytes(50), "damaged"),
    ],
)
def test_damaged_files_are_refused_in_one_line(tmp_path, data, message):
    with pytest.raises(SceneError, match=message) as caught:
        _read(tmp_path, data)
    assert "\n" not in str(caught.value)


def test_decompression_bomb_is_refused_by_its_header(tmp_path):
    bomb = _png(np.zeros((1, 1, 3), int), 2, 8)
    head = b"IHDR" + struct.pack(">IIBBBBB", 100_000, 100_000, 8, 2, 0, 0, 0)
    bomb = bomb[:12] + head + struct.pack(">I", zlib.crc32(head)) + bomb[33:]
    with pytest.raises(SceneError, match="more than 134217728 texels"):
        _read(tmp_path, bomb)


def test_missing_file_is_refused(tmp_path):
    with pytest.raises(SceneError, match="cannot be opened"):
        read_image_file(str(tmp_path / "nothing.png"))


def test_member_of_a_package(tmp_path):
    package = tmp_path / "scene.usdz"
    with zipfile.ZipFile(package, "w") as archive:
        archive.writestr("scene.usda", "#usda 1.0\n")
        archive.writestr("0/red.png", _png(np.full((2, 2, 3), 7), 2, 8))
    image = read_image_file(f"{package}[0/red.png]")
    assert (image.pixels[..., :3] == 7).all()
