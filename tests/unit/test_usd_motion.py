# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What moves within an interval, and what velocities carry, against USD's own arithmetic and by hand."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from warp_rt import Renderer, RenderOptions
from warp_rt.report import Report
from warp_rt.scene import Camera
from warp_rt.usd.load import load_stage
from warp_rt.usd.motion import carriers, moves, read_times


def stage(body: str) -> Usd.Stage:
    made = Usd.Stage.CreateInMemory()
    assert made.GetRootLayer().ImportFromString(f"#usda 1.0\n(timeCodesPerSecond = 10)\n{body}")
    return made


@pytest.mark.parametrize(
    ("attribute", "moving"),
    [
        ("float a = 1", False),
        ("float a.timeSamples = { 2: 1 }", False),
        ("float a.timeSamples = { 2: 1, 3: 1 }", False),
        ("float a.timeSamples = { 0: 0, 1: 1, 2: 2 }", False),  # later the last holds
        ("float a.timeSamples = { 2: 1, 3: 2 }", True),
        ("float a.timeSamples = { 0: 1, 9: 2 }", True),
        ("token a.timeSamples = { 0: 'x', 9: 'y' }", False),  # which is not interpolated
        ("token a.timeSamples = { 2: 'x', 2.75: 'y' }", True),
        ("float a.timeSamples = { 2: 1, 2.75: 2, 3: 1, 4: 1 }", True),  # between equal ends
        ("vector3f[] velocities.timeSamples = { 2: [(1, 1, 1)] }", True),
        ("vector3f[] velocities = [(1, 1, 1)]", False),
        ("float inputs:a.timeSamples = { 2: 1, 3: 2 }", False),  # of lights and materials, which count at the frame
        ("double a.spline = {\n bezier,\n 1: 0; post linear,\n 4: 1,\n}", True),
    ],
)
def test_what_moves_from_2_5_to_3(attribute, moving) -> None:
    assert moves(stage(f'def "p" {{\n{attribute}\n}}'), 2.5, 3.0) is moving


def test_prototypes_of_instances_move() -> None:
    """The samples stand in another layer, so that nothing but the instance's prototype has them."""
    for samples, moving in (("{ 2: 1, 3: 2 }", True), ("{ 0: 1, 1: 2 }", False)):
        other = stage(f'def "c" {{\ndef "p" {{\nfloat a.timeSamples = {samples}\n}}\n}}')
        name = other.GetRootLayer().identifier
        made = stage(f'def "i" (instanceable = true\nreferences = @{name}@</c>) {{\n}}')
        assert moves(made, 2.5, 3.0) is moving


@pytest.mark.parametrize(
    ("points", "velocities", "time", "carried"),
    [
        ("{ 0: [(0, 0, 0)], 1: [(9, 0, 0)] }", "{ 0: [(1, 0, 0)], 1: [(1, 0, 0)] }", 0.5, True),
        ("{ 0: [(0, 0, 0)] }", "{ 0: [(1, 0, 0)] }", -3.0, True),  # the first sample holds
        ("{ 0: [(0, 0, 0)], 1: [(9, 0, 0)] }", "{ 0.5: [(1, 0, 0)] }", 0.75, False),
        ("{ 0: [(0, 0, 0)], 1: [(9, 0, 0)] }", "{ 0: [(1, 0, 0)] }", 0.75, False),
        ("{ 0: [(0, 0, 0)] }", "{ 0: [(1, 0, 0), (1, 0, 0)] }", 0.5, False),
        ("{ 0: [] }", "{ 0: [] }", 0.5, False),
    ],
)
def test_velocities_carry_where_they_fit_as_usd_has_it(points, velocities, time, carried) -> None:
    made = stage(
        f'def Points "p" {{\npoint3f[] points.timeSamples = {points}\n'
        f"vector3f[] velocities.timeSamples = {velocities}\n}}"
    )
    prim, code = made.GetPrimAtPath("/p"), Usd.TimeCode(time)
    assert carriers(prim, code) == ({"velocities"} if carried else set())
    schema = UsdGeom.PointBased(prim)
    moved = schema.ComputePointsAtTime(code, code) != schema.GetPointsAttr().Get(code)
    assert moved is carried
    assert not carriers(prim, Usd.TimeCode.Default())
    report = Report()
    read_times(prim, code, code, report)
    is_idle = not carried and "[]" not in velocities
    assert [(note.code, note.prim) for note in report] == ([("N936", "/p")] if is_idle else [])


def test_whether_velocities_carry_instances_is_decided_at_the_frame() -> None:
    """Those of the samples that a moment lies between would, but the frame's do not: USD interpolates both."""
    made = stage(
        """def PointInstancer "i" {
            rel prototypes = [</i/p>]
            int[] protoIndices = [0]
            point3f[] positions.timeSamples = { 0: [(0, 0, 0)], 1: [(1, 0, 0)], 2: [(2, 0, 0)] }
            vector3f[] velocities.timeSamples = { 0.5: [(0, 9, 0)], 1: [(0, 9, 0)], 2: [(0, 9, 0)] }
            def Sphere "p" {}
        }"""
    )
    schema = UsdGeom.PointInstancer.Get(made, "/i")
    (expected,) = schema.ComputeInstanceTransformsAtTime(1.5, 0.75)
    placed = load_stage(made, time=1.5, base_time=0.75).instances.world_from_local[0]
    np.testing.assert_allclose(placed, np.array(expected).T)
    np.testing.assert_allclose(placed[:3, 3], (1.5, 0, 0))


TRIANGLES = """
    int[] faceVertexCounts.timeSamples = { 0: [3], 1: [3, 3] }
    int[] faceVertexIndices.timeSamples = { 0: [0, 1, 2], 1: [0, 1, 2, 0, 2, 3] }
    point3f[] points.timeSamples = {
        0: [(0, 0, 0), (1, 0, 0), (0, 1, 0)], 1: [(0, 0, 9), (1, 0, 9), (1, 1, 9), (0, 1, 9)] }
    vector3f[] velocities.timeSamples = {
        0: [(10, 0, 0), (10, 0, 0), (10, 0, 0)], 1: [(0, 20, 0), (0, 20, 0), (0, 20, 0), (0, 20, 0)] }
    vector3f[] accelerations.timeSamples = {
        0: [(0, 0, 0), (0, 0, 0), (0, 0, 0)], 1: [(0, 0, 800), (0, 0, 800), (0, 0, 800), (0, 0, 800)] }
    uniform token subdivisionScheme = "none"
"""


@pytest.mark.parametrize(
    ("velocities", "accelerations", "is_idle"),
    [
        ("{ 0: [(1, 0, 0)] }", "{ 0: [(0, 8, 0)] }", False),
        ("{ 0: [(1, 0, 0)] }", "{ 0: [(0, 0, 0)], 1: [(0, 0, 0)] }", False),
        ("{ 0: [(1, 0, 0)] }", "{ 0: [(0, 8, 0)], 1: [(0, 8, 0)] }", True),
        ("{ 0: [(1, 0, 0)] }", "{ 0: [(0, 8, 0), (0, 8, 0)] }", True),
        ("", "{ 0: [(0, 8, 0)] }", True),
    ],
)
def test_accelerations_that_usd_passes_over_are_noted(velocities, accelerations, is_idle) -> None:
    body = 'def Points "p" {\npoint3f[] points.timeSamples = { 0: [(0, 0, 0)] }\n'
    body += f"vector3f[] velocities.timeSamples = {velocities}\n" if velocities else ""
    made, plain = stage(f"{body}vector3f[] accelerations.timeSamples = {accelerations}\n}}"), stage(body + "}")
    prim, code = made.GetPrimAtPath("/p"), Usd.TimeCode(0.5)
    without = UsdGeom.PointBased(plain.GetPrimAtPath("/p")).ComputePointsAtTime(code, code)
    is_passed_over = UsdGeom.PointBased(prim).ComputePointsAtTime(code, code) == without
    report = Report()
    read_times(prim, code, code, report)
    assert [note.code for note in report] == (["N936"] if is_idle else [])
    assert is_passed_over or not is_idle


def test_points_and_topology_are_of_the_sample_that_the_frame_begins_with() -> None:
    made = stage(f'def Mesh "m" {{\n{TRIANGLES}\n}}')
    own = load_stage(made, time=0.5).meshes[0]  # a frame between samples
    assert own.points[0].tolist() == [0.5, 0, 0]  # 10 a second, 10 time codes a second, half of one
    before = load_stage(made, time=0.75, base_time=1.0).meshes[0]
    assert len(before.triangles) == 2
    # Back a quarter of a time code: y -20 / 40, z 9 + 800 / 2 / 40^2
    np.testing.assert_allclose(before.points[0], [0, -0.5, 9.25], rtol=1e-6)
    np.testing.assert_allclose(
        load_stage(made, time=1.25, base_time=1.0).meshes[0].points[0], [0, 0.5, 9.25], rtol=1e-6
    )


def test_curves_points_and_tetrahedra_are_carried_too() -> None:
    moving = """
        point3f[] points.timeSamples = { 0: [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)] }
        vector3f[] velocities.timeSamples = { 0: [(0, 0, 40), (0, 0, 40), (0, 0, 40), (0, 0, 40)] }
        float[] widths = [1, 1, 1, 1]
    """
    made = stage(
        f'def Points "p" {{\n{moving}\n}}\n'
        f'def BasisCurves "c" {{\n{moving}\nuniform token type = "linear"\nint[] curveVertexCounts = [4]\n}}\n'
        f'def TetMesh "t" {{\n{moving}\nint4[] tetVertexIndices = [(0, 1, 2, 3)]\n}}\n'
    )
    for mesh in load_stage(made, time=0.25, base_time=0.0).meshes:
        np.testing.assert_allclose(np.asarray(mesh.points).reshape(-1, 3)[0], [0, 0, 1], atol=1e-6)


@pytest.mark.parametrize("rate", ["0", "-24"])
def test_without_a_rate_velocities_move_nothing(rate):
    """Division by it would send everything to infinity; positions are interpolated, as without velocities."""
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(
        f"""#usda 1.0
        (
            timeCodesPerSecond = {rate}
        )
        def PointInstancer "i" {{
            rel prototypes = </i/p>
            int[] protoIndices = [0]
            point3f[] positions.timeSamples = {{ 0: [(0, 0, 0)], 10: [(10, 0, 0)] }}
            vector3f[] velocities.timeSamples = {{ 0: [(5, 0, 0)], 10: [(5, 0, 0)] }}
            def Sphere "p" {{}}
        }}
        def Points "q" {{
            point3f[] points.timeSamples = {{ 0: [(0, 0, 0)], 10: [(10, 0, 0)] }}
            vector3f[] velocities.timeSamples = {{ 0: [(5, 0, 0)], 10: [(5, 0, 0)] }}
            float[] widths = [1]
        }}
        """
    )
    scene = load_stage(stage, time=5.0)
    assert [record.code for record in scene.diagnostics] == ["W512"]
    assert scene.instances.world_from_local[scene.instances.instance_id >= 0][0, :3, 3].tolist() == [5, 0, 0]
    points = next(mesh for mesh in scene.meshes if mesh.points.ravel()[0] == 5)
    assert points.points.ravel().tolist() == [5, 0, 0]


def test_angular_velocities_turn_instances() -> None:
    made = stage("""
        def PointInstancer "i" {
            int[] protoIndices = [0]
            point3f[] positions = [(0, 0, 0)]
            quath[] orientations.timeSamples = { 0: [(1, 0, 0, 0)] }
            vector3f[] angularVelocities.timeSamples = { 0: [(0, 0, 900)] }
            rel prototypes = </i/s>
            def Sphere "s" { }
        }""")  # 900 degrees a second are 90 a time code
    matrix = load_stage(made, time=0.5, base_time=0.0).instances.world_from_local[0]
    np.testing.assert_allclose(matrix[:2, :2], np.sqrt(0.5) * np.array([[1, -1], [1, 1]]), atol=2e-3)


def test_an_instancer_is_that_of_the_sample_that_the_frame_begins_with() -> None:
    made = stage("""
        def PointInstancer "i" {
            int[] protoIndices.timeSamples = { 0: [0], 1: [0, 0] }
            point3f[] positions.timeSamples = { 0: [(0, 0, 0)], 1: [(0, 0, 0), (5, 0, 0)] }
            vector3f[] velocities.timeSamples = { 0: [(0, 0, 0)], 1: [(10, 0, 0), (10, 0, 0)] }
            rel prototypes = </i/s>
            def Sphere "s" { }
        }""")
    matrices = load_stage(made, time=0.5, base_time=1.0).instances.world_from_local
    np.testing.assert_allclose(np.sort(matrices[:, 0, 3]), [-0.5, 4.5])
    assert len(load_stage(made, time=0.5).instances) == 1


HERE, THERE = (f"[(0, 0, {z}), (1, 1, {z}), (2, 0, {z}), (3, 1, {z})]" for z in (0, 4))
SPEEDS, RATES = (f"[(0, 0, {z}), (0, 0, {z}), (0, 0, {z}), (0, 0, {z})]" for z in (10, 40))  # a second
CURVES = {
    "BasisCurves": "",
    "NurbsCurves": "int[] order = [4]\ndouble[] knots = [0, 0, 0, 0, 1, 1, 1, 1]\ndouble2[] ranges = [(0, 1)]",
    "HermiteCurves": "vector3f[] tangents = [(1, 0, 0), (1, 0, 0), (1, 0, 0), (1, 0, 0)]",
}
MOTIONS = {
    "velocities": (f"point3f[] points.timeSamples = {{ 0: {HERE} }}", lambda t: t),
    "accelerations": (f"point3f[] points.timeSamples = {{ 0: {HERE} }}", lambda t: t + 0.2 * t * t),
    "samples": (f"point3f[] points.timeSamples = {{ 0: {HERE}, 2: {THERE} }}", lambda t: 2 * min(t, 2)),
}


@pytest.mark.parametrize("kind", CURVES)
@pytest.mark.parametrize("motion", MOTIONS)
def test_curves_of_all_kinds_move(kind: str, motion: str) -> None:
    """By p + v t + a t^2 / 2, t in seconds, which are 10 time codes; between samples, linearly."""
    points, height = MOTIONS[motion]
    if motion != "samples":
        points += f"\nvector3f[] velocities.timeSamples = {{ 0: {SPEEDS} }}"
    if motion == "accelerations":
        points += f"\nvector3f[] accelerations.timeSamples = {{ 0: {RATES} }}"
    common = f'int[] curveVertexCounts = [4]\nfloat[] widths = [0.1] (interpolation = "constant")\n{CURVES[kind]}'
    made = stage(f'def {kind} "c" {{\n{common}\n{points}\n}}')
    still = load_stage(made, time=0.0).meshes[0].points
    for time in (0.5, 1.0, 2.5):
        moved = load_stage(made, time=time).meshes[0].points
        np.testing.assert_allclose(moved[..., :2], still[..., :2], atol=1e-6)
        np.testing.assert_allclose(moved[..., 2], height(time), rtol=1e-5)
    within = load_stage(made, time=1.5, base_time=1.0).meshes[0].points  # a moment of the frame's shutter
    np.testing.assert_allclose(within[..., 2], height(1.5), rtol=1e-5)


@pytest.mark.parametrize("kind", CURVES)
def test_refitted_curves_are_those_that_are_built_anew(kind: str) -> None:
    points = f"point3f[] points.timeSamples = {{ 0: {HERE}, 2: {THERE} }}"
    common = f'int[] curveVertexCounts = [4]\nfloat[] widths = [0.5] (interpolation = "constant")\n{CURVES[kind]}'
    made = stage(f'def {kind} "c" {{\n{common}\n{points}\n}}')
    first, second = (load_stage(made, time=time) for time in (0.0, 2.0))
    camera = Camera("/c", look_down(), window=(-3.0, 3.0, -3.0, 3.0), is_perspective=False)
    options = RenderOptions(width=24, height=24, aovs=("color", "depth"))
    before = Renderer(first, options)
    refitted, anew = (Renderer(second, options, previous=previous).render(camera=camera) for previous in (before, None))
    np.testing.assert_array_equal(refitted.aovs["depth"], anew.aovs["depth"])
    np.testing.assert_array_equal(refitted.color, anew.color)
    hit = np.isfinite(anew.aovs["depth"])
    assert hit.sum() > 20
    # The eye is at 10, the curve at 4, and its radius 0.25.
    assert 5.75 - 1e-3 < anew.aovs["depth"][hit].min() < 5.77


def look_down() -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = (1.5, 0.5, 10.0)
    return matrix
