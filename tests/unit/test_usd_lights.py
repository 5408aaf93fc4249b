# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdLux lights against the schema's rules and closed forms."""

import math

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from warp_rt.report import Report
from warp_rt.scene import Dome, Instances, LightKind, Shadow
from warp_rt.upload.device_lights import light_record
from warp_rt.upload.light_tables import LightTables
from warp_rt.usd.ies import ProfileCache
from warp_rt.usd.lights import is_light, read_lights
from warp_rt.usd.mesh_lights import MeshLightReader

TIME = Usd.TimeCode.Default()
REPORT = Report()
_NONE = np.zeros(0, np.int32)
NO_MESHES = MeshLightReader((), Instances(_NONE, np.zeros((0, 4, 4)), _NONE, _NONE, _NONE, _NONE), (), (), (), ())


class _NoImages:
    """Stands for the images: remembers what is asked for."""

    def __init__(self):
        self.loaded = []

    def image(self, asset, prim):
        self.loaded.append(asset.path)
        return 7

    def decoded(self, row, attribute, prim):
        return row, True

    def latlong(self, row, layout, *, is_srgb, stretch=None):
        if layout == "cubeMapVerticalCross":  # stands for an image of other proportions
            return -1, False
        return (row, is_srgb) if layout in ("automatic", "latlong") else (row + 1, False)


def _stage(body):
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString("#usda 1.0\n" + body)
    return stage


def _read(body, matrix=None, images=None):
    """Return the light /L of a stage, and the diagnostics' codes."""
    stage = _stage(body)
    report = Report()
    matrix = np.eye(4) if matrix is None else matrix
    lights = read_lights(
        stage.GetPrimAtPath("/L"), matrix, TIME, report, images or _NoImages(), ProfileCache(report), NO_MESHES
    )
    return next(iter(lights), None), [diagnostic.code for diagnostic in report]


def _light(kind, inputs="", matrix=None):
    light, codes = _read(f'def {kind} "L" {{\n{inputs}\n}}', matrix)
    assert codes == []
    return light


def _scale(x, y, z):
    return np.diag([x, y, z, 1.0])


# --- emission


@pytest.mark.parametrize("kind", ["SphereLight", "RectLight", "DiskLight", "CylinderLight"])
def test_radiance_is_intensity_times_power_of_two_times_color(kind):
    inputs = "float inputs:intensity = 3\nfloat inputs:exposure = 2\ncolor3f inputs:color = (1, 0.5, 0.25)"
    light = _light(kind, inputs)
    assert light.radiance == pytest.approx((12, 6, 3))
    assert light.path == "/L"
    assert light.casts_shadow
    assert (light.diffuse, light.specular) == (1, 1)
    assert light.cone_angle == pytest.approx(math.pi)


def test_defaults_of_the_schema():
    assert _light("RectLight").radiance == (1, 1, 1)
    assert (_light("RectLight").width, _light("RectLight").height) == (1, 1)
    assert _light("SphereLight").radius == 0.5
    assert (_light("CylinderLight").radius, _light("CylinderLight").length) == (0.5, 1)
    distant = _light("DistantLight")
    assert distant.radiance == (50000, 50000, 50000)
    assert distant.angle == pytest.approx(math.radians(0.53))
    kinds = {"SphereLight": 2, "RectLight": 3, "DiskLight": 4, "CylinderLight": 5, "DistantLight": 1}
    assert {kind: int(_light(kind).kind) for kind in kinds} == kinds


def test_multipliers_and_shadow():
    inputs = "float inputs:diffuse = 0.25\nfloat inputs:specular = 2\nbool inputs:shadow:enable = 0"
    light = _light("DiskLight", inputs)
    assert (light.diffuse, light.specular, light.casts_shadow) == (0.25, 2, False)


@pytest.mark.parametrize(("kelvin", "nearest"), [(11000, 10000), (500, 1000)])
def test_temperatures_that_usd_does_not_know_are_told(kelvin, nearest):
    body = 'def RectLight "L" {{\nbool inputs:enableColorTemperature = {}\nfloat inputs:colorTemperature = {}\n}}'
    light, codes = _read(body.format(1, kelvin))
    assert (light.radiance, codes) == (_read(body.format(1, nearest))[0].radiance, ["W415"])
    assert light.radiance == pytest.approx(tuple(UsdLux.BlackbodyTemperatureAsRgb(kelvin)))
    assert _read(body.format(0, kelvin))[1] == []


def test_temperature_counts_only_where_enabled():
    # usd-core's black body at 6500 K is (1.0433, 0.9836, 1.0346)
    assert _light("RectLight", "float inputs:colorTemperature = 2000").radiance == (1, 1, 1)
    light = _light("RectLight", "bool inputs:enableColorTemperature = 1")
    assert light.radiance == pytest.approx((1.0433, 0.9836, 1.0346), abs=1e-4)


# --- normalisation by world-space area

AREAS = [
    ("RectLight", "float inputs:width = 2\nfloat inputs:height = 3", _scale(1, 1, 1), 6.0),
    ("RectLight", "float inputs:width = 2\nfloat inputs:height = 3", _scale(2, 5, 9), 60.0),
    ("DiskLight", "float inputs:radius = 2", _scale(1, 1, 1), 4 * math.pi),
    ("DiskLight", "float inputs:radius = 2", _scale(3, 0.5, 7), 6 * math.pi),
    ("SphereLight", "float inputs:radius = 2", _scale(1, 1, 1), 16 * math.pi),
    ("SphereLight", "float inputs:radius = 2", _scale(0.5, 0.5, 0.5), 4 * math.pi),
    ("CylinderLight", "float inputs:radius = 2\nfloat inputs:length = 3", _scale(1, 1, 1), 12 * math.pi),
    ("CylinderLight", "float inputs:radius = 2\nfloat inputs:length = 3", _scale(4, 0.5, 0.5), 24 * math.pi),
]


@pytest.mark.parametrize(("kind", "inputs", "matrix", "area"), AREAS)
def test_normalize_divides_by_the_area_in_world_space(kind, inputs, matrix, area):
    light = _light(kind, inputs + "\nbool inputs:normalize = 1\nfloat inputs:intensity = 5", matrix)
    assert light.radiance == pytest.approx((5 / area,) * 3, rel=1e-6)
    plain = _light(kind, inputs + "\nfloat inputs:intensity = 5", matrix)
    assert plain.radiance == (5, 5, 5)


def test_rect_area_takes_shear():
    shear = np.eye(4)
    shear[0, 1] = 3.0  # y leans towards x: base times height stays 1
    assert _light("RectLight", "bool inputs:normalize = 1", shear).radiance[0] == pytest.approx(1)


def test_a_point_under_uneven_scale_is_that_of_a_sphere_of_the_same_area():
    # Oblate spheroid of half axes 2, 2, 1: 2 pi a^2 (1 + (1 - e^2) / e atanh e), e^2 = 3/4; Thomsen is within 1.2 %.
    e = math.sqrt(0.75)
    area = 2 * math.pi * 4 * (1 + (1 - e * e) / e * math.atanh(e))
    body = 'def SphereLight "L" {\nfloat inputs:radius = 1\nbool inputs:normalize = 1\nbool treatAsPoint = 1\n}'
    light, codes = _read(body, _scale(2, 2, 1))
    assert codes == []
    assert 1 / light.radiance[0] == pytest.approx(area, rel=0.012)
    radius = light_record(light, np.zeros(3), LightTables(lambda light: (-1, np.ones(3))))["radius"]
    assert 4 * math.pi * radius**2 == pytest.approx(1 / light.radiance[0])


def test_elliptic_cylinder_keeps_length_and_circumference():
    # Ramanujan's first formula is exact to 1e-6 for 2 : 1; the circumference of that ellipse is 9.688448.
    body = 'def CylinderLight "L" {\nfloat inputs:radius = 1\nbool inputs:normalize = 1\n}'
    light, codes = _read(body, _scale(3, 2, 1))
    assert codes == []
    assert 1 / light.radiance[0] == pytest.approx(3 * 9.688448, rel=1e-5)
    record = light_record(light, np.zeros(3), LightTables(lambda light: (-1, np.ones(3))))
    half_axes = [record[name] for name in ("half_x", "half_y", "half_z")]
    np.testing.assert_allclose(half_axes, np.diag([1.5, 2, 1]))


@pytest.mark.parametrize(
    ("angle", "projected"),
    [
        (0, 1.0),  # a delta light
        (60, math.pi * 0.25),  # pi sin^2 30
        (180, math.pi),
        (240, math.pi * (2 - 0.75)),  # beyond the horizon: 2 - sin^2 120
        (360, 2 * math.pi),
    ],
)
def test_distant_light_normalisation(angle, projected):
    inputs = f"float inputs:angle = {angle}\nfloat inputs:intensity = 6"
    assert _light("DistantLight", inputs).radiance[0] == 6
    light = _light("DistantLight", inputs + "\nbool inputs:normalize = 1")
    assert light.radiance[0] == pytest.approx(6 / projected)
    assert light.angle == pytest.approx(math.radians(angle))


# --- points


def test_treat_as_point_keeps_radiance_and_radius():
    light = _light("SphereLight", "bool treatAsPoint = 1\nfloat inputs:radius = 0.25\nfloat inputs:intensity = 2")
    assert (light.kind, light.radius, light.has_falloff) == (LightKind.POINT, 0.25, True)
    assert light.radiance == (2, 2, 2)


@pytest.mark.parametrize("radius", [0.0, 0.01, 3.0])
def test_normalised_point_sends_a_quarter_of_its_intensity(radius):
    # radiant intensity = L pi r^2, and L = I / (4 pi r^2), for every radius and scale
    inputs = (
        f"bool treatAsPoint = 1\nfloat inputs:radius = {radius}\nbool inputs:normalize = 1\nfloat inputs:intensity = 8"
    )
    light = _light("SphereLight", inputs, _scale(2, 2, 2))
    assert light.radiance[0] * math.pi * (2 * light.radius) ** 2 == pytest.approx(2)


def test_point_of_radius_zero_is_read_as_normalised():
    body = 'def SphereLight "L" {\nbool treatAsPoint = 1\nfloat inputs:radius = 0\nfloat inputs:intensity = 8\n}'
    light, codes = _read(body)
    assert light.radiance[0] * math.pi * light.radius**2 == pytest.approx(2)
    assert codes == ["W412"]


def test_the_lectures_point_light_has_one_value_everywhere():
    inputs = (
        'bool treatAsPoint = 1\ntoken warp_rt:falloff = "none"\nfloat inputs:radius = 0\nbool inputs:normalize = 1\n'
        "float inputs:intensity = 3\nfloat inputs:exposure = 1\ncolor3f inputs:color = (1, 0.5, 0)"
    )
    light = _light("SphereLight", inputs, _scale(5, 5, 5))
    assert (light.kind, light.has_falloff) == (LightKind.POINT, False)
    assert light.radiance == pytest.approx((6, 3, 0))


@pytest.mark.parametrize("light", ["SphereLight", "DiskLight", "DistantLight"])
def test_falloff_needs_treat_as_point(light):
    found, codes = _read(f'def {light} "L" {{\ntoken warp_rt:falloff = "none"\n}}')
    assert (found.has_falloff, codes) == (True, ["N926"])


# --- shaping


def test_shaping_is_read_where_authored():
    inputs = (
        "float inputs:shaping:focus = 3\ncolor3f inputs:shaping:focusTint = (0.1, 0.2, 0.3)\n"
        "float inputs:shaping:cone:angle = 30\nfloat inputs:shaping:cone:softness = 0.5"
    )
    light = _light("SphereLight", inputs)
    assert (light.focus, light.cone_softness) == (3, 0.5)
    assert light.focus_tint == pytest.approx((0.1, 0.2, 0.3))
    assert light.cone_angle == pytest.approx(math.pi / 6)


def test_applied_shaping_has_the_schemas_cone():
    light, _ = _read('def SphereLight "L" (apiSchemas = ["ShapingAPI"]) {}')
    assert light.cone_angle == pytest.approx(math.pi / 2)


def test_distant_lights_are_not_shaped():
    for shaping in ("float inputs:shaping:cone:angle = 10", "asset inputs:shaping:ies:file = @lamp.ies@"):
        light, codes = _read(f'def DistantLight "L" {{\n{shaping}\n}}')
        assert light.cone_angle == pytest.approx(math.pi)
        assert light.profile is None
        assert codes == ["N919"]
        assert _read(f'def DomeLight "L" {{\n{shaping}\n}}')[1] == ["N919"]
    assert _read('def DistantLight "L" { float inputs:shaping:focus = None\n}')[1] == []  # blocked: nothing is said


@pytest.mark.parametrize(
    ("kind", "inputs", "codes"),
    [
        ("SphereLight", "float inputs:intesity = 100\nbool inputs:normalise = 1", ["N934"]),
        ("SphereLight", "float inputs:shaping:cone:angel = 20", ["N934"]),
        ("SphereLight", "float inputs:angle = 3\nasset inputs:texture:file = @a.png@", ["N934"]),
        ("RectLight", "float inputs:radius = 2\nfloat inputs:radius.connect = </M.outputs:r>", ["N934"]),
        ("SphereLight", "bool inputs:normalize = 1\nfloat inputs:shaping:focus = 2\nbool inputs:shadow:enable = 0", []),
        ("DomeLight", "bool inputs:normalize = 1", ["N934"]),
        ("DomeLight", "bool inputs:normalize = 0\nfloat inputs:diffuse = 0.5", []),
    ],
)
def test_inputs_that_a_light_does_not_have(kind: str, inputs: str, codes: list[str]) -> None:
    assert _read(f'def {kind} "L" {{\n{inputs}\n}}')[1] == codes


@pytest.mark.parametrize(
    ("kind", "inputs", "name", "value"),
    [
        ("SphereLight", "float inputs:shaping:focus = -3", "focus", 0),
        ("SphereLight", "float inputs:shaping:cone:angle = 200", "cone_angle", math.pi),
        ("SphereLight", "float inputs:shaping:cone:angle = -20", "cone_angle", 0),
        ("SphereLight", "float inputs:shaping:cone:softness = 1.5", "cone_softness", 1),
        ("DistantLight", "float inputs:angle = -1", "angle", 0),
        ("SphereLight", "bool treatAsPoint = 1\nfloat inputs:radius = -1\nbool inputs:normalize = 1", "radius", 1),
    ],
)
def test_values_out_of_their_range_are_taken_as_the_nearest(kind, inputs, name, value):
    light, codes = _read(f'def {kind} "L" {{\n{inputs}\n}}')
    assert (getattr(light, name), codes) == (pytest.approx(value), ["W415"])


@pytest.mark.parametrize(
    ("kind", "size"),
    [("SphereLight", "radius"), ("RectLight", "width"), ("RectLight", "height"), ("CylinderLight", "length")],
)
def test_a_negative_size_is_none(kind, size):
    assert _read(f'def {kind} "L" {{\nfloat inputs:{size} = -2\n}}') == (None, ["W415", "W409"])


# --- shadows


@pytest.mark.parametrize(
    ("inputs", "shadow"),
    [
        ("", Shadow()),
        ("color3f inputs:shadow:color = (0, 0.5, 1)", Shadow((0.0, 0.5, 1.0))),
        ("float inputs:shadow:distance = 3", Shadow(distance=3.0)),
        ("float inputs:shadow:distance = 0", Shadow(distance=0.0)),
        ("float inputs:shadow:falloff = 3\nfloat inputs:shadow:falloffGamma = 2", Shadow()),  # of no distance
        ("float inputs:shadow:distance = 3\nfloat inputs:shadow:falloff = 2", Shadow(distance=3.0, falloff=2.0)),
        ("float inputs:shadow:distance = 3\nfloat inputs:shadow:falloff = 7", Shadow(distance=3.0, falloff=3.0)),
        (
            "float inputs:shadow:distance = 3\nfloat inputs:shadow:falloff = 2\nfloat inputs:shadow:falloffGamma = 4",
            Shadow(distance=3.0, falloff=2.0, falloff_gamma=4.0),
        ),
    ],
)
def test_shadow_api(inputs, shadow):
    """A distance below 0 is no limit, a falloff up to 0 none, and it cannot exceed the distance."""
    assert _light("SphereLight", inputs).shadow == shadow


# --- textures


def test_a_rects_texture_is_loaded():
    images = _NoImages()
    light, codes = _read('def RectLight "L" {\nasset inputs:texture:file = @t.png@\n}', images=images)
    assert (light.image, light.is_srgb, images.loaded, codes) == (7, True, ["t.png"], [])


# --- domes


def _dome(kind, body="", header=""):
    stage = _stage(f'({header})\ndef {kind} "L" {{\n{body}\n}}' if header else f'def {kind} "L" {{\n{body}\n}}')
    report, images = Report(), _NoImages()
    (dome,) = read_lights(stage.GetPrimAtPath("/L"), np.eye(4), TIME, report, images, ProfileCache(report), NO_MESHES)
    return dome, [d.code for d in report], images.loaded


def test_dome_without_texture_is_uniform():
    dome, codes, _ = _dome("DomeLight", "float inputs:intensity = 2\nfloat inputs:exposure = -1")
    assert isinstance(dome, Dome)
    assert (dome.radiance, dome.image, codes, dome.is_visible) == ((1, 1, 1), -1, [], True)
    np.testing.assert_array_equal(dome.world_from_light, np.eye(4))


def test_dome_texture_is_loaded_for_layouts_that_are_supported():
    for layout in ("automatic", "latlong"):
        dome, codes, loaded = _dome(
            "DomeLight", f'asset inputs:texture:file = @sky.hdr@\ntoken inputs:texture:format = "{layout}"'
        )
        assert (dome.image, dome.is_srgb, loaded, codes) == (7, True, ["sky.hdr"], [])
    file = "asset inputs:texture:file = @sky.hdr@\ntoken inputs:texture:format = "
    for layout in ("mirroredBall", "angular"):
        dome, codes, _ = _dome("DomeLight", f'{file}"{layout}"')
        assert (dome.image, dome.is_srgb, codes) == (8, False, [])
    dome, codes, _ = _dome("DomeLight", f'{file}"cubeMapVerticalCross"')
    assert (dome.image, codes) == (-1, ["W411"])
    dome, codes, _ = _dome("DomeLight", f'{file}"octahedral"')
    assert (dome.image, codes) == (7, ["W413"])


def test_domes_have_shadows_too():
    dome, _, _ = _dome("DomeLight", "bool inputs:shadow:enable = 0\nfloat inputs:shadow:distance = 3")
    assert (dome.casts_shadow, dome.shadow) == (False, Shadow(distance=3.0))


@pytest.mark.parametrize(
    ("kind", "up", "pole", "is_turned"),
    [
        ("DomeLight", "Z", "", False),  # +Y always
        ("DomeLight_1", "Y", "scene", False),
        ("DomeLight_1", "Z", "scene", True),
        ("DomeLight_1", "Z", "Y", False),
        ("DomeLight_1", "Y", "Z", True),
    ],
)
def test_pole_of_the_dome(kind, up, pole, is_turned):
    body = f'uniform token poleAxis = "{pole}"' if pole else ""
    dome, _, _ = _dome(kind, body, f'upAxis = "{up}"')
    # The schema: the top pole is +Z instead of +Y, and the image's centre -Y instead of +Z.
    top, center = dome.world_from_light[:3, 1], dome.world_from_light[:3, 2]
    np.testing.assert_array_equal(top, [0, 0, 1] if is_turned else [0, 1, 0])
    np.testing.assert_array_equal(center, [0, -1, 0] if is_turned else [0, 0, 1])
    assert np.linalg.det(dome.world_from_light) == pytest.approx(1)


# --- what gives no light, and what is ignored


def test_is_light():
    stage = _stage(
        'def SphereLight "A" {}\ndef Mesh "B" (apiSchemas = ["MeshLightAPI"]) {}\ndef Mesh "C" {}\ndef "D" {}'
    )
    assert [is_light(stage.GetPrimAtPath(path)) for path in ("/A", "/B", "/C", "/D")] == [True, True, False, False]


@pytest.mark.parametrize("kind", ["GeometryLight", "PortalLight", "PluginLight"])
def test_unsupported_kinds_are_named(kind):
    assert _read(f'def {kind} "L" {{}}') == (None, ["W401"])


@pytest.mark.parametrize("kind", ["Mesh", "Sphere", "Points", "Volume"])
@pytest.mark.parametrize("api", ["LightAPI", "MeshLightAPI"])
def test_geometry_that_is_not_drawn_gives_no_light(kind, api):
    stage = _stage(f'def {kind} "L" (apiSchemas = ["{api}"]) {{}}')
    prim = stage.GetPrimAtPath("/L")
    assert is_light(prim)
    report = Report()
    assert read_lights(prim, np.eye(4), TIME, report, _NoImages(), ProfileCache(report), NO_MESHES) == ()
    (found,) = report
    assert (found.code, found.message) == ("W401", f"a {kind} as a light is not drawn; it gives no light")


@pytest.mark.parametrize("matrix", [_scale(1, 1, 0), np.full((4, 4), np.nan)])
def test_singular_transform_is_named(matrix):
    assert _read('def RectLight "L" {}', matrix) == (None, ["W409"])


@pytest.mark.parametrize("kind", ["SphereLight", "DistantLight", "DomeLight"])
def test_a_place_beyond_the_reach_of_coordinates_is_none(kind):
    matrix = np.eye(4)
    matrix[1, 3] = 1e30
    assert _read(f'def {kind} "L" {{}}', matrix) == (None, ["W409"])


def test_a_size_beyond_the_reach_of_coordinates_is_that_reach():
    light, codes = _read('def SphereLight "L" {\nfloat inputs:radius = 1e30\n}')
    assert (light.radius, codes) == (1e12, ["W415"])


@pytest.mark.parametrize(
    ("kind", "inputs"),
    [
        ("SphereLight", "float inputs:radius = 0"),
        ("RectLight", "float inputs:width = 0"),
        ("RectLight", "float inputs:exposure = 5000"),
        ("RectLight", "float inputs:exposure = 100"),
        ("DomeLight", "float inputs:intensity = 1e30"),
    ],
)
def test_lights_without_area_or_bounds_are_named(kind, inputs):
    assert _read(f'def {kind} "L" {{\n{inputs}\n}}') == (None, ["W409"])


@pytest.mark.parametrize(
    ("kind", "inputs", "code"),
    [
        ("SphereLight", "asset inputs:shaping:ies:file = @lamp.ies@", "W402"),
        ("SphereLight", "rel light:filters = </F>", "W403"),
        ("SphereLight", "float intensity = 3", "W407"),
        ("DomeLight", "rel portals = </F>", "W410"),
    ],
)
def test_features_that_are_ignored_are_named(kind, inputs, code):
    light, codes = _read(f'def {kind} "L" {{\n{inputs}\n}}')
    assert light is not None
    assert light.radiance == (1, 1, 1)
    assert codes == [code]


@pytest.mark.parametrize(
    ("kind", "old"),
    [
        ("SphereLight", "float radius = 2"),
        ("SphereLight", "bool shadow:enable = 0"),
        ("SphereLight", "color3f shadow:color = (1, 0, 0)"),
        ("SphereLight", "float shaping:cone:angle = 20"),
        ("SphereLight", "asset shaping:ies:file = @lamp.ies@"),
        ("SphereLight", "float specular = 0"),
        ("RectLight", "asset texture:file = @t.png@"),
        ("DomeLight", "asset texture:file = @t.png@"),
        ("DomeLight_1", 'token texture:format = "latlong"'),
        ("DistantLight", "float angle = 2"),
        ("DistantLight", "bool enableColorTemperature = 1"),
        ("DistantLight", "float colorTemperature = 2000"),
    ],
)
def test_names_without_the_prefix_are_named(kind, old):
    assert _read(f'def {kind} "L" {{\n{old}\n}}')[1] == ["W407"]


def test_what_the_schema_never_prefixed_is_no_old_name():
    assert _read('def SphereLight "L" {\nbool treatAsPoint = 1\nfloat guideRadius = 3\n}')[1] == []


@pytest.mark.parametrize(
    ("kind", "values"),
    [
        ("SphereLight", 'string inputs:intensity = "bright"\nfloat3[] inputs:color = [(1, 2, 3), (4, 5, 6)]'),
        ("SphereLight", 'float inputs:intensity = nan\nstring inputs:normalize = "yes"'),
        ("SphereLight", 'float2 inputs:color = (1, 2)\ntoken[] treatAsPoint = ["a", "b"]'),
        ("SphereLight", 'string inputs:shaping:focus = "much"\nfloat inputs:shaping:focusTint = 1'),
        ("SphereLight", 'string inputs:shadow:enable = "no"\nint inputs:shaping:ies:file = 3'),
        ("SphereLight", 'bool treatAsPoint = 1\ntoken warp_rt:falloff = "linear"\nstring inputs:radius = "x"'),
        ("RectLight", 'string inputs:width = "2"\nint inputs:texture:file = 3'),
        ("DistantLight", 'string inputs:intensity = "x"\nfloat2 inputs:angle = (1, 2)'),
        ("DomeLight_1", 'token poleAxis = "X"\nstring inputs:texture:file = "a.png"'),
    ],
)
def test_values_of_a_wrong_type_are_named_and_those_of_the_schema_hold(kind, values):
    """As many diagnostics as values, and the light of the same schema without them."""
    wanted = [line for line in values.split("\n") if line != "bool treatAsPoint = 1"]
    point = "bool treatAsPoint = 1" if "falloff" in values else ""
    light, codes = _read(f'def {kind} "L" {{\n{values}\n}}')
    assert codes == ["W413"] * len(wanted)
    expected, _ = _read(f'def {kind} "L" {{\n{point}\n}}')
    for name in ("radiance", "diffuse", "specular"):
        assert getattr(light, name) == getattr(expected, name)
    if kind.startswith("Dome"):
        assert light.image == -1
        np.testing.assert_array_equal(light.world_from_light, expected.world_from_light)
    else:
        for name in ("kind", "radius", "width", "angle", "focus", "focus_tint", "has_falloff", "casts_shadow"):
            assert getattr(light, name) == getattr(expected, name)


def test_numbers_of_another_precision_count():
    assert _light("SphereLight", "double inputs:intensity = 3\nint inputs:exposure = 1").radiance == (6, 6, 6)


def test_sampled_values_are_read_at_their_time():
    stage = Usd.Stage.CreateInMemory()
    light = UsdLux.SphereLight.Define(stage, "/L")
    light.CreateIntensityAttr().Set(1.0, 0.0)
    light.CreateIntensityAttr().Set(3.0, 10.0)
    (read,) = read_lights(
        light.GetPrim(), np.eye(4), Usd.TimeCode(5), Report(), _NoImages(), ProfileCache(Report()), NO_MESHES
    )
    assert read.radiance == pytest.approx((2, 2, 2))


def test_dome_that_is_turned_to_the_stages_up_axis_by_its_own_transform():
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    light = UsdLux.DomeLight.Define(stage, "/L")
    light.OrientToStageUpAxis()
    matrix = np.array(Gf.Matrix4d(light.ComputeLocalToWorldTransform(TIME))).T
    (dome,) = read_lights(
        stage.GetPrimAtPath(Sdf.Path("/L")), matrix, TIME, Report(), _NoImages(), ProfileCache(Report()), NO_MESHES
    )
    np.testing.assert_allclose(dome.world_from_light[:3, 1], [0, 0, 1], atol=1e-12)
