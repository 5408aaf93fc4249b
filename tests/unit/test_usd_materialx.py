# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""MaterialX's nodes written as UsdShade: what they give is held against their definitions, texel by texel."""

from __future__ import annotations

import colorsys

import numpy as np
import pytest
from PIL import Image as PilImage
from pxr import Usd, UsdShade

from warp_rt.report import Report
from warp_rt.scene import OpacityMode, Wrap
from warp_rt.scene.programs import Op
from warp_rt.scene.texture_values import texture_values
from warp_rt.usd.image_cache import ImageCache
from warp_rt.usd.load import load_stage
from warp_rt.usd.materials import MaterialReader
from warp_rt.usd.surface_inputs import InputReader

TEXELS = np.random.default_rng(6).integers(0, 256, (4, 4, 4)).astype(np.uint8)
SPOT = (0.375, 0.625)  # the middle of column 1, row 2 from below: the row 1 of the file
TEXEL = TEXELS[1, 1] / 255.0
RGB, ALPHA = TEXEL[:3], TEXEL[3]


@pytest.fixture(scope="module")
def image(tmp_path_factory):
    path = tmp_path_factory.mktemp("materialx") / "image.png"
    PilImage.fromarray(TEXELS).save(path)
    return path.as_posix()


def node(name: str, identifier: str, *lines: str, outputs: tuple[str, ...] = ("out",)) -> str:
    ports = "".join(f"float outputs:{output}\n" for output in outputs)
    return f'def Shader "{name}" {{\nuniform token info:id = "{identifier}"\n' + "\n".join(lines) + f"\n{ports}}}\n"


def picture(image: str, kind: str = "color4", name: str = "T", *lines: str) -> str:
    return node(name, f"ND_image_{kind}", f'asset inputs:file = @{image}@ (colorSpace = "raw")', *lines)


def wire(name: str, source: str, output: str = "out", kind: str = "color3f") -> str:
    return f"{kind} inputs:{name}.connect = </M/{source}.outputs:{output}>"


def read(nodes: str, count: int = 3, output: str = "out", name: str = "N", spot=SPOT):
    """Return the input that is connected to node N, its value at a spot, its reader, and the codes."""
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(
        f'#usda 1.0\ndef Material "M" {{\ndef Shader "S" {{\n{wire("x", name, output)}\n}}\n{nodes}\n}}'
    )
    report = Report()
    images = ImageCache(report)
    reader = InputReader(images, Usd.TimeCode.Default(), report)
    found = reader.read(UsdShade.Shader(stage.GetPrimAtPath("/M/S")).GetInput("x"), count, stage.GetPrimAtPath("/M"))
    value = None
    if found is not None and found.texture >= 0:
        value = texture_values(reader.textures[found.texture], images.images, np.array([spot]))[0]
    elif found is not None and not found.primvar:
        value = np.array(found.value)
    if value is not None:
        value = np.repeat(value[found.channel], count) if found.channel >= 0 else value[:count]
    return found, value, reader, [d.code for d in report]


def at(nodes: str, spots) -> np.ndarray:
    """Return the values of the texture that node N gives, at spots: shape [n, 4]; it is told to be an image."""
    found, _, reader, codes = read(nodes)
    assert codes == ["N938"]
    values = texture_values(reader.textures[found.texture], reader._rows._images.images, np.array(spots))
    return np.repeat(values[:, found.channel, None], 4, axis=1) if found.channel >= 0 else values


def vec(name: str, *values: float, kind: str = "color3f") -> str:
    numbers = tuple(float(value) for value in values)
    return f"{kind} inputs:{name} = {numbers if len(numbers) > 1 else numbers[0]}"


A, B = np.array([0.5, 0.25, 2.0]), np.array([0.1, -0.2, 0.3])
CASES = {
    "add": (wire("in1", "T"), vec("in2", *B), RGB + B),
    "subtract": (vec("in1", *A), wire("in2", "T"), A - RGB),
    "multiply": (wire("in1", "T"), vec("in2", *A), RGB * A),
    "divide": (wire("in1", "T"), vec("in2", *A), RGB / A),
    "invert": (wire("in", "T"), "", 1 - RGB),
    "luminance": (wire("in", "T"), "", np.repeat(RGB @ (0.2722287, 0.6740818, 0.0536895), 3)),
    "range": (
        wire("in", "T"),
        "\n".join((vec("inlow", *B), vec("inhigh", *A), vec("outlow", 0, 0, 1), vec("outhigh", 1, 2, 3))),
        np.array((0, 0, 1)) + (RGB - B) / (A - B) * np.array((1, 2, 2)),
    ),
}


@pytest.mark.parametrize("category", CASES)
def test_arithmetic_of_a_texture_and_constants(image, category):
    *lines, expected = CASES[category]
    _, value, _, codes = read(picture(image, "color3") + node("N", f"ND_{category}_color3", *lines))
    np.testing.assert_allclose(value, expected, atol=1e-6)
    assert codes == []


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        ((wire("fg", "T"), vec("bg", *B), vec("mix", 0.25, kind="float")), 0.25 * RGB + 0.75 * B),
        ((vec("fg", *A), vec("bg", *B), wire("mix", "X", "outr", "float")), B + (A - B) * RGB[0]),
        ((wire("fg", "T"), wire("bg", "T"), vec("mix", 0.25, kind="float")), RGB),
    ],
)
def test_mix(image, lines, expected):
    nodes = picture(image, "color3") + node("X", "ND_separate3_color3", wire("in", "T"), outputs=("outr",))
    _, value, _, codes = read(nodes + node("N", "ND_mix_color3", *lines))
    np.testing.assert_allclose(value, expected, atol=1e-6)
    assert codes == []


@pytest.mark.parametrize(
    ("identifier", "lines", "output", "expected"),
    [
        ("ND_convert_color4_color3", (), "out", RGB),
        ("ND_separate4_color4", (), "outg", np.repeat(RGB[1], 3)),
        ("ND_separate4_color4", (), "outa", np.repeat(ALPHA, 3)),
        ("ND_extract_color4", ("int inputs:index = 2",), "out", np.repeat(RGB[2], 3)),
        ("ND_swizzle_color4_color3", ('string inputs:channels = "bar"',), "out", (RGB[2], ALPHA, RGB[0])),
        ("ND_swizzle_color4_color3", ('string inputs:channels = "g01"',), "out", (RGB[1], 0, 1)),
        ("ND_dotproduct_vector4", (vec("in2", 1, 2, 3, 4, kind="float4"),), "out", np.repeat(TEXEL @ (1, 2, 3, 4), 3)),
    ],
)
def test_channels(image, identifier, lines, output, expected):
    name = "in1" if "dotproduct" in identifier else "in"
    nodes = picture(image) + node("N", identifier, wire(name, "T"), *lines, outputs=(output,))
    _, value, _, codes = read(nodes, output=output)
    np.testing.assert_allclose(value, expected, atol=1e-6)
    assert codes == []


def test_channels_of_one_image_are_combined_though_two_nodes_read_it(image):
    nodes = picture(image, "color4") + picture(image, "color4", "U")
    nodes += node("X", "ND_separate4_color4", wire("in", "T"), outputs=("outb",))
    nodes += node("Y", "ND_separate4_color4", wire("in", "U"), outputs=("outr",))
    lines = (wire("in1", "X", "outb"), vec("in2", 0.5, kind="float"), wire("in3", "Y", "outr"))
    _, value, reader, codes = read(nodes + node("N", "ND_combine3_color3", *lines))
    np.testing.assert_allclose(value, (RGB[2], 0.5, RGB[0]), atol=1e-6)
    assert (codes, len(reader.textures)) == ([], 1)


def test_mixed_channels_keep_their_wrap_mode_and_their_fallback(image):
    body = 'string inputs:uaddressmode = "constant"'
    nodes = picture(image, "color3", "T", body) + node("N", "ND_luminance_color3", wire("in", "T"))
    nodes += node("P", "ND_invert_color3", wire("in", "N"))
    _, outside, _, _ = read(nodes, name="P", spot=(-1.0, 0.5))
    np.testing.assert_allclose(outside[:3], 1.0, atol=1e-6)  # 1 - luminance of black
    missing = node("T", "ND_image_color3", "asset inputs:file = @/nowhere.png@", vec("default", 0.2, 0.4, 0.6))
    _, value, _, codes = read(missing + node("N", "ND_luminance_color3", wire("in", "T")))
    np.testing.assert_allclose(value, np.repeat((0.2, 0.4, 0.6) @ np.array((0.2722287, 0.6740818, 0.0536895)), 3))
    assert codes == ["W201"]


@pytest.mark.parametrize(
    ("category", "lines", "expected"),
    [
        ("power", (vec("in1", 4, kind="float"), vec("in2", 0.5, kind="float")), 2.0),
        ("clamp", (vec("in", 4, kind="float"),), 1.0),
        ("smoothstep", (vec("in", 0.25, kind="float"),), 0.15625),
        ("sin", (vec("in", np.pi / 6, kind="float"),), 0.5),
        ("round", (vec("in", 0.5, kind="float"),), 1.0),
        ("round", (vec("in", 2.5, kind="float"),), 3.0),
        ("modulo", (vec("in1", -0.25, kind="float"), vec("in2", 1, kind="float")), 0.75),
        ("ifgreater", (vec("value1", 2, kind="float"), vec("in1", 5, kind="float"), vec("in2", 6, kind="float")), 5.0),
        ("ifequal", (vec("value1", 2, kind="float"), vec("in1", 5, kind="float"), vec("in2", 6, kind="float")), 6.0),
    ],
)
def test_constants_are_computed(category, lines, expected):
    _, value, _, codes = read(node("N", f"ND_{category}_float", *lines), count=1)
    assert (value[0], codes) == (pytest.approx(expected, rel=1e-6), [])


@pytest.mark.parametrize(("category", "gray"), [("luminance", 0.2722287), ("saturate", 0.2722287)])
def test_alpha_of_a_grey_is_that_of_the_colour(category, gray):
    """Of red of alpha 0.25, without any saturation."""
    lines = (vec("in", 1, 0, 0, 0.25, kind="color4f"), "float inputs:amount = 0" if category == "saturate" else "")
    nodes = node("X", f"ND_{category}_color4", *lines)
    for index, expected in ((0, gray), (3, 0.25)):
        picked = node("N", "ND_extract_color4", wire("in", "X", kind="color4f"), f"int inputs:index = {index}")
        _, value, _, codes = read(nodes + picked, count=1)
        assert (value[0], codes) == (pytest.approx(expected, rel=1e-6), [])


def test_primvars_are_scaled_and_shifted():
    nodes = node("P", "ND_geompropvalue_color3", 'string inputs:geomprop = "paint"', vec("default", 1, 2, 3))
    nodes += node("X", "ND_multiply_color3", wire("in1", "P"), vec("in2", *A))
    found, _, _, codes = read(nodes + node("N", "ND_add_color3", wire("in1", "X"), vec("in2", *B)))
    assert (found.value, found.primvar, found.channel, codes) == ((1, 2, 3, 0), "paint", -1, [])
    np.testing.assert_allclose((found.scale, found.bias), ((*A, 1.0), (*B, 0.0)), rtol=1e-6)


@pytest.mark.parametrize(
    ("identifier", "lines"),
    [
        ("ND_flake2d", ()),
        ("ND_extract_color3", (wire("in", "T"), "int inputs:index = -1")),
        ("ND_extract_color3", (wire("in", "T"), "int inputs:index = 7")),
        ("ND_luminance_color3", (wire("in", "T"), "float inputs:lumacoeffs = 0.3")),
    ],
)
def test_what_does_not_fold_is_named(image, identifier, lines):
    found, _, _, codes = read(picture(image, "color3") + node("N", identifier, *lines))
    assert (found, codes) == (None, ["W303"])


def test_a_texture_times_a_primvar_is_a_program(image):
    other = node("U", "ND_geompropvalue_color3", 'string inputs:geomprop = "paint"')
    product = node("N", "ND_multiply_color3", wire("in1", "T"), wire("in2", "U"))
    found, _, reader, codes = read(picture(image, "color3") + other + product)
    assert [step.op for step in found.program.steps] == [Op.TEXTURE, Op.PRIMVAR, Op.MULTIPLY]
    assert (list(found.program.primvars), list(found.program.textures), codes) == (["paint"], [0], [])
    assert reader.textures[0].primvar == "st"


def test_components_of_a_primvar_that_are_mixed_are_a_program():
    paint = node("U", "ND_geompropvalue_color3", 'string inputs:geomprop = "paint"')
    found, _, _, codes = read(paint + node("N", "ND_luminance_color3", wire("in", "U")))
    assert ([step.op for step in found.program.steps], codes) == ([Op.PRIMVAR, Op.AFFINE], [])


@pytest.mark.parametrize(
    ("category", "lines", "expected"),
    [
        ("divide", (wire("in1", "T"), vec("in2", 0, 1, 1)), (0, RGB[1], RGB[2])),
        ("divide", (vec("in1", 1, 1, 1), vec("in2", 0, 2, 4)), (0, 0.5, 0.25)),
        ("power", (vec("in1", -2, 4, 9), vec("in2", 0.5, 0.5, 0.5)), (0, 2, 3)),
    ],
)
def test_what_is_no_number_is_0_and_named(image, category, lines, expected):
    _, value, reader, codes = read(picture(image, "color3") + node("N", f"ND_{category}_color3", *lines))
    np.testing.assert_allclose(value, expected, atol=1e-6)
    assert codes == ["W303"]
    assert "no number" in next(iter(reader._report)).message


def test_what_is_no_number_at_some_texels_is_0_there_and_named(image):
    """The square root of a texel less one half, in red: 0 below it."""
    nodes = picture(image, "color3") + node("X", "ND_subtract_color3", wire("in1", "T"), vec("in2", 0.5, 0, 0))
    _, value, reader, codes = read(nodes + node("N", "ND_sqrt_color3", wire("in", "X")))
    count = int((TEXELS[..., 0] < 127.5).sum())
    assert 0 < count < 16
    assert codes == ["W313"]
    message = next(iter(reader._report)).message
    assert f"at {count} of them something on the way is no number and counts as 0" in message
    np.testing.assert_allclose(value, np.sqrt(np.maximum(RGB - (0.5, 0, 0), 0)), atol=2e-6)


# --- what is made an image

OTHERS = np.random.default_rng(7).integers(1, 256, (4, 4, 4)).astype(np.uint8)
U_RGB = OTHERS[1, 1, :3] / 255.0
U_ALPHA = OTHERS[1, 1, 3] / 255.0
T1, U1 = wire("in1", "T"), wire("in2", "U")
PAIR = (wire("fg", "T"), wire("bg", "U"))
X = np.clip((RGB - 0.1) / 0.8, 0, 1)


def hsv(function, color: np.ndarray) -> np.ndarray:
    return np.array(function(*color.tolist()))


def adjusted(color: np.ndarray, amount) -> np.ndarray:
    h, s, v = colorsys.rgb_to_hsv(*color)
    return np.array(colorsys.hsv_to_rgb((h + amount[0]) % 1, s * amount[1], v * amount[2]))


COMPUTED = {
    "multiply": ((T1, U1), RGB * U_RGB),
    "add": ((T1, U1), RGB + U_RGB),
    "subtract": ((T1, U1), RGB - U_RGB),
    "divide": ((T1, U1), RGB / U_RGB),
    "mix": ((*PAIR, wire("mix", "V", kind="float")), U_ALPHA * RGB + (1 - U_ALPHA) * U_RGB),
    "min": ((T1, U1), np.minimum(RGB, U_RGB)),
    "max": ((T1, U1), np.maximum(RGB, U_RGB)),
    "power": ((T1, vec("in2", *A)), RGB**A),
    "clamp": ((wire("in", "T"), vec("low", 0.3, 0.3, 0.3), vec("high", 0.5, 0.5, 0.5)), np.clip(RGB, 0.3, 0.5)),
    "smoothstep": ((wire("in", "T"), vec("low", 0.1, 0.1, 0.1), vec("high", 0.9, 0.9, 0.9)), X * X * (3 - 2 * X)),
    "range": (
        (wire("in", "T"), vec("inlow", 0.1, 0.1, 0.1), vec("inhigh", 0.9, 0.9, 0.9), vec("gamma", 2, 2, 2),
         "bool inputs:doclamp = 1"),
        np.sqrt(X),
    ),
    "ifgreater": (
        (wire("value1", "V", kind="float"), "float inputs:value2 = 0.9", T1, U1),
        RGB if U_ALPHA > 0.9 else U_RGB,
    ),
    "plus": ((*PAIR, "float inputs:mix = 0.5"), 0.5 * (RGB + U_RGB) + 0.5 * U_RGB),
    "minus": (PAIR, U_RGB - RGB),
    "difference": (PAIR, np.abs(U_RGB - RGB)),
    "screen": (PAIR, 1 - (1 - RGB) * (1 - U_RGB)),
    "saturate": (
        (wire("in", "T"), "float inputs:amount = 0.25"),
        0.25 * RGB + 0.75 * (RGB @ (0.2722287, 0.6740818, 0.0536895)),
    ),
    "contrast": ((wire("in", "T"), vec("amount", 2, 2, 2), vec("pivot", *A)), (RGB - A) * 2 + A),
    "rgbtohsv": ((wire("in", "T"),), hsv(colorsys.rgb_to_hsv, RGB)),
    "hsvtorgb": ((wire("in", "T"),), hsv(colorsys.hsv_to_rgb, RGB)),
    "hsvadjust": ((wire("in", "T"), vec("amount", 0.4, 0.5, 2, kind="float3")), adjusted(RGB, (0.4, 0.5, 2))),
    "sqrt": ((wire("in", "T"),), np.sqrt(RGB)),
}  # fmt: skip


def pictures(image: str, others: str) -> str:
    """Return the nodes T and U, two images, and V, the alpha of U."""
    return (
        picture(image, "color3")
        + picture(others, "color3", "U")
        + picture(others, "color4", "W")
        + node("V", "ND_extract_color4", wire("in", "W", kind="color4f"), "int inputs:index = 3")
    )


@pytest.fixture(scope="module")
def others(tmp_path_factory):
    path = tmp_path_factory.mktemp("materialx") / "others.png"
    PilImage.fromarray(OTHERS).save(path)
    return path.as_posix()


@pytest.mark.parametrize("category", COMPUTED)
def test_what_is_computed_of_images(image, others, category):
    """Texel by texel, exactly; that it becomes an image is told where it does not fold."""
    lines, expected = COMPUTED[category]
    found, value, reader, codes = read(pictures(image, others) + node("N", f"ND_{category}_color3", *lines))
    np.testing.assert_allclose(value, expected, atol=2e-6)
    assert codes == ([] if category in ("saturate", "contrast") else ["N938"])
    texture = reader.textures[found.texture]
    assert (texture.wrap_s, texture.wrap_t) == (Wrap.REPEAT, Wrap.REPEAT)  # as the images are


@pytest.mark.parametrize(
    ("category", "lines", "expected"),
    [
        ("crossproduct", (T1, U1), np.cross(RGB, U_RGB)),
        ("normalize", (wire("in", "T"),), RGB / np.linalg.norm(RGB)),
        ("magnitude", (wire("in", "T"),), np.repeat(np.linalg.norm(RGB), 3)),
        ("distance", (T1, U1), np.repeat(np.linalg.norm(RGB - U_RGB), 3)),
        ("dotproduct", (T1, U1), np.repeat(RGB @ U_RGB, 3)),
    ],
)
def test_vectors_of_images(image, others, category, lines, expected):
    _, value, _, codes = read(pictures(image, others) + node("N", f"ND_{category}_vector3", *lines))
    np.testing.assert_allclose(value, expected, atol=2e-6)
    assert codes == ["N938"]


@pytest.mark.parametrize("mode", ["clamp", "periodic", "mirror", "constant"])
def test_images_that_are_computed_go_on_as_those_they_are_made_of(image, others, mode):
    modes = [f'string inputs:{axis}addressmode = "{mode}"' for axis in "uv"]
    nodes = picture(image, "color3", "T", *modes) + picture(others, "color3", "U", *modes)
    nodes += node("X", "ND_multiply_color3", T1, U1) + node("N", "ND_add_color3", wire("in1", "X"), vec("in2", *A))
    inside = read(nodes, spot=SPOT)[1]
    np.testing.assert_allclose(inside, RGB * U_RGB + A, atol=2e-6)
    beyond = read(nodes, spot=(SPOT[0] + 1, SPOT[1]))[1]
    first, second = TEXELS[1, :, :3] / 255.0, OTHERS[1, :, :3] / 255.0  # that row, from the left
    column = {"clamp": 3, "periodic": 1, "mirror": 2}.get(mode)
    expected = A if column is None else first[column] * second[column] + A
    np.testing.assert_allclose(beyond, expected, atol=2e-6)


def test_images_that_lie_differently_are_computed_as_fine_as_the_finest(image, others):
    """One repeated thrice, the other once: over the unit square, which both fit."""
    tiled = node(
        "U", "ND_tiledimage_color3", f'asset inputs:file = @{others}@ (colorSpace = "raw")',
        vec("uvtiling", 3, 3, kind="float2"),
    )  # fmt: skip
    nodes = picture(image, "color3") + tiled + node("N", "ND_multiply_color3", T1, U1)
    spot = (0.5 / 12, 0.5 / 12)
    found, value, reader, codes = read(nodes, spot=spot)
    height, width, _ = reader._rows._images.images[reader.textures[found.texture].image].pixels.shape
    assert (width, height, codes) == (12, 12, ["N938"])
    corner = read(picture(image, "color3", "N"), spot=spot)[1]
    np.testing.assert_allclose(value, corner * OTHERS[3, 0, :3] / 255.0, atol=2e-6)


def test_what_no_wrap_mode_continues_is_told(image, others):
    tiled = node(
        "U", "ND_tiledimage_color3", f'asset inputs:file = @{others}@ (colorSpace = "raw")',
        vec("uvtiling", 0.3, 0.3, kind="float2"),
    )  # fmt: skip
    _, _, reader, codes = read(picture(image, "color3") + tiled + node("N", "ND_multiply_color3", T1, U1))
    assert codes == ["N938"]
    assert "repeated beyond" in next(iter(reader._report)).message
    assert next(iter(reader.unknown_beyond.values())).is_continued == (False, False)


def test_images_that_are_placed_alike_say_by_their_wrap_modes_how_they_go_on(image, others):
    _, _, reader, _ = read(pictures(image, others) + node("N", "ND_multiply_color3", T1, U1))
    assert next(iter(reader._report)).message == "what its network computes is made an image of 4 x 4 texels"


@pytest.mark.parametrize("center", [-3.0, 0.0, 1.0, 5.0, 13.0])
def test_a_change_beyond_the_unit_square_shows(center):
    """Red below the centre and green above; the image is as wide as it takes, and that it is one is told."""
    lines = (vec("valuel", 1, 0, 0), vec("valuer", 0, 1, 0), vec("center", center, kind="float"))
    nodes = node("N", "ND_splitlr_color3", *lines)
    spots = [(center - 0.1, 0.5), (center + 0.1, 0.5), (-900, 0.5), (900, 0.5), (center + 0.1, 700)]
    expected = [(1, 0, 0), (0, 1, 0), (1, 0, 0), (0, 1, 0), (0, 1, 0)]
    np.testing.assert_allclose(at(nodes, spots)[:, :3], expected, atol=1e-6)
    message = next(iter(read(nodes)[2]._report)).message
    assert message.endswith("that it goes on beyond as the image does is seen at samples alone")


def test_a_ramp_over_ten_units_is_whole():
    """Of coordinates by a tenth; the image reaches to 16, and linear interpolation is exact but about the end at 10."""
    nodes = node("C", "ND_texcoord_vector2")
    nodes += node("P", "ND_multiply_vector2", wire("in1", "C"), vec("in2", 0.1, 0.1, kind="float2"))
    lines = (vec("valuel", 0, 0, 0), vec("valuer", 1, 1, 1), wire("texcoord", "P"))
    values = at(nodes + node("N", "ND_ramplr_color3", *lines), [(-40, 0.5), (2.5, 3), (7.5, -2), (11, 0.5), (70, 9)])
    np.testing.assert_allclose(values[:, 0], [0, 0.25, 0.75, 1, 1], atol=1e-3)


@pytest.mark.parametrize("center", [40.0, 500.0])
def test_a_change_that_no_image_reaches_is_told(center):
    lines = (vec("valuel", 1, 0, 0), vec("valuer", 0, 1, 0), vec("center", center, kind="float"))
    _, _, reader, codes = read(node("N", "ND_splitlr_color3", *lines))
    assert codes == ["N938"]
    message = next(iter(reader._report)).message
    assert "from 0 to 1, and repeated beyond, as what is computed is not" in message


S, T = 0.4, 0.66
COLORS = {name: np.random.default_rng(k).uniform(size=3) for k, name in enumerate(("a", "b", "c", "d"))}


@pytest.mark.parametrize(
    ("category", "names", "expected"),
    [
        ("ramplr", ("valuel", "valuer"), COLORS["a"] * (1 - S) + COLORS["b"] * S),
        ("ramptb", ("valuet", "valueb"), COLORS["a"] * T + COLORS["b"] * (1 - T)),
        (
            "ramp4",
            ("valuetl", "valuetr", "valuebl", "valuebr"),
            (COLORS["a"] * (1 - S) + COLORS["b"] * S) * T + (COLORS["c"] * (1 - S) + COLORS["d"] * S) * (1 - T),
        ),
        ("splitlr", ("valuel", "valuer"), COLORS["a"]),
        ("splittb", ("valuet", "valueb"), COLORS["a"]),
        ("checkerboard", ("color1", "color2"), COLORS["b"]),  # 3 + 5 is even
    ],
)
def test_what_is_computed_of_coordinates(category, names, expected):
    """Exactly: what is linear by linear interpolation; the top is where t is 1."""
    lines = [vec(name, *color) for name, color in zip(names, COLORS.values(), strict=False)]
    _, value, _, codes = read(node("N", f"ND_{category}_color3", *lines), spot=(S, T))
    np.testing.assert_allclose(value, expected, atol=1e-6)
    assert codes == ["N938"]


@pytest.mark.parametrize("kind", ["float", "color3"])
def test_noise_of_coordinates(kind):
    """0 where coordinates are whole, with the slope of one of the gradients there; the pivot is added."""
    count = 1 if kind == "float" else 3
    place = node("C", "ND_texcoord_vector2") + node(
        "P", "ND_multiply_vector2", wire("in1", "C"), vec("in2", 8, 8, kind="float2")
    )
    lines = [wire("texcoord", "P"), "float inputs:pivot = 0.25"]
    lines += [vec("amplitude", *[2.0] * count, kind="float" if count == 1 else "float3")]
    nodes = place + node("N", f"ND_noise2d_{kind}", *lines)
    step = 2 / 1024
    for spot in ((0.25, 0.5), (0.375, 0.875)):
        value, across, up = at(nodes, [spot, (spot[0] + step, spot[1]), (spot[0], spot[1] + step)])[:, :count]
        np.testing.assert_allclose(value, 0.25, atol=2e-3)  # 1/2048 of what lies between least and greatest
        slopes = np.sort(np.abs(np.stack([across, up]) - value) / (2 * 0.6616 * 8 * step), axis=0)
        np.testing.assert_allclose(slopes, [[1] * count, [2] * count], rtol=0.02)


@pytest.mark.parametrize(
    ("identifier", "lines", "size"),
    [
        ("ND_ramplr_color3", (vec("valuer", 1, 1, 1),), (2, 1)),
        ("ND_ramptb_color3", (vec("valueb", 1, 1, 1),), (1, 2)),
        ("ND_ramp4_color3", (vec("valuebr", 1, 1, 1),), (2, 2)),
        ("ND_splitlr_color3", (vec("valuer", 1, 1, 1),), (1024, 1)),
        ("ND_checkerboard_color3", (vec("uvtiling", 8, 8, kind="float2"),), (256, 256)),  # once in a quarter
        ("ND_noise2d_float", (), (65, 65)),
    ],
)
def test_images_of_coordinates_have_the_texels_that_they_need(identifier, lines, size):
    found, _, reader, codes = read(node("N", identifier, *lines))
    pixels = reader._rows._images.images[reader.textures[found.texture].image].pixels
    assert (pixels.shape[1], pixels.shape[0], codes) == (*size, ["N938"])


def test_what_is_computed_of_coordinates_is_so_between_texels():
    """Waves at random places in and beyond the unit square, to twice what the image is to be exact to."""
    nodes = node("C", "ND_texcoord_vector2") + node("X", "ND_separate2_vector2", wire("in", "C"), outputs=("outx",))
    nodes += node("P", "ND_multiply_float", wire("in1", "X", "outx"), vec("in2", 4 * np.pi, kind="float"))
    spots = np.random.default_rng(4).uniform(-3, 3, (200, 2))
    values = at(nodes + node("N", "ND_sin_float", wire("in", "P")), spots)[:, 0]
    np.testing.assert_allclose(values, np.sin(4 * np.pi * spots[:, 0]), atol=2 * 2 / 2048)


def test_what_is_finer_than_texels_is_told():
    lines = (vec("uvtiling", 900, 900, kind="float2"), vec("uvoffset", 0.1, 0, kind="float2"))
    _, _, reader, codes = read(node("N", "ND_checkerboard_color3", *lines))
    assert codes == ["W313"]
    assert "what is finer than its texels is lost" in next(iter(reader._report)).message


@pytest.mark.parametrize(("reach", "codes"), [(1.0, ["N938"]), (1.5, ["N938", "W313"])])
def test_coordinates_beyond_an_image_are_told(reach, codes):
    """Noise is computed over the unit square; only a mesh with coordinates beyond it sees that it is repeated."""
    stage = Usd.Stage.CreateInMemory()
    surface = f'uniform token info:id = "UsdPreviewSurface"\n{wire("roughness", "N", kind="float")}'
    stage.GetRootLayer().ImportFromString(
        f"""#usda 1.0
        def Mesh "Quad" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
            int[] faceVertexCounts = [4]
            int[] faceVertexIndices = [0, 1, 2, 3]
            point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
            texCoord2f[] primvars:st = [(0, 0), ({reach}, 0), ({reach}, 1), (0, 1)] (interpolation = "vertex")
            rel material:binding = </M>
        }}
        def Material "M" {{
            token outputs:surface.connect = </M/S.outputs:surface>
            def Shader "S" {{ {surface}
                token outputs:surface
            }}
            {node("N", "ND_noise2d_float")}
        }}"""
    )
    told = [d for d in load_stage(stage).diagnostics if d.code in ("N938", "W313")]
    assert [d.code for d in told] == codes
    assert all(d.prim == "/M/S.inputs:roughness" for d in told)
    assert reach == 1.0 or "/Quad has coordinates" in told[1].message


def test_a_chequer_made_of_floors():
    """The graph that MaterialX's tests have: modulo(floor(8 s) + floor(8 t), 2)."""
    nodes = node("C", "ND_texcoord_vector2")
    nodes += node("M", "ND_multiply_vector2", wire("in1", "C"), vec("in2", 8, 8, kind="float2"))
    nodes += node("X", "ND_extract_vector2", wire("in", "M"), "int inputs:index = 0")
    nodes += node("Y", "ND_extract_vector2", wire("in", "M"), "int inputs:index = 1")
    nodes += node("F", "ND_floor_float", wire("in", "X")) + node("G", "ND_floor_float", wire("in", "Y"))
    nodes += node("A", "ND_add_float", wire("in1", "F"), wire("in2", "G"))
    nodes += node("N", "ND_modulo_float", wire("in1", "A"), "float inputs:in2 = 2")
    spots = np.array([(0.06, 0.06), (0.19, 0.06), (0.19, 0.19), (1.06, 0.19), (-0.06, 0.06)])
    np.testing.assert_array_equal(at(nodes, spots)[:, 0], np.floor(8 * spots).sum(axis=1) % 2)


def test_tiles_are_computed_each_by_itself(tmp_path):
    colors = {1001: (10, 20, 30), 1002: (200, 100, 50)}
    for number, color in colors.items():
        for name, factor in (("a", 1), ("b", 0.5)):
            texels = np.full((2, 2, 3), np.multiply(color, factor)).astype(np.uint8)
            PilImage.fromarray(texels).save(tmp_path / f"{name}.{number}.png")
    a, b = ((tmp_path / f"{name}.<UDIM>.png").as_posix() for name in "ab")
    nodes = picture(a, "color3") + picture(b, "color3", "U") + node("N", "ND_multiply_color3", T1, U1)
    for k, color in enumerate(colors.values()):
        _, value, _, codes = read(nodes, spot=(k + 0.5, 0.5))
        expected = np.array(color) / 255 * (np.multiply(color, 0.5).astype(np.uint8) / 255)
        np.testing.assert_allclose(value, expected, atol=2e-6)
        assert codes == ["N938"]


def test_nodes_that_many_lead_to_are_read_once(image, others):
    """Each of 60 nodes adds the one before to itself: 2^60 ways through the network."""
    nodes = picture(image, "color3", "X0") + "".join(
        node(f"X{k + 1}", "ND_max_color3", wire("in1", f"X{k}"), wire("in2", f"X{k}")) for k in range(60)
    )
    _, value, _, codes = read(nodes, name="X60")
    np.testing.assert_allclose(value, RGB, atol=2e-6)
    assert codes == ["N938"]


# --- coordinates


def moved(image: str, nodes: str, source: str = "P") -> tuple[np.ndarray, str, list]:
    """Return where (1, 0), (0, 1) and (0.3, 0.2) come to, the primvar and the codes."""
    _, _, reader, codes = read(picture(image, "color3", "N", wire("texcoord", source, kind="float2")) + nodes)
    texture = reader.textures[0]
    places = np.array([(1, 0, 1), (0, 1, 1), (0.3, 0.2, 1)])
    return places @ texture.uv_transform.T, texture.primvar, codes


def place2d(uv: np.ndarray, pivot, scale, rotate, offset, order) -> np.ndarray:
    """Return what the reference library's graph NG_place2d_vector2 gives."""

    def turn(v):
        c, s = np.cos(np.radians(rotate)), np.sin(np.radians(rotate))
        return np.stack([c * v[:, 0] + s * v[:, 1], -s * v[:, 0] + c * v[:, 1]], -1)

    at = uv - pivot
    return turn(at / scale) - offset + pivot if order == 0 else turn(at - offset) / scale + pivot


@pytest.mark.parametrize("order", [0, 1])
def test_place2d(image, order):
    pivot, scale, offset = np.array((0.5, 0.25)), np.array((2.0, 4.0)), np.array((0.1, -0.3))
    lines = [vec(name, *v, kind="float2") for name, v in (("pivot", pivot), ("scale", scale), ("offset", offset))]
    got, primvar, codes = moved(
        image,
        node("P", "ND_place2d_vector2", *lines, "float inputs:rotate = 30", f"int inputs:operationorder = {order}"),
    )
    uv = np.array([(1, 0), (0, 1), (0.3, 0.2)])
    np.testing.assert_allclose(got, place2d(uv, pivot, scale, 30, offset, order), atol=1e-6)
    assert (primvar, codes) == ("st", [])


def test_coordinates_are_scaled_by_arithmetic(image):
    nodes = node("C", "ND_geompropvalue_vector2", 'string inputs:geomprop = "map2"')
    nodes += node("X", "ND_multiply_vector2", wire("in1", "C", kind="float2"), vec("in2", 3, 2, kind="float2"))
    nodes += node("P", "ND_add_vector2", wire("in1", "X", kind="float2"), vec("in2", 0.5, 0, kind="float2"))
    got, primvar, codes = moved(image, nodes)
    np.testing.assert_allclose(got, [(3.5, 0), (0.5, 2), (1.4, 0.4)], atol=1e-6)
    assert (primvar, codes) == ("map2", [])


def test_tiled_images(image):
    sizes = (
        ("uvtiling", (2, 3)),
        ("uvoffset", (0.5, 0.25)),
        ("realworldimagesize", (2, 2)),
        ("realworldtilesize", (1, 4)),
    )
    lines = [vec(name, *values, kind="float2") for name, values in sizes]
    nodes = node("N", "ND_tiledimage_vector3", f"asset inputs:file = @{image}@", *lines)
    _, _, reader, codes = read(nodes)
    uv = np.array((0.3, 0.2))
    expected = (uv * (2, 3) - (0.5, 0.25)) / 2 * (1, 4)
    np.testing.assert_allclose(reader.textures[0].uv_transform @ (*uv, 1), expected, atol=1e-6)
    assert codes == []


@pytest.mark.parametrize("order", [0, 1])
def test_images_of_gltf_are_placed_as_its_library_says(image, order):
    """A place2d about (0, 1) by 1 / scale, -rotate and (-x, y) of the offset."""
    lines = [vec(name, *values, kind="float2") for name, values in (("scale", (2, 4)), ("offset", (0.25, 0.5)))]
    lines += [vec("rotate", 30, kind="float"), vec("operationorder", order, kind="int").replace(".0", "")]
    file = f'asset inputs:file = @{image}@ (colorSpace = "raw")'
    _, _, reader, codes = read(node("N", "ND_gltf_image_color3_color3_1_0", file, *lines))
    uv = np.array([(1, 0), (0, 1), (0.3, 0.2)])
    expected = place2d(uv, (0, 1), (0.5, 0.25), -30, (-0.25, 0.5), order)
    got = np.column_stack([uv, np.ones(3)]) @ reader.textures[0].uv_transform.T
    np.testing.assert_allclose(got, expected, atol=1e-6)
    assert codes == []


def test_images_of_gltf_have_factors_and_sets_of_coordinates(image):
    file = f'asset inputs:file = @{image}@ (colorSpace = "raw")'
    body = (file, vec("factor", 0.5, 2, 1), "int inputs:uvindex = 1")
    _, value, reader, codes = read(node("N", "ND_gltf_image_color3_color3_1_0", *body))
    np.testing.assert_allclose(value, RGB * (0.5, 2, 1), atol=1e-6)
    assert (reader.textures[0].primvar, codes) == ("st1", [])
    tint = vec("color", 0.5, 0.5, 1, 0.5, kind="color4f")
    nodes = node("N", "ND_gltf_colorimage", file, tint, outputs=("outcolor", "outa"))
    _, value, _, _ = read(nodes, output="outcolor")
    np.testing.assert_allclose(value, RGB * (0.5, 0.5, 1), atol=1e-6)
    _, value, _, _ = read(nodes, count=1, output="outa")
    np.testing.assert_allclose(value, [ALPHA * 0.5], atol=1e-6)
    _, value, _, _ = read(node("N", "ND_gltf_normalmap_vector3_1_0", f"asset inputs:file = @{image}@"))
    np.testing.assert_allclose(value, 2 * RGB - 1, atol=1e-6)


@pytest.mark.parametrize(("index", "name"), [(0, "st"), (1, "st1")])
def test_sets_of_coordinates(image, index, name):
    assert moved(image, node("P", "ND_texcoord_vector2", f"int inputs:index = {index}"))[1:] == (name, [])


def test_coordinates_that_do_not_fold_are_named(image):
    assert moved(image, node("P", "ND_flake2d"))[1:] == ("st", ["W303"])


def test_an_image_at_a_place_in_space_is_read_by_a_program(image):
    place = node("P", "ND_position_vector3") + node("Q", "ND_convert_vector3_vector2", wire("in", "P"))
    image_node = node("N", "ND_image_color3", f"asset inputs:file = @{image}@", wire("texcoord", "Q", kind="float2"))
    found, _, _, codes = read(place + image_node)
    steps = found.program.steps
    assert [step.op for step in steps].count(Op.TEXTURE_AT) == 1
    assert {Op.POSITION, Op.POSITION_ACROSS, Op.POSITION_DOWN} <= {step.op for step in steps}
    assert codes == []


# --- surfaces


def surface(identifier: str, body: str, nodes: str = ""):
    """Return the material of a surface, its reader, and the diagnostics."""
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(f"""#usda 1.0
        def Sphere "s" (
            prepend apiSchemas = ["MaterialBindingAPI"]
        )
        {{
            rel material:binding = </M>
        }}
        def Material "M"
        {{
            token outputs:mtlx:surface.connect = </M/S.outputs:out>
            def Shader "S"
            {{
                uniform token info:id = "{identifier}"
                {body}
                token outputs:out
            }}
            {nodes}
        }}""")
    report = Report()
    reader = MaterialReader(stage, Usd.TimeCode.Default(), report)
    row = reader.bind(stage.GetPrimAtPath("/s"))
    return reader.materials[row], reader, list(report)


def test_standard_surface_with_both_factors_of_a_product(image):
    body = "\n".join((wire("base_color", "T"), "float inputs:base = 0.5", wire("transmission", "X", "outa", "float")))
    nodes = picture(image) + node("X", "ND_separate4_color4", wire("in", "T"), outputs=("outa",))
    material, reader, _ = surface("ND_standard_surface_surfaceshader", body, nodes)
    for name, expected in (("diffuseColor", 0.5 * RGB), ("opacity", 1 - ALPHA)):
        found = material.inputs[name]
        value = texture_values(reader.textures[found.texture], reader.images, np.array([SPOT]))[0]
        np.testing.assert_allclose(value[found.channel] if found.channel >= 0 else value[:3], expected, atol=1e-6)


def test_a_weight_may_vary_where_the_colour_does_not(image):
    body = "\n".join((vec("base_color", *A), wire("base", "T", kind="float")))
    material, reader, _ = surface("ND_standard_surface_surfaceshader", body, picture(image, "float"))
    found = material.inputs["diffuseColor"]
    value = texture_values(reader.textures[found.texture], reader.images, np.array([SPOT]))[0]
    np.testing.assert_allclose(value[:3], A * RGB[0], atol=1e-6)


@pytest.mark.parametrize(
    ("identifier", "weight", "ior"),
    [
        ("ND_standard_surface_surfaceshader", "specular", "specular_IOR"),
        ("ND_open_pbr_surface_surfaceshader", "specular_weight", "specular_ior"),
        ("ND_gltf_pbr_surfaceshader", "specular", "ior"),
    ],
)
def test_the_specular_weight_scales_the_reflectance_head_on(identifier, weight, ior):
    material, _, _ = surface(identifier, f"float inputs:{weight} = 0.5\nfloat inputs:{ior} = 1.6")
    n = material.inputs["ior"].value[0]
    assert ((1 - n) / (1 + n)) ** 2 == pytest.approx(0.5 * (0.6 / 2.6) ** 2)


@pytest.mark.parametrize(
    ("identifier", "name"),
    [("ND_standard_surface_surfaceshader", "opacity"), ("ND_open_pbr_surface_surfaceshader", "geometry_opacity")],
)
def test_opacity_of_other_models_is_coverage(identifier, name):
    kind = "color3f" if name == "opacity" else "float"
    value = "(0.25, 0.25, 0.25)" if name == "opacity" else "0.25"
    material, _, _ = surface(identifier, f"{kind} inputs:{name} = {value}")
    assert (material.inputs["opacity"].value[0], material.opacity_mode) == (0.25, OpacityMode.PRESENCE)


@pytest.mark.parametrize(
    ("mode", "opacity", "threshold"), [(0, 1.0, 0.0), (1, 0.25, 0.75), (2, 0.25, 0.0)], ids=["opaque", "mask", "blend"]
)
def test_alpha_modes_of_gltf(mode, opacity, threshold):
    body = f"float inputs:alpha = 0.25\nint inputs:alpha_mode = {mode}\nfloat inputs:alpha_cutoff = 0.75"
    material, _, _ = surface("ND_gltf_pbr_surfaceshader", body)
    assert (material.inputs["opacity"].value[0], material.opacity_threshold) == (opacity, threshold)


def test_normal_maps_of_other_models(image):
    nodes = picture(image, "vector3") + node("N", "ND_normalmap", wire("in", "T"), "float inputs:scale = 0.5")
    material, reader, found = surface("ND_open_pbr_surface_surfaceshader", wire("geometry_normal", "N"), nodes)
    texture = reader.textures[material.inputs["normal"].texture]
    value = texture_values(texture, reader.images, np.array([SPOT]))[0, :3]
    np.testing.assert_allclose(value, (RGB * 2 - 1) * (0.5, 0.5, 1), atol=1e-6)
    assert [d.code for d in found] == ["W302"]


def test_a_surfaces_own_normal_is_no_map():
    material, _, found = surface(
        "ND_standard_surface_surfaceshader", wire("normal", "N"), node("N", "ND_normal_vector3")
    )
    assert ("normal" in material.inputs, [d.code for d in found]) == (False, ["W302"])


@pytest.mark.parametrize(
    ("other", "ior"),
    [
        ("float inputs:coat = 1", 1.5),
        ("float inputs:coat = 1\nfloat inputs:coat_IOR = 2", 2),
        ("float inputs:transmission = 1", 2),
    ],
)
def test_the_specular_weight_leaves_coats_and_refraction_alone(other, ior):
    """Both have the index of refraction, so that the reflectance is scaled in the specular workflow."""
    body = f"float inputs:specular = 0.5\nfloat inputs:specular_IOR = 2\n{other}"
    material, _, _ = surface("ND_standard_surface_surfaceshader", body)
    assert (material.use_specular_workflow, material.inputs["ior"].value[0]) == (True, ior)
    np.testing.assert_allclose(material.inputs["specularColor"].value[:3], 0.5 / 9)
    np.testing.assert_allclose(material.inputs["diffuseColor"].value[:3], 0.8, rtol=1e-6)


def test_the_specular_weight_is_none_of_a_metals():
    body = "float inputs:specular = 0\nfloat inputs:coat = 1\nfloat inputs:coat_IOR = 1.75\nfloat inputs:metalness = 1"
    material, _, _ = surface("ND_standard_surface_surfaceshader", body)
    assert (material.use_specular_workflow, material.inputs["ior"].value[0]) == (False, 1.75)


def test_values_of_a_wrong_type_are_told_once():
    """Also those that are looked at for what else they decide about, as the weight of a coat."""
    names = ("coat_IOR", "coat_color", "sheen", "specular", "transmission")
    body = "\n".join(["float inputs:coat = 1", *(f'string inputs:{name} = "1"' for name in names)])
    _, _, found = surface("ND_standard_surface_surfaceshader", body)
    assert sorted(d.prim.rpartition(":")[2] for d in found if d.code == "W306") == list(names)


def test_a_coat_of_gltf_has_an_index_of_its_own():
    body = "float inputs:metallic = 0\nfloat inputs:ior = 2\nfloat inputs:clearcoat = 1"
    material, _, _ = surface("ND_gltf_pbr_surfaceshader", body)
    assert material.inputs["ior"].value[0] == 1.5
    np.testing.assert_allclose(material.inputs["specularColor"].value[:3], 1 / 9, rtol=1e-6)


def test_a_coat_has_its_own_index():
    """OpenPBR's is 1.6 where nothing is said, over a base of 1.5."""
    material, _, found = surface("ND_open_pbr_surface_surfaceshader", "float inputs:coat_weight = 1")
    assert (material.use_specular_workflow, material.inputs["ior"].value[0]) == (True, 1.6)
    np.testing.assert_allclose(material.inputs["specularColor"].value[:3], 0.04, rtol=1e-6)
    np.testing.assert_allclose(material.inputs["diffuseColor"].value[:3], 0.8, rtol=1e-6)
    assert found[-1].message.endswith(", without coat_darkening")


def test_the_index_of_a_coat_over_what_bends_rays_is_lost():
    body = "float inputs:coat_weight = 1\nfloat inputs:coat_darkening = 0\nfloat inputs:transmission_weight = 0.5"
    material, _, found = surface("ND_open_pbr_surface_surfaceshader", body)
    assert (material.inputs["ior"].value[0], found[-1].message.rpartition(", ")[2]) == (1.5, "without coat_ior")


def test_coverage_of_three_channels_is_their_mean(image):
    """So MaterialX itself translates a Standard Surface to a UsdPreviewSurface."""
    model = "ND_standard_surface_surfaceshader"
    material, _, _ = surface(model, "color3f inputs:opacity = (0.2, 0.3, 1)")
    assert material.inputs["opacity"].value[0] == pytest.approx(0.5)
    material, reader, _ = surface(model, wire("opacity", "T"), picture(image, "color3"))
    found = material.inputs["opacity"]
    value = texture_values(reader.textures[found.texture], reader.images, np.array([SPOT]))[0]
    assert value[found.channel] == pytest.approx(RGB.mean(), abs=1e-6)


# Inputs of models that UsdPreviewSurface has nothing for, as MaterialX 1.39's libraries define them, by what each needs
# to do anything. Those are left out that are parts of others here, as specular_rotation is of specular_anisotropy.
UNDRAWN = {
    "ND_standard_surface_surfaceshader": {
        "": (
            *(
                "float diffuse_roughness = 0.5",
                "color3f specular_color = (1, 0.5, 0)",
                "float specular_anisotropy = 0.5",
            ),
            *("float subsurface = 0.5", "float sheen = 0.5", "float thin_film_thickness = 100"),
        ),
        "float transmission = 0.5": (
            *("color3f transmission_color = (1, 0.5, 0)", "color3f transmission_scatter = (0.5, 0.5, 0.5)"),
            *("float transmission_dispersion = 20", "float transmission_extra_roughness = 0.5", "bool thin_walled = 1"),
        ),
        "float coat = 0.5": (
            *("color3f coat_color = (1, 0.5, 0)", "float coat_anisotropy = 0.5"),
            *("float coat_affect_color = 0.5", "float coat_affect_roughness = 0.5"),
        ),
    },
    "ND_open_pbr_surface_surfaceshader": {
        "": (
            *("float base_diffuse_roughness = 0.5", "color3f specular_color = (1, 0.5, 0)", "float fuzz_weight = 0.5"),
            *(
                "float specular_roughness_anisotropy = 0.5",
                "float subsurface_weight = 0.5",
                "float thin_film_weight = 1",
            ),
        ),
        "float transmission_weight = 0.5": (
            *("color3f transmission_color = (1, 0.5, 0)", "float transmission_depth = 1"),
            *("float transmission_dispersion_scale = 0.5", "bool geometry_thin_walled = 1"),
        ),
        "float coat_darkening = 0\nfloat coat_weight = 0.5": (
            *("color3f coat_color = (1, 0.5, 0)", "float coat_roughness_anisotropy = 0.5"),
        ),
        "float coat_weight = 0.5": ("float coat_darkening = 1",),
    },
}


@pytest.mark.parametrize(
    ("model", "needs", "line"),
    [(model, needs, line) for model, parts in UNDRAWN.items() for needs, lines in parts.items() for line in lines],
)
def test_what_is_not_drawn_is_named_where_it_does_anything(model, needs, line):
    name = line.split()[1]
    lines = [line, *needs.splitlines()]
    with_all, alone = (
        surface(model, "\n".join(part.replace(" ", " inputs:", 1) for part in body))[2][-1].message
        for body in (lines, [line])
    )
    assert with_all.endswith(f", without {name}")
    assert alone.endswith("UsdPreviewSurface" if needs else f", without {name}")


@pytest.mark.parametrize(
    ("model", "line", "name"),
    [
        ("ND_standard_surface_surfaceshader", "color3f inputs:base_colour = (1, 0, 0)", "inputs:base_colour"),
        ("ND_standard_surface_surfaceshader", "color3f inputs:sheen_color = (1, 0, 0)", ""),
        ("ND_gltf_pbr_surfaceshader", "float inputs:alpha_cutoff = 0.25", ""),
        ("PxrSurface", "float inputs:glowGain = 1", "inputs:glowGain"),
    ],
)
def test_inputs_that_an_approximation_knows_nothing_of_are_noted(model, line, name):
    _, _, found = surface(model, line)
    said = [f"the approximation has no {name}; ignored"] if name else []
    assert [d.message for d in found if d.code == "N917"] == said


@pytest.mark.parametrize(
    ("normal", "coat_normal", "is_lost"),
    [("B", "", True), ("", "B", True), ("B", "B", False), ("B", "N", True), ("N", "", False), ("", "N", False)],
)
def test_a_normal_of_the_coats_own_is_named(image, normal, coat_normal, is_lost):
    """UsdPreviewSurface bends both lobes alike. N is the surface's own."""
    wires = {"normal": normal, "coat_normal": coat_normal}
    body = "\n".join(wire(name, to) for name, to in wires.items() if to) + "\nfloat inputs:coat = 1"
    nodes = picture(image, "vector3") + node("B", "ND_normalmap", wire("in", "T")) + node("N", "ND_normal_vector3")
    _, _, found = surface("ND_standard_surface_surfaceshader", body, nodes)
    assert found[-1].message.endswith("without coat_normal") == is_lost


def test_what_is_lost_is_named_where_it_is_used():
    body = "float inputs:sheen = 0.5\nfloat inputs:subsurface = 0\ncolor3f inputs:coat_color = (1, 1, 1)"
    _, _, found = surface("ND_standard_surface_surfaceshader", body)
    assert [d.message for d in found] == [
        "the surface 'ND_standard_surface_surfaceshader' is approximated by a UsdPreviewSurface, without sheen"
    ]


def test_a_reflectance_of_no_index_is_that_of_the_default():
    material, _, found = surface(
        "ND_standard_surface_surfaceshader", "float inputs:specular = 0.5\nfloat inputs:specular_IOR = -1"
    )
    n = material.inputs["ior"].value[0]
    assert ((1 - n) / (1 + n)) ** 2 == pytest.approx(0.5 * 0.04)
    assert [d.code for d in found] == ["W306", "W302"]


@pytest.mark.parametrize("value", ['string inputs:sheen = "much"', "asset inputs:sheen = @much.png@"])
def test_what_would_be_lost_is_a_number(value):
    _, _, found = surface("ND_standard_surface_surfaceshader", value)
    assert [d.code for d in found] == ["W306", "W302"]
    assert "sheen" not in found[-1].message


def test_beyond_an_image_of_the_address_mode_constant_lies_its_default(image):
    """MaterialX 1.39, image: there the node gives the value of its input ``default``."""
    nodes = picture(
        image, "color3", "T", 'string inputs:uaddressmode = "constant"', "color3f inputs:default = (0.1, 0.2, 0.3)"
    )
    _, beyond, _, codes = read(nodes, name="T", spot=(4.0, 0.25))
    np.testing.assert_allclose(beyond, (0.1, 0.2, 0.3), atol=1e-6)
    _, within, _, _ = read(nodes, name="T")
    np.testing.assert_allclose(within, RGB, atol=1e-6)
    assert codes == []
