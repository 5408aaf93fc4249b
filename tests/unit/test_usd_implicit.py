# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Implicit shapes against their volumes, surfaces and the extents that UsdGeom computes."""

import math

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from warp_rt.report import Report
from warp_rt.usd.implicit import TYPES, make_shape, read_shape


def read(kind: str, body: str = ""):
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(f'#usda 1.0\ndef {kind} "S"\n{{\n{body}\n}}\n')
    prim = stage.GetPrimAtPath("/S")
    report = Report()
    return read_shape(prim, Usd.TimeCode(0), report), report, stage


def points_of(kind: str, body: str = "") -> tuple[np.ndarray, np.ndarray]:
    """World points and triangles."""
    shape, _, _ = read(kind, body)
    mesh = make_shape(shape.key)
    matrix = shape.local_from_unit
    return mesh.points.astype(float) @ matrix[:3, :3].T + matrix[:3, 3], mesh.triangles


def volume_of(points: np.ndarray, triangles: np.ndarray) -> float:
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


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
def test_volume_is_that_of_the_solid_and_outward(kind: str, body: str, volume: float, axis: str) -> None:
    if kind not in ("Sphere", "Cube"):
        body += f'\nuniform token axis = "{axis}"'
    points, triangles = points_of(kind, body)
    # An inscribed prism of 96 sides has (sin x) / x of the circle's area, x = pi / 48; half spheres lose more.
    assert 0.997 * volume < volume_of(points, triangles) <= volume * (1 + 1e-6)


@pytest.mark.parametrize("kind", [kind for kind in TYPES if kind != "Plane"])
def test_shapes_are_closed(kind: str) -> None:
    shape, _, _ = read(kind)
    assert make_shape(shape.key).is_closed


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
    points, _ = points_of(kind, body)
    _, _, stage = read(kind, body)
    extent = np.array(UsdGeom.Boundable.ComputeExtentFromPlugins(UsdGeom.Boundable(stage.GetPrimAtPath("/S")), 0))
    # The widest part of the larger cap of a Capsule_1 need not lie on a ring: within half of 3.75 degrees of one.
    slack = np.abs(extent).max() * (1 - math.cos(math.pi / 96)) if kind == "Capsule_1" else 1e-5
    np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], extent, atol=slack)


@pytest.mark.parametrize("kind", ["Sphere", "Capsule", "Cylinder", "Cone"])
def test_normals_are_those_of_the_exact_surface(kind: str) -> None:
    shape, _, _ = read(kind, "" if kind == "Sphere" else "double height = 2\ndouble radius = 1")
    mesh = make_shape(shape.key)
    position = mesh.points[mesh.triangles].reshape(-1, 3).astype(float)
    normal = mesh.normals.values[mesh.normals.indices].reshape(-1, 3).astype(float)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1, atol=1e-6)
    if kind in ("Sphere", "Capsule"):
        core = position.copy()
        core[:, :2] = 0
        core[:, 2] = 0 if kind == "Sphere" else np.clip(core[:, 2], -1, 1)
        np.testing.assert_allclose(normal, position - core, atol=1e-6)
        return
    is_side = np.abs(normal[:, 2]) < 0.99
    assert (np.abs(position[~is_side, 2]) == 1).all()
    side = position[is_side]
    slope = 0.0 if kind == "Cylinder" else 1 / math.sqrt(5)  # a cone of radius 1 and height 2 rises by 2 over 1
    np.testing.assert_allclose(normal[is_side, 2], slope, atol=1e-6)
    at_rim = np.linalg.norm(side[:, :2], axis=1) > 0.5
    radial = side[at_rim, :2] * math.sqrt(1 - slope**2)
    np.testing.assert_allclose(normal[is_side][at_rim, :2], radial, atol=1e-6)


def test_cone_tip_normals_lie_halfway_along_each_triangle() -> None:
    mesh = make_shape(read("Cone")[0].key)
    tip = int(np.argmax(mesh.points[:, 2]))
    rows, columns = np.nonzero(mesh.triangles == tip)
    assert len(rows) == 96
    for row, column in zip(rows, columns, strict=True):
        others = [k for k in range(3) if k != column]
        middle = mesh.points[mesh.triangles[row, others]].mean(axis=0)[:2]
        normal = mesh.normals.values[mesh.normals.indices[row, column]][:2]
        np.testing.assert_allclose(normal / np.linalg.norm(normal), middle / np.linalg.norm(middle), atol=1e-5)


def test_shapes_of_any_size_share_their_mesh() -> None:
    assert read("Sphere", "double radius = 2")[0].key == read("Sphere", "double radius = 0.1")[0].key
    assert read("Cylinder", "double height = 9")[0].key == read("Cylinder")[0].key
    assert read("Cylinder_1", "double height = 9")[0].key == read("Cylinder")[0].key
    assert read("Capsule", "double radius = 2\ndouble height = 4")[0].key == read("Capsule_1")[0].key
    assert read("Cone")[0].key != read("Cylinder")[0].key


@pytest.mark.parametrize("axis", "XYZ")
def test_a_plane_faces_its_axis(axis: str) -> None:
    points, triangles = points_of("Plane", f'uniform token axis = "{axis}"')
    for a, b, c in points[triangles]:
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
    ],
)
def test_a_shape_without_extent_is_left_out_with_a_code(kind: str, body: str) -> None:
    shape, report, _ = read(kind, body)
    assert shape is None
    assert [record.code for record in report] == ["W140"]


@pytest.mark.parametrize(("kind", "body", "volume"), VOLUMES)
def test_left_handed_shapes_are_turned_inside_out(kind: str, body: str, volume: float) -> None:
    right, _, _ = read(kind, body)
    left, report, _ = read(kind, f'{body}\nuniform token orientation = "leftHanded"')
    assert len(report) == 0
    assert left.key != right.key
    outward, inward = make_shape(right.key), make_shape(left.key)
    points = inward.points.astype(float) @ left.local_from_unit[:3, :3].T
    assert volume_of(points, inward.triangles) == pytest.approx(-volume, rel=2e-3)
    assert inward.is_closed
    if outward.normals is not None:
        # At every corner the normal of the same point, reversed.
        np.testing.assert_array_equal(
            inward.normals.values[inward.normals.indices],
            -outward.normals.values[outward.normals.indices[:, [0, 2, 1]]],
        )
        np.testing.assert_array_equal(inward.triangles, outward.triangles[:, [0, 2, 1]])


@pytest.mark.parametrize("body", ['token axis = "W"', "int axis = 2", 'token orientation = "left"'])
def test_tokens_that_the_schema_does_not_have_are_named(body: str) -> None:
    shape, report, _ = read("Cone", body)
    expected, _, _ = read("Cone")
    assert [record.code for record in report] == ["W114"]
    assert shape.key == expected.key
    np.testing.assert_array_equal(shape.local_from_unit, expected.local_from_unit)
