# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A scene on a device as one camera sees it: what stepped in where the stage has no camera or no light."""

from __future__ import annotations

from dataclasses import dataclass

import warp as wp

from warp_rt.bvh.accel import Accel
from warp_rt.device.arrays import array_of_one
from warp_rt.kernels import frame_structs, scene_structs
from warp_rt.options import RenderOptions
from warp_rt.rendering.film_camera import camera_data, choose_camera, exposed, frame_camera
from warp_rt.rendering.frame import frame_data
from warp_rt.rendering.headlight import headlight
from warp_rt.rendering.notes import view_notes
from warp_rt.report import Diagnostic
from warp_rt.scene import Camera, Light, Scene
from warp_rt.upload.device_scene import DeviceScene, with_lights


@dataclass(frozen=True)
class PreparedView:
    """A camera, and the scene as it is lit for it."""

    scene: Scene
    camera: Camera
    """With the exposure that the settings ask for."""
    lights: tuple[Light, ...]
    """The scene's, or a headlight."""
    device_scene: DeviceScene
    notes: tuple[Diagnostic, ...]
    """On the defaults that stepped in."""

    def terms(self, accel: Accel, options: RenderOptions, size: tuple[int, int]) -> list[wp.array]:
        """Return what every kernel of a render takes first: scene, hierarchies and frame.

        Args:
            accel: The scene's.
            options: Resolved.
            size: Width and height of the whole picture [pixel].
        """
        eye = camera_data(self.camera, *size, self.scene.settings, self.device_scene.origin, accel.device)
        frame = frame_data(options, self.scene, eye)
        return [
            array_of_one(self.device_scene.data, scene_structs.SceneData, accel.device),
            accel.table,
            array_of_one(frame, frame_structs.FrameData, accel.device),
        ]


def prepare_view(
    scene: Scene, device_scene: DeviceScene, options: RenderOptions, camera: str | Camera | None
) -> PreparedView:
    """Return a scene as a camera sees it.

    Args:
        scene: Without a camera it is framed, without a light it has a headlight.
        device_scene: The same on a device.
        options: Resolved.
        camera: As for ``Renderer.render``.

    Raises:
        SceneError: The scene has no camera of that name.
    """
    chosen = camera if isinstance(camera, Camera) else choose_camera(scene, camera)
    seen_by = frame_camera(scene, options) if chosen is None else chosen
    lights = scene.lights
    if not scene.lights and not scene.domes:
        lights = (headlight(seen_by),)
        device_scene = with_lights(device_scene, lights)
    notes = view_notes(
        scene,
        options,
        seen_by,
        is_framed=chosen is None,
        absent_aovs=[aov for aov, primvar in device_scene.aov_primvars.items() if primvar.size == 0],
    )
    return PreparedView(scene, exposed(seen_by, scene.settings), lights, device_scene, notes)
