# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The ray tree of one pixel, written down by the render's own functions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import warp as wp

from warp_rt.bvh.accel import Accel
from warp_rt.device.arrays import array_of_one
from warp_rt.device.launch import Deadline, StopFlag
from warp_rt.kernels import record_tree
from warp_rt.kernels.observer import TreeRecorder
from warp_rt.options import DEFAULT_DEPTH, RenderOptions
from warp_rt.rendering.film_buffers import film_area
from warp_rt.rendering.film_camera import image_size
from warp_rt.rendering.prepared_view import PreparedView
from warp_rt.rendering.tree_pixel import check_pixel, chosen_samples
from warp_rt.rendering.tree_recording import Records, make_roots, record
from warp_rt.rendering.worker_scratch import walking_scratch
from warp_rt.scene import Scene
from warp_rt.tree.ray_tree import RayTree


def trace_pixel(
    view: PreparedView, accel: Accel, options: RenderOptions, pixel: tuple[int, int], samples: Sequence[int] | None
) -> RayTree:
    """Return the ray tree of a pixel.

    Args:
        view: Scene and camera.
        accel: The scene's hierarchies.
        options: Resolved.
        pixel: Column and row in the film, which may be a crop of the picture.
        samples: Which of the pixel's samples; None: all.

    Raises:
        OptionError: There is no such pixel or sample.
        LimitError: The tree is larger than anybody would read, or the time limit was reached.
    """
    scene, camera = view.scene, view.camera
    size = image_size(camera, options, scene.settings)
    left, top, width, height = film_area(options.crop, camera, scene.settings, *size)
    check_pixel(pixel, width, height)
    x, y = int(pixel[0]), int(pixel[1])
    taken = chosen_samples(samples, options.spp)
    records, values = _record(view.terms(accel, options, size), accel, options, (left + x, top + y), taken)
    # The film's own arithmetic, sample after sample, so that the very same float32 numbers come out.
    total = np.zeros(4, np.float32)
    for value in values:
        total += value
    mean = total / np.float32(len(taken))
    red, green, blue = (mean[:3] * np.float32(camera.exposure_scale)).tolist()
    return RayTree(
        x=x,
        y=y,
        width=width,
        height=height,
        roots=make_roots(records, scene, view.lights, view.device_scene.origin),
        samples=taken,
        value=(red, green, blue),
        alpha=float(mean[3]),
        exposure_scale=camera.exposure_scale,
        spp=options.spp,
        depth=options.depth or DEFAULT_DEPTH,
        threshold=options.threshold or 0.0,
        camera=camera.path,
        source=scene.source,
        time=scene.time,
        scene_size=_diagonal(scene),
    )


def _record(
    terms: list[wp.array], accel: Accel, options: RenderOptions, pixel: tuple[int, int], samples: Sequence[int]
) -> tuple[Records, np.ndarray]:
    """Return the records of a pixel's samples, and the radiance and alpha of each: float32, shape [samples, 4].

    Args:
        terms: The kernel's first arguments.
        accel: The hierarchies.
        options: Resolved.
        pixel: Column and row in the whole picture.
        samples: Which to trace.
    """
    device, depth = accel.device, options.depth or DEFAULT_DEPTH
    deadline = Deadline(options.time_limit)
    stop = StopFlag(device)
    scratch = walking_scratch(accel, depth, rows=1)
    values = wp.zeros(options.spp, dtype=wp.vec4, device=device)

    def launch(recorder: TreeRecorder) -> None:
        recorders = array_of_one(recorder, TreeRecorder, device)
        for sample in samples:
            inputs = [*terms, recorders, *scratch.arguments, *pixel, sample]
            wp.launch(record_tree.record_sample, dim=1, inputs=inputs, outputs=[values], device=device)
            deadline.check()

    records = record(launch, depth=depth, stop=stop.array, device=device)
    return records, values.numpy()[list(samples)]


def _diagonal(scene: Scene) -> float:
    """Return the diagonal of the scene's box; 1 where there is none."""
    low, high = scene.bounds()
    length = float(np.linalg.norm(high - low))
    return length if np.isfinite(length) and length > 0 else 1.0
