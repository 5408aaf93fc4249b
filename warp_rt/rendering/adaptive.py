# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Refinement of surfaces by the size of their edges in the picture: complexity ``auto``.

A frame is read twice: as cages, whose edges tell from the camera how often each surface is to be refined, and refined.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from warp_rt.options import RenderOptions
from warp_rt.rendering.film_camera import choose_camera, frame_camera, image_size, picture_window
from warp_rt.scene import Camera, Mesh, Product, Scene, Settings, local_bounds
from warp_rt.scene.source import RefinableSource

EDGE_PIXELS = 4.0
"""Length of edges in the picture above which a surface is refined once more [pixel]. A chord of 4 pixels leaves an arc
of radius 20 pixels by a tenth of one."""
MAX_LEVEL = 5
MAX_TRIANGLES = 1 << 22
"""Of a refined surface, by which its level is bounded too."""

View = Callable[[Scene], tuple[Scene, "str | Camera | None"]]
"""Says what of a scene is seen, and the camera that sees it: its name, a camera, or None for the scene's."""


class AdaptiveSource:
    """A stage whose surfaces are refined for what one camera sees of them.

    Args:
        source: The stage, its surfaces as cages.
        options: Of the pictures.
        view: Tells their camera.
    """

    def __init__(self, source: RefinableSource, options: RenderOptions, view: View) -> None:
        self._source = source
        self._options = options
        self._view = view
        self._levels: dict[float | None, dict[str, int]] = {}

    def scene(self, time: float | None = None, *, base_time: float | None = None) -> Scene:
        """Return the scene at a time; at moments of a frame, surfaces are refined as for the frame."""
        frame = time if base_time is None else base_time
        if frame not in self._levels:
            scene, camera = self._view(self._source.scene(frame))
            self._levels = {frame: refinement_levels(scene, camera, self._options)}
            self._levels[scene.time] = self._levels[frame]  # which None stood for
        return self._source.scene(time, base_time=base_time, levels=self._levels[frame])

    def products(self) -> tuple[Product, ...]:
        """Return the pictures that the render settings ask for."""
        return self._source.products()


def refinement_levels(scene: Scene, camera: str | Camera | None, options: RenderOptions) -> dict[str, int]:
    """Return how often the surface of each prim is to be refined, by path; prims of level 0 are not among them.

    The longest edge of a prim's cage, seen from the eye without foreshortening, is halved by every refinement; mirrors
    may show it from any side. Of several copies the one that is nearest for its size counts.

    Args:
        scene: With surfaces as cages.
        camera: Which; None: the scene's.
        options: Of the picture.
    """
    eye = camera if isinstance(camera, Camera) else choose_camera(scene, camera) or frame_camera(scene, options)
    pixels = _pixel_density(eye, image_size(eye, options, scene.settings), scene.settings)
    position = eye.world_from_camera[:3, 3]
    nearest: dict[int, tuple[float, int]] = {}
    bounds = [local_bounds(mesh) if isinstance(mesh, Mesh) else None for mesh in scene.meshes]
    for row, (mesh, prim) in enumerate(zip(scene.instances.mesh, scene.instances.prim, strict=True)):
        box = bounds[mesh]
        if box is None:
            continue
        matrix = scene.instances.world_from_local[row]
        stretch = np.linalg.norm(matrix[:3, :3], axis=0).max()
        distance = float(np.linalg.norm(matrix[:3, :3] @ box.mean(axis=0) + matrix[:3, 3] - position))
        size = stretch / max(distance, 1e-30) if eye.is_perspective else stretch
        if prim not in nearest or size > nearest[prim][0]:
            nearest[prim] = size, row
    levels = {}
    for prim, (_, row) in nearest.items():
        mesh = scene.meshes[scene.instances.mesh[row]]
        if isinstance(mesh, Mesh):
            longest = pixels * _longest_edge(mesh, scene.instances.world_from_local[row], eye)
            # The bound stands first, for of a window beyond all bounds the other is NaN.
            longest = min(EDGE_PIXELS * 2.0**MAX_LEVEL, longest)
            level = math.ceil(math.log2(max(longest, EDGE_PIXELS) / EDGE_PIXELS))
            budget = int(math.log(max(MAX_TRIANGLES / len(mesh.triangles), 1.0), 4))
            levels[scene.prims[prim]] = min(level, budget, MAX_LEVEL)
    return {path: level for path, level in levels.items() if level > 0}


def _pixel_density(eye: Camera, size: tuple[int, int], settings: Settings) -> float:
    """Return how many pixels a unit of the world takes, in a perspective at distance 1, where they are closest.

    Args:
        eye: With whatever scale and shear it has.
        size: Width and height of the picture [pixel].
        settings: How the camera's window is fitted.
    """
    left, right, bottom, top = picture_window(eye, *size, settings)
    x_axis, y_axis, z_axis = eye.world_from_camera[:3, :3].T
    sides = abs(right - left) * np.linalg.norm(x_axis), abs(top - bottom) * np.linalg.norm(y_axis)
    upright = np.cross(x_axis, y_axis)
    distance = abs(upright @ z_axis) / np.linalg.norm(upright) if eye.is_perspective else 1.0  # of the window
    with np.errstate(divide="ignore", invalid="ignore"):  # so far beside the axis that nothing is left of its sides
        return float(max(size[0] / sides[0], size[1] / sides[1]) * distance)


def _longest_edge(mesh: Mesh, world_from_local: np.ndarray, eye: Camera) -> float:
    """Return the greatest length of a mesh's edges, in a perspective divided by their distance from the eye."""
    points = mesh.points.astype(np.float64) @ world_from_local[:3, :3].T + world_from_local[:3, 3]
    corners = points[mesh.triangles]
    ends = np.roll(corners, -1, axis=1)
    lengths = np.linalg.norm(ends - corners, axis=2)
    if eye.is_perspective:
        # An edge that passes the eye is as near as half its length.
        away = np.linalg.norm((corners + ends) / 2 - eye.world_from_camera[:3, 3], axis=2)
        lengths = lengths / np.maximum(away, np.maximum(lengths / 2, 1e-30))
    return float(lengths.max())
