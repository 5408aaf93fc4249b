# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Notes on a picture: defaults that stepped in, what it leaves out, and that nothing of the scene shows."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np

from warp_rt.options import RenderOptions
from warp_rt.rendering.film_camera import has_lens, share_of_picture, shutter_of
from warp_rt.report import Diagnostic
from warp_rt.scene import Camera, RayMask, Scene

_LOST = 1e-4  # share of a picture below which what shows, or where it could, is thought to be lost in it


def view_notes(
    scene: Scene, options: RenderOptions, camera: Camera, *, is_framed: bool, absent_aovs: Sequence[str]
) -> tuple[Diagnostic, ...]:
    """Return the notes on a picture before it is traced.

    Args:
        scene: As it was loaded.
        options: Resolved.
        camera: What it is seen through.
        is_framed: Whether the camera stands in for one that the stage has not.
        absent_aovs: Primvars that are asked for, and that nothing drawn has.
    """
    return tuple(_view_notes(scene, options, camera, is_framed, absent_aovs))


def _view_notes(
    scene: Scene, options: RenderOptions, camera: Camera, is_framed: bool, absent_aovs: Sequence[str]
) -> Iterator[Diagnostic]:
    source = scene.source or "scene"
    if is_framed:
        yield Diagnostic("N901", source, "no camera in the stage: the scene is framed")
    if options.spp == 1 and has_lens(camera, scene.settings):
        message = "one sample a pixel goes through the lens' centre: drawn sharp; --spp shows depth of field"
        yield Diagnostic("N930", camera.path, message)
    has_extent = bool(scene.domes) or any(light.has_extent for light in scene.lights)
    if not scene.lights and not scene.domes:
        yield Diagnostic("N902", source, "no light in the stage: a headlight is used")
    if has_extent and not options.light_samples:
        message = (
            "lights of some size and domes cast sharp shadows or none, and highlights are those of points: "
            "light samples make both soft (--light-samples)"
        )
        yield Diagnostic("N907", source, message)
    if options.light_samples and not has_extent:
        yield Diagnostic(
            "N935", source, "light samples: there is no dome, and no light has an extent: shadows stay sharp"
        )
    for aov in absent_aovs:
        yield Diagnostic("N933", source, f"nothing that is drawn has the AOV {aov}: 0 everywhere")


def shutter_note(scene: Scene, options: RenderOptions, camera: Camera) -> Diagnostic | None:
    """Return the note that the frame's time is all that is drawn, though something moves while the shutter is open."""
    opens, closes = shutter_of(camera, scene.settings)
    if (opens, closes) == (0.0, 0.0) or closes < opens:
        return None
    how = (
        "motion blur needs several samples a pixel (--spp)"
        if options.spp == 1
        else "only whole pictures of a stage blur"
    )
    message = f"the shutter is open while things move: drawn as at the frame's time; {how}"
    return Diagnostic("N931", camera.path, message)


def emptiness_note(scene: Scene, camera: Camera, size: tuple[int, int], alpha: np.ndarray) -> Diagnostic | None:
    """Return the note that a whole picture shows next to nothing: the scene lies elsewhere, or is too small in it.

    Args:
        scene: What was rendered.
        camera: What it was seen through.
        size: Width and height of the picture [pixel].
        alpha: Of the picture, shape [height, width].
    """
    covered = float(alpha.sum())
    if covered > _LOST * alpha.size:
        return None
    seen = f"{covered:.2g} of {alpha.size:,} pixels show" if covered else "nothing of the picture shows"
    return _lost_scene(scene, camera, size, seen)


def unseen_note(scene: Scene, camera: Camera, size: tuple[int, int]) -> Diagnostic | None:
    """Return the note that a whole picture would show next to nothing, for the box about the scene covers none of it.

    Args:
        scene: What would be rendered.
        camera: What it would be seen through.
        size: Width and height of the picture [pixel].
    """
    return _lost_scene(scene, camera, size, "next to nothing of the picture can show")


def _lost_scene(scene: Scene, camera: Camera, size: tuple[int, int], seen: str) -> Diagnostic | None:
    box = _seen_box(scene)
    if box is None or share_of_picture(box, camera, *size, scene.settings) >= _LOST:
        return None
    low, high = (", ".join(f"{number:g}" for number in corner) for corner in box)
    return Diagnostic("N932", camera.path, f"{seen} the scene, which reaches from ({low}) to ({high})")


def _seen_box(scene: Scene) -> np.ndarray | None:
    """Return the world-space box of what eye rays may see: float64, shape [2, 3]; None where there is nothing."""
    instances = scene.instances
    if instances.seen_by is not None:
        instances = instances[np.flatnonzero(instances.seen_by & RayMask.EYE)]
    box = dataclasses.replace(scene, instances=instances).bounds()
    return box if np.isfinite(box).all() else None
