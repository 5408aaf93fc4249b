# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Implicit shapes against their volumes, surfaces and the extents that UsdGeom computes."""

import math

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from warp_rt.report import Report
from warp_rt.scene import Mesh, ShapeKind, Shapes, local_bounds
from warp_rt.usd.implicit import TYPES, make_shape, read_shape
from warp_rt.usd.load import load_stage


def read(kind: str, body: str = ""):
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(f'#usda 1.0\ndef {kind} "S"\n{{\n{body}\n}}\n')
    prim = stage.GetPrimAtPath("/S")
    report = Report()
    return read_shape(prim, Usd.TimeCode(0), report), report, stage


def geometry_of(kind: str, body: str = "") -> tuple[Mesh | Shapes, np.ndarray]:
    """Return the unit shape and the transform that gives it its size."""
    shape, _, _ = read(kind, body)
    return make_shape(shape.key), shape.local_from_unit


def volume_of(points: np.ndarray, triangles: np.ndarray) -> float:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def area_within(shapes: Shapes, level: float) -> float:
    """Return the area in which a plane z = ``level`` of the unit shape cuts it, by half spaces and circles."""
    balls, radii = shapes.points[0].astype(float), shapes.radii[0].astype(float)
    if shapes.kind == ShapeKind.FRUSTUM:
        share = (level - balls[0, 2]) / (balls[1, 2] - balls[0, 2])
        radius = radii[0] + share * (radii[1] - radii[0]) if 0 <= share <= 1 else 0.0
        return math.pi * radius**2
    # What a ball sweeps: the largest circle in which a ball on the way is cut.
    u = np.linspace(0, 1, 2001)[:, None]
    center = balls[0, 2] + u * (balls[-1, 2] - balls[0, 2])
    square = (radii[0] + u * (radii[-1] - radii[0])) ** 2 - (level - center) ** 2
    return math.pi * max(float(square.max()), 0.0)


def solid_volume(geometry: Mesh | Shapes, matrix: np.ndarray) -> float:
    scale = abs(np.linalg.det(matrix[:3, :3]))
    if isinstance(geometry, Mesh):
        return scale * volume_of(geometry.points.astype(float), geometry.triangles)
    low, high = local_bounds(geometry)[:, 2]
    edges = np.linspace(low, high, 2001)
    areas = [area_within(geometry, level) for level in (edges[1:] + edges[:-1]) / 2]
    return scale * float(np.sum(areas)) * (high - low) / 2000


def spherical_cap(radius: float, height_ratio: float) -> float:
    """Volume of the part of a sphere beyond a plane, ``height_ratio`` radii high."""
    height = height_ratio * radius
    return math.pi * height**2 * (3 * radius - height) / 3


# A Capsule_1 of radii 1 and 3 over a height of 2 has a side at 45 degrees: its caps' radii are 1 and 3 times sqrt 2.
VOLUMES = [
    ("Sphere", "double radius = 2", 4 / 3 * math.pi * 8),
    ("Cube", "double size = 3", 27.0),
    ("Cylinder", "double radius = 2\ndouble height = 5", math.pi * 4 * 5),
    ("Cone", "double radius = 2\ndouble height = 6", math.pi * 4 * 6 / 3),
    ("Capsule", "double radius = 2\ndouble height = 3", math.pi * 4 * 3 + 4 / 3 * math.pi * 8),
    ("Cylinder_1", "double radiusBottom = 1\ndouble radiusTop = 3\ndouble height = 2", math.pi * 2 / 3 * (1 + 3 + 9)),
    (
        "Capsule_1",
        "double radiusBottom = 1\ndouble radiusTop = 3\ndouble height = 2",
        math.pi * 2 / 3 * 13 + spherical_cap(2**0.5, 1 - 0.5**0.5) + spherical_cap(3 * 2**0.5, 1 + 0.5**0.5),
    ),
    ("Cylinder_1", "double radiusBottom = 0\ndouble radiusTop = 3\ndouble height = 2", math.pi * 9 * 2 / 3),
]


@pytest.mark.parametrize(("kind", "body", "volume"), VOLUMES)
@pytest.mark.parametrize("axis", "XYZ")
def test_volume_is_that_of_the_solid(kind: str, body: str, volume: float, axis: str) -> None:
    if kind not in ("Sphere", "Cube"):
        body += f'\nuniform token axis = "{axis}"'
    assert solid_volume(*geometry_of(kind, body)) == pytest.approx(volume, rel=1e-5)


@pytest.mark.parametrize("kind", [kind for kind in TYPES if kind != "Plane"])
def test_shapes_are_closed(kind: str) -> None:
    geometry, _ = geometry_of(kind)
    assert geometry.is_closed
    assert isinstance(geometry, Mesh) or geometry.caps == (True, True)


@pytest.mark.parametrize("axis", "XYZ")
@pytest.mark.parametrize("kind", TYPES)
def test_extent_is_the_one_that_usd_computes(kind: str, axis: str) -> None:
    sizes = {
        "Sphere": "double radius = 2",
        "Cube": "double size = 3",
        "Plane": "double width = 3\ndouble length = 5",
        "Cylinder_1": "double radiusBottom = 1\ndouble radiusTop = 3\ndouble height = 7",
        "Capsule_1": "double radiusBottom = 1\ndouble radiusTop = 3\ndouble height = 7",
    }
    body = sizes.get(kind, "double radius = 2\ndouble height = 7")
    if kind not in ("Sphere", "Cube"):
        body += f'\nuniform token axis = "{axis}"'
    _, _, stage = read(kind, body)
    expected = np.array(UsdGeom.Boundable.ComputeExtentFromPlugins(UsdGeom.Boundable(stage.GetPrimAtPath("/S")), 0))
    np.testing.assert_allclose(load_stage(stage).bounds(), expected, atol=1e-5)


def test_shapes_of_any_size_share_their_mesh() -> None:
    assert read("Sphere", "double radius = 2")[0].key == read("Sphere", "double radius = 0.1")[0].key
    assert read("Cylinder", "double height = 9")[0].key == read("Cylinder")[0].key
    assert read("Cylinder_1", "double height = 9")[0].key == read("Cylinder")[0].key
    assert read("Capsule", "double radius = 2\ndouble height = 4")[0].key == read("Capsule_1")[0].key
    assert read("Cone")[0].key != read("Cylinder")[0].key


@pytest.mark.parametrize("axis", "XYZ")
def test_a_plane_faces_its_axis(axis: str) -> None:
    mesh, matrix = geometry_of("Plane", f'uniform token axis = "{axis}"')
    points = mesh.points @ matrix[:3, :3].T
    for a, b, c in points[mesh.triangles]:
        normal = np.cross(b - a, c - a)
        np.testing.assert_allclose(normal / np.linalg.norm(normal), np.eye(3)["XYZ".index(axis)], atol=1e-12)


@pytest.mark.parametrize(
    ("kind", "body"),
    [
        ("Sphere", "double radius = 0"),
        ("Cylinder", "double height = 0"),
        ("Cube", "double size = nan"),
        ("Sphere", 'string radius = "x"'),
        ("Cylinder_1", 'string radiusTop = "x"'),
        ("Capsule", 'string height = "x"'),
        ("Capsule_1", "double height = 0\ndouble radiusTop = 1"),
        ("Capsule_1", "double height = 0\ndouble radiusTop = 0"),
        ("Capsule_1", "double radiusTop = 1e300"),
        ("Capsule", "double height = 1e300"),
        ("Capsule", "double radius = 1e-30"),
    ],
)
def test_a_shape_without_extent_is_left_out_with_a_code(kind: str, body: str) -> None:
    shape, report, _ = read(kind, body)
    assert shape is None
    assert [record.code for record in report] == ["W140"]


def test_a_size_below_0_is_told() -> None:
    shape, report, _ = read("Cylinder", "double radius = -2\ndouble height = 3")
    np.testing.assert_allclose(np.diag(shape.local_from_unit), [2, 2, 1.5, 1])
    assert [(record.code, record.message) for record in report] == [
        ("W140", "below 0, the magnitude is taken: radius -2")
    ]


@pytest.mark.parametrize(("kind", "body", "volume"), VOLUMES)
def test_left_handed_shapes_are_turned_inside_out(kind: str, body: str, volume: float) -> None:
    right, _, _ = read(kind, body)
    left, report, _ = read(kind, f'{body}\nuniform token orientation = "leftHanded"')
    assert len(report) == 0
    assert left.key != right.key
    outward, inward = make_shape(right.key), make_shape(left.key)
    assert inward.is_closed
    if isinstance(outward, Shapes):
        assert (outward.is_inside_out, inward.is_inside_out) == (False, True)
        np.testing.assert_array_equal(inward.points, outward.points)
    else:
        assert solid_volume(inward, left.local_from_unit) == pytest.approx(-volume, rel=1e-6)


UPRIGHT = {  # where s and t run on faces by where they look
    (-1, 0, 0): ((0, 0, 1), (0, 1, 0)),
    (1, 0, 0): ((0, 0, -1), (0, 1, 0)),
    (0, -1, 0): ((1, 0, 0), (0, 0, 1)),
    (0, 1, 0): ((1, 0, 0), (0, 0, -1)),
    (0, 0, -1): ((-1, 0, 0), (0, 1, 0)),
    (0, 0, 1): ((1, 0, 0), (0, 1, 0)),
}


@pytest.mark.parametrize("orientation", ["rightHanded", "leftHanded"])
@pytest.mark.parametrize(
    ("kind", "axis", "size"),
    [("Cube", "Z", (3, 3, 3)), ("Plane", "X", (0, 4, 6)), ("Plane", "Y", (6, 0, 4)), ("Plane", "Z", (6, 4, 0))],
)
def test_st_of_flat_shapes_is_upright_from_outside(
    kind: str, axis: str, size: tuple[int, int, int], orientation: str
) -> None:
    """From 0 to 1 over each face; seen from where the face looks, s to the right of t: their cross product."""
    extent = "double size = 3" if kind == "Cube" else "double width = 6\ndouble length = 4"
    shape, matrix = geometry_of(kind, f'{extent}\ntoken axis = "{axis}"\ntoken orientation = "{orientation}"')
    points = (shape.points @ matrix[:3, :3].T)[shape.triangles].astype(float)
    st = shape.primvars["st"].values[shape.primvars["st"].indices]
    facing = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    facing *= -1 if orientation == "leftHanded" else 1
    for corners, values, normal in zip(points, st, np.sign(facing), strict=True):
        s, t = np.array(UPRIGHT[tuple(normal.astype(int).tolist())])
        np.testing.assert_array_equal(np.cross(s, t), normal)
        for along, found in ((s, values[:, 0]), (t, values[:, 1])):
            np.testing.assert_allclose(found, corners @ along / np.abs(along @ size) + 0.5, atol=1e-6)


@pytest.mark.parametrize("body", ['token axis = "W"', "int axis = 2", 'token orientation = "left"'])
def test_tokens_that_the_schema_does_not_have_are_named(body: str) -> None:
    shape, report, _ = read("Cone", body)
    expected, _, _ = read("Cone")
    assert [record.code for record in report] == ["W114"]
    assert shape.key == expected.key
    np.testing.assert_array_equal(shape.local_from_unit, expected.local_from_unit)


@pytest.mark.parametrize("kind", ["Sphere", "Cube"])
def test_what_has_no_axis_is_not_turned(kind: str) -> None:
    """By the schema: only Capsule, Cone, Cylinder and Plane have an axis."""
    plain, _, _ = read(kind)
    for axis in ("X", "up"):
        turned, report, _ = read(kind, f'uniform token axis = "{axis}"')
        np.testing.assert_array_equal(turned.local_from_unit, plain.local_from_unit)
        assert len(report) == 0  # the walk tells that it has none
