# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Render settings, the products' overrides, and our own attributes."""

import pytest
from pxr import Usd

from warp_rt.errors import SceneError
from warp_rt.report import Report
from warp_rt.scene import Settings
from warp_rt.usd.load import load_stage
from warp_rt.usd.settings import read_settings, settings_of_pass


def _read(settings="", products="", metadata='renderSettingsPrimPath = "/Render/S"', path=None):
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(
        f'#usda 1.0\n({metadata}\n)\ndef "Render" {{\ndef RenderSettings "S" {{\n{settings}\n}}\n{products}\n}}'
    )
    report = Report()
    found, purposes = read_settings(stage, report, path)
    return found, purposes, [d.code for d in report]


def test_nothing_is_said():
    assert _read(metadata="") == (Settings(), None, [])
    assert _read() == (Settings(path="/Render/S"), None, [])


def test_our_own_terms():
    body = (
        "color3f warp_rt:ambient = (0.1, 0.2, 0.3)\ncolor3f warp_rt:background = (1, 0, 0.5)\n"
        "int warp_rt:depth = 4\nfloat warp_rt:threshold = 0.25"
    )
    found, _, codes = _read(body)
    assert found.ambient == pytest.approx((0.1, 0.2, 0.3))
    assert found.background == (1, 0, 0.5)
    assert (found.depth, found.threshold, codes) == (4, 0.25, [])


def test_standard_terms():
    body = (
        "uniform int2 resolution = (640, 480)\nuniform float pixelAspectRatio = 2\n"
        'uniform token aspectRatioConformPolicy = "cropAperture"\nrel camera = </Cam>\n'
        'uniform token[] includedPurposes = ["default", "guide"]'
    )
    found, purposes, codes = _read(body)
    assert (found.resolution, found.pixel_aspect_ratio, found.aspect_policy) == ((640, 480), 2, "cropAperture")
    assert (found.camera, purposes, codes) == ("/Cam", ("default", "guide"), [])


def test_first_raster_product_overrides_what_it_authors():
    products = (
        'def RenderProduct "Deep" {\nuniform token productType = "deepRaster"\nuniform int2 resolution = (1, 1)\n}\n'
        'def RenderProduct "P" {\nuniform int2 resolution = (32, 16)\nrel camera = </Other>\n}\n'
        'def RenderProduct "Q" {\nuniform int2 resolution = (2, 2)\n}'
    )
    body = (
        "rel products = [</Render/Deep>, </Render/P>, </Render/Q>]\nuniform int2 resolution = (640, 480)\n"
        "uniform float pixelAspectRatio = 2\nrel camera = </Cam>"
    )
    found, _, codes = _read(body, products)
    assert (found.resolution, found.pixel_aspect_ratio, found.camera) == ((32, 16), 2, "/Other")
    assert codes == ["W524", "W524"]


def test_a_path_is_taken_before_the_metadata():
    assert _read(metadata="", path="/Render/S")[0].path == "/Render/S"
    with pytest.raises(SceneError, match="/Nothing is no RenderSettings prim"):
        _read(path="/Nothing")


def test_metadata_that_lead_nowhere_are_named():
    assert _read(metadata='renderSettingsPrimPath = "/Nothing"') == (Settings(), None, ["W521"])


@pytest.mark.parametrize(
    "body",
    [
        "uniform int2 resolution = (0, 480)",
        "uniform int2 resolution = (640, 1000000)",
        "uniform float pixelAspectRatio = 0",
        'uniform token aspectRatioConformPolicy = "stretch"',
        "int warp_rt:depth = 0",
        "float warp_rt:threshold = -1",
        "float warp_rt:threshold = nan",
        "float warp_rt:ambient = 1",
        'string warp_rt:background = "red"',
        'token includedPurposes = "render"',
    ],
)
def test_values_without_meaning_are_named_and_left_out(body):
    assert _read(body) == (Settings(path="/Render/S"), None, ["W523"])


@pytest.mark.parametrize(
    "body",
    [
        "uniform float4 dataWindowNDC = (0, 0, 0.5, 1)",
        'uniform token renderingColorSpace = "acescg"',
        'uniform token[] materialBindingPurposes = ["preview", ""]',
        'token materialBindingPurposes = "full"',
        "int warp_rt:dept = 3",
    ],
)
def test_terms_that_are_ignored_are_named(body):
    assert _read(body) == (Settings(path="/Render/S"), None, ["W522"])


def test_names_of_files_and_vars_are_not_read_which_is_noted():
    product = 'def RenderProduct "P" {\ntoken productName = "a.exr"\n}'
    assert _read("rel products = </Render/P>", product)[2] == ["N904"]
    product = 'def RenderProduct "P" {\nrel orderedVars = </Render/V>\n}\ndef RenderVar "V" {\n}'
    assert _read("rel products = </Render/P>", product)[2] == ["N904"]
    assert _read("rel products = </Render/P>", 'def RenderProduct "P" {\n}')[2] == []


@pytest.mark.parametrize(
    ("metadata", "expected"),
    [
        ("", [("N903", "/R/A"), ("N903", "/R/B"), ("N903", "/R/P")]),
        ('renderSettingsPrimPath = "/R/B"', [("N903", "/R/P")]),
        ('renderSettingsPrimPath = "/R/C"', [("W521", "/R/C"), ("N903", "/R/A"), ("N903", "/R/B"), ("N903", "/R/P")]),
    ],
)
def test_settings_that_nothing_names_are_noted(metadata, expected):
    """usdrecord, too, passes over them; beside settings that are named, others are its alternatives."""
    stage = Usd.Stage.CreateInMemory()
    prims = 'def RenderSettings "A" {\n}\ndef RenderSettings "B" {\n}\ndef RenderPass "P" {\n}'
    text = f'#usda 1.0\n({metadata}\n)\ndef Sphere "s" {{\n}}\ndef Scope "R" {{\n{prims}\n}}'
    stage.GetRootLayer().ImportFromString(text)
    assert [(d.code, d.prim) for d in load_stage(stage).diagnostics] == expected


def test_a_camera_that_is_not_there_is_named():
    stage = Usd.Stage.CreateInMemory()
    text = (
        '#usda 1.0\n(renderSettingsPrimPath = "/S"\n)\ndef RenderSettings "S" {\nrel camera = </Cam>\n}\n'
        'def Sphere "s" {\n}\n'
    )
    stage.GetRootLayer().ImportFromString(text)
    assert [(d.code, d.prim) for d in load_stage(stage).diagnostics] == [("W523", "/S")]
    stage.GetRootLayer().ImportFromString(text + 'def Camera "Cam" {\n}')
    assert load_stage(stage).diagnostics == ()


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("", []),
        ("uniform bool collection:prune:includeRoot = 0", []),
        ('uniform token collection:matte:mode = "relationship"', []),
        ("uniform bool collection:matte:includeRoot = 1", ["W522"]),
        ("rel collection:prune:includes = </a>\nrel collection:cameraVisibility:excludes = </a>", ["W522", "W522"]),
        ('uniform pathExpression collection:renderVisibility:membershipExpression = "/a"', ["W522"]),
    ],
)
def test_collections_of_a_pass_are_told(body: str, told: list[str]) -> None:
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(f'#usda 1.0\ndef RenderPass "P" {{ rel renderSource = </S>\n{body}\n}}')
    report = Report()
    assert settings_of_pass(stage, "/P", report) == "/S"
    assert [record.code for record in report] == told
