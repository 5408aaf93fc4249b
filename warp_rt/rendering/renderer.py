# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The renderer: a scene prepared once on a device, then rendered from any number of cameras."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from warp_rt.bvh.accel import Accel, build_accel, build_modules, refit_accel
from warp_rt.bvh.mesh_trees import has_same_triangles
from warp_rt.device.compile import load_kernels
from warp_rt.device.launch import Deadline
from warp_rt.device.workers import default_thread_count
from warp_rt.errors import OptionError
from warp_rt.options import RenderOptions
from warp_rt.rendering.constant_inputs import with_constant_inputs
from warp_rt.rendering.exposure import Exposure
from warp_rt.rendering.film import Film, RayCounts
from warp_rt.rendering.film_buffers import film_area, make_film_buffers
from warp_rt.rendering.film_camera import camera_of_film, image_size, pixel_aspect_ratio
from warp_rt.rendering.film_launches import expose_film
from warp_rt.rendering.frame import resolve_options
from warp_rt.rendering.kernel_choice import choose_kernel
from warp_rt.rendering.notes import emptiness_note, shutter_note
from warp_rt.rendering.prepared_view import PreparedView, prepare_view
from warp_rt.report import Diagnostic
from warp_rt.scene import Camera, Scene, check_scene
from warp_rt.upload.device_scene import DeviceScene, upload_scene
from warp_rt.warp_setup import init_warp, resolve_device

if TYPE_CHECKING:
    from warp_rt.tree.ray_tree import RayTree

_REBUILD_COST = 1.25  # cost of a refitted hierarchy, in that of the built one, from which building anew pays


class Renderer:
    """A scene on a device, with its hierarchies: ready to render.

    Where kernels have to be compiled, a line of the log ``warp_rt`` says so.

    Args:
        scene: What to render. Without lights it gets a headlight for each render.
        options: How.
        device: ``auto``, ``cpu``, or ``cuda:N``.
        previous: A renderer of a scene like this one, such as the frame before. Where only points and
            transforms differ, its hierarchy is refitted instead of built, unless it has become much dearer to trace.
            Its images on the device are shared where ``Scene.images`` holds the same objects.

    Raises:
        OptionError: ``scene`` is no Scene.
        DeviceError: There is no such device.
        LimitError: The scene has more triangles than a hierarchy can hold.
        SceneError: A point is not finite, or farther than 1e15 from its mesh's origin; or something has no material.
    """

    def __init__(
        self,
        scene: Scene,
        options: RenderOptions | None = None,
        *,
        device: str = "auto",
        previous: Renderer | None = None,
    ) -> None:
        check_scene(scene)
        init_warp()
        self.device = resolve_device(device)
        self.scene = with_constant_inputs(scene)
        if not isinstance(options, RenderOptions | None):
            raise OptionError(f"options: RenderOptions expected, got {type(options).__name__}")
        self.options = resolve_options(options or RenderOptions(), scene.settings)
        """With every term that was left open filled in."""
        self.threads = self.options.threads or default_thread_count()
        self.seconds = {"upload": 0.0, "build": 0.0, "compile": 0.0, "render": 0.0}
        """Wall-clock seconds spent on each stage so far."""
        self.diagnostics: tuple[Diagnostic, ...] = ()
        """Notes on the latest render: defaults that stepped in."""

        with self._clock("compile"):
            self._kernel = choose_kernel(self.scene, self.options, self.device)
            load_kernels(
                [
                    (module.rpartition(".")[2], name)
                    for module, name in (
                        (self._kernel.func.__module__, self.device),
                        *((file.__name__, place) for file, place in build_modules(self.options.bvh, self.device)),
                    )
                ],
                threads=self.threads,
            )
        with self._clock("build"):
            self.accel: Accel = self._refit(previous) or build_accel(
                scene,
                device=self.device,
                bvh=self.options.bvh,
                intersector=self.options.intersector,
                threads=self.threads,
            )
        with self._clock("upload"):
            self._device_scene: DeviceScene = upload_scene(
                self.scene,
                device=self.device,
                placement=self.accel.placement,
                texture_filter=self.options.texture_filter,
                samples_domes=bool(self.options.light_samples),
                shadows=self.options.shadows,
                aovs=self.options.aovs,
                previous=None if previous is None else previous._device_scene,
            )

    def _refit(self, previous: Renderer | None) -> Accel | None:
        """Return the previous renderer's hierarchy, refitted; None where there is none that fits, or it is too dear."""
        if previous is None or previous.device != self.device:
            return None
        if (previous.options.bvh, previous.options.intersector) != (self.options.bvh, self.options.intersector):
            return None
        if not has_same_triangles(previous.scene, self.scene):
            return None
        accel = refit_accel(previous.accel, self.scene, threads=self.threads)
        is_good = accel.statistics.sah_cost <= _REBUILD_COST * accel.statistics.built_cost
        return accel if is_good else None

    @property
    def device_bytes(self) -> int:
        """Device memory of the scene and its hierarchies [byte]."""
        return self._device_scene.bytes + self.accel.statistics.bytes

    def render(
        self,
        *,
        camera: str | Camera | None = None,
        depth: int | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> Film:
        """Return the picture from one camera.

        Args:
            camera: Path or name of a camera of the scene, or a camera of one's own. None: the render settings' camera,
                else ``main_cam``, else the stage's first, else one that frames the scene.
            depth: Levels of the ray tree; None: as the options say.
            progress: Called now and then from this thread with the finished fraction, 0 to 1.

        Raises:
            SceneError: The scene has no camera of that name.
            OptionError: The crop lies outside the picture, or the depth is out of range.
            LimitError: The time limit was reached.
        """
        film = self.start_film(camera, depth=depth)
        self.expose(film, range(film.options.spp), camera=camera, progress=progress)
        self._note(shutter_note(self.scene, self.options, film.camera))
        return self.develop(film)

    def start_film(
        self, camera: str | Camera | None = None, *, depth: int | None = None, aovs: tuple[str, ...] | None = None
    ) -> Exposure:
        """Return an unexposed film; ``expose`` adds samples to it, also those of renderers of other moments.

        Args:
            camera: As for ``render``.
            depth: Likewise.
            aovs: What it holds, besides colour; None: as the options say.

        Raises:
            SceneError: The scene has no camera of that name.
            OptionError: The crop lies outside the picture, or the depth is out of range.
        """
        changes: dict[str, Any] = {"depth": depth, "aovs": aovs}
        options = dataclasses.replace(self.options, **{name: to for name, to in changes.items() if to is not None})
        chosen = self._view(camera).camera
        size = image_size(chosen, options, self.scene.settings)
        area = film_area(options.crop, chosen, self.scene.settings, *size)
        buffers = make_film_buffers(options.aovs, area, self.device, self._device_scene.aov_primvars)
        return Exposure(options, chosen, size, buffers, Deadline(options.time_limit))

    def expose(
        self,
        film: Exposure,
        samples: range,
        *,
        camera: str | Camera | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> None:
        """Add samples of every pixel to a film.

        Args:
            film: Made by a renderer of the same device and options.
            samples: Which of the picture's samples; each has its own place in the pixel and on the lens.
            camera: As for ``render``.
            progress: Likewise.

        Raises:
            SceneError: The scene has no camera of that name.
            LimitError: The time limit was reached.
        """
        view = self._view(camera)
        with self._clock("render"):
            film.counts = film.counts + expose_film(
                self._kernel,
                view.terms(self.accel, film.options, film.size),
                self.accel,
                film,
                samples,
                threads=self.threads,
                progress=progress,
            )

    def develop(self, film: Exposure) -> Film:
        """Return what a film that this renderer has started shows, once all its samples are there."""
        width, height = film.buffers.area[2:]
        is_window = film.options.crop is None and film.buffers.area != (0, 0, *film.size)
        aovs = film.buffers.develop(spp=film.options.spp, camera=film.camera, origin=self._device_scene.origin)
        if self.scene.rendering_from_rec709 is not None:
            back = np.linalg.inv(self.scene.rendering_from_rec709)
            aovs["color"] = (aovs["color"] @ back.T).astype(np.float32)
        if film.options.crop is None:
            self._note(emptiness_note(self.scene, film.camera, film.size, aovs["alpha"]))
        return Film(
            width=width,
            height=height,
            aovs=aovs,
            rays=RayCounts.from_row(film.counts),
            prims=self.scene.prims,
            instance_paths=self.scene.instance_paths,
            labels=self.scene.labels,
            facts=self._facts(film.camera, film.options),
            data_window=(*film.buffers.area[:2], *film.size) if is_window else None,
            pixel_aspect_ratio=pixel_aspect_ratio(film.camera, *film.size, self.scene.settings),
            camera=camera_of_film(film.camera, film.size, film.buffers.area, self.scene.settings),
            diagnostics=tuple(dict.fromkeys((*self.scene.diagnostics, *self.diagnostics))),
        )

    def trace_tree(
        self, x: int, y: int, *, camera: str | Camera | None = None, samples: Sequence[int] | None = None
    ) -> RayTree:
        """Return the ray tree of a pixel: what ``render`` does for it, written down.

        Args:
            x: Column of the pixel in the film, which may be a crop of the picture; 0 on the left.
            y: Row; 0 at the top.
            camera: As for ``render``.
            samples: Which of the pixel's samples; None: all.

        Raises:
            OptionError: There is no such pixel or sample.
            SceneError: The scene has no camera of that name.
            LimitError: The tree is larger than anybody would read, or the time limit was reached.
        """
        from warp_rt.rendering.trace_pixel import trace_pixel
        from warp_rt.rendering.tree_pixel import check_request

        check_request((x, y), samples, self.options)
        with self._clock("compile"):
            load_kernels([("record_tree", self.device)])
        view = self._view(camera)
        self._note(shutter_note(self.scene, self.options, view.camera))
        with self._clock("render"):
            return trace_pixel(view, self.accel, self.options, (x, y), samples)

    def _view(self, camera: str | Camera | None) -> PreparedView:
        """Return the scene as a camera sees it; note the defaults that stepped in."""
        view = prepare_view(self.scene, self._device_scene, self.options, camera)
        self.diagnostics = view.notes
        return view

    def _note(self, note: Diagnostic | None) -> None:
        """Keep a note, once."""
        if note is not None:
            self.diagnostics = tuple(dict.fromkeys((*self.diagnostics, note)))

    def _facts(self, camera: Camera, options: RenderOptions) -> dict[str, object]:
        facts: dict[str, object] = {"source": self.scene.source, "camera": camera.path, "time": self.scene.time}
        facts |= {
            name: getattr(options, name)
            for name in ("integrator", "spp", "light_samples", "seed", "depth", "threshold")
        }
        return {name: value for name, value in facts.items() if value not in (None, "")}

    @contextmanager
    def _clock(self, stage: str) -> Iterator[None]:
        """Add the time that a ``with`` block takes to one entry of ``seconds``."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] += time.perf_counter() - start
