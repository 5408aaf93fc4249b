# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What can be before triangles of a mesh light, of bodies whose sides are known."""

from __future__ import annotations

import numpy as np

from warp_rt.kernels.mesh_visibility import INSIDE, OUTSIDE
from warp_rt.upload.light_bodies import BOTH_SIDES, connected_parts, convex_bodies, free_sides_of

CORNER = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
BODY = CORNER[[(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]]
"""A tetrahedron, wound as seen from outside."""
ROOM = BODY[:, ::-1]
OUT, IN = int(OUTSIDE), int(INSIDE)


def test_sides_from_which_nothing_is_before_a_triangle() -> None:
    """All around a convex body, both of a sheet; of two bodies only what looks past the other, of a room its inside."""
    assert free_sides_of(BODY).tolist() == [OUT] * 4
    assert free_sides_of(ROOM).tolist() == [IN] * 4
    assert free_sides_of(BODY[:1]).tolist() == [BOTH_SIDES]
    # The second is before the slanted side of the first, and behind the others.
    assert free_sides_of(np.concatenate([BODY, BODY + 2])).tolist() == [OUT] * 3 + [0] * 4 + [OUT]


def test_parts_hang_together_by_corners() -> None:
    chain = np.concatenate([BODY + k * CORNER[1] for k in range(5)])  # one touches the next
    parts = connected_parts(np.concatenate([chain, BODY + 7 * CORNER[2], chain[:1]]))
    assert len(set(parts[:20])) == 1
    assert len(set(parts[20:24])) == 1
    assert parts[24] == parts[0] != parts[20]


def test_bodies_are_convex() -> None:
    """A tetrahedron, one seen from within, another one; a tetrahedron with a flap is none."""
    flap = np.concatenate([BODY, [[(1, 0, 0), (2, 0, 0), (1, 1, 0.2)]]])
    triangles = np.concatenate([BODY, ROOM + 3, BODY + 6, flap + 9])
    parts = np.repeat([5, 7, 8, 20], [4, 4, 4, 5])
    assert convex_bodies(triangles, parts).tolist() == [5] * 4 + [-1] * 4 + [8] * 4 + [-1] * 5
