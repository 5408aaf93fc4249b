# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The pixel and the samples that a ray tree is asked for: whether there are any such, found out before the work."""

from __future__ import annotations

from collections.abc import Sequence
from numbers import Integral

from warp_rt.errors import OptionError
from warp_rt.options import RenderOptions
from warp_rt.rendering.film_buffers import film_area
from warp_rt.rendering.film_camera import choose_camera, frame_camera, image_size
from warp_rt.rendering.frame import resolve_options
from warp_rt.scene import Camera, Scene


def check_request(pixel: tuple[int, int], samples: Sequence[int] | None, options: RenderOptions) -> None:
    """Refuse a pixel or a sample that no stage's picture has with these options.

    Args:
        pixel: Column and row in the film, which may be a crop of the picture.
        samples: Which of the pixel's samples; None: all.
        options: How it would be rendered.

    Raises:
        OptionError: There is no such pixel or sample.
    """
    chosen_samples(samples, options.spp)
    x, y = pixel
    if not (isinstance(x, Integral) and isinstance(y, Integral)):
        raise OptionError(f"pixel ({x!r}, {y!r}): whole numbers expected")
    if min(x, y) < 0:
        raise OptionError(f"pixel ({x}, {y}) lies outside the picture, whose top left one is (0, 0)")
    if options.crop is not None:
        check_pixel(pixel, *options.crop[2:])


def check_pixel_of(scene: Scene, pixel: tuple[int, int], options: RenderOptions, camera: str | Camera | None) -> None:
    """Refuse a pixel that the picture of a scene has not.

    Args:
        scene: Of the frame.
        pixel: Column and row in the film.
        options: How it would be rendered.
        camera: As for ``Renderer.render``.

    Raises:
        OptionError: There is no such pixel.
        SceneError: There is no such camera.
    """
    options = resolve_options(options, scene.settings)
    chosen = camera if isinstance(camera, Camera) else choose_camera(scene, camera)
    seen_by = chosen or frame_camera(scene, options)
    size = image_size(seen_by, options, scene.settings)
    check_pixel(pixel, *film_area(options.crop, seen_by, scene.settings, *size)[2:])


def check_pixel(pixel: tuple[int, int], width: int, height: int) -> None:
    """Refuse a pixel that a film of a width and a height [pixel] has not.

    Raises:
        OptionError: It has not.
    """
    x, y = pixel
    if not (0 <= x < width and 0 <= y < height):
        raise OptionError(f"pixel ({x}, {y}) lies outside the picture of {width} x {height} pixels")


def chosen_samples(samples: Sequence[int] | None, spp: int) -> tuple[int, ...]:
    """Return which of a pixel's ``spp`` samples to trace: those asked for, else all.

    Raises:
        OptionError: There is no such sample, or none is asked for.
    """
    chosen = tuple(range(spp)) if samples is None else tuple(samples)
    if not chosen:
        raise OptionError("samples: at least one expected")
    for sample in chosen:
        if not 0 <= sample < spp:
            raise OptionError(f"sample: {sample} is outside 0..{spp - 1}")
    return chosen
