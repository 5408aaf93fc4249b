# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""From files and primvars to pixels: a square that shines as its texture says, seen straight on, a texel a pixel."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image as PilImage

from warp_rt import Renderer, RenderOptions
from warp_rt.usd.load import load_stage

RNG = np.random.default_rng(3)
BYTES = {count: RNG.integers(1, 256, (2, 2, count)).astype(np.uint8) for count in (1, 2, 3, 4)}
WORDS = {count: RNG.integers(1, 65536, (2, 2, count)) for count in (1, 2, 3, 4)}
FLOATS = {count: RNG.uniform(0, 3, (2, 2, count)).astype(np.float32) for count in (1, 3)}
MODES = {1: "L", 2: "LA", 3: "RGB", 4: "RGBA"}
SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]


def linear(values: np.ndarray) -> np.ndarray:
    """The sRGB curve of IEC 61966-2-1."""
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def png16(path: Path, pixels: np.ndarray) -> None:
    """Write a PNG of 16 bits a channel, which Pillow does not for several channels (ISO/IEC 15948)."""
    height, width, count = pixels.shape
    rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in pixels)

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    header = struct.pack(">IIBBBBB", width, height, 16, {1: 0, 2: 4, 3: 2, 4: 6}[count], 0, 0, 0)
    parts = (chunk(b"IHDR", header), chunk(b"IDAT", zlib.compress(rows)), chunk(b"IEND", b""))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(parts))


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("pixels")
    for count, pixels in BYTES.items():
        PilImage.fromarray(pixels.squeeze(), MODES[count]).save(path / f"b{count}.png")
    for count, pixels in WORDS.items():
        png16(path / f"w{count}.png", pixels)
    for count, pixels in FLOATS.items():
        header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
        with OpenEXR.File(header, {"RGB" if count == 3 else "Y": pixels.squeeze()}) as file:
            file.write(str(path / f"f{count}.exr"))
    for tile, value in ((1001, 50), (1003, 100), (1012, 150)):
        PilImage.fromarray(np.full((2, 2, 3), value, np.uint8)).save(path / f"u.{tile}.png")
    return path


def coordinates(points=SQUARE, kind: str = "texCoord2f", interpolation: str = "vertex", extra: str = "") -> str:
    return f'{kind}[] primvars:st = {points} (interpolation = "{interpolation}")\n{extra}'


def texture(file: str, *lines: str, name: str = "T") -> str:
    outputs = "\n".join(("float3 outputs:rgb", *(f"float outputs:{channel}" for channel in "rgba")))
    return f"""
        def Shader "{name}" {{
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @{file}@
            float2 inputs:st.connect = </M/R.outputs:result>
            {chr(10).join(lines)}
            {outputs}
        }}"""


READER = """
        def Shader "R" {
            uniform token info:id = "UsdPrimvarReader_float2"
            string inputs:varname = "st"
            float2 outputs:result
        }"""


FACES = """
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    uniform token subdivisionScheme = "none"
"""


def pixels(
    folder: Path,
    nodes: str,
    *,
    st: str | None = None,
    source: str = "T.outputs:rgb",
    size: int = 2,
    material: str = "",
    kind: str = "Mesh",
    shape: str = FACES,
    texture_filter: str = "bilinear",
) -> np.ndarray:
    """Return the picture of a square whose emission some nodes give, row 0 at the top: shape [size, size, 3].

    ``kind`` and ``shape`` make something else of the square's corners.
    """
    path = folder / "stage.usda"
    path.write_text(f"""#usda 1.0
(upAxis = "Y")
def Camera "Eye" {{
    token projection = "orthographic"
    float horizontalAperture = 10
    float verticalAperture = 10
    double3 xformOp:translate = (0.5, 0.5, 5)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
def DistantLight "Dark" {{
    float inputs:intensity = 0
}}
def {kind} "Square" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    {shape}
    {coordinates() if st is None else st}
    rel material:binding = </M>
}}
def Material "M" {{
    {material}
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S" {{
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0, 0, 0)
        float inputs:ior = 1
        float inputs:roughness = 1
        color3f inputs:emissiveColor.connect = </M/{source}>
        token outputs:surface
    }}
    {nodes}
}}""")
    options = RenderOptions(width=size, height=size, texture_filter=texture_filter)
    return np.asarray(Renderer(load_stage(path), options).render().color)[..., :3]


GREY = {1, 2}


def channels(values: np.ndarray) -> np.ndarray:
    """What red, green and blue are of an image: those of a grey one are all its grey."""
    return np.repeat(values[..., :1], 3, axis=2) if values.shape[2] in GREY else values[..., :3]


FORMATS = {
    **{f"b{n}.png": (BYTES[n] / 255, n >= 3) for n in BYTES},
    **{f"w{n}.png": (WORDS[n] / 65535, False) for n in WORDS},
    **{f"f{n}.exr": (FLOATS[n].astype(float), False) for n in FLOATS},
}


@pytest.mark.parametrize("space", ["auto", "raw", "sRGB"])
@pytest.mark.parametrize("file", FORMATS)
def test_formats_and_their_colour_spaces(folder, file, space):
    """Under auto 8 bits of three or four channels are sRGB."""
    values, is_encoded = FORMATS[file]
    found = pixels(folder, READER + texture(file, f'token inputs:sourceColorSpace = "{space}"'))
    is_encoded = {"auto": is_encoded, "raw": False, "sRGB": True}[space]
    expected = linear(channels(values)) if is_encoded else channels(values)
    np.testing.assert_allclose(found, expected, rtol=2e-5, atol=2e-6)


@pytest.mark.parametrize("file", FORMATS)
def test_alpha_is_never_decoded(folder, file):
    values, _ = FORMATS[file]
    lines = ('token inputs:sourceColorSpace = "sRGB"',)
    alpha = values[..., -1:] if values.shape[2] in (2, 4) else np.ones((2, 2, 1))
    found = pixels(folder, READER + texture(file, *lines), source="T.outputs:a")
    np.testing.assert_allclose(found, np.repeat(alpha, 3, axis=2), atol=2e-6)


def test_texels_are_decoded_then_scaled_then_shifted(folder):
    lines = ("float4 inputs:scale = (2, 0.5, 1.5, 1)", "float4 inputs:bias = (0.1, 0.2, 0.05, 0)")
    expected = linear(BYTES[3] / 255) * (2, 0.5, 1.5) + (0.1, 0.2, 0.05)
    np.testing.assert_allclose(pixels(folder, READER + texture("b3.png", *lines)), expected, rtol=1e-5)


def test_a_fallback_is_not_scaled(folder):
    lines = ("float4 inputs:scale = (2, 2, 2, 2)", "float4 inputs:fallback = (0.3, 0.6, 0.9, 0.5)")
    found = pixels(folder, READER + texture("none.png", *lines))
    np.testing.assert_allclose(found, np.broadcast_to((0.3, 0.6, 0.9), (2, 2, 3)), rtol=1e-5)


def texel(place: float, mode: str) -> int | None:
    """Which of two texels an axis has at a place; none outside of a black border."""
    k = int(np.floor(2 * place))
    folded = {"clamp": min(max(k, 0), 1), "repeat": k % 2, "mirror": min(k % 4, 3 - k % 4)}
    return folded.get(mode, k if 0 <= k < 2 else None)


@pytest.mark.parametrize("mode", ["black", "clamp", "repeat", "mirror", "useMetadata", ""])
def test_wrap_modes_beyond_the_image_each_way(folder, mode):
    """Black is a texel of 0, which is scaled and shifted as others are; a PNG has no metadata, and so is black."""
    lines = [f'token inputs:wrap{axis} = "{mode}"' for axis in "ST"] if mode else []
    st = coordinates([(-1, -2), (3, -2), (3, 2), (-1, 2)])
    found = pixels(folder, READER + texture("b3.png", *lines, "float4 inputs:bias = (0.5, 0, 0, 0)"), st=st, size=8)
    texels = linear(BYTES[3] / 255)
    expected = np.zeros((8, 8, 3))
    for row in range(8):
        for column in range(8):
            x, y = texel(-0.75 + 0.5 * column, mode), texel(1.75 - 0.5 * row, mode)
            expected[row, column] = 0 if x is None or y is None else texels[1 - y, x]
    np.testing.assert_allclose(found, np.add(expected, (0.5, 0, 0)), rtol=1e-5, atol=1e-6)


def test_udim_tiles_that_are_missing_are_black(folder):
    st = coordinates([(-1, -1), (3, -1), (3, 3), (-1, 3)])
    nodes = READER + texture("u.<UDIM>.png", 'token inputs:sourceColorSpace = "raw"')
    expected = np.zeros((4, 4))  # of tiles, the top row first
    expected[2, 1], expected[2, 3], expected[1, 2] = 50 / 255, 100 / 255, 150 / 255
    found = pixels(folder, nodes, st=st, size=4)
    np.testing.assert_allclose(found, np.repeat(expected[..., None], 3, axis=2), atol=1e-6)
    alpha = pixels(folder, nodes, st=st, size=4, source="T.outputs:a")
    np.testing.assert_allclose(alpha[..., 0], expected > 0, atol=1e-6)


TEXELS = linear(BYTES[3] / 255)


@pytest.mark.parametrize(
    ("st", "expected"),
    [
        (coordinates(interpolation="faceVarying"), TEXELS),
        (coordinates(interpolation="varying"), TEXELS),
        (coordinates([(1, 1), (0, 1), (0, 0), (1, 0)], interpolation="faceVarying",
                     extra="int[] primvars:st:indices = [2, 3, 0, 1]"), TEXELS),
        (coordinates([(0.25, 0.25)], interpolation="uniform"), TEXELS[1, 0]),
        (coordinates([(0.75, 0.75)], interpolation="constant"), TEXELS[0, 1]),
        (coordinates(kind="float2"), TEXELS),
        (coordinates(kind="texCoord2h"), TEXELS),
        (coordinates(kind="texCoord2d"), TEXELS),
        (coordinates([(*place, 5) for place in SQUARE], kind="texCoord3f"), TEXELS),
    ],
    ids=["faceVarying", "varying", "indexed", "uniform", "constant", "float2", "half", "double", "three"],
)  # fmt: skip
def test_texture_coordinates_of_every_kind(folder, st, expected):
    found = pixels(folder, READER + texture("b3.png"), st=st)
    np.testing.assert_allclose(found, np.broadcast_to(expected, (2, 2, 3)), rtol=1e-5)


def test_transforms_scale_then_turn_then_move(folder):
    """Of an image whose red is s and whose green is t."""
    ramp = np.stack(np.broadcast_arrays(np.arange(256)[None], 255 - np.arange(256)[:, None], 0), -1).astype(np.uint8)
    PilImage.fromarray(ramp).save(folder / "ramp.png")
    move = """
        def Shader "X" {
            uniform token info:id = "UsdTransform2d"
            float2 inputs:in.connect = </M/R.outputs:result>
            float inputs:rotation = 30
            float2 inputs:scale = (2, 3)
            float2 inputs:translation = (0.1, -0.2)
            float2 outputs:result
        }"""
    modes = [f'token inputs:wrap{axis} = "clamp"' for axis in "ST"]
    image = texture("ramp.png", 'token inputs:sourceColorSpace = "raw"', *modes).replace("/M/R.", "/M/X.")
    st = coordinates([(0, 0), (0.2, 0), (0.2, 0.2), (0, 0.2)])
    found = pixels(folder, READER + move + image, st=st, size=4)
    along = (np.arange(4) + 0.5) / 20
    place = np.stack(np.meshgrid(along, along[::-1]), -1) * (2, 3)
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    place = place @ np.array([[c, s], [-s, c]]) + (0.1, -0.2)
    np.testing.assert_allclose(found[..., :2], np.clip((place * 256 - 0.5) / 255, 0, 1), atol=1e-5)


def test_files_and_factors_through_nested_graphs(folder):
    graphs = """
        def NodeGraph "G" {
            asset inputs:file.connect = </M.inputs:file>
            color3f outputs:out.connect = </M/G/H.outputs:out>
            def NodeGraph "H" {
                asset inputs:file.connect = </M/G.inputs:file>
                float4 inputs:gain = (2, 2, 2, 1)
                color3f outputs:out.connect = </M/G/H/T.outputs:rgb>
                def Shader "T" {
                    uniform token info:id = "UsdUVTexture"
                    asset inputs:file.connect = </M/G/H.inputs:file>
                    float4 inputs:scale.connect = </M/G/H.inputs:gain>
                    float2 inputs:st.connect = </M/R.outputs:result>
                    float3 outputs:rgb
                }
            }
        }"""
    found = pixels(folder, READER + graphs, source="G.outputs:out", material="asset inputs:file = @b3.png@")
    np.testing.assert_allclose(found, 2 * TEXELS, rtol=1e-5)


@pytest.mark.parametrize("where", ["reader", "prim", "material"])
@pytest.mark.parametrize("kind", ["float", "float3", "float4", "int", "normal", "point", "vector"])
def test_readers_of_every_type(folder, kind, where):
    types = {"normal": "normal3f", "point": "point3f", "vector": "vector3f"}
    value = {"float": 0.25, "int": 2, "float4": (0.1, 0.2, 0.3, 0.4)}.get(kind, (0.1, 0.2, 0.3))
    nothing = tuple(0 for _ in value) if isinstance(value, tuple) else 0
    own = types.get(kind, kind)
    reader = f"""
        def Shader "T" {{
            uniform token info:id = "UsdPrimvarReader_{kind}"
            string inputs:varname = "some"
            {own} inputs:fallback = {value if where == "reader" else nothing}
            {own} outputs:result
        }}"""
    st = f'{own}[] primvars:some = [{value}] (interpolation = "constant")' if where == "prim" else ""
    material = f"{own} primvars:some = {value}" if where == "material" else ""
    found = pixels(folder, reader, st=st, source="T.outputs:result", material=material, size=1)
    expected = value[:3] if isinstance(value, tuple) else (value,) * 3
    np.testing.assert_allclose(found[0, 0], expected, rtol=1e-6)


@pytest.mark.parametrize(
    ("kind", "shape"),
    [
        ("Mesh", FACES),
        ("Points", "float[] widths = [1, 1, 1, 1]"),
        ("BasisCurves", 'uniform token type = "linear"\nint[] curveVertexCounts = [4]\nfloat[] widths = [1, 1, 1, 1]'),
        ("BasisCurves", "int[] curveVertexCounts = [4]\nfloat[] widths = [1, 1]"),
    ],
)
def test_without_coordinates_one_texel_is_shown(folder, kind, shape):
    """That at (0, 0), the fallback of coordinates, whatever the ray's footprint."""
    image = texture("b3.png", 'token inputs:wrapS = "clamp"', 'token inputs:wrapT = "clamp"')
    found = pixels(folder, READER + image, st="", size=8, kind=kind, shape=shape, texture_filter="anisotropic")
    met = found.any(axis=2)
    assert met.sum() > 20
    np.testing.assert_allclose(found[met], np.tile(linear(BYTES[3][1, 0] / 255), (met.sum(), 1)), rtol=1e-5)
