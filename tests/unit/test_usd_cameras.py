# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdGeomCamera against OpenUSD's own frustum, and the schema's rules."""

import math

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from warp_rt.report import Report
from warp_rt.usd.cameras import read_camera, report_hidden

TIME = Usd.TimeCode.Default()


def _read(body="", matrix=None):
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(f'#usda 1.0\ndef Camera "C" {{\n{body}\n}}')
    prim, report = stage.GetPrimAtPath("/C"), Report()
    camera = read_camera(prim, np.eye(4) if matrix is None else matrix, TIME, report)
    window = UsdGeom.Camera(prim).GetCamera(TIME).frustum.window
    return camera, [d.code for d in report], (window.min[0], window.max[0], window.min[1], window.max[1])


WINDOWS = [
    "",
    "float focalLength = 35\nfloat horizontalAperture = 36\nfloat verticalAperture = 24",
    "float horizontalApertureOffset = 3\nfloat verticalApertureOffset = -2",
    'token projection = "orthographic"\nfloat horizontalAperture = 40\nfloat verticalAperture = 20',
    'token projection = "orthographic"\nfloat horizontalApertureOffset = 5\nfloat verticalApertureOffset = 1',
    "float focalLength = 0.5\nfloat horizontalAperture = 0.36\nfloat verticalAperture = 0.28125",
]


@pytest.mark.parametrize("body", WINDOWS)
def test_window_is_that_of_openusds_frustum(body):
    camera, codes, expected = _read(body)
    assert camera.window == pytest.approx(expected, rel=1e-6)
    assert camera.is_perspective == ("orthographic" not in body)
    assert (camera.path, codes) == ("/C", [])


def test_apertures_are_tenths_of_a_scene_unit():
    camera, _, _ = _read('token projection = "orthographic"\nfloat horizontalAperture = 40')
    assert camera.window[1] - camera.window[0] == pytest.approx(4)


def test_transform_keeps_scale_and_shear():
    matrix = np.array([[2.0, 1, 0, 5], [0, 3, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]])
    np.testing.assert_array_equal(_read(matrix=matrix)[0].world_from_camera, matrix)


def test_singular_transform_keeps_its_translation():
    matrix = np.diag([1.0, 0, 1, 1])
    matrix[:3, 3] = 4, 5, 6
    camera, codes, _ = _read(matrix=matrix)
    np.testing.assert_array_equal(camera.world_from_camera[:, 3], [4, 5, 6, 1])
    np.testing.assert_array_equal(camera.world_from_camera[:3, :3], np.eye(3))
    assert codes == ["W424"]


def test_clipping_range_counts_where_authored():
    assert _read()[0].clipping_range == (0, math.inf)
    assert _read("float2 clippingRange = (0.5, 20)")[0].clipping_range == (0.5, 20)
    assert _read("float2 clippingRange = (-3, 20)")[0].clipping_range == (0, 20)
    orthographic = 'token projection = "orthographic"\nfloat2 clippingRange = (-3, 20)'
    assert _read(orthographic)[0].clipping_range == (-3, 20)
    camera, codes, _ = _read("float2 clippingRange = (5, inf)")
    assert (camera.clipping_range, codes) == ((5, math.inf), [])
    for senseless in ("(5, 5)", "(nan, 5)", "(-inf, 5)"):
        camera, codes, _ = _read(f"float2 clippingRange = {senseless}")
        assert (camera.clipping_range, codes) == ((0, math.inf), ["W424"])


def test_exposure_scale():
    # time * iso / 100 * responsivity * 2^exposure / fStop^2, with exposure:fStop
    body = (
        "float exposure = 3\nfloat exposure:time = 0.5\nfloat exposure:iso = 200\nfloat exposure:responsivity = 3\n"
        "float exposure:fStop = 2"
    )
    assert _read(body)[0].exposure_scale == pytest.approx(0.5 * 2 * 3 * 8 / 4)
    assert _read()[0].exposure_scale == 1


@pytest.mark.parametrize(("body", "why"), [("exposure:fStop = 0", "not finite"), ("exposure:time = -1", "below 0")])
def test_exposures_that_make_no_sense_are_named(body, why):
    stage, report = Usd.Stage.CreateInMemory(), Report()
    stage.GetRootLayer().ImportFromString(f'#usda 1.0\ndef Camera "C" {{\nfloat {body}\n}}')
    assert read_camera(stage.GetPrimAtPath("/C"), np.eye(4), TIME, report).exposure_scale == 1
    assert [(record.code, why in record.message) for record in report] == [("W424", True)]


def test_an_f_number_below_0_is_named():
    camera, codes, _ = _read("float fStop = -2\nfloat focusDistance = 5")
    assert (camera.lens_radius, codes) == (0, ["W424"])


@pytest.mark.parametrize("name", ["focalLength", "horizontalAperture", "verticalAperture"])
def test_lengths_that_make_no_sense_are_replaced_by_the_schemas(name):
    for value in ("0", "-5", "inf"):
        camera, codes, _ = _read(f"float {name} = {value}")
        assert camera.window == pytest.approx(_read()[0].window, rel=1e-6)
        assert codes == ["W424"]


def test_the_shutter():
    assert _read("double shutter:open = -0.25\ndouble shutter:close = 0.5")[0].shutter == (-0.25, 0.5)
    assert _read("double shutter:open = 0.25\ndouble shutter:close = 0.25")[0].shutter == (0.25, 0.25)
    # It closes before it opens; whether that counts is for the render settings to say.
    camera, codes, _ = _read("double shutter:open = 0.5")
    assert (camera.shutter, camera.exposure_scale, codes) == ((0.5, 0), 1, [])


@pytest.mark.parametrize(
    "body",
    [
        'token projection = "fisheye"',
        'string focalLength = "long"',
        'string horizontalApertureOffset = "x"',
        "float verticalApertureOffset = inf",
        'string fStop = "f/8"',
        'string shutter:open = "x"',
        'string exposure = "x"',
        "float2 exposure:iso = (1, 2)",
        'string clippingRange = "x"',
    ],
)
def test_values_of_a_wrong_type_are_named_and_those_of_the_schema_hold(body):
    camera, codes, _ = _read(body)
    expected, _, _ = _read()
    assert codes == ["W424"]
    assert camera.window == pytest.approx(expected.window, rel=1e-6)
    for name in ("is_perspective", "clipping_range", "exposure_scale"):
        assert getattr(camera, name) == getattr(expected, name)


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_the_aperture_is_the_focal_length_over_the_f_number(projection):
    body = f'token projection = "{projection}"\nfloat fStop = 2.5\nfloat focusDistance = 7\nfloat focalLength = 40'
    camera, codes, _ = _read(body)
    assert camera.lens_radius == pytest.approx(40 * 0.1 / 2.5 / 2)  # tenths of a scene unit, over the f-number
    assert (camera.focus_distance, codes) == (7, [])


def test_a_lens_that_nothing_is_in_focus_of_stays_a_pinhole():
    for body, expected in {
        "float fStop = 2.8": ["W421"],
        "float fStop = 2.8\nfloat focusDistance = -1": ["W421"],
        "float focusDistance = 5": [],
    }.items():
        camera, codes, _ = _read(body)
        assert (camera.lens_radius, camera.focus_distance, codes) == (0, 0, expected)


def test_clipping_planes():
    camera, codes, _ = _read("float4[] clippingPlanes = [(1, 0, 0, -2), (0, 0, -1, 3)]")
    assert (camera.clipping_planes, codes) == (((1, 0, 0, -2), (0, 0, -1, 3)), [])
    assert _read("float4[] clippingPlanes = []")[1] == []
    for body in ("int clippingPlanes = 1", "float4[] clippingPlanes = [(1, 0, nan, 0)]"):
        camera, codes, _ = _read(body)
        assert (camera.clipping_planes, codes) == ((), ["W422"])


BOX = np.array([[-1.0, -1, -1], [1, 1, 1]])
FAR_BACK = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 10], [0, 0, 0, 1]])


@pytest.mark.parametrize(
    ("body", "hides"),
    [
        ("float2 clippingRange = (11.5, 100)", True),
        ("float2 clippingRange = (10.5, 100)", False),
        ("float2 clippingRange = (1, 8.5)", True),
        ("float2 clippingRange = (1, 9.5)", False),
        ("float4[] clippingPlanes = [(1, 0, 0, -1.5)]", True),  # x >= 1.5
        ("float4[] clippingPlanes = [(1, 0, 0, -0.5)]", False),
        ("float4[] clippingPlanes = [(0, 0, 1, 8)]", True),  # z >= -8, where the camera stands in z = 10
    ],
)
def test_clipping_that_hides_everything_is_told(body, hides):
    report = Report()
    report_hidden([_read(body, FAR_BACK)[0]], BOX, report)
    assert [d.code for d in report] == (["W426"] if hides else [])


def test_a_scene_behind_the_camera_is_not_hidden_by_its_clipping():
    report = Report()
    behind = np.diag([1.0, 1, 1, 1])
    behind[2, 3] = -10
    report_hidden([_read("float2 clippingRange = (1, 100)", behind)[0]], BOX, report)
    report_hidden([_read("float2 clippingRange = (1, 2)", behind)[0]], np.full((2, 3), np.nan), report)
    report_hidden([_read('token projection = "orthographic"', behind)[0]], BOX, report)
    assert not list(report)


@pytest.mark.parametrize("f_number", ["1", "2.8", "0.5"])
def test_exposure_scale_is_openusds(f_number):
    stage = Usd.Stage.CreateInMemory()
    camera = UsdGeom.Camera.Define(stage, "/C")
    body = f"float exposure = -1.5\nfloat exposure:time = 0.25\nfloat exposure:fStop = {f_number}"
    stage.GetRootLayer().ImportFromString(f'#usda 1.0\ndef Camera "C" {{\n{body}\n}}')
    assert _read(body)[0].exposure_scale == pytest.approx(camera.ComputeLinearExposureScale(TIME), rel=1e-6)


@pytest.mark.parametrize("body", ["exposure:fStop = 0", "exposure = 1000", "exposure = 128", "exposure:iso = 3e38"])
def test_an_exposure_without_end_is_named(body):
    """Nor is there one in the single precision of films, in which 0 would become no number."""
    camera, codes, _ = _read(f"float exposure:responsivity = 1000\nfloat {body}")
    assert (camera.exposure_scale, codes) == (1, ["W424"])


def test_back_plates_are_named():
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString('#usda 1.0\ndef Camera "C" (prepend apiSchemas = ["BackPlateAPI:p"]) {\n}')
    report = Report()
    read_camera(stage.GetPrimAtPath("/C"), np.eye(4), TIME, report)
    assert [d.code for d in report] == ["W425"]
