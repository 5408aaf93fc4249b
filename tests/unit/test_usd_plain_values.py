# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Values that are read and looked through together are those that are read one at a time."""

from __future__ import annotations

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from warp_rt.report import Report
from warp_rt.usd.authored import AuthoredReader
from warp_rt.usd.normals import read_normals
from warp_rt.usd.plain_values import PlainValues, read_plain_values
from warp_rt.usd.primvars import Layout, read_primvars
from warp_rt.usd.sources import Source

# Two triangles that share an edge.
LAYOUT = Layout(4, 2, 6, np.array([(0, 1, 2), (2, 3, 0)]), np.array([0, 1]), np.arange(6).reshape(2, 3))
TIME = Usd.TimeCode(0)

PLAIN = [
    'float[] primvars:a = [1, 2, 3, 4] (interpolation = "vertex")',
    'float2[] primvars:a = [(1, 2), (3, 4)] (interpolation = "uniform")',
    'texCoord2f[] primvars:st = [(0, 0), (1, 1)] (interpolation = "faceVarying")\n'
    "int[] primvars:st:indices = [0, 1, 0, 1, 1, 0]",
    "color3f[] primvars:displayColor = [(1, 0, 0)]",
    'color4f[] primvars:c = [(1, 0, 0, 1)]\nfloat[] primvars:d = [5, 6] (interpolation = "uniform")',
    'int[] primvars:skel:jointIndices = [1, 2] (interpolation = "constant"\nelementSize = 2)',
    "string[] primvars:names = ['a', 'b']",
    "float[] primvars:a.timeSamples = { 0: [1], 10: [3] }",
]
NOT_PLAIN = [
    'float[] primvars:a = [1, inf, 3, 4] (interpolation = "vertex")',
    "double[] primvars:a = [1]",
    "half2[] primvars:a = [(1, 2)]",
    "int[] primvars:a = [1]",
    "float primvars:a = 1",
    "float[] primvars:a = []",
    "float[] primvars:a = None",
    "float2[] primvars:displayColor = [(1, 0)]",
    'float[] primvars:a = [1, 2] (interpolation = "uniform")\nint[] primvars:a:indices = [0, 2]',
    'float[] primvars:a = [1, 2] (interpolation = "uniform")\nint[] primvars:a:indices = [-1, 0]',
    'float[] primvars:a = [1, 2] (interpolation = "uniform")\nint[] primvars:a:indices = None',
    'color3f[] primvars:displayColor = [(1, 0, 0)] (colorSpace = "srgb_rec709_scene")',
    "rel primvars:a = </a>",
]


def stage_of(bodies: list[str]) -> Usd.Stage:
    stage = Usd.Stage.CreateInMemory()
    text = "".join(f'def Mesh "m{k}"\n{{\n{body}\n}}\n' for k, body in enumerate(bodies))
    stage.GetRootLayer().ImportFromString(f"#usda 1.0\n{text}")
    return stage


def read(stage: Usd.Stage, has_normals: bool = False) -> list[PlainValues]:
    reader = AuthoredReader()
    prims = stage.GetPseudoRoot().GetChildren()
    sources = [Source(prim, reader.read(prim, has_clips=False), None, TIME, None, 0) for prim in prims]
    return read_plain_values(sources, [has_normals] * len(sources), Report())


def test_plain_primvars_are_those_read_one_at_a_time() -> None:
    stage = stage_of([*PLAIN, *NOT_PLAIN])
    for prim, values in zip(stage.GetPseudoRoot().GetChildren(), read(stage), strict=True):
        expected = read_primvars(prim, LAYOUT, TIME, Report())
        if values.primvars is None:
            continue
        assert [rows.name for rows in values.primvars] == list(expected)
        for rows in values.primvars:
            found = rows.lay_out(LAYOUT)
            assert found is not None
            np.testing.assert_array_equal(found.values, expected[rows.name].values)
            if expected[rows.name].indices is None:
                assert found.indices is None
            else:
                np.testing.assert_array_equal(found.indices, expected[rows.name].indices)


def test_what_is_not_plain_does_not_concern_its_neighbours() -> None:
    bodies = [body for pair in zip(NOT_PLAIN, PLAIN + PLAIN, strict=False) for body in pair]
    are_plain = [values.primvars is not None for values in read(stage_of(bodies))]
    assert are_plain == [False, True] * len(NOT_PLAIN)


def test_primvars_of_another_length_are_not_laid_out() -> None:
    (values,) = read(stage_of(['float[] primvars:a = [1, 2, 3] (interpolation = "vertex")']))
    assert values.primvars is not None
    assert values.primvars[0].lay_out(LAYOUT) is None


def test_prims_share_a_constant_of_the_same_value_and_name() -> None:
    one, other = ("color3f[] primvars:displayColor = [(1, 0, 0)]", "color3f[] primvars:displayColor = [(1, -0.0, 0)]")
    alike, unlike = "float[] primvars:a = [2]", "float[] primvars:b = [2]"
    laid_out = []
    for values in read(stage_of([one, other, one, alike, unlike, alike])):
        assert values.primvars is not None
        laid_out.append(values.primvars[0].lay_out(LAYOUT))
    assert laid_out[0] is laid_out[2]
    assert laid_out[3] is laid_out[5]
    assert len({id(primvar) for primvar in laid_out}) == 4
    assert [np.signbit(primvar.values[0, 1]) for primvar in laid_out[:2] if primvar] == [False, True]


def test_a_constant_that_is_not_finite_is_not_laid_out_and_does_not_concern_others() -> None:
    bodies = ["float[] primvars:a = [nan]", "float[] primvars:a = [1]", "float2[] primvars:a = [(inf, 1)]"]
    laid_out = [values.primvars[0].lay_out(LAYOUT) for values in read(stage_of(bodies)) if values.primvars]
    assert [primvar is None for primvar in laid_out] == [True, False, True]


@pytest.mark.parametrize(
    ("body", "is_plain"),
    [
        ('normal3f[] normals = [(0, 0, 1), (0, 1, 0)] (interpolation = "uniform")', True),
        ("normal3f[] normals = [(0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 0, 2)]", True),
        ('normal3f[] normals = [(0, 0, 1), (0, nan, 0)] (interpolation = "uniform")', False),
        ("half3[] normals = [(0, 0, 1), (0, 1, 0), (1, 0, 0), (0, 0, 2)]", False),
        ("normal3f[] normals = [(0, 0, 1)]\nnormal3f[] primvars:normals = [(0, 1, 0)]", False),
    ],
)
def test_plain_normals_are_those_read_one_at_a_time(body: str, is_plain: bool) -> None:
    stage = stage_of([body])
    (values,) = read(stage, has_normals=True)
    assert (values.normals is not None) == is_plain
    if values.normals is not None:
        found = values.normals.lay_out(LAYOUT)
        expected = read_normals(UsdGeom.Mesh(stage.GetPrimAtPath("/m0")), LAYOUT, TIME, Report())
        assert found is not None
        assert expected is not None
        np.testing.assert_array_equal(found.values, expected.values)
        np.testing.assert_array_equal(found.indices, expected.indices)
