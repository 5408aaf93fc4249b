# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Cameras."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from warp_rt.errors import SceneError


@dataclass(frozen=True)
class Camera:
    """A perspective or an orthographic camera that looks along its local -Z with +Y up."""

    path: str
    world_from_camera: np.ndarray
    """float64, shape [4, 4], with whatever scale and shear the stage gives it."""
    window: tuple[float, float, float, float]
    """left, right, bottom, top: on the plane z = -1 (perspective) or in scene units (orthographic)."""
    is_perspective: bool = True
    clipping_range: tuple[float, float] = (0.0, np.inf)
    """Nearest and farthest distance along -Z that eye rays see."""
    clipping_planes: tuple[tuple[float, float, float, float], ...] = ()
    """(a, b, c, d) in the camera's space: eye rays do not see points where a x + b y + c z + d < 0."""
    lens_radius: float = 0.0
    """Half the aperture's diameter [scene unit]; 0: a pinhole."""
    focus_distance: float = 0.0
    """Distance along -Z of the plane in focus [scene unit]; 0: all is sharp, whatever the lens."""
    exposure_scale: float = 1.0
    """Linear factor on colour from the camera's exposure attributes."""
    shutter: tuple[float, float] = (0.0, 0.0)
    """When it opens and closes, time codes from the frame's; zeros also where nothing moves meanwhile. One that closes
    before it opens exposes nothing: colour is black."""
    is_conformed: bool = False
    """Whether the window is that of the picture, whatever its sides and its pixels' aspect ratio; else the render
    settings' aspectRatioConformPolicy fits it, and their dataWindowNDC cuts a part out."""

    @staticmethod
    def from_intrinsics(
        intrinsics: Any, width: int, height: int, world_from_camera: Any, *, path: str = "/camera"
    ) -> Camera:
        """Return the pinhole camera of a calibrated picture, to be rendered with this width and height.

        Args:
            intrinsics: K, shape [3, 3]: ``fx, 0, cx; 0, fy, cy; 0, 0, 1`` [pixel]. It takes points of the camera's
                space, with Y down and Z forward as computer vision has them, to the picture. The picture's top left
                corner is (0, 0) and the centre of its first pixel (0.5, 0.5); where that one is (0, 0), as in OpenCV,
                cx and cy are less by a half.
            width: Of the picture [pixel].
            height: Likewise.
            world_from_camera: Shape [4, 4]; the camera looks along its -Z with +Y up, see :func:`look_at`. To a pose
                with Y down and Z forward, ``pose``, belongs ``pose @ np.diag([1, -1, -1, 1])``.
            path: What messages call it.

        Raises:
            SceneError: K is none: not finite, with a skew, or without focal lengths; or the pose is no finite matrix.

        Reference: Hartley and Zisserman, Multiple View Geometry, 6.1.
        """
        k, matrix = np.asarray(intrinsics, float), np.asarray(world_from_camera, float)
        if k.shape != (3, 3) or not np.isfinite(k).all() or min(k[0, 0], k[1, 1]) <= 0:
            raise SceneError(f"{path}: intrinsics: a matrix fx, 0, cx; 0, fy, cy; 0, 0, 1 expected, got {k.tolist()}")
        if k[0, 1] or k[1, 0] or k[2].tolist() != [0, 0, 1]:
            raise SceneError(f"{path}: intrinsics: pixels at right angles and a last row 0, 0, 1 expected")
        if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
            raise SceneError(f"{path}: world_from_camera: a matrix of 4 x 4 finite numbers expected")
        (fx, fy), (cx, cy) = k[[0, 1], [0, 1]].tolist(), k[:2, 2].tolist()
        window = (-cx / fx, (width - cx) / fx, (cy - height) / fy, cy / fy)
        return Camera(path, matrix, window, is_conformed=True)

    def intrinsics(self, width: int, height: int) -> np.ndarray:
        """Return K of a picture that shows the camera's whole window, as :meth:`from_intrinsics` takes it.

        ``film.camera.intrinsics(film.width, film.height)`` is that of a film.

        Args:
            width: Of the picture [pixel].
            height: Likewise.

        Raises:
            SceneError: An orthographic camera has none.
        """
        if not self.is_perspective:
            raise SceneError(f"{self.path}: an orthographic camera has no intrinsics")
        left, right, bottom, top = self.window
        fx, fy = width / (right - left), height / (top - bottom)
        return np.array([[fx, 0.0, -left * fx], [0.0, fy, top * fy], [0.0, 0.0, 1.0]])


def look_at(eye: Any, target: Any, up: Any) -> np.ndarray:
    """Return the ``world_from_camera`` of a camera that has a point in the middle of its picture: float64 [4, 4].

    Args:
        eye: Where the camera is, world space.
        target: What it looks at.
        up: What is upwards in the picture; (0, 0, 1) with Z up.

    Raises:
        SceneError: The eye is at the target, it looks along ``up``, or a number is not finite.
    """
    origin, upwards = np.asarray(eye, float), np.asarray(up, float)
    with np.errstate(invalid="ignore", over="ignore"):
        back = origin - np.asarray(target, float)
        right = np.cross(upwards, back)
        lengths = np.linalg.norm(back), np.linalg.norm(right)
    if not np.isfinite(lengths).all() or min(lengths) == 0:
        raise SceneError(f"look_at: from {eye} no way leads to {target} that is not along {up}")
    matrix = np.eye(4)
    matrix[:3, 2], matrix[:3, 0], matrix[:3, 3] = back / lengths[0], right / lengths[1], origin
    matrix[:3, 1] = np.cross(matrix[:3, 2], matrix[:3, 0])
    return matrix
