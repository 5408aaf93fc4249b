# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""MaterialX's nodes of constants and of texture coordinates: against the specification's formulas, in float64."""

from __future__ import annotations

import colorsys

import numpy as np
import pytest
from PIL import Image as PilImage
from pxr import Usd, UsdShade

from warp_rt.report import Report
from warp_rt.scene.texture_values import texture_values
from warp_rt.usd.image_cache import ImageCache
from warp_rt.usd.noise import cells, perlin, perlin_vector, worley, worley_vector
from warp_rt.usd.surface_inputs import InputReader


def node(name: str, identifier: str, *lines: str) -> str:
    body = "\n".join((f'uniform token info:id = "{identifier}"', *lines, "float outputs:out"))
    return f'def Shader "{name}" {{\n{body}\n}}\n'


def number(name: str, *values: float) -> str:
    kind, values = "float" if len(values) == 1 else f"float{len(values)}", tuple(map(float, values))
    return f"{kind} inputs:{name} = {values if len(values) > 1 else values[0]}"


def read(nodes: str, spots=((0.0, 0.0),), count: int = 3, time: float | None = None):
    """Return the values of node N at texture coordinates, shape [n, count], and the codes of what was told."""
    stage = Usd.Stage.CreateInMemory()
    wire = "color3f inputs:x.connect = </M/N.outputs:out>"
    stage.GetRootLayer().ImportFromString(f'#usda 1.0\ndef Material "M" {{\ndef Shader "S" {{\n{wire}\n}}\n{nodes}\n}}')
    report = Report()
    images = ImageCache(report)
    code = Usd.TimeCode.Default() if time is None else Usd.TimeCode(time)
    reader = InputReader(images, code, report)
    port = UsdShade.Shader(stage.GetPrimAtPath("/M/S")).GetInput("x")
    found = reader.read(port, count, stage.GetPrimAtPath("/M"))
    codes = [d.code for d in report]
    if found is None:
        return None, codes
    if found.texture < 0:
        return np.tile(found.value[:count], (len(spots), 1)), codes
    values = texture_values(reader.textures[found.texture], images.images, np.array(spots, float))
    return (values[:, [found.channel] * count] if found.channel >= 0 else values[:, :count]), codes


FG, BG = np.array((0.2, 0.5, 0.7, 0.6)), np.array((0.9, 0.1, 0.4, 0.5))
F, B, A, K = FG[:3], BG[:3], 0.6, 0.5
MIX = 0.25
OVERLAID = np.where(B >= 0.5, 1 - 2 * (1 - F) * (1 - B), 2 * F * B)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("overlay", OVERLAID),
        ("burn", 1 - (1 - B) / F),
        ("dodge", B / (1 - F)),
        ("in", F * K),
        ("out", F * (1 - K)),
        ("mask", B * A),
        ("over", F + B * (1 - A)),
        ("matte", F * A + B * (1 - A)),
        ("disjointover", F + B * (1 - A) / K),
    ],
)
def test_compositing(name, expected):
    lines = (number("fg", *FG), number("bg", *BG), number("mix", MIX))
    (value,), codes = read(node("N", f"ND_{name}_color4", *lines))
    np.testing.assert_allclose(value, MIX * expected + (1 - MIX) * B, rtol=1e-6)
    assert codes == []


@pytest.mark.parametrize(("name", "divisor"), [("burn", 0.0), ("dodge", 1.0)])
def test_burn_and_dodge_by_0_are_0(name, divisor):
    (value,), codes = read(node("N", f"ND_{name}_float", number("fg", divisor), number("bg", 0.5)), count=1)
    assert (value.tolist(), codes) == ([0.0], [])


def graded(color, hue, saturation, gamma, lift, gain, contrast, pivot, exposure):
    h, s, v = colorsys.rgb_to_hsv(*color)
    color = np.array(colorsys.hsv_to_rgb((h + hue) % 1, s, v))
    grey = color @ (0.2722287, 0.6740818, 0.0536895)
    color = (grey + saturation * (color - grey)) ** (1 / gamma)
    color = (color * (1 - lift) + lift) * gain
    return ((color - pivot) * contrast + pivot) * 2**exposure


def test_colour_correction():
    values = {
        "hue": 0.1, "saturation": 0.8, "gamma": 2.0, "lift": 0.1, "gain": 1.5, "contrast": 1.2,
        "contrastpivot": 0.4, "exposure": 0.5,
    }  # fmt: skip
    lines = [number(name, value) for name, value in values.items()]
    (value,), codes = read(node("N", "ND_colorcorrect_color3", number("in", *F), *lines))
    np.testing.assert_allclose(value, graded(F, *values.values()), rtol=1e-5)
    assert codes == []


def turned(vector, axis, degrees):
    """Rodrigues' formula for rows times matrices, as MaterialX has it."""
    axis, angle = np.array(axis) / np.linalg.norm(axis), np.radians(degrees)
    return (
        np.array(vector) * np.cos(angle)
        + np.cross(vector, axis) * np.sin(angle)
        + axis * (axis @ vector) * (1 - np.cos(angle))
    )


@pytest.mark.parametrize(
    ("identifier", "lines", "expected"),
    [
        ("trianglewave_float", (number("in", 0.3),), 0.3),
        ("trianglewave_float", (number("in", -0.8),), 0.2),
        ("trianglewave_float", (number("in", 7.5),), 0.5),
        ("ifgreater_boolean", (number("value1", 2), number("value2", 1)), 1),
        ("ifgreatereq_boolean", (number("value1", 1), number("value2", 1)), 1),
        ("ifequal_booleanI", (number("value1", 1), number("value2", 2)), 0),
        ("logical_and", ("bool inputs:in1 = 1", "bool inputs:in2 = 0"), 0),
        ("logical_or", ("bool inputs:in1 = 1", "bool inputs:in2 = 0"), 1),
        ("logical_xor", ("bool inputs:in1 = 1", "bool inputs:in2 = 1"), 0),
        ("logical_not", ("bool inputs:in = 0",), 1),
        ("rotate3d_vector3", (number("in", 1, 2, 3), number("amount", 30), number("axis", 1, 1, 0)),
         turned((1, 2, 3), (1, 1, 0), 30)),
        ("rotate3d_vector3", (number("in", 1, 0, 0), number("amount", 90)), (0, 0, 1)),
        ("randomfloat_integer", ("int inputs:in = 7", "int inputs:seed = 3"), cells(np.array([(7.0, 3.0)]))[0, 0]),
        ("randomfloat_float", (number("in", 0.5), "int inputs:seed = 3", number("min", 2), number("max", 4)),
         2 + 2 * cells(np.array([(2048.0, 3.0)]))[0, 0]),
        ("g22_rec709_to_lin_rec709_color3", (number("in", *F),), F**2.2),
        ("rec709_display_to_lin_rec709_color3", (number("in", *F),), F**2.4),
        ("srgb_texture_to_lin_rec709_color3", (number("in", *F),), ((F + 0.055) / 1.055) ** 2.4),
        # ACES' own matrix, of Bradford's adaptation, to three places.
        ("acescg_to_lin_rec709_color3", (number("in", *F),),
         np.array([[1.705, -0.622, -0.083], [-0.130, 1.141, -0.011], [-0.024, -0.129, 1.153]]) @ F),
    ],
)  # fmt: skip
def test_of_constants(identifier, lines, expected):
    (value,), codes = read(node("N", f"ND_{identifier}", *lines))
    size = np.size(expected)
    np.testing.assert_allclose(value[:size], np.reshape(expected, size), atol=2e-3 if "acescg" in identifier else 1e-5)
    assert codes == []


@pytest.mark.parametrize(("identifier", "expected"), [("ND_frame_float", 48.0), ("ND_time_float", 2.0)])
def test_the_frame_and_its_time(identifier, expected):
    (value,), codes = read(node("N", identifier), count=1, time=48.0)
    assert (value.tolist(), codes) == ([expected], [])


# --- of texture coordinates

SPOTS = np.random.default_rng(5).uniform(0.02, 0.98, (200, 2))
S, T = SPOTS.T
STOPS = (0.1, 0.4, 0.8)
COLORS = np.array([(0.9, 0.1, 0.2, 1), (0.1, 0.8, 0.3, 0.5), (0.2, 0.3, 0.7, 0.25)])


def ramp(place, share):
    """The ramp's definition, interval by interval: before the first stop the first colour holds."""
    result = np.tile(COLORS[0, :3], (len(place), 1))
    for k in range(2):
        part = np.array([share(p, STOPS[k], STOPS[k + 1]) for p in place])[:, None]
        mixed = COLORS[k, :3] * (1 - part) + COLORS[k + 1, :3] * part
        result = np.where((place > STOPS[k])[:, None], mixed, result)
    return result


def straight(p, low, high):
    return np.clip((p - low) / (high - low), 0, 1)


def smooth(p, low, high):
    x = straight(p, low, high)
    return x * x * (3 - 2 * x)


@pytest.mark.parametrize(
    ("kind", "place"),
    [
        (0, S),
        (1, np.arctan2(S - 0.5, T - 0.5) / (2 * np.pi) + 0.5),
        (2, 1.414 * np.hypot(S - 0.5, T - 0.5)),
        (3, 2 * np.maximum(np.abs(S - 0.5), np.abs(T - 0.5))),
    ],
    ids=["straight", "about", "away", "squares"],
)
@pytest.mark.parametrize(("interpolation", "share"), [(0, straight), (1, smooth)])
def test_ramps_of_many_stops(kind, place, interpolation, share):
    lines = [f"int inputs:type = {kind}", f"int inputs:interpolation = {interpolation}", "int inputs:num_intervals = 3"]
    for k in range(3):
        lines += [number(f"interval{k + 1}", STOPS[k]), number(f"color{k + 1}", *COLORS[k])]
    values, codes = read(node("N", "ND_ramp", *lines), SPOTS)
    is_seam = (kind == 1) & (np.abs(S - 0.5) < 0.01) & (T < 0.5)  # where the turn ends and begins
    np.testing.assert_allclose(values[~is_seam], ramp(place, share)[~is_seam], atol=4e-3)
    assert codes == ["N938"]


@pytest.mark.parametrize(
    ("identifier", "lines", "distance"),
    [
        ("circle_float", (number("center", 0.5, 0.25), number("radius", 0.3)), np.hypot(S - 0.5, T - 0.25) - 0.3),
        ("line_float", (number("point1", 0.2, 0.3), number("point2", 0.2, 0.7), number("radius", 0.15)),
         np.hypot(S - 0.2, T - np.clip(T, 0.3, 0.7)) - 0.15),
    ],
)  # fmt: skip
def test_shapes(identifier, lines, distance):
    """1 within and 0 without, to within a texel of the edge."""
    values, codes = read(node("N", f"ND_{identifier}", *lines), SPOTS, count=1)
    is_clear = np.abs(distance) > 2 / 1024
    np.testing.assert_allclose(values[is_clear, 0], distance[is_clear] < 0, atol=1e-6)
    assert codes == ["N938"]


PLACES = SPOTS * (3, 5)
OTHER = perlin(np.add(PLACES, (19, 73)))


@pytest.mark.parametrize(
    ("identifier", "expected", "lines"),
    [
        ("noise2d_vector2", perlin_vector(PLACES)[:, :2], ()),
        ("noise2d_color4", np.hstack([perlin_vector(PLACES), OTHER]), ()),
        ("worleynoise2d_vector3", worley_vector(PLACES, np.ones((200, 1))), ()),
        ("unifiednoise2d_float", 0.5 + 0.5 * perlin(PLACES), ("int inputs:type = 0",)),
        ("unifiednoise2d_float", worley(PLACES, np.ones((200, 1))).clip(0, 1), ("int inputs:type = 2",)),
    ],
)
def test_noises_of_several_components(identifier, expected, lines):
    """To twice 1/2048 of what lies between least and greatest, or a texel of 1024 of a slope of 5."""
    place = node("C", "ND_texcoord_vector2") + node(
        "P", "ND_multiply_vector2", "float2 inputs:in1.connect = </M/C.outputs:out>", number("in2", 3, 5)
    )
    wire = "float2 inputs:texcoord.connect = </M/P.outputs:out>"
    count = min(expected.shape[1], 3)
    values, codes = read(place + node("N", f"ND_{identifier}", wire, *lines), SPOTS, count=3)
    np.testing.assert_allclose(values[:, :count], expected[:, :count], atol=5 / 1024)
    assert codes == ["N938"]


def test_images_are_read_at_computed_places(tmp_path):
    """An image of 2 x 2 texels at st + 0.3 sin(2 pi t) across."""
    texels = np.array([[10, 90], [170, 250]], np.uint8)
    PilImage.fromarray(texels).save(tmp_path / "image.png")
    nodes = node("C", "ND_texcoord_vector2") + node(
        "Y", "ND_extract_vector2", "float2 inputs:in.connect = </M/C.outputs:out>", "int inputs:index = 1"
    )
    nodes += node("W", "ND_multiply_float", "float inputs:in1.connect = </M/Y.outputs:out>", number("in2", 2 * np.pi))
    nodes += node("Z", "ND_sin_float", "float inputs:in.connect = </M/W.outputs:out>")
    nodes += node("D", "ND_multiply_float", "float inputs:in1.connect = </M/Z.outputs:out>", number("in2", 0.3))
    nodes += node("V", "ND_combine2_vector2", "float inputs:in1.connect = </M/D.outputs:out>")
    nodes += node(
        "P", "ND_add_vector2", *(f"float2 inputs:in{k}.connect = </M/{x}.outputs:out>" for k, x in ((1, "C"), (2, "V")))
    )
    modes = [f'string inputs:{axis}addressmode = "clamp"' for axis in "uv"]
    wire = "float2 inputs:texcoord.connect = </M/P.outputs:out>"
    file = f"asset inputs:file = @{(tmp_path / 'image.png').as_posix()}@"
    values, codes = read(nodes + node("N", "ND_image_float", file, wire, *modes), SPOTS, count=1)
    share_x = np.clip((S + 0.3 * np.sin(2 * np.pi * T)) * 2 - 0.5, 0, 1)
    share_y = np.clip(T * 2 - 0.5, 0, 1)
    bottom, top = (row[0] * (1 - share_x) + row[1] * share_x for row in (texels[1] / 255, texels[0] / 255))
    np.testing.assert_allclose(values[:, 0], bottom * (1 - share_y) + top * share_y, atol=3e-3)
    assert codes == ["N938"]


def test_normals_of_heights(tmp_path):
    """Of an image, by central differences at its texels; of waves, by their derivative; the map of -1..1 to 0..1."""
    heights = np.random.default_rng(9).integers(0, 256, (8, 8)).astype(np.uint8)
    PilImage.fromarray(heights).save(tmp_path / "height.png")
    image = node("H", "ND_image_float", f"asset inputs:file = @{(tmp_path / 'height.png').as_posix()}@")
    wire = "float inputs:in.connect = </M/H.outputs:out>"
    spots = (np.stack(np.meshgrid(np.arange(8), np.arange(8)), -1).reshape(-1, 2) + 0.5) / 8
    values, codes = read(image + node("N", "ND_heighttonormal_vector3", wire, number("scale", 3)), spots)
    h = heights[::-1] / 255 * 3  # row 0 at the bottom
    across = (np.roll(h, -1, 1) - np.roll(h, 1, 1)) / 2 * 8
    upwards = (np.roll(h, -1, 0) - np.roll(h, 1, 0)) / 2 * 8
    normals = np.stack([-across / 16, -upwards / 16, np.ones_like(across)], -1).reshape(-1, 3)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    np.testing.assert_allclose(values, 0.5 * normals + 0.5, atol=1e-4)  # differences of float32 over 1/4096
    assert codes == ["N938"]

    waves = node("C", "ND_texcoord_vector2")
    waves += node("X", "ND_extract_vector2", "float2 inputs:in.connect = </M/C.outputs:out>")
    waves += node("W", "ND_multiply_float", "float inputs:in1.connect = </M/X.outputs:out>", number("in2", 2 * np.pi))
    waves += node("H", "ND_sin_float", "float inputs:in.connect = </M/W.outputs:out>")
    values, codes = read(waves + node("N", "ND_heighttonormal_vector3", wire, number("scale", 4)), SPOTS)
    slope = 4 * 2 * np.pi * np.cos(2 * np.pi * S) / 16
    normals = np.stack([-slope, 0 * slope, np.ones_like(slope)], -1) / np.hypot(slope, 1)[:, None]
    np.testing.assert_allclose(values, 0.5 * normals + 0.5, atol=2e-3)
    assert codes == ["N938"]


# --- what is approximated, and what is told


def test_a_blur_is_left_out_and_told():
    (value,), codes = read(node("N", "ND_blur_color3", number("in", *F), number("size", 0.1)))
    np.testing.assert_allclose(value, F, rtol=1e-6)
    assert codes == ["W303"]


def test_a_blur_of_nothing_is_0():
    (value,), codes = read(node("N", "ND_blur_color3", number("size", 0.1)))
    assert (value.tolist(), codes) == ([0, 0, 0], ["W303"])


@pytest.mark.parametrize("category", ["luminance", "saturate"])
def test_coefficients_of_luminance_may_vary(category):
    """Here those of red and green are the squares of the texture coordinates."""
    chain = node("E", "ND_convert_vector2_vector3", "float2 inputs:in.connect = </M/P.outputs:out>")
    chain += node("P", "ND_power_vector2", "float2 inputs:in1.connect = </M/C.outputs:out>", number("in2", 2, 2))
    chain += node("C", "ND_texcoord_vector2")
    lines = (number("in", *F), number("amount", 0.25), "float3 inputs:lumacoeffs.connect = </M/E.outputs:out>")
    values, codes = read(chain + node("N", f"ND_{category}_color3", *lines), SPOTS)
    grey = (SPOTS**2 @ F[:2])[:, None] * np.ones(3)
    expected = grey if category == "luminance" else 0.75 * grey + 0.25 * F
    np.testing.assert_allclose(values, expected, atol=1e-3)
    assert codes == ["N938"]


def test_hexagons_are_the_image_repeated_and_told(tmp_path):
    texels = np.random.default_rng(2).integers(0, 256, (4, 4, 3)).astype(np.uint8)
    PilImage.fromarray(texels).save(tmp_path / "image.png")
    lines = (
        f'asset inputs:file = @{(tmp_path / "image.png").as_posix()}@ (colorSpace = "raw")',
        number("tiling", 2, 3),
    )
    values, codes = read(node("N", "ND_hextiledimage_color3", *lines), [((1.375 / 2), (2.625 / 3))])
    np.testing.assert_allclose(values[0], texels[1, 1] / 255, atol=1e-6)
    assert codes == ["W303"]


# --- what nodes say where the stage says nothing, and where formulas end


def typed(kind: str, name: str, *values: float) -> str:
    said = repr(values) if len(values) > 1 else repr(values[0])
    return f"{kind} inputs:{name} = {said}"


@pytest.mark.parametrize(
    ("identifier", "lines", "expected"),
    [
        ("ND_smoothstep_float", (number("in", 0.5), number("low", 0.5), number("high", 0.5)), (1, 1, 1)),
        ("ND_smoothstep_float", (number("in", 0.4), number("low", 0.5), number("high", 0.5)), (0, 0, 0)),
        ("ND_smoothstep_float", (number("in", 0.0), number("low", 2.0), number("high", -1.0)), (1, 1, 1)),
        ("ND_ifequal_color3", (number("in1", 1, 2, 3), number("in2", 4, 5, 6)), (1, 2, 3)),
        ("ND_ifequal_color3B", (number("in1", 1, 2, 3), number("in2", 4, 5, 6)), (1, 2, 3)),
        ("ND_ifgreater_color3", (number("in1", 1, 2, 3), number("in2", 4, 5, 6)), (1, 2, 3)),
        ("ND_ifequal_boolean", (), (0, 0, 0)),
        ("ND_ifequal_booleanI", (), (0, 0, 0)),
        ("ND_ifequal_booleanB", (), (1, 1, 1)),
        ("ND_ln_float", (), (0, 0, 0)),
        ("ND_convert_integer_boolean", (typed("int", "in", 3),), (1, 1, 1)),
        ("ND_switch_float", (number("in1", 4.0), typed("float", "which", -2.0)), (4, 4, 4)),
        ("ND_switch_float", (number("in10", 4.0), typed("float", "which", 9.5)), (4, 4, 4)),
        ("ND_switch_float", (number("in10", 4.0), typed("float", "which", 10.0)), (0, 0, 0)),
        ("ND_hsvtorgb_color3", (number("in", 0.3, -0.5, 0.75),), (0.75, 0.75, 0.75)),
        ("ND_rgbtohsv_color3", (number("in", -0.25, -0.5, -1.0),), (0, 0, -0.25)),
    ],
)
def test_defaults_and_ends_of_formulas(identifier, lines, expected):
    """As the library of MaterialX 1.39.5 has them."""
    (value,), codes = read(node("N", identifier, *lines))
    np.testing.assert_allclose(value, expected, atol=1e-6)
    assert codes == []


@pytest.mark.parametrize(
    ("identifier", "lines", "index", "expected"),
    [
        ("ND_convert_color3_vector4", (number("in", 1, 2, 3),), 3, 1.0),
        ("ND_convert_vector3_vector4", (number("in", 1, 2, 3),), 3, 1.0),
        ("ND_convert_vector2_color4", (number("in", 1, 2),), 2, 0.0),
        ("ND_convert_vector2_color4", (number("in", 1, 2),), 3, 1.0),
        ("ND_convert_float_color4", (number("in", 0.5),), 3, 0.5),
        ("ND_combine2_color4CF", (number("in2", 0.5),), 3, 0.5),
        ("ND_combine2_vector4VF", (number("in2", 0.5),), 1, 0.0),
        ("ND_combine2_vector4VV", (number("in2", 0.5, 0.25),), 3, 0.25),
        ("ND_premult_color4", (), 3, 1.0),
        ("ND_colorcorrect_color4", (), 3, 0.0),
        ("ND_unpremult_color4", (), 3, 1.0),
    ],
)
def test_components_that_are_filled_up(identifier, lines, index, expected):
    """Vectors of three have 1 as their fourth component, numbers have themselves."""
    wire = "color4f inputs:in.connect = </M/V.outputs:out>"
    nodes = node("V", identifier, *lines) + node("N", "ND_extract_color4", wire, typed("int", "index", index))
    (value,), codes = read(nodes, count=1)
    np.testing.assert_allclose(value, [expected], atol=1e-6)
    assert codes == []


def test_values_of_no_extent_are_not_smeared_over_an_image():
    """The field is s but where s and t are 0, at which one of the two texels each way lies."""
    nodes = node("C", "ND_texcoord_vector2")
    nodes += node("X", "ND_extract_vector2", "float2 inputs:in.connect = </M/C.outputs:out>")
    nodes += node(
        "D", "ND_dotproduct_vector2", "float2 inputs:in1.connect = </M/C.outputs:out>", number("in2", 0.7, -0.45)
    )
    lines = ("float inputs:value2.connect = </M/D.outputs:out>", "float inputs:in2.connect = </M/X.outputs:out>")
    values, codes = read(nodes + node("N", "ND_ifequal_float", number("in1", 9.0), *lines), SPOTS, count=1)
    np.testing.assert_allclose(values[:, 0], S, atol=1e-3)
    assert codes == ["N938"]


def test_constants_beyond_float32_are_told_and_bounded():
    """1e20 squared, which float32 has not, and which no light comes near."""
    (value,), codes = read(node("N", "ND_multiply_color3", number("in1", 1e20, 1, -1e20), number("in2", 1e20, 1, 1e20)))
    assert (value.tolist(), codes) == ([2.0**60, 1.0, -(2.0**60)], ["W303", "W312"])


# --- tiles


def hexagon(x, y, radius):
    """A hexagon whose edges' distance from the middle is the radius, two of them upright."""
    return (np.abs(x) <= radius) & (0.5 * np.abs(x) + np.sqrt(0.75) * np.abs(y) <= radius)


def circle(x, y, radius):
    return x**2 + y**2 <= radius**2


def clover_leaf(x, y, radius):
    ends = ((0.5, 0), (-0.5, 0), (0, 0.5), (0, -0.5))
    return np.any([circle(x - radius * i, y - radius * j, radius / 2) for i, j in ends], axis=0)


def rows(shape, x, y, radius, height):
    """Shapes in the middles of tiles of a unit, each row of some height half a tile on."""
    around = [(i + 0.5 * (j % 2), j * height) for i in range(-1, 5) for j in range(-1, 6)]
    return np.any([shape(x - u, y - v, radius) for u, v in around], axis=0)


def square(x, y):
    return 2 * (x % 1) - 1, 2 * (y % 1) - 1


@pytest.mark.parametrize("is_staggered", [False, True])
@pytest.mark.parametrize(
    ("name", "shape", "height"),
    [
        ("tiledcircles", circle, np.sqrt(0.75)),
        ("tiledcloverleafs", clover_leaf, 0.5),
        ("tiledhexagons", hexagon, np.sqrt(0.75)),
        ("grid", None, 0),
        ("crosshatch", None, 0),
    ],
)
def test_tiles(name, shape, height, is_staggered):
    """Three by two tiles; between texels edges are as wide as one."""
    said = "thickness" if shape is None else "size"
    lines = (number("uvtiling", 3, 2), number(said, 0.3), typed("bool", "staggered", int(is_staggered)))
    values, codes = read(node("N", f"ND_{name}_color3", *lines), SPOTS, count=3)
    x, y = 3 * S, 2 * T
    if shape is not None:
        expected = rows(shape, x, y, 0.15, height) if is_staggered else shape(*square(x, y), 0.3)
    else:
        u, v = square(x + 0.5 * (y % 2 > 1) * is_staggered, y)
        bars, hatching = (
            (np.abs(u) > 0.7) | (np.abs(v) > 0.7),
            np.minimum(np.abs(u - v), np.abs(u + v)) <= 0.3 * np.sqrt(2),
        )
        expected = bars if name == "grid" else hatching
    assert 0.02 < expected.mean() < 0.98
    assert (np.abs(values - expected[:, None]) < 1e-3).all(axis=1).mean() > 0.96
    assert codes == ["N938"]


@pytest.mark.parametrize(("name", "shape"), [("hexagon", hexagon), ("cloverleaf", clover_leaf)])
def test_hexagons_and_clover_leaves(name, shape):
    nodes = node("N", f"ND_{name}_float", number("center", 0.5, 0.4), number("radius", 0.3))
    values, codes = read(nodes, SPOTS, count=1)
    expected = shape(S - 0.5, T - 0.4, 0.3)
    assert (np.abs(values[:, 0] - expected) < 1e-3).mean() > 0.97
    assert codes == ["N938"]


def spline(t):
    """Return the uniform cubic B-spline's weights of the texels before, about and after a place."""
    return np.stack([(1 - t) ** 3, 4 - 6 * t**2 + 3 * t**3, 4 - 6 * (1 - t) ** 2 + 3 * (1 - t) ** 3, t**3]) / 6


@pytest.mark.parametrize("nodes", ["image", "scaled", "squared", "doubled"])
@pytest.mark.parametrize("filtertype", ["closest", "cubic"])
def test_images_are_read_between_texels_as_their_filtertype_says(tmp_path, nodes, filtertype):
    codes = np.random.default_rng(1).integers(0, 256, (1, 8)).astype(np.uint8)
    PilImage.fromarray(codes).save(tmp_path / "codes.png")
    texels = codes[0] / 255
    file = f"asset inputs:file = @{(tmp_path / 'codes.png').as_posix()}@"
    is_image = nodes == "image"
    image = node("N" if is_image else "I", "ND_image_float", file, f'string inputs:filtertype = "{filtertype}"')
    chain = {
        "image": "",
        "scaled": node("N", "ND_multiply_float", "float inputs:in1.connect = </M/I.outputs:out>", number("in2", 0.5)),
        "squared": node("N", "ND_power_float", "float inputs:in1.connect = </M/I.outputs:out>", number("in2", 2.0)),
        "doubled": node(
            "N",
            "ND_add_float",
            "float inputs:in1.connect = </M/I.outputs:out>",
            "float inputs:in2.connect = </M/I.outputs:out>",
        ),
    }[nodes]
    # what is computed of cubic images is exact where its texels are, and linear in between
    s = (np.arange(8) + 0.5) / 8 if (filtertype, nodes) == ("cubic", "squared") else np.linspace(0.01, 0.99, 60)
    values, told = read(image + chain, np.stack([s, np.full_like(s, 0.4)], axis=1), count=1)
    if filtertype == "closest":
        expected = texels[np.floor(8 * s).astype(int)]
    else:
        first = np.floor(8 * s - 0.5).astype(int)
        weights = spline(8 * s - 0.5 - first)
        expected = sum(weights[k + 1] * texels[(first + k) % 8] for k in range(-1, 3))
    expected = {"image": expected, "scaled": expected / 2, "squared": expected**2, "doubled": 2 * expected}[nodes]
    np.testing.assert_allclose(values[:, 0], expected, atol=1e-6)
    assert told == (["N938"] if nodes == "squared" else [])


@pytest.mark.parametrize(
    ("identifier", "line", "codes"),
    [
        ("ND_normalmap_float", "float3 inputs:normal.connect = </M/P.outputs:out>", ["W303"]),
        ("ND_normalmap_float", "float3 inputs:normal.connect = </M/O.outputs:out>", []),
        ("ND_normalmap_float", "", []),
        ("ND_image_vector3", 'string inputs:filtertype = "closest"', []),
        ("ND_image_vector3", 'string inputs:filtertype = "smooth"', ["W204"]),
        ("ND_image_vector3", 'string inputs:framerange = "1-9"', ["W303"]),
        ("ND_image_vector3", 'string inputs:filtertype = "linear"', []),
    ],
)
def test_inputs_that_do_not_count_are_told(tmp_path, identifier, line, codes):
    PilImage.new("RGB", (2, 2), (128, 128, 255)).save(tmp_path / "map.png")
    file = f"asset inputs:file = @{(tmp_path / 'map.png').as_posix()}@" if "image" in identifier else ""
    nodes = node("P", "ND_position_vector3") + node("O", "ND_normal_vector3")
    value, found = read(nodes + node("N", identifier, file, line))
    assert value is not None
    assert found == codes
