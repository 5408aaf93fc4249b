# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Random simple polygons keep their area; random topology never leads out of the arrays."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from warp_rt.report import Report
from warp_rt.triangulate import triangulate
from warp_rt.usd.polygons import drawable_polygons


@settings(max_examples=300, deadline=None)
@given(
    radii=st.lists(st.floats(0.05, 1.0), min_size=3, max_size=40),
    normal=st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(0.1, 1)),
    first=st.integers(0, 39),
)
def test_star_shaped_polygons_keep_their_area(radii, normal, first) -> None:
    count = len(radii)
    angle = np.arange(count) * (2 * np.pi / count)
    flat = np.stack([np.cos(angle) * radii, np.sin(angle) * radii, np.zeros(count)], axis=1)
    following = np.roll(flat, -1, axis=0)
    area = abs((flat[:, 0] * following[:, 1] - flat[:, 1] * following[:, 0]).sum()) / 2  # the shoelace formula
    frame = np.linalg.qr(np.column_stack([normal, (1, 0, 0), (0, 1, 0)]))[0]
    points = np.roll(flat, first, axis=0) @ frame[:, [1, 2, 0]].T
    corners, _ = triangulate(points, np.array([0]), np.array([count]), np.arange(count))
    a, b, c = (points[corners[:, k]] for k in range(3))
    assert len(corners) == count - 2
    np.testing.assert_allclose(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2, area, rtol=1e-6)


@settings(max_examples=500, deadline=None)
@given(
    is_usable=hnp.arrays(bool, st.integers(0, 12)),
    counts=hnp.arrays(
        np.int64, st.integers(1, 10), elements=st.sampled_from([-(2**31), -1, 0, 1, 2, 3, 4, 5, 7, 2**31 - 1])
    ),
    indices=hnp.arrays(np.int64, st.integers(0, 30), elements=st.integers(-2, 14)),
)
def test_any_topology_gives_valid_triangles(is_usable, counts, indices) -> None:
    rng = np.random.default_rng(0)
    points = rng.normal(size=(len(is_usable), 3))
    polygons = drawable_polygons(is_usable, counts, indices, "/M", Report())
    assert (polygons.starts + polygons.counts <= len(indices)).all()
    corners, faces = triangulate(points, polygons.starts, polygons.counts, polygons.indices)
    vertices = indices[corners]
    assert ((vertices >= 0) & (vertices < len(points))).all()
    assert is_usable[vertices].all()
    # A triangle stays within the corners of its own face.
    start, count = polygons.starts[faces, None], polygons.counts[faces, None]
    assert ((corners >= start) & (corners < start + count)).all()
