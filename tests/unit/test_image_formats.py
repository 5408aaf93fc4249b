# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Every kind of image file at every depth: files made here as their specifications have them, values compared."""

import io
import itertools
import struct
import zlib

import numpy as np
import OpenEXR
import pytest
from PIL import Image as PilImage

from warp_rt.errors import SceneError
from warp_rt.usd.image_files import read_image_file

HEIGHT, WIDTH = 18, 21  # neither fits strips of 7 rows nor tiles of 16


def read(tmp_path, data: bytes) -> tuple[np.ndarray, int]:
    """Return texels as float64, top row first, and the number of channels."""
    path = tmp_path / "image"
    path.write_bytes(data)
    file = read_image_file(str(path))
    return file.pixels[::-1].astype(float) / (255 if file.pixels.dtype == np.uint8 else 1), file.channel_count


def texels(dtype: np.dtype, channels: int, size: tuple[int, int] = (HEIGHT, WIDTH)) -> np.ndarray:
    rng = np.random.default_rng(channels)
    if dtype.kind == "f":
        return rng.uniform(0, 4, (*size, channels)).astype(dtype)
    return rng.integers(0, np.iinfo(dtype).max, (*size, channels), dtype=dtype, endpoint=True)


def picture(values: np.ndarray) -> np.ndarray:
    """Return what 1 to 4 channels stand for, float64, shape [h, w, 4]: integers are shares of their greatest value."""
    values = values / float(np.iinfo(values.dtype).max) if values.dtype.kind in "ui" else values.astype(float)
    count = values.shape[2]
    color = values[..., :3] if count >= 3 else np.repeat(values[..., :1], 3, axis=2)
    alpha = values[..., count - 1 :] if count in (2, 4) else np.ones((*values.shape[:2], 1))
    return np.concatenate([color, alpha], axis=2)


# --- TIFF


def lzw(raw: bytes) -> bytes:
    """Return bytes compressed by LZW, as libtiff does it: the strip of a grey file."""
    file = io.BytesIO()
    PilImage.frombytes("L", (len(raw), 1), raw).save(file, "TIFF", compression="tiff_lzw")
    with PilImage.open(file) as image:
        (offset,), (size,) = image.tag_v2[273], image.tag_v2[279]
    return file.getvalue()[offset : offset + size]


COMPRESSIONS = {1: bytes, 5: lzw, 8: zlib.compress}


def tiff(
    values: np.ndarray,
    *,
    order: str = "<",
    photometric: int | None = None,
    compression: int = 1,
    predictor: int = 1,
    is_planar: bool = False,
    is_tiled: bool = False,
    extra: int = 2,
) -> bytes:
    """Return a TIFF of channels [h, w, c] as TIFF 6.0 has it, in strips of 7 rows or tiles of 16 x 16."""
    height, width, count = values.shape
    big, bits = values.dtype.newbyteorder(">"), values.dtype.itemsize * 8
    photometric = (2 if count >= 3 else 1) if photometric is None else photometric

    def encode(block: np.ndarray) -> bytes:
        raw = block.astype(values.dtype.newbyteorder(order)).tobytes()
        if predictor == 2:
            differences = np.concatenate([block[:, :1], block[:, 1:] - block[:, :-1]], axis=1)
            raw = differences.astype(values.dtype.newbyteorder(order)).tobytes()
        if predictor == 3:  # the most significant bytes of a row first, then differences of bytes
            rows, columns, samples = block.shape
            planes = block.astype(big).view(np.uint8).reshape(rows, columns * samples, -1)
            line = planes.transpose(0, 2, 1).reshape(rows, -1)
            raw = np.concatenate([line[:, :samples], line[:, samples:] - line[:, :-samples]], axis=1).tobytes()
        return COMPRESSIONS[compression](raw)

    blocks = []
    for plane in np.split(values, count, axis=2) if is_planar else [values]:
        if is_tiled:
            padded = np.pad(plane, ((0, -height % 16), (0, -width % 16), (0, 0)))
            corners = itertools.product(range(0, height, 16), range(0, width, 16))
            blocks += [encode(padded[y : y + 16, x : x + 16]) for y, x in corners]
        else:
            blocks += [encode(plane[y : y + 7]) for y in range(0, height, 7)]
    tags = {
        **{256: ("I", [width]), 257: ("I", [height]), 258: ("H", [bits] * count), 259: ("H", [compression])},
        **{262: ("H", [photometric]), 277: ("H", [count]), 284: ("H", [1 + is_planar]), 317: ("H", [predictor])},
        339: ("H", [{"u": 1, "i": 2, "f": 3}[values.dtype.kind]] * count),
        **({322: ("I", [16]), 323: ("I", [16])} if is_tiled else {278: ("I", [7])}),
        (324 if is_tiled else 273): ("I", [0] * len(blocks)),
        (325 if is_tiled else 279): ("I", [len(block) for block in blocks]),
    }
    colors = {0: 1, 1: 1, 2: 3, 5: 4}[photometric]
    if count > colors:
        tags[338] = ("H", [extra] * (count - colors))
    longer = {tag: len(numbers) * struct.calcsize(kind) for tag, (kind, numbers) in tags.items()}
    at = 8 + 2 + 12 * len(tags) + 4
    places = {}
    for tag in sorted(tags):
        if longer[tag] > 4:
            places[tag], at = at, at + longer[tag]
    offsets = [at + sum(len(block) for block in blocks[:k]) for k in range(len(blocks))]
    tags[324 if is_tiled else 273] = ("I", offsets)
    directory, values_beyond = struct.pack(f"{order}H", len(tags)), b""
    for tag in sorted(tags):
        kind, numbers = tags[tag]
        body = struct.pack(f"{order}{len(numbers)}{kind}", *numbers)
        if tag in places:
            values_beyond += body
            body = struct.pack(f"{order}I", places[tag])
        directory += struct.pack(f"{order}HHI", tag, 3 if kind == "H" else 4, len(numbers)) + body.ljust(4, b"\0")
    head = struct.pack(f"{order}2sHI", b"II" if order == "<" else b"MM", 42, 8)
    return head + directory + struct.pack(f"{order}I", 0) + values_beyond + b"".join(blocks)


@pytest.mark.parametrize("is_tiled", [False, True], ids=["strips", "tiles"])
@pytest.mark.parametrize("is_planar", [False, True], ids=["pixels", "planes"])
@pytest.mark.parametrize("dtype", ["u1", "u2", "u4", "f2", "f4", "f8"])
@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_tiff(tmp_path, channels, dtype, is_planar, is_tiled):
    values = texels(np.dtype(dtype), channels)
    for order, compression in itertools.product("<>", COMPRESSIONS):
        for predictor in (1,) if compression == 1 else (1, 3 if values.dtype.kind == "f" else 2):
            fields = {"order": order, "compression": compression, "predictor": predictor}
            found, count = read(tmp_path, tiff(values, is_planar=is_planar, is_tiled=is_tiled, **fields))
            np.testing.assert_allclose(found, picture(values), rtol=1e-6, err_msg=str(fields))
            assert count == channels


def test_tiff_whose_zero_is_white_and_signed_numbers(tmp_path):
    values = texels(np.dtype("u2"), 1)
    found, _ = read(tmp_path, tiff(values, photometric=0))
    np.testing.assert_allclose(found[..., 0], 1 - values[..., 0] / 65535, atol=1e-6)
    signed = values.astype("i2")
    found, _ = read(tmp_path, tiff(signed))
    np.testing.assert_allclose(found[..., 0], signed[..., 0] / 32767, atol=1e-6)


@pytest.mark.parametrize("dtype", ["u1", "u2"])
def test_cmyk_tiff_is_ink_on_white(tmp_path, dtype):
    values = texels(np.dtype(dtype), 4)
    ink = values / float(np.iinfo(values.dtype).max)
    found, _ = read(tmp_path, tiff(values, photometric=5))
    # In 8 bits the product is rounded to a code.
    np.testing.assert_allclose(found[..., :3], (1 - ink[..., :3]) * (1 - ink[..., 3:]), atol=1.01 / 255)


def test_colours_that_are_multiplied_by_alpha_are_divided(tmp_path):
    values = texels(np.dtype("f4"), 4)
    values[0, 0] = 0
    found, _ = read(tmp_path, tiff(values, extra=1))
    np.testing.assert_allclose(found[1, 1, :3], values[1, 1, :3] / values[1, 1, 3], rtol=1e-6)
    assert (found[0, 0] == 0).all()


@pytest.mark.parametrize("cut", [9, 60, 300, 1500])
def test_damaged_wide_tiff_is_refused_in_one_line(tmp_path, cut):
    with pytest.raises(SceneError, match=r"^[^\n]+$"):
        read(tmp_path, tiff(texels(np.dtype("u2"), 3), compression=8)[:cut])


# --- PNG


PASSES = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2))


def png(codes, color_type, depth, *, is_interlaced=False, palette=None, clear=b"") -> bytes:
    """Return a PNG of codes [h, w, c] as PNG (third edition) has it, unfiltered."""

    def lines(block: np.ndarray) -> bytes:
        if depth == 16:
            return b"".join(b"\0" + row.astype(">u2").tobytes() for row in block)
        rows = (row.reshape(-1, 1).astype(np.uint8) for row in block)
        return b"".join(b"\0" + np.packbits(np.unpackbits(row, axis=1)[:, 8 - depth :]).tobytes() for row in rows)

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    parts = [codes[y::step_y, x::step_x] for x, y, step_x, step_y in PASSES] if is_interlaced else [codes]
    size = struct.pack(">II", codes.shape[1], codes.shape[0])
    result = b"\x89PNG\r\n\x1a\n"
    result += chunk(b"IHDR", size + struct.pack(">BBBBB", depth, color_type, 0, 0, is_interlaced))
    result += chunk(b"PLTE", palette) if palette else b""
    result += chunk(b"tRNS", clear) if clear else b""
    body = b"".join(lines(part) for part in parts if part.size)
    return result + chunk(b"IDAT", zlib.compress(body)) + chunk(b"IEND", b"")


KINDS = [(0, 1, depth) for depth in (1, 2, 4, 8, 16)] + [(2, 3, depth) for depth in (8, 16)]  # colour type, channels
ALPHA = [(color_type, channels, depth) for color_type, channels in ((4, 2), (6, 4)) for depth in (8, 16)]


@pytest.mark.parametrize("is_interlaced", [False, True], ids=["plain", "interlaced"])
@pytest.mark.parametrize(
    ("color_type", "channels", "depth", "has_clear"),
    [*((*kind, False) for kind in KINDS + ALPHA), *((*kind, True) for kind in KINDS)],
)
def test_png(tmp_path, color_type, channels, depth, has_clear, is_interlaced):
    codes = np.random.default_rng(depth).integers(0, 1 << depth, (11, 13, channels))
    expected = picture(codes / ((1 << depth) - 1))
    clear = b""
    if has_clear:
        clear = codes[3, 4].astype(">u2").tobytes()
        expected[..., 3] = ~(codes == codes[3, 4]).all(axis=2)
    found, _ = read(tmp_path, png(codes, color_type, depth, is_interlaced=is_interlaced, clear=clear))
    np.testing.assert_allclose(found, expected, atol=1e-6)


@pytest.mark.parametrize("depth", [1, 2, 4, 8])
def test_png_with_a_palette(tmp_path, depth):
    rng = np.random.default_rng(depth)
    palette = rng.integers(0, 256, (1 << depth, 4), dtype=np.uint8)
    codes = rng.integers(0, 1 << depth, (11, 13, 1))
    clear = palette[:, 3].tobytes()
    found, _ = read(tmp_path, png(codes, 3, depth, palette=palette[:, :3].tobytes(), clear=clear))
    np.testing.assert_allclose(found, palette[codes[..., 0]] / 255, atol=1e-6)


# --- OpenEXR


def exr(tmp_path, *parts: OpenEXR.Part) -> bytes:
    OpenEXR.File(list(parts)).write(str(tmp_path / "made.exr"))
    return (tmp_path / "made.exr").read_bytes()


@pytest.mark.parametrize("is_tiled", [False, True], ids=["scanlines", "tiles"])
@pytest.mark.parametrize("dtype", [np.float16, np.float32])
@pytest.mark.parametrize(
    ("compression", "tolerance"),
    [
        *((name, 0.0) for name in ("NO", "RLE", "ZIPS", "ZIP", "PIZ")),
        ("PXR24", 2.0**-15),  # 32-bit floats keep 15 bits of mantissa
        ("B44", 2.0**-6),  # lossy: 4 x 4 texels in 14 bytes
        ("B44A", 2.0**-6),
        ("DWAA", 0.03),  # lossy: cosines
        ("DWAB", 0.03),
    ],
)
def test_exr(tmp_path, compression, tolerance, dtype, is_tiled):
    values = np.kron(texels(np.dtype(dtype), 4, (3, 4)), np.ones((8, 8, 1), dtype)).astype(dtype)
    kind = OpenEXR.tiledimage if is_tiled else OpenEXR.scanlineimage
    header = {"compression": getattr(OpenEXR, f"{compression}_COMPRESSION"), "type": kind}
    header |= {"tiles": OpenEXR.TileDescription()} if is_tiled else {}
    found, count = read(tmp_path, exr(tmp_path, OpenEXR.Part(header, {"RGBA": values})))
    np.testing.assert_allclose(found, values, rtol=tolerance, atol=tolerance)
    assert count == 4


def test_exr_of_whole_numbers_and_of_other_line_orders(tmp_path):
    grey = np.arange(12, dtype=np.uint32).reshape(3, 4)
    found, count = read(tmp_path, exr(tmp_path, OpenEXR.Part({}, {"Y": grey})))
    np.testing.assert_array_equal(found[..., 0], grey)
    assert count == 1
    header = {"lineOrder": OpenEXR.DECREASING_Y}
    found, _ = read(tmp_path, exr(tmp_path, OpenEXR.Part(header, {"Y": grey.astype(np.float32)})))
    np.testing.assert_array_equal(found[..., 0], grey)


def test_exr_shows_the_first_part_that_is_a_picture(tmp_path):
    depth = OpenEXR.Part({"name": "depth"}, {"Z": np.ones((3, 4), np.float32)})
    values = texels(np.dtype(np.float32), 3, (3, 4))
    color = OpenEXR.Part({"name": "color"}, {"RGB": values})
    found, count = read(tmp_path, exr(tmp_path, depth, color))
    np.testing.assert_array_equal(found[..., :3], values)
    assert count == 3
    with pytest.raises(SceneError, match="no colour among its channels Z"):
        read(tmp_path, exr(tmp_path, depth))


def chroma_exr(planes: dict[str, np.ndarray], step: int) -> bytes:
    """Return an uncompressed EXR of luminance, and of chroma at every so many texels, which OpenEXR's Python cannot."""
    height, width = planes["Y"].shape

    def attribute(name: str, kind: str, data: bytes) -> bytes:
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(data)) + data

    steps = {name: 1 if name in "AY" else step for name in sorted(planes)}
    channels = b"".join(n.encode() + b"\0" + struct.pack("<4i", 2, 0, s, s) for n, s in steps.items())
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    head = struct.pack("<2i", 20000630, 2) + attribute("channels", "chlist", channels + b"\0")
    head += attribute("compression", "compression", b"\0") + attribute("lineOrder", "lineOrder", b"\0")
    head += attribute("dataWindow", "box2i", window) + attribute("displayWindow", "box2i", window)
    head += attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    head += attribute("screenWindowCenter", "v2f", bytes(8))
    head += attribute("screenWindowWidth", "float", struct.pack("<f", 1)) + b"\0"
    lines = []
    for row in range(height):
        there = [planes[name][row // s].astype("<f4").tobytes() for name, s in steps.items() if row % s == 0]
        data = b"".join(there)
        lines.append(struct.pack("<2i", row, len(data)) + data)
    ends = len(head) + 8 * height + np.cumsum([0, *map(len, lines)])
    return head + ends[:-1].astype("<u8").tobytes() + b"".join(lines)


@pytest.mark.parametrize("step", [1, 2])
@pytest.mark.parametrize("has_alpha", [False, True])
def test_exr_of_luminance_and_chroma(tmp_path, step, has_alpha):
    """Chroma that is linear in the place is what it was between the texels that have it."""
    rng = np.random.default_rng(3)
    y, x = np.mgrid[0:6, 0:8]
    luminance = rng.uniform(0.2, 4, (6, 8))
    red, blue = 0.3 - 0.04 * x + 0.02 * y, 0.03 * x - 0.2 + 0.01 * y
    planes = {"Y": luminance, "RY": red[::step, ::step], "BY": blue[::step, ::step]}
    if has_alpha:
        planes["A"] = rng.uniform(0, 1, (6, 8))
    found, count = read(tmp_path, chroma_exr(planes, step))
    within = np.s_[: 7 - step, : 9 - step]
    np.testing.assert_allclose(found[..., 0][within], ((1 + red) * luminance)[within], rtol=1e-5)
    np.testing.assert_allclose(found[..., 2][within], ((1 + blue) * luminance)[within], rtol=1e-5)
    rec709 = [0.2126, 0.7152, 0.0722]
    np.testing.assert_allclose(found[..., :3] @ rec709, luminance, rtol=1e-3)
    assert count == (4 if has_alpha else 3)


# --- TGA, JPEG, WebP, BMP


@pytest.mark.parametrize("compression", [None, "tga_rle"])
@pytest.mark.parametrize("mode", ["L", "LA", "RGB", "RGBA"])
def test_tga(tmp_path, mode, compression):
    values = texels(np.dtype("u1"), len(mode))
    file = io.BytesIO()
    options = {"compression": compression} if compression else {}
    PilImage.fromarray(values.squeeze(), mode).save(file, "TGA", **options)
    found, count = read(tmp_path, file.getvalue())
    np.testing.assert_allclose(found, picture(values), atol=1e-6)
    assert count == len(mode)


@pytest.mark.parametrize("depth", [24, 32])
def test_tga_with_a_palette(tmp_path, depth):
    rng = np.random.default_rng(depth)
    palette, codes = rng.integers(0, 256, (20, 4), dtype=np.uint8), rng.integers(0, 20, (5, 6), dtype=np.uint8)
    entries = palette[:, [2, 1, 0, 3][: depth // 8]].tobytes()
    head = struct.pack("<BBBHHBHHHHBB", 0, 1, 1, 0, 20, depth, 0, 0, 6, 5, 8, 0x20)
    found, count = read(tmp_path, head + entries + codes.tobytes())
    expected = palette[codes] / 255
    if depth == 24:
        expected[..., 3] = 1
    np.testing.assert_allclose(found, expected, atol=1e-6)
    assert count == depth // 8


@pytest.mark.parametrize("progressive", [False, True])
@pytest.mark.parametrize("mode", ["L", "RGB", "CMYK"])
def test_jpeg(tmp_path, mode, progressive):
    """Of one colour, which survives the cosines; ink is ink on white."""
    color = np.array([[[200, 30, 90, 51]]], np.uint8)[..., : 1 if mode == "L" else len(mode)]
    values = np.broadcast_to(color, (16, 24, color.shape[2]))
    file = io.BytesIO()
    PilImage.fromarray(np.ascontiguousarray(values).squeeze(), mode).save(
        file, "JPEG", quality=100, progressive=progressive
    )
    found, count = read(tmp_path, file.getvalue())
    if mode == "CMYK":
        color = ((255 - color[..., :3].astype(int)) * (255 - color[..., 3:].astype(int)) / 255).round().astype(np.uint8)
    np.testing.assert_allclose(found, np.broadcast_to(picture(color), found.shape), atol=1.6 / 255)
    assert count == (1 if mode == "L" else 3)


@pytest.mark.parametrize(("kind", "modes"), [("WEBP", ("RGB", "RGBA")), ("BMP", ("L", "RGB"))])
def test_webp_and_bmp(tmp_path, kind, modes):
    for mode in modes:
        values = texels(np.dtype("u1"), len(mode))
        file = io.BytesIO()
        PilImage.fromarray(values.squeeze(), mode).save(
            file, kind, **({"lossless": True, "exact": True} if kind == "WEBP" else {})
        )
        found, _ = read(tmp_path, file.getvalue())
        np.testing.assert_allclose(found, picture(values), atol=1e-6)
