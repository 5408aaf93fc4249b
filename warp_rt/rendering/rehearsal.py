# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a picture would be and be told with, found out on the host: nothing is uploaded, built or traced."""

from __future__ import annotations

from dataclasses import dataclass

from warp_rt.options import RenderOptions, is_primvar_aov
from warp_rt.rendering.film_buffers import film_area
from warp_rt.rendering.film_camera import choose_camera, frame_camera, image_size, shutter_of
from warp_rt.rendering.frame import resolve_options
from warp_rt.rendering.notes import shutter_note, unseen_note, view_notes
from warp_rt.rendering.shutter import Moment, plan_moments
from warp_rt.report import Diagnostic
from warp_rt.scene import Camera, Scene
from warp_rt.upload.meshes import primvar_size


@dataclass(frozen=True)
class Rehearsal:
    """A picture that is not made."""

    camera: Camera
    """The scene's, or one that frames it."""
    width: int
    """Of the film, which is the crop or the data window where there is one [pixel]."""
    height: int
    """Likewise."""
    moments: tuple[Moment, ...]
    """While the shutter is open; none where the frame's own time is all that shows."""
    notes: tuple[Diagnostic, ...]
    """Those of the picture, but for what only its pixels tell."""


def rehearse(scene: Scene, options: RenderOptions, camera: str | None = None) -> Rehearsal:
    """Return what the picture of a stage's scene would be.

    Args:
        scene: Of a frame.
        options: How it would be rendered.
        camera: As for ``Renderer.render``.

    Raises:
        SceneError: There is no such camera, or nothing is left of the data window.
        OptionError: Nothing is left of the crop.
    """
    options = resolve_options(options, scene.settings)
    chosen = choose_camera(scene, camera)
    seen_by = chosen or frame_camera(scene, options)
    size = image_size(seen_by, options, scene.settings)
    width, height = film_area(options.crop, seen_by, scene.settings, *size)[2:]
    primvars = [aov for aov in options.aovs if is_primvar_aov(aov)]
    absent = [aov for aov in primvars if not primvar_size(scene, aov.removeprefix("primvars:"))]
    notes = list(view_notes(scene, options, seen_by, is_framed=chosen is None, absent_aovs=absent))
    moments = plan_moments(scene.time, shutter_of(seen_by, scene.settings), options.spp)
    late = [
        None if moments else shutter_note(scene, options, seen_by),
        unseen_note(scene, seen_by, size) if options.crop is None else None,
    ]
    notes += [note for note in late if note is not None]
    return Rehearsal(seen_by, width, height, moments, tuple(notes))
