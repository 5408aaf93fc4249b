# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A camera for scenes that have none, placed as usdrecord places it."""

from __future__ import annotations

import itertools
import math

import numpy as np

from warp_rt.scene import Camera, Scene

# GfCamera's defaults, in tenths of a scene unit.
_FOCAL_LENGTH = 50.0
_HORIZONTAL_APERTURE = 20.955
_VERTICAL_APERTURE = 15.2908

_NEAR = 1.0  # GfCamera's near distance [scene unit]: usdrecord steps back by it where the camera is nearer
_FLAT = 1e-3  # extent by the largest one, below which a scene would be a line: a pixel of usdrecord's 960
_LOW = 0.5  # area of a box's front by that of its largest face, below which it is looked at from a corner
# From a corner: the three faces of a box are all turned to the eye, and by angles that a light there tells apart.
_ELEVATION = math.radians(35)
_AZIMUTH = math.radians(30)  # from the face that is seen best, to the other
_MARGIN = 1.05  # around a box seen from a corner, which would touch the picture's edges
_PATH = "/__framing"


def frame_scene(scene: Scene, *, aspect: float = 0.0, as_usdrecord: bool = False) -> Camera:
    """Return a camera that sees the whole scene, along -Z with +Y up, or along +Y with +Z up.

    As in usdrecord, the circle about the corner of the bounding box that faces the camera fills the width of a 50 mm
    camera's picture. Five departures: the camera steps back from a scene so high that its box would reach beyond the
    picture's upper edge; it does not step back from a small one for the sake of a near plane, which it lacks; a box
    whose top or right face has more than twice the area of its front is looked at from a corner, 35 degrees above and
    30 to the right or, where the right face is the largest, 60, from as near as shows all of it, but for a margin; one
    that is flat along its up axis, of which usdrecord's camera would see an edge thinner than a pixel, straight from
    above, and one that is flat along its right axis straight from there; and an empty scene is framed like a cube of
    side 2 about the origin.

    Args:
        scene: Its bounds and its up axis count.
        as_usdrecord: Without the first three departures.
        aspect: Width by height of the image, which the window is widened or heightened to, never cut (the policy
            expandAperture). 0: unknown; the window keeps that of a 35 mm academy frame, as GfCamera has it.

    Reference: OpenUSD, UsdAppUtils, framing of a stage without camera.
    """
    low, high = scene.bounds()
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        low, high = np.full(3, -1.0), np.full(3, 1.0)
    center, size = (low + high) / 2, high - low
    # Right, up and back (out of the picture), as rows.
    is_z_up = scene.up_axis == "Z"
    front = np.eye(3) if not is_z_up else np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    axes = _view(front, size @ np.abs(front).T, may_be_oblique=not as_usdrecord)
    half_width, half_height = _HORIZONTAL_APERTURE / 2 / _FOCAL_LENGTH, _VERTICAL_APERTURE / 2 / _FOCAL_LENGTH
    to_face = math.hypot(size @ np.abs(axes[0]), size @ np.abs(axes[1])) / 2 / half_width
    if aspect > 0:
        half_width, half_height = max(half_width, half_height * aspect), max(half_height, half_width / aspect)
    if not as_usdrecord:
        to_face = max(to_face, float(size @ np.abs(axes[1])) / 2 / half_height)
    distance = to_face + float(size @ np.abs(axes[2])) / 2
    across = np.zeros(2)
    if np.count_nonzero(axes) > 3:  # not along an axis of the box
        across, distance = _nearest_eye(axes, size, np.array([half_width, half_height]) / _MARGIN)
    if distance == 0 or (as_usdrecord and distance < _NEAR):
        distance += _NEAR
    matrix = np.eye(4)
    matrix[:3, :3] = axes.T
    matrix[:3, 3] = center + np.append(across, distance) @ axes
    return Camera(_PATH, matrix, (-half_width, half_width, -half_height, half_height))


def _nearest_eye(axes: np.ndarray, size: np.ndarray, half_size: np.ndarray) -> tuple[np.ndarray, float]:
    """Return where an eye is that sees all of a box from as near as can be: to the right and up, and back.

    Counted from the box's centre. Each side of the view is a plane that the box lies behind; two that face each other
    meet where the eye may be at the nearest.

    Args:
        axes: Of the view: right, up and back.
        size: Extents of the box along the world's axes.
        half_size: Tangents of half the angles of view, across and up.
    """
    corners = np.array(list(itertools.product((-0.5, 0.5), repeat=3))) * size
    across, back = axes[:2] @ corners.T / half_size[:, None], axes[2] @ corners.T
    high, low = (back + across).max(axis=1), (back - across).max(axis=1)
    return half_size * (high - low) / 2, float((high + low).max() / 2)


def _view(front: np.ndarray, size: np.ndarray, *, may_be_oblique: bool) -> np.ndarray:
    """Return the axes (right, up, back) of the view that shows a box well: shape [3, 3], rows in world space.

    Args:
        front: The axes of the view of its front, likewise.
        size: Extents of the box along them.
        may_be_oblique: Whether low and narrow boxes that are not flat are looked at from a corner.
    """
    right, up, back = front
    least = _FLAT * size.max()
    width, height, depth = np.maximum(size, least)
    top, side = width * depth, height * depth
    is_from_above = top >= side
    thickness = size[1] if is_from_above else size[0]
    if thickness <= least < size[2]:
        return np.stack([right, -back, up] if is_from_above else [-back, up, right])
    if may_be_oblique and width * height < _LOW * max(top, side):
        azimuth = _AZIMUTH if is_from_above else math.pi / 2 - _AZIMUTH
        level = math.sin(azimuth) * right + math.cos(azimuth) * back
        across = math.cos(azimuth) * right - math.sin(azimuth) * back
        sine, cosine = math.sin(_ELEVATION), math.cos(_ELEVATION)
        return np.stack([across, cosine * up - sine * level, cosine * level + sine * up])
    return front
