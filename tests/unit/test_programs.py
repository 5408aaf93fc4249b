# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Programs: what kernels compute of the place, against the same functions of arrays in float64."""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping
from functools import cache

import numpy as np
import pytest
import warp as wp
from pxr import Usd, UsdShade

import warp_rt
from warp_rt.kernels import constants, op_codes
from warp_rt.kernels.program import eval_program
from warp_rt.kernels.scene_structs import SceneData
from warp_rt.kernels.surface import Surface
from warp_rt.report import Report
from warp_rt.scene import Input, Material, MaterialModel, NormalFrame, Scene
from warp_rt.scene.materials import LARGEST_INPUT
from warp_rt.scene.programs import MAX_REGISTERS, Op, Program, Step
from warp_rt.upload.device_scene import upload_scene
from warp_rt.usd.color_spaces import color_space
from warp_rt.usd.decoding import linear
from warp_rt.usd.materials import MaterialReader
from warp_rt.usd.materialx_nodes import fold
from warp_rt.usd.noise import cells, perlin, perlin_vector, worley_vector
from warp_rt.usd.preview_signals import _reflectance
from warp_rt.usd.program_compiler import MAX_STEPS, compile_program
from warp_rt.usd.signals import DoesNotFold, Signal, add, apply, multiply, of_surface
from warp_rt.usd.solid_noise import (
    cell_numbers,
    cells_solid,
    perlin_solid_vector,
    worley_cells,
    worley_cells_vector,
    worley_solid_cells,
    worley_solid_cells_vector,
    worley_solid_vector,
)

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

POSITION = of_surface(Op.POSITION, 3)
PLACES = np.random.default_rng(7).uniform(-2.5, 2.5, (96, 3)).astype(np.float32)
VIEW = (0.0, 0.0, -1.0)
NORMAL = (0.6, 0.0, 0.8)


@wp.kernel
def evaluate(scenes: wp.array[SceneData], places: wp.array[wp.vec3], program: int, values: wp.array[wp.vec4]):
    """Write what a program computes at each place."""
    i = wp.tid()
    surface = Surface()
    surface.position = places[i]
    surface.n_shading = wp.vec3(0.6, 0.0, 0.8)
    values[i] = eval_program(scenes[0], surface, program, wp.vec3(0.0, 0.0, 1.0), True)


def run(program: Program, places: np.ndarray = PLACES, **placed: object) -> np.ndarray:
    """Return what kernels compute, shape [n, 4]."""
    material = Material("/m", MaterialModel.WHITTED, {"diffuse": Input(program=program)})
    square = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    scene = upload_scene(Scene.from_arrays(square, [(0, 1, 2)], material=material, **placed), device="cpu")
    values = wp.zeros(len(places), dtype=wp.vec4, device="cpu")
    data = wp.array([scene.data], dtype=SceneData, device="cpu")
    wp.launch(evaluate, len(places), [data, wp.array(places, dtype=wp.vec3, device="cpu"), 0], [values], device="cpu")
    return values.numpy()


def compiled(signal: Signal) -> Program:
    return compile_program(signal, lambda source: 0)


def in_float64(signal: Signal, places: np.ndarray = PLACES) -> np.ndarray:
    """Return a signal by the functions of arrays that it is made of, shape [n, k]; what is no number is 0."""
    if signal.value is not None:
        return np.tile(signal.matrix[:, -1], (len(places), 1))
    field = signal.source.computed
    if field.function is Op.POSITION:
        found = places.astype(float)
    elif isinstance(field.function, Op):
        found = np.tile({Op.VIEW_WORLD: VIEW, Op.NORMAL_WORLD: NORMAL}.get(field.function, NORMAL), (len(places), 1))
    else:
        with np.errstate(all="ignore"):
            found = np.asarray(field.function(*(in_float64(part, places) for part in field.arguments)), float)
        found = np.where(np.isfinite(found), found, 0.0)
    padded = np.zeros((len(places), 4))
    padded[:, : found.shape[1]] = found
    return padded @ signal.matrix[:, :-1].T + signal.matrix[:, -1]


@cache
def varying(name: str, size: int, low: float, high: float) -> Signal:
    """Return components that are linear functions of the place, different ones for each name, between two numbers."""
    generator = np.random.default_rng(zlib.crc32(name.encode()))
    linear_part = generator.uniform(-1.0, 1.0, (size, 3))
    linear_part *= 0.5 * (high - low) / (2.5 * np.abs(linear_part).sum(axis=1, keepdims=True))
    return POSITION.map(linear_part, 0.5 * (high + low))


CONSTANTS = {
    *("octaves", "style", "type", "num_intervals", "interpolation", "clampoutput", "doclamp"),
    *("lumacoeffs", "faceforward", "invert", "upaxis", "seed", "index", "gamma", "operationorder", "staggered"),
}
TYPES = {"float": 1, "color3": 3, "color4": 4, "vector2": 2, "vector3": 3, "vector4": 4}
FIXED = {
    "texcoord": 2,
    "position": 3,
    "uvtiling": 2,
    "uvoffset": 2,
    "point1": 2,
    "point2": 2,
    "lacunarity": 1,
    "diminish": 1,
}


def made(identifier: str, given: Mapping[str, float] | None = None, low: float = 0.1, high: float = 0.95) -> Signal:
    """Return what a node makes of inputs that all vary with the place, but for those that have to be constant."""
    kind = identifier.rpartition("_")[2].removesuffix("FA")

    def read(name: str) -> Signal | None:
        if given and name in given:
            return Signal.constant([given[name]])
        if name in CONSTANTS:
            return None
        if name == "temperature":
            return varying(name, 1, 900.0, 9000.0)
        wide = name in ("texcoord", "position")
        size = FIXED.get(name, TYPES.get(kind, 1))
        return varying(name, size, -3.0 if wide else low, 3.0 if wide else high)

    return fold(identifier, "out", read, lambda name: "")


NODES = [
    *(f"ND_{name}_color3" for name in ("multiply", "divide", "modulo", "min", "max", "power", "safepower", "clamp")),
    *(f"ND_{name}_vector2" for name in ("fract", "floor", "ceil", "round", "sign", "absval", "sqrt", "exp", "ln")),
    *(f"ND_{name}_float" for name in ("sin", "cos", "tan", "asin", "acos", "atan2", "trianglewave", "smoothstep")),
    *(f"ND_{name}_color4" for name in ("over", "in", "out", "mask", "matte", "disjointover", "premult", "unpremult")),
    *(f"ND_{name}_color3" for name in ("overlay", "burn", "dodge", "difference", "screen", "mix", "inside", "outside")),
    *(f"ND_{name}_color3" for name in ("rgbtohsv", "hsvtorgb", "hsvadjust", "colorcorrect", "contrast", "range")),
    *(f"ND_{name}_color3" for name in ("saturate", "luminance", "invert", "subtract", "remap", "ifgreater", "ifequal")),
    *(f"ND_{name}_vector3" for name in ("normalize", "crossproduct", "rotate3d", "magnitude", "distance", "reflect")),
    *(f"ND_{name}_boolean" for name in ("ifgreater", "ifgreatereq", "ifequal")),
    *(f"ND_{name}_color3" for name in ("ramplr", "ramptb", "ramp4", "splitlr", "splittb", "checkerboard")),
    *("ND_circle_float", "ND_line_float", "ND_ramp", "ND_blackbody", "ND_randomfloat_float", "ND_randomcolor_float"),
    *("ND_logical_and", "ND_logical_or", "ND_logical_xor", "ND_logical_not", "ND_refract_vector3"),
    *(f"ND_noise{d}_{kind}" for d in ("2d", "3d") for kind in ("float", "vector2", "color3", "vector4")),
    *(f"ND_fractal{d}_{kind}" for d in ("2d", "3d") for kind in ("float", "vector2", "color3", "color4")),
    *(f"ND_{name}noise{d}_float" for name in ("cell", "worley", "unified") for d in ("2d", "3d")),
    *("ND_worleynoise3d_vector3", "ND_worleynoise2d_vector2", "ND_facingratio_float"),
    *("ND_tiledhexagons_color3", "ND_tiledcloverleafs_color3", "ND_crosshatch_color3", "ND_grid_color3"),
    *("ND_switch_color3", "ND_place2d_vector2", "ND_rotate2d_vector2"),
]


@pytest.mark.parametrize("identifier", NODES)
def test_nodes_of_the_place(identifier: str) -> None:
    signal = made(identifier)
    assert signal.value is None
    expected = in_float64(signal)
    values = run(compiled(signal))[:, : signal.size]
    # At an edge, as of a cell, a rounding decides; nearly all places are away from any.
    close = np.isclose(values, expected, rtol=1e-4, atol=1e-4).all(axis=1)
    assert close.mean() > 0.95, (values[~close][:3], expected[~close][:3])


# The jitter of the last kind is a coordinate of its own, of tens of thousands: float32 has few digits left there.
KINDS = [*({"type": kind} for kind in range(3)), {"type": 3, "jitter": 1.0}, {"type": 2, "style": 1}, {"jitter": 0.3}]


@pytest.mark.parametrize("dimension", ["2d", "3d"])
@pytest.mark.parametrize("given", KINDS)
def test_any_noise(dimension: str, given: dict[str, float]) -> None:
    signal = made(f"ND_unifiednoise{dimension}_float", given)
    close = np.isclose(run(compiled(signal))[:, 0], in_float64(signal)[:, 0], atol=2e-4)
    assert close.mean() > 0.95


@pytest.mark.parametrize("name", ["srgb_texture", "acescg", "g22_rec709", "rec709_display", "adobergb"])
def test_colours_of_other_spaces(name: str) -> None:
    space = color_space({"rec709_display": "g24_rec709"}.get(name, name))
    assert space is not None
    signal = linear(varying("color", 3, -0.2, 1.2), space)
    np.testing.assert_allclose(run(compiled(signal))[:, :3], in_float64(signal), atol=2e-6)


def test_reflectance_of_an_index() -> None:
    signal = apply(_reflectance, varying("ior", 1, 1.1, 2.5))
    np.testing.assert_allclose(run(compiled(signal))[:, 0], in_float64(signal)[:, 0], rtol=1e-4)


# --- noises: values of MaterialX 1.39.5's own mx_noise.glsl, compiled as C++

PLACE = np.array([(-1.25, 4.5, 2.125)])
JITTER = np.array([[0.75]])


@pytest.mark.parametrize(
    ("function", "arguments", "expected"),
    [
        (perlin_vector, (PLACE[:, :2],), None),
        (perlin_solid_vector, (PLACE,), (-0.39678809, 0.0255990047, 0.74441576)),
        (cells_solid, (PLACE,), (0.536072493,)),
        (cell_numbers, (PLACE,), (0.408467323, 0.330743819, 0.960655212)),
        (worley_solid_vector, (PLACE, JITTER), (0.632205129, 0.791733682, 0.797972262)),
        (worley_solid_cells, (PLACE, JITTER), (0.738028705,)),
        (worley_solid_cells_vector, (PLACE, JITTER), (0.81598419, 0.0071204612, 0.649727464)),
        (worley_vector, (PLACE[:, :2], JITTER), (0.217017353, 0.839324832, 0.898222685)),
        (worley_cells, (PLACE[:, :2], JITTER), (0.10310407,)),
        (worley_cells_vector, (PLACE[:, :2], JITTER), (0.997861445, 0.738028705, 0.536072493)),
    ],
)
def test_noises_are_those_of_the_reference_library(
    function: Callable[..., np.ndarray], arguments: tuple[np.ndarray, ...], expected: tuple[float, ...] | None
) -> None:
    found = function(*arguments)[0]
    if expected is None:
        np.testing.assert_allclose(found[0], perlin(*arguments)[0, 0])
    else:
        np.testing.assert_allclose(found, expected, atol=1e-6)


@pytest.mark.parametrize(
    ("identifier", "expected"),
    [
        ("ND_fractal3d_vector4", (-0.506980181, 0.172644794, 0.785651147, 0.251524746)),
        ("ND_fractal3d_vector2", (-0.506980181, 0.251524746)),
        ("ND_fractal2d_vector4", (-0.426269025, -0.102283984, -0.640773952, -1.18513882)),
        ("ND_fractal2d_vector2", (-0.426269025, -1.18513882)),
        ("ND_noise3d_vector4", (-0.39678809, 0.0255990047, 0.74441576, 0.00973563921)),
    ],
)
def test_fractals_are_those_of_the_reference_library(identifier: str, expected: tuple[float, ...]) -> None:
    """Constants, computed while the stage is read, and kernels alike.

    Of places up to 193 x 2.1^3 = 1800 float32 tells 1.2e-4 apart, and noise is up to 2 steep.
    """
    given = {"octaves": 4.0, "lacunarity": 2.1, "diminish": 0.6, "amplitude": 1.0, "pivot": 0.0}

    def node(place: Signal) -> Signal:
        numbers = {name: Signal.constant([value]) for name, value in given.items()}
        return fold(identifier, "out", {**numbers, "position": place, "texcoord": place.pick([0, 1])}.get, str)

    np.testing.assert_allclose(node(Signal.constant(PLACE[0])).value, expected, atol=1e-4)
    values = run(compiled(node(POSITION)), PLACE.astype(np.float32))[0]
    np.testing.assert_allclose(values[: len(expected)], expected, atol=1e-4)


def test_noise_of_cells_is_that_of_the_host() -> None:
    values = run(compiled(of_surface(Op.CELLS_3D, 1, POSITION.map(4 * np.eye(3)))))
    np.testing.assert_allclose(values[:, 0], cells_solid(4.0 * PLACES)[:, 0], rtol=1e-6)
    values = run(compiled(of_surface(Op.CELLS_2D, 1, POSITION.pick([0, 2]))))
    np.testing.assert_allclose(values[:, 0], cells(PLACES[:, [0, 2]].astype(float))[:, 0], rtol=1e-6)


# --- spaces

PLACED = np.array([(0, -2, 0, 5), (1, 0, 0.5, -3), (0, 0, 3, 2), (0, 0, 0, 1)], float)


@pytest.mark.parametrize(
    ("op", "expected"),
    [
        (Op.POINT_TO_OBJECT, lambda p: (p - PLACED[:3, 3]) @ np.linalg.inv(PLACED[:3, :3]).T),
        (Op.POINT_TO_WORLD, lambda p: p @ PLACED[:3, :3].T + PLACED[:3, 3]),
        (Op.VECTOR_TO_OBJECT, lambda p: p @ np.linalg.inv(PLACED[:3, :3]).T),
        (Op.VECTOR_TO_WORLD, lambda p: p @ PLACED[:3, :3].T),
        (Op.NORMAL_TO_OBJECT, lambda p: p @ PLACED[:3, :3]),
        (Op.NORMAL_TO_WORLD, lambda p: p @ np.linalg.inv(PLACED[:3, :3])),
    ],
)
def test_spaces(op: Op, expected: Callable[[np.ndarray], np.ndarray]) -> None:
    values = run(compiled(of_surface(op, 3, of_surface(Op.POSITION_WORLD, 3))), world_from_local=PLACED)[:, :3]
    wanted = expected(PLACES.astype(float))
    if "NORMAL" in op.name:
        wanted /= np.linalg.norm(wanted, axis=1, keepdims=True)
    np.testing.assert_allclose(values, wanted, atol=1e-5)


def test_the_place_of_an_object_is_in_its_own_space() -> None:
    values = run(compiled(POSITION), world_from_local=PLACED)[:, :3]
    np.testing.assert_allclose(values, (PLACES - PLACED[:3, 3]) @ np.linalg.inv(PLACED[:3, :3]).T, atol=1e-5)


# --- programs themselves


def test_host_and_kernels_agree_on_steps() -> None:
    assert {f"OP_{op.name}" for op in Op} == {name for name in vars(op_codes) if name.startswith("OP_")}
    assert all(int(getattr(op_codes, f"OP_{op.name}")) == op for op in Op)
    assert int(constants.REGISTERS) == MAX_REGISTERS
    assert float(constants.INPUT_MAX) == LARGEST_INPUT


def test_what_is_no_number_is_0_step_by_step() -> None:
    root = apply(np.sqrt, POSITION.pick([0]))
    values = run(compiled(add(root, Signal.constant([1.0]))))[:, 0]
    np.testing.assert_allclose(values, np.sqrt(np.maximum(PLACES[:, 0], 0.0)) + 1.0, rtol=1e-6)


def test_equal_steps_are_taken_once_and_registers_used_again() -> None:
    wave = apply(np.sin, POSITION.pick([0]))
    total = wave
    for _ in range(100):
        total = apply(np.cos, multiply(total, add(wave, Signal.constant([2.0]))))
    steps = compiled(total).steps
    assert sum(step.op is Op.SIN for step in steps) == 1
    assert max(step.out for step in steps) < 4
    assert steps[-1].out == 0


def test_programs_that_are_too_large_are_refused() -> None:
    total = POSITION.pick([0])
    for _ in range(MAX_STEPS):
        total = apply(np.sin, total)
    with pytest.raises(DoesNotFold):
        compiled(total)
    waves = [apply(np.sin, POSITION.pick([0]).map(np.array([[k + 1.0]]))) for k in range(MAX_REGISTERS + 2)]
    product = waves[0]
    for wave in (*waves[1:], *waves):
        product = multiply(product, wave)
    with pytest.raises(DoesNotFold):
        compiled(product)


def test_a_colour_space_comes_after_all_else() -> None:
    matrix = np.array([(0.5, 0.25, 0.0), (0.0, 1.0, 0.5), (2.0, 0.0, 1.0)])
    values = run(compiled(POSITION).then(matrix))
    np.testing.assert_allclose(values[:, :3], PLACES @ matrix.T, rtol=1e-5, atol=1e-6)
    assert Program((Step(Op.POSITION),)).then(matrix).steps[-1].size == 3


# --- matrices and normals, from stages


UNLIT = """uniform token info:id = "ND_surface_unlit"
color3f inputs:emission_color.connect = </M/N.outputs:out>"""
STANDARD = """uniform token info:id = "ND_standard_surface_surfaceshader"
float3 inputs:normal.connect = </M/N.outputs:out>"""


def shaded(nodes: str, surface: str = UNLIT) -> tuple[Material, list[str]]:
    """Return the material of a stage, and the codes of what was told."""
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(
        f"""#usda 1.0
        def Material "M" {{
            token outputs:mtlx:surface.connect = </M/S.outputs:out>
            def Shader "S" {{
                {surface}
                token outputs:out
            }}
            {nodes}
        }}"""
    )
    report = Report()
    reader = MaterialReader(stage, Usd.TimeCode.Default(), report)
    row = reader._add(UsdShade.Material(stage.GetPrimAtPath("/M")))
    return reader.materials[row], [d.code for d in report if d.code != "W302"]


def node(name: str, identifier: str, *lines: str) -> str:
    body = "\n".join((f'uniform token info:id = "{identifier}"', *lines, "float outputs:out"))
    return f'def Shader "{name}" {{\n{body}\n}}\n'


def on(name: str, source: str, kind: str = "float3") -> str:
    return f"{kind} inputs:{name}.connect = </M/{source}.outputs:out>"


def row(name: str, values: list[float]) -> str:
    return f"float3 inputs:{name} = {tuple(values)}"


P = node("P", "ND_position_vector3")
ROWS = [[2.0, 0.0, 1.0], [0.5, 1.0, 0.0], [0.0, -1.0, 3.0]]
MATRIX = np.array(ROWS)
OF_ROWS = "ND_creatematrix_vector3_matrix33"
MADE = node("A", OF_ROWS, *(row(f"in{k + 1}", ROWS[k]) for k in range(3)))
OF_PLACE = node("A", OF_ROWS, on("in1", "P"), row("in2", ROWS[1]), row("in3", ROWS[2]))
TRANSPOSED = node("B", "ND_transpose_matrix33", on("in", "A", "matrix3d"))
INVERTED = node("B", "ND_invertmatrix_matrix33", on("in", "A", "matrix3d"))


def with_place(p: np.ndarray) -> np.ndarray:
    """Return the matrices whose first rows are places, shape [n, 3, 3]."""
    return np.array([np.array([place, *MATRIX[1:]]) for place in p])


@pytest.mark.parametrize(
    ("nodes", "source", "expected"),
    [
        ("", "", lambda p: p @ MATRIX),
        (MADE, "A", lambda p: p @ MATRIX),
        (MADE + TRANSPOSED, "B", lambda p: p @ MATRIX.T),
        (MADE + INVERTED, "B", lambda p: p @ np.linalg.inv(MATRIX)),
        (OF_PLACE, "A", lambda p: np.einsum("ni,nij->nj", p, with_place(p))),
        (OF_PLACE + INVERTED, "B", lambda p: np.einsum("ni,nij->nj", p, np.linalg.inv(with_place(p)))),
    ],
)
def test_vectors_by_matrices(nodes: str, source: str, expected: Callable[[np.ndarray], np.ndarray]) -> None:
    mat = on("mat", source, "matrix3d") if source else f"matrix3d inputs:mat = {tuple(map(tuple, ROWS))}"
    material, codes = shaded(P + nodes + node("N", "ND_transformmatrix_vector3", on("in", "P"), mat))
    assert codes == []
    values = run(material.inputs["emissiveColor"].program)[:, :3]
    np.testing.assert_allclose(values, expected(PLACES.astype(float)), rtol=2e-3, atol=1e-4)


def test_points_by_matrices_of_four_rows_are_moved() -> None:
    mat = "matrix4d inputs:mat = ((1, 0, 0, 0), (0, 2, 0, 0), (0, 0, 3, 0), (4, 5, 6, 1))"
    material, codes = shaded(P + node("N", "ND_transformmatrix_vector3M4", on("in", "P"), mat))
    assert codes == []
    values = run(material.inputs["emissiveColor"].program)[:, :3]
    np.testing.assert_allclose(values, PLACES * (1, 2, 3) + (4, 5, 6), atol=1e-5)


def test_a_matrix_without_an_inverse_is_told() -> None:
    flat = node("A", OF_ROWS, row("in1", [1.0, 0.0, 0.0]), row("in3", [1.0, 0.0, 0.0]))
    result = node("N", "ND_transformmatrix_vector3", on("in", "P"), on("mat", "B", "matrix3d"))
    assert shaded(P + flat + INVERTED + result)[1] == ["W303"]


BUMPS = (
    P
    + node("W", "ND_normal_vector3", 'string inputs:space = "world"')
    + node("Q", "ND_noise3d_vector3", on("position", "P"))
)


def test_a_normal_of_the_world_stays_in_it() -> None:
    material, codes = shaded(BUMPS + node("N", "ND_add_vector3", on("in1", "W"), on("in2", "Q")), STANDARD)
    assert (material.inputs["normal"].normal_frame, codes) == (NormalFrame.WORLD, [])
    values = run(material.inputs["normal"].program)[:, :3]
    np.testing.assert_allclose(values, NORMAL + perlin_solid_vector(PLACES.astype(float)), atol=1e-4)


def test_a_normal_map_of_the_place_stays_in_the_frame_of_the_surface() -> None:
    material, codes = shaded(BUMPS + node("N", "ND_normalmap_float", on("in", "Q")), STANDARD)
    assert (material.inputs["normal"].normal_frame, codes) == (NormalFrame.PRIMVAR, [])
    values = run(material.inputs["normal"].program)[:, :3]
    np.testing.assert_allclose(values, 2.0 * perlin_solid_vector(PLACES.astype(float)) - 1.0, atol=1e-4)


SURFACE = """#usda 1.0
def Sphere "Ball" (prepend apiSchemas = ["MaterialBindingAPI"])
{{
    rel material:binding = </M>
}}
def DomeLight "Sky"
{{
}}
def Material "M"
{{
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S"
    {{
        uniform token info:id = "UsdPreviewSurface"
        {said}
        token outputs:surface
    }}
    def Shader "P"
    {{
        uniform token info:id = "ND_position_vector3"
        float3 outputs:out
    }}
    def Shader "L"
    {{
        uniform token info:id = "ND_magnitude_vector3"
        float3 inputs:in.connect = </M/P.outputs:out>
        float outputs:out
    }}
    def Shader "N"
    {{
        uniform token info:id = "ND_multiply_float"
        float inputs:in1.connect = </M/L.outputs:out>
        float inputs:in2 = {factor}
        float outputs:out
    }}
}}
"""


def picture(said: str, factor: float = 1.0) -> np.ndarray:
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(SURFACE.format(said=said, factor=factor))
    return warp_rt.render(stage, width=12, height=12, device="cpu")["color"]


@pytest.mark.parametrize("name", ["roughness", "clearcoatRoughness", "metallic", "clearcoat", "occlusion"])
@pytest.mark.parametrize("factor", [3.0, 1e30])
def test_what_is_computed_beyond_1_counts_as_1(name: str, factor: float) -> None:
    """Of an input that goes from 0 to 1, as of a constant; nothing is sent out that does not arrive."""
    coat = "" if name == "clearcoat" else "float inputs:clearcoat = 1"
    computed = picture(f"{coat}\nfloat inputs:{name}.connect = </M/N.outputs:out>", factor)
    np.testing.assert_allclose(computed, picture(f"{coat}\nfloat inputs:{name} = 1"), rtol=1e-5, atol=1e-6)
    assert computed.max() <= 1.0 + 1e-3


def test_pictures_of_huge_colours_are_numbers() -> None:
    assert np.isfinite(picture("color3f inputs:diffuseColor.connect = </M/N.outputs:out>", 3e38)).all()
    assert np.isfinite(picture("color3f inputs:emissiveColor = (3e38, -3e38, 1)")).all()
