# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Meshes that are cut into triangles together are those that each would be alone, and boxes are measured likewise."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Usd

from warp_rt.report import Report
from warp_rt.scene import Mesh, local_bounds, local_boxes
from warp_rt.usd.authored import AuthoredReader
from warp_rt.usd.load import load_stage
from warp_rt.usd.mesh import read_meshes
from warp_rt.usd.sources import Source
from warp_rt.usd.volumes import enclose_volumes

TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)

# A closed mesh, one with holes, polygons convex and not, and every kind of damage, smooth and flat by turns.
BODIES = (
    "int[] faceVertexCounts = [3, 3, 3, 3]\nint[] faceVertexIndices = [0,2,1, 0,1,3, 0,3,2, 1,2,3]",
    "int[] faceVertexCounts = [4, 3]\nint[] faceVertexIndices = [0,1,2,3, 2,1,0]\nint[] holeIndices = [0]",
    "int[] faceVertexCounts = [5, 3, 4]\nint[] faceVertexIndices = [0,1,4,2,3, 0,1,2, 3,2,1,0]",
    "int[] faceVertexCounts = [3, 2, 3]\nint[] faceVertexIndices = [0,1,2, 0,1, 1,2,3]",
    "int[] faceVertexCounts = [3, 3]\nint[] faceVertexIndices = [0,1,9, 1,2,3]",
    "int[] faceVertexCounts = [3, 3]\nint[] faceVertexIndices = [0,1,2]",
    "int[] faceVertexCounts = [3, 3]\nint[] faceVertexIndices = [0,1,5, 1,2,3]",
    "int[] faceVertexCounts = []\nint[] faceVertexIndices = []",
)
POINTS = "point3f[] points = [(0,0,0), (1,0,0), (1,1,0), (0,1,0.5), (0.4,0.4,0), (inf,0,0)]"


def test_meshes_that_are_cut_together_are_those_cut_alone() -> None:
    stage = Usd.Stage.CreateInMemory()
    schemes = ("none", "catmullClark")
    texts = [
        f'def Mesh "m{k}_{scheme}" {{\n{POINTS}\n{body}\nuniform token subdivisionScheme = "{scheme}"\n'
        'texCoord2f[] primvars:st = [(0,0), (1,0), (1,1), (0,1), (2,2), (3,3)] (interpolation = "vertex")\n}'
        for scheme in schemes
        for k, body in enumerate(BODIES)
    ]
    stage.GetRootLayer().ImportFromString("#usda 1.0\n" + "\n".join(texts))
    reader = AuthoredReader()
    prims = stage.GetPseudoRoot().GetChildren()
    sources = [Source(prim, reader.read(prim, has_clips=False), None, Usd.TimeCode(0), None, 0) for prim in prims]
    report, alone_report = Report(), Report()
    together = read_meshes(sources, report)
    alone = [read_meshes([source], alone_report)[0] for source in sources]
    assert set(report) == set(alone_report)
    assert len(report) > 8
    for one, other in zip(together, alone, strict=True):
        assert (one is None) == (other is None)
        if one is None or other is None:
            continue
        a, b = one.mesh, other.mesh
        assert isinstance(a, Mesh)
        assert isinstance(b, Mesh)
        assert a.is_closed == b.is_closed
        for name in ("points", "triangles", "face_ids"):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
        assert (a.normals is None) == (b.normals is None)
        if a.normals is not None and b.normals is not None:
            np.testing.assert_array_equal(a.normals.values, b.normals.values)
        np.testing.assert_array_equal(a.primvars["st"].indices, b.primvars["st"].indices)


@pytest.mark.parametrize("block", [1, 3, 1 << 18])
def test_volumes_of_many_meshes(block: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A tetrahedron is closed; not without a face, not with one turned over; nothing encloses nothing."""
    monkeypatch.setattr("warp_rt.usd.volumes._BLOCK", block)
    turned = TETRAHEDRON.copy()
    turned[0] = turned[0, ::-1]
    meshes = [TETRAHEDRON, TETRAHEDRON[1:], TETRAHEDRON[:0], turned, TETRAHEDRON]
    points = np.concatenate([CORNERS + k for k in range(len(meshes))])
    triangles = np.concatenate([mesh + 4 * k for k, mesh in enumerate(meshes)])
    found = enclose_volumes(points, triangles, np.array([len(mesh) for mesh in meshes]))
    assert found.tolist() == [True, False, False, False, True]


def test_boxes_of_many_meshes_are_those_of_each() -> None:
    rng = np.random.default_rng(1)
    meshes = []
    for count in (4, 9, 1500, 5):
        points = rng.normal(size=(count, 3)).astype(np.float32)
        meshes.append(Mesh(points, rng.integers(0, count - 1, (count, 3)).astype(np.int32)))
    meshes.append(Mesh(CORNERS, np.zeros((0, 3), np.int32)))
    expected = np.array([local_bounds(mesh) for mesh in meshes])
    np.testing.assert_array_equal(local_boxes(meshes), expected)


@pytest.mark.parametrize("body", ["int[] faceVertexCounts = [2]", "int[] faceVertexCounts = [9]"])
@pytest.mark.parametrize("others", [0, 1])
def test_a_smooth_mesh_of_no_face_to_draw_costs_only_itself(body: str, others: int) -> None:
    stage = Usd.Stage.CreateInMemory()
    bad = f'def Mesh "bad" {{\n{POINTS}\n{body}\nint[] faceVertexIndices = [0, 1]\n}}\n'
    good = f'def Mesh "good" {{\n{POINTS}\n{BODIES[0]}\nuniform token subdivisionScheme = "none"\n}}\n'
    stage.GetRootLayer().ImportFromString("#usda 1.0\n" + bad + good * others)
    scene = load_stage(stage)
    assert [scene.prims[row] for row in scene.instances.prim] == ["/good"] * others
    assert any(record.prim == "/bad" and record.is_warning for record in scene.diagnostics)
