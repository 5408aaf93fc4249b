# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The renderer: a scene prepared once on a device, then rendered from any number of cameras."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from numbers import Integral
from typing import Any

import numpy as np
import warp as wp

from warp_rt.accel import Accel, build_accel, build_modules, make_stacks, refit_accel
from warp_rt.compile import load_kernels
from warp_rt.constant_inputs import with_constant_inputs
from warp_rt.device_scene import DeviceScene, upload_scene, with_lights
from warp_rt.errors import OptionError
from warp_rt.exposure import Exposure
from warp_rt.film import Film, RayCounts
from warp_rt.film_buffers import Rectangle, film_area, make_film_buffers
from warp_rt.film_camera import (
    camera_data,
    choose_camera,
    exposed,
    frame_camera,
    has_lens,
    image_size,
    pixel_aspect_ratio,
    share_of_picture,
    shutter_of,
)
from warp_rt.frame import frame_data, resolve_options
from warp_rt.headlight import headlight
from warp_rt.kernels import (
    ray_counts,
    record_tree,
    render,
    render_costs,
    render_plain,
    render_together,
    render_together_plain,
    structs,
    tile_structs,
)
from warp_rt.kernels.observer import TreeRecorder
from warp_rt.launch import Deadline, StopFlag, Tile, bands_of, run_bands, run_tiles, tiles_of
from warp_rt.mesh_trees import has_same_triangles
from warp_rt.options import COSTS, DEFAULT_DEPTH, RenderOptions
from warp_rt.plain import is_plain
from warp_rt.report import Diagnostic
from warp_rt.scene import Camera, Light, RayMask, Scene, check_scene
from warp_rt.task_stack import task_bytes, task_capacity
from warp_rt.tile_scratch import make_tile_trees
from warp_rt.tree.ray_tree import RayTree
from warp_rt.tree_recording import Records, make_roots, record
from warp_rt.warp_setup import init_warp, resolve_device
from warp_rt.workers import default_thread_count


@dataclasses.dataclass(frozen=True)
class Scratch:
    """What one worker's launches need."""

    arguments: list[Any]
    """Of the kernel: scratch memory, and last the counters."""
    kept: Any = None
    """What has to live as long."""

    @property
    def counts(self) -> np.ndarray:
        """Counters: int64, summed over threads."""
        return self.arguments[-1].numpy().sum(axis=0, dtype=np.int64)


_LOST = 1e-4  # share of a picture below which what shows, or where it could, is thought to be lost in it
_REBUILD_COST = 1.25  # cost of a refitted hierarchy, in that of the built one, from which building anew pays
_CUDA_COUNTER_ROWS = 256  # spreads atomic additions
_KERNELS = {
    (False, False): render.render_tile,
    (False, True): render_plain.render_tile_plain,
    (True, False): render_together.render_tile_together,
    (True, True): render_together_plain.render_tile_together_plain,
}  # by whether the trees of a tile's pixels grow together, and whether the scene is plain


class Renderer:
    """A scene on a device, with its hierarchies: ready to render.

    Args:
        scene: What to render. Without lights it gets a headlight for each render.
        options: How.
        device: ``auto``, ``cpu``, or ``cuda:N``.
        on_compile: Called once if kernels have to be compiled, which takes seconds.
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
        on_compile: Callable[[], None] | None = None,
        previous: Renderer | None = None,
    ) -> None:
        check_scene(scene)
        init_warp()
        self.device = resolve_device(device)
        self._on_compile = on_compile
        self.scene = with_constant_inputs(scene)
        self.options = resolve_options(options or RenderOptions(), scene.settings)
        """With every term that was left open filled in."""
        self.threads = self.options.threads or default_thread_count()
        self.seconds = {"upload": 0.0, "build": 0.0, "compile": 0.0, "render": 0.0}
        """Wall-clock seconds spent on each stage so far."""
        self.diagnostics: tuple[Diagnostic, ...] = ()
        """Notes on the latest render: defaults that stepped in."""

        with self._clock("compile"):
            self._kernel = self._choose_kernel()
            load_kernels(
                [
                    (module.rpartition(".")[2], name)
                    for module, name in (
                        (self._kernel.func.__module__, self.device),
                        *((file.__name__, place) for file, place in build_modules(self.options.bvh, self.device)),
                    )
                ],
                on_compile=on_compile,
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

    def _choose_kernel(self) -> wp.Kernel:
        """Return the fastest kernel that draws the scene and gives the AOVs that are wanted.

        On a CPU the trees of a tile's pixels grow together, but where costs are counted, which are those of rays that
        are traced one by one, and with the triangle tests that are for single rays.
        """
        if set(self.options.aovs) & set(COSTS):
            return render_costs.render_tile_costs
        is_together = self.device == "cpu" and self.options.intersector == "watertight"
        return _KERNELS[is_together, is_plain(self.scene, self.options)]

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
        self._note_shutter(film.camera)
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
        chosen, _, _ = self._set_up(camera)
        width, height = image_size(chosen, options, self.scene.settings)
        area = film_area(options.crop, self.scene.settings, width, height)
        buffers = make_film_buffers(options.aovs, area, self.device, self._device_scene.aov_primvars)
        return Exposure(options, chosen, (width, height), buffers, Deadline(options.time_limit))

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
        chosen, device_scene, _ = self._set_up(camera)
        with self._clock("render"):
            eye = camera_data(chosen, *film.size, self.scene.settings, device_scene.origin, self.device)
            frame = frame_data(film.options, self.scene, eye)
            film.counts = film.counts + self._trace(
                [
                    self._array_of_one(device_scene.data, structs.SceneData),
                    self.accel.table,
                    self._array_of_one(frame, structs.FrameData),
                    self._array_of_one(film.buffers.data, structs.FilmData),
                ],
                film,
                samples,
                progress,
            )

    def develop(self, film: Exposure) -> Film:
        """Return what a film that this renderer has started shows, once all its samples are there."""
        width, height = film.buffers.area[2:]
        is_window = film.options.crop is None and film.buffers.area != (0, 0, *film.size)
        aovs = film.buffers.develop(spp=film.options.spp, camera=film.camera, origin=self._device_scene.origin)
        if self.scene.rendering_from_rec709 is not None:
            back = np.linalg.inv(self.scene.rendering_from_rec709)
            aovs["color"] = (aovs["color"] @ back.T).astype(np.float32)
        developed = Film(
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
        )
        self._note_emptiness(developed, film)
        return developed

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
        with self._clock("compile"):
            load_kernels([("record_tree", self.device)], on_compile=self._on_compile)
        chosen, device_scene, lights = self._set_up(camera)
        self._note_shutter(chosen)
        width, height = image_size(chosen, self.options, self.scene.settings)
        area = film_area(self.options.crop, self.scene.settings, width, height)
        _check_pixel(x, y, area)
        taken = _chosen_samples(samples, self.options.spp)
        eye = camera_data(chosen, width, height, self.scene.settings, device_scene.origin, self.device)
        frame = frame_data(self.options, self.scene, eye)
        shared = [
            self._array_of_one(device_scene.data, structs.SceneData),
            self.accel.table,
            self._array_of_one(frame, structs.FrameData),
        ]
        with self._clock("render"):
            records, values = self._record(shared, (area[0] + int(x), area[1] + int(y)), taken)
        # The film's own arithmetic, sample after sample, so that the very same float32 numbers come out.
        total = np.zeros(4, np.float32)
        for value in values:
            total += value
        mean = total / np.float32(len(taken))
        red, green, blue = (mean[:3] * np.float32(chosen.exposure_scale)).tolist()
        return RayTree(
            x=int(x),
            y=int(y),
            width=area[2],
            height=area[3],
            roots=make_roots(records, self.scene, lights, device_scene.origin),
            samples=taken,
            value=(red, green, blue),
            alpha=float(mean[3]),
            exposure_scale=chosen.exposure_scale,
            spp=self.options.spp,
            depth=self._depth,
            threshold=self.options.threshold or 0.0,
            camera=chosen.path,
            source=self.scene.source,
            time=self.scene.time,
            scene_size=_diagonal(self.scene),
        )

    def _record(
        self, shared: list[wp.array], pixel: tuple[int, int], samples: Sequence[int]
    ) -> tuple[Records, np.ndarray]:
        """Return the records of a pixel's samples, and the radiance and alpha of each: float32, shape [samples, 4].

        Args:
            shared: The kernel's first arguments.
            pixel: Column and row in the whole picture.
            samples: Which to trace.
        """
        deadline = Deadline(self.options.time_limit)
        stop = StopFlag(self.device)
        scratch = self._scratch(1, self._depth)
        values = wp.zeros(self.options.spp, dtype=wp.vec4, device=self.device)

        def launch(recorder: TreeRecorder) -> None:
            recorders = self._array_of_one(recorder, TreeRecorder)
            for sample in samples:
                inputs = [*shared, recorders, *scratch.arguments, *pixel, sample]
                wp.launch(record_tree.record_sample, dim=1, inputs=inputs, outputs=[values], device=self.device)
                deadline.check()

        records = record(launch, depth=self._depth, stop=stop.array, device=self.device)
        return records, values.numpy()[list(samples)]

    def _set_up(self, camera: str | Camera | None) -> tuple[Camera, DeviceScene, tuple[Light, ...]]:
        """Return the camera, the scene as it is lit, and its lights; note the defaults that stepped in."""
        notes: list[Diagnostic] = []
        source = self.scene.source or "scene"
        chosen = camera if isinstance(camera, Camera) else choose_camera(self.scene, camera)
        if chosen is None:
            chosen = frame_camera(self.scene, self.options)
            notes.append(Diagnostic("N901", source, "no camera in the stage: the scene is framed"))
        if self.options.spp == 1 and has_lens(chosen, self.scene.settings):
            message = "one sample a pixel goes through the lens' centre: drawn sharp; --spp shows depth of field"
            notes.append(Diagnostic("N930", chosen.path, message))
        device_scene, lights = self._device_scene, self.scene.lights
        if not self.scene.lights and not self.scene.domes:
            notes.append(Diagnostic("N902", source, "no light in the stage: a headlight is used"))
            lights = (headlight(chosen),)
            device_scene = with_lights(device_scene, lights)
        elif not self.options.light_samples and (self.scene.domes or any(light.has_extent for light in lights)):
            message = "lights of some size and domes cast sharp shadows or none: light samples make them soft"
            notes.append(Diagnostic("N907", source, message))
        for aov, primvar in self._device_scene.aov_primvars.items():
            if primvar.size == 0:
                notes.append(Diagnostic("N933", source, f"nothing that is drawn has the AOV {aov}: 0 everywhere"))
        self.diagnostics = tuple(notes)
        return exposed(chosen, self.scene.settings), device_scene, lights

    def _note_shutter(self, camera: Camera) -> None:
        """Note that the frame's time is all that is drawn, though something moves while the shutter is open."""
        opens, closes = shutter_of(camera, self.scene.settings)
        if (opens, closes) == (0.0, 0.0) or closes < opens:
            return
        how = (
            "motion blur needs several samples a pixel (--spp)"
            if self.options.spp == 1
            else "only whole pictures of a stage blur"
        )
        message = f"the shutter is open while things move: drawn as at the frame's time; {how}"
        self.diagnostics = (*self.diagnostics, Diagnostic("N931", camera.path, message))

    def _note_emptiness(self, developed: Film, film: Exposure) -> None:
        """Note that a whole picture shows next to nothing because the scene lies elsewhere, or is too small in it."""
        covered = float(developed.alpha.sum())
        if film.options.crop is not None or covered > _LOST * developed.alpha.size:
            return
        box = _seen_box(self.scene)
        if box is None or share_of_picture(box, film.camera, *film.size, self.scene.settings) >= _LOST:
            return
        low, high = (", ".join(f"{number:g}" for number in corner) for corner in box)
        seen = f"{covered:.2g} of {developed.alpha.size:,} pixels show" if covered else "nothing of the picture shows"
        note = Diagnostic("N932", film.camera.path, f"{seen} the scene, which reaches from ({low}) to ({high})")
        self.diagnostics = tuple(dict.fromkeys((*self.diagnostics, note)))

    def _trace(
        self, shared: list[wp.array], film: Exposure, samples: range, progress: Callable[[float], None] | None
    ) -> np.ndarray:
        """Launch the render kernel over the whole film; return the sum of the counter rows.

        Args:
            shared: The kernel's first arguments.
            film: Takes the samples.
            samples: Which.
            progress: As for ``render``.
        """
        is_cpu = self.device == "cpu"
        size, options, deadline = film.buffers.area[2:], film.options, film.deadline
        depth = options.depth or DEFAULT_DEPTH
        tiles = tiles_of(*size, options.tile_size) if is_cpu else bands_of(*size, task_bytes(depth))
        rows = 1 if is_cpu else max(tile[2] * tile[3] for tile in tiles)
        scratches: list[Scratch] = []
        stop = StopFlag(self.device)

        # A recorded launch costs a sixth of a fresh one, time in which no other thread could submit its own.
        # It does not keep its arguments alive: ``scratches`` does.
        is_together = self._kernel in (_KERNELS[True, False], _KERNELS[True, True])

        def record() -> tuple[wp.Launch, int]:
            scratches.append(self._tile_scratch(depth) if is_together else self._scratch(rows, depth))
            inputs = [*shared, stop.array, *scratches[-1].arguments]
            following = [wp.vec4i(), 0]
            command = wp.launch(self._kernel, dim=1, inputs=[*inputs, *following], device=self.device, record_cmd=True)
            return command, len(inputs)

        def launch(recorded: tuple[wp.Launch, int], tile: Tile, sample: int) -> None:
            command, first = recorded
            command.set_dim(1 if is_together else tile[2] * tile[3])
            command.set_param_at_index(first, wp.vec4i(*tile))
            command.set_param_at_index(first + 1, sample)
            command.launch()

        if is_cpu:
            run_tiles(
                launch,
                tiles,
                samples,
                threads=min(self.threads, len(tiles)),
                make_scratch=record,
                stop=stop,
                deadline=deadline,
                progress=progress,
            )
        else:
            command = record()
            run_bands(
                lambda band, sample: launch(command, band, sample),
                tiles,
                samples,
                device=self.device,
                deadline=deadline,
                progress=progress,
            )
        return np.sum([scratch.counts for scratch in scratches], axis=0)

    def _scratch(self, rows: int, depth: int) -> Scratch:
        """Return ray tasks, traversal stacks and counters, for trees that are walked ray by ray."""
        capacity = task_capacity(depth)
        tasks = wp.empty(shape=(rows, capacity), dtype=structs.RayTask, device=self.device)
        return Scratch([tasks, make_stacks(self.accel, rows), self._counters(depth)])

    def _tile_scratch(self, depth: int) -> Scratch:
        """Return the trees that grow together, and counters."""
        trees = make_tile_trees(self.accel, depth)
        return Scratch([self._array_of_one(trees, tile_structs.TileTrees), self._counters(depth)], kept=trees)

    def _counters(self, depth: int) -> wp.array:
        elements = int(ray_counts.LEVELS) + int(ray_counts.PER_LEVEL) * depth
        rows = 1 if self.device == "cpu" else _CUDA_COUNTER_ROWS
        return wp.zeros(shape=(rows, elements), dtype=wp.int64, device=self.device)

    @property
    def _depth(self) -> int:
        return self.options.depth or DEFAULT_DEPTH

    def _array_of_one(self, struct: Any, dtype: Any) -> wp.array:
        return wp.array([struct], dtype=dtype, device=self.device)

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


def _seen_box(scene: Scene) -> np.ndarray | None:
    """Return the world-space box of what eye rays may see: float64, shape [2, 3]; None where there is nothing."""
    instances = scene.instances
    if instances.seen_by is not None:
        instances = instances[np.flatnonzero(instances.seen_by & RayMask.EYE)]
    box = dataclasses.replace(scene, instances=instances).bounds()
    return box if np.isfinite(box).all() else None


def _diagonal(scene: Scene) -> float:
    """Return the diagonal of the scene's box; 1 where there is none."""
    low, high = scene.bounds()
    length = float(np.linalg.norm(high - low))
    return length if np.isfinite(length) and length > 0 else 1.0


def _check_pixel(x: int, y: int, area: Rectangle) -> None:
    if not (isinstance(x, Integral) and isinstance(y, Integral)):
        raise OptionError(f"pixel ({x!r}, {y!r}): whole numbers expected")
    if not (0 <= x < area[2] and 0 <= y < area[3]):
        raise OptionError(f"pixel ({x}, {y}) lies outside the picture of {area[2]} x {area[3]} pixels")


def _chosen_samples(samples: Sequence[int] | None, spp: int) -> tuple[int, ...]:
    """Return which samples of a pixel to trace: those asked for, else all."""
    chosen = tuple(range(spp)) if samples is None else tuple(samples)
    if not chosen:
        raise OptionError("samples: at least one expected")
    for sample in chosen:
        if not 0 <= sample < spp:
            raise OptionError(f"sample: {sample} is outside 0..{spp - 1}")
    return chosen
