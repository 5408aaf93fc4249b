# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The segments of UsdGeomHermiteCurves, as the Bezier curves that they are.

Reference: UsdGeomHermiteCurves schema documentation. It leaves open what ``vertex`` values are, for there are no
tangents of primvars: they are interpolated from point to point, as ``varying`` ones.
"""

from __future__ import annotations

import numpy as np

from warp_rt.usd.curve_layout import Blend, ShapeLayout, lay_out_polylines

# Bezier points from a point, its tangent, the next point and its tangent.
_BEZIER_FROM_HERMITE = np.array([[1, 0, 0, 0], [1, 1 / 3, 0, 0], [0, 0, 1, -1 / 3], [0, 0, 1, 0]])


def lay_out_hermite_curves(lengths: np.ndarray, point_count: int) -> ShapeLayout:
    """Return the segments of HermiteCurves; their controls are the prim's points, and then its tangents.

    Args:
        lengths: Points of each curve, int64, shape [curves].
        point_count: Of the prim.
    """
    straight = lay_out_polylines(lengths, point_count)
    ends = straight.vertex.rows
    rows = np.stack([ends[:, 0], point_count + ends[:, 0], ends[:, 1], point_count + ends[:, 1]], axis=1)
    controls = Blend(rows, np.broadcast_to(_BEZIER_FROM_HERMITE, (len(rows), 4, 4)))
    return ShapeLayout(straight.counts, controls, straight.vertex, straight.varying, straight.curve)
