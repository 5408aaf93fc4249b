# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The renderer: a scene prepared once on a device, then rendered from any number of cameras."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import warp as wp

from warp_rt.accel import Accel, build_accel, make_stacks
from warp_rt.compile import load_kernels
from warp_rt.device_scene import upload_scene
from warp_rt.errors import OptionError
from warp_rt.film import Film, RayCounts
from warp_rt.film_camera import camera_data, choose_camera, frame_camera, image_size
from warp_rt.headlight import headlight
from warp_rt.kernels import ray_counts, ray_tree, structs
from warp_rt.kernels.bvh_structs import AccelData
from warp_rt.kernels.constants import PASS_LIMIT
from warp_rt.kernels.shading import SHADOW_AUTO, SHADOW_OPAQUE, SHADOW_TRANSMIT
from warp_rt.launch import Deadline, Tile, bands_of, run_bands, run_tiles, tiles_of
from warp_rt.options import DEFAULT_DEPTH, DEFAULT_THRESHOLD, RenderOptions
from warp_rt.report import Diagnostic
from warp_rt.scene import Camera, Material, MaterialModel, Scene
from warp_rt.warp_setup import init_warp, resolve_device
from warp_rt.workers import default_thread_count

_BLACK = (0.0, 0.0, 0.0)
_CUDA_COUNTER_ROWS = 256  # spreads atomic additions

# AOV: the field of FilmData it is written to, its bit, its type there, and what it holds where nothing was met.
_AOV_FIELDS: dict[str, tuple[str, int, Any, float]] = {
    "depth": ("depth", ray_tree.AOV_DEPTH, wp.float32, np.inf),
    "distance": ("distance", ray_tree.AOV_DISTANCE, wp.float32, np.inf),
    "normal": ("normal", ray_tree.AOV_NORMAL, wp.vec3, 0.0),
    "position": ("position", ray_tree.AOV_POSITION, wp.vec3, np.nan),  # 0 once developed
    "uv": ("uv", ray_tree.AOV_UV, wp.vec2, 0.0),
    "primId": ("prim", ray_tree.AOV_PRIM, wp.int32, -1),
    "instanceId": ("instance", ray_tree.AOV_INSTANCE, wp.int32, -1),
    "elementId": ("element", ray_tree.AOV_ELEMENT, wp.int32, -1),
}


class Renderer:
    """A scene on a device, with its hierarchies: ready to render.

    Args:
        scene: What to render. Without lights it gets a headlight for each render.
        options: How.
        device: ``auto``, ``cpu``, or ``cuda:N``.
        on_compile: Called once if kernels have to be compiled, which takes seconds.

    Raises:
        DeviceError: There is no such device.
        OptionError: Options contradict the scene.
    """

    def __init__(
        self,
        scene: Scene,
        options: RenderOptions | None = None,
        *,
        device: str = "auto",
        on_compile: Callable[[], None] | None = None,
    ) -> None:
        init_warp()
        self.device = resolve_device(device)
        self.scene = scene
        self.options = _resolve(options or RenderOptions(), scene)
        self.threads = self.options.threads or default_thread_count()
        self.seconds = {"upload": 0.0, "build": 0.0, "compile": 0.0, "render": 0.0}
        """Wall-clock seconds spent on each stage so far."""
        self.diagnostics: tuple[Diagnostic, ...] = ()
        """Notes on the latest render: defaults that stepped in."""

        with _clock(self.seconds, "compile"):
            for module in ("bvh_build", "bvh_collapse", "ray_tree"):
                load_kernels(module, device="cpu" if module != "ray_tree" else self.device, on_compile=on_compile)
        with _clock(self.seconds, "build"):
            self.accel: Accel = build_accel(
                scene,
                device=self.device,
                bvh=self.options.bvh,
                intersector=self.options.intersector,
                threads=self.threads,
            )
        self._upload(scene)

    def _upload(self, scene: Scene) -> None:
        with _clock(self.seconds, "upload"):
            self._device_scene = upload_scene(scene, device=self.device, placement=self.accel.placement)

    @property
    def device_bytes(self) -> int:
        """Device memory of the scene and its hierarchies [byte]."""
        return self._device_scene.bytes + self.accel.statistics.bytes

    def render(self, *, camera: str | Camera | None = None, progress: Callable[[float], None] | None = None) -> Film:
        """Return the picture from one camera.

        Args:
            camera: Path or name of a camera of the scene, or a camera of one's own. None: the render settings' camera,
                else ``main_cam``, else the stage's first, else one that frames the scene.
            progress: Called now and then from this thread with the finished fraction, 0 to 1.

        Raises:
            SceneError: The scene has no camera of that name.
            OptionError: The crop lies outside the picture.
            LimitError: The time limit was reached.
        """
        deadline = Deadline(self.options.time_limit)
        notes: list[Diagnostic] = []
        source = self.scene.source or "scene"
        chosen = camera if isinstance(camera, Camera) else choose_camera(self.scene, camera)
        if chosen is None:
            chosen = frame_camera(self.scene, self.options)
            notes.append(Diagnostic("N901", source, "no camera in the stage: the scene is framed"))
        if not self.scene.lights and not self.scene.domes:
            notes.append(Diagnostic("N902", source, "no light in the stage: a headlight is used"))
            self._upload(dataclasses.replace(self.scene, lights=(headlight(chosen),)))
        self.diagnostics = tuple(notes)
        with _clock(self.seconds, "render"):
            return self._render(chosen, deadline, progress)

    def _render(self, camera: Camera, deadline: Deadline, progress: Callable[[float], None] | None) -> Film:
        width, height = image_size(camera, self.options, self.scene.settings)
        x, y, film_width, film_height = _crop(self.options.crop, width, height)
        film, arrays = _make_film(self.options.aovs, x, y, film_width, film_height, self.device)
        frame = _frame_data(self.options, self.scene)
        frame.camera = camera_data(camera, width, height, self.scene.settings, self._device_scene.origin)
        is_cpu = self.device == "cpu"
        tiles = (
            tiles_of(film_width, film_height, self.options.tile_size) if is_cpu else bands_of(film_width, film_height)
        )
        workers = min(self.threads, len(tiles)) if is_cpu else 1
        rows = 1 if is_cpu else max(tile[2] * tile[3] for tile in tiles)
        scratch = [self._scratch(rows) for _ in range(workers)]

        # Arrays of one, see render_tile.
        shared: list[wp.array] = [
            wp.array([struct], dtype=dtype, device=self.device)
            for struct, dtype in (
                (self._device_scene.data, structs.SceneData),
                (self.accel.data, AccelData),
                (frame, structs.FrameData),
                (film, structs.FilmData),
            )
        ]

        def launch(worker: int, tile: Tile, sample: int) -> None:
            tasks, stacks, counts = scratch[worker]
            inputs = [*shared, tasks, stacks, counts, wp.vec4i(*tile), sample]
            wp.launch(ray_tree.render_tile, dim=tile[2] * tile[3], inputs=inputs, device=self.device)

        samples = self.options.spp
        if is_cpu:
            run_tiles(launch, tiles, samples, threads=workers, deadline=deadline, progress=progress)
        else:
            run_bands(launch, tiles, samples, device=self.device, deadline=deadline, progress=progress)
        counts = sum(counts.numpy().sum(axis=0, dtype=np.int64) for _, _, counts in scratch)
        return self._develop(arrays, np.asarray(counts), camera)

    def _scratch(self, rows: int) -> tuple[wp.array, Any, wp.array]:
        """Return the memory that one worker's launches need: ray tasks, traversal stacks, counters."""
        depth = self.options.depth or DEFAULT_DEPTH
        capacity = 2 * (depth + int(PASS_LIMIT)) + 1  # ray_tree.task_capacity
        tasks = wp.empty(shape=(rows, capacity), dtype=structs.RayTask, device=self.device)
        elements = int(ray_counts.LEVELS) + int(ray_counts.PER_LEVEL) * depth
        counter_rows = 1 if self.device == "cpu" else _CUDA_COUNTER_ROWS
        counts = wp.zeros(shape=(counter_rows, elements), dtype=wp.int64, device=self.device)
        return tasks, make_stacks(self.accel, rows), counts

    def _develop(self, arrays: dict[str, wp.array], counts: np.ndarray, camera: Camera) -> Film:
        """Return the film with samples averaged, exposure applied, and positions in world space."""
        sums = arrays.pop("color").numpy()
        color = sums / np.float32(self.options.spp)
        aovs = {"color": color[..., :3] * np.float32(camera.exposure_scale), "alpha": color[..., 3].copy()}
        aovs |= {name: array.numpy() for name, array in arrays.items()}
        if "position" in aovs:
            world = aovs["position"] + self._device_scene.origin
            aovs["position"] = np.nan_to_num(world, nan=0.0).astype(np.float32)
        height, width = color.shape[:2]
        return Film(
            width=width,
            height=height,
            aovs=aovs,
            rays=RayCounts.from_row(counts),
            prims=self.scene.prims,
            instance_paths=self.scene.instance_paths,
            labels=self.scene.labels,
            facts=_facts(self.scene, self.options, camera),
        )


def _facts(scene: Scene, options: RenderOptions, camera: Camera) -> dict[str, object]:
    facts: dict[str, object] = {"source": scene.source, "camera": camera.path, "time": scene.time}
    facts |= {name: getattr(options, name) for name in ("integrator", "spp", "seed", "depth", "threshold")}
    return {name: value for name, value in facts.items() if value not in (None, "")}


class _clock:
    """Adds the time that a ``with`` block takes to one entry of ``seconds``."""

    def __init__(self, seconds: dict[str, float], stage: str) -> None:
        self._seconds, self._stage = seconds, stage

    def __enter__(self) -> None:
        self._start = time.perf_counter()

    def __exit__(self, *exception: object) -> None:
        self._seconds[self._stage] += time.perf_counter() - self._start


def _resolve(options: RenderOptions, scene: Scene) -> RenderOptions:
    """Return the options with every term that they leave open taken from the scene's settings, else its default."""
    settings = scene.settings

    def first(*values: Any) -> Any:
        return next(value for value in values if value is not None)

    return dataclasses.replace(
        options,
        depth=first(options.depth, settings.depth, DEFAULT_DEPTH),
        threshold=first(options.threshold, settings.threshold, DEFAULT_THRESHOLD),
        ambient=first(options.ambient, settings.ambient, _BLACK),
        background=options.background if options.background is not None else settings.background,
    )


def _frame_data(options: RenderOptions, scene: Scene) -> Any:
    """Return ``kernels.structs.FrameData`` but for its camera."""
    frame = structs.FrameData()
    frame.depth = options.depth
    # A weight is at most the product of sums Kr + Kt; float32's largest number stands for an infinite threshold.
    frame.threshold = min(options.threshold or 0.0, float(np.finfo(np.float32).max))
    frame.ambient = options.ambient
    frame.background = options.background or _BLACK
    frame.background_alpha = 0.0 if options.background is None else 1.0
    frame.shadow_mode = _shadow_mode(options.shadows, scene)
    frame.sample_count = options.spp
    frame.seed = options.seed
    return frame


def _shadow_mode(shadows: str, scene: Scene) -> int:
    """Return the cheapest mode that gives the wanted shadows: where no material lets light through, any hit will do."""
    if shadows == "opaque":
        return int(SHADOW_OPAQUE)
    if not any(_lets_light_through(material, with_whitted=shadows == "transmit") for material in scene.materials):
        return int(SHADOW_OPAQUE)
    return int(SHADOW_TRANSMIT if shadows == "transmit" else SHADOW_AUTO)


def _lets_light_through(material: Material, *, with_whitted: bool) -> bool:
    if material.model == MaterialModel.WHITTED:
        source = material.inputs.get("transmission")
        return with_whitted and source is not None and (_varies(source) or max(source.value[:3]) > 0)
    source = material.inputs.get("opacity")
    return source is not None and (_varies(source) or source.value[0] < 1)


def _varies(source: Any) -> bool:
    return source.texture >= 0 or bool(source.primvar)


def _crop(crop: tuple[int, int, int, int] | None, width: int, height: int) -> tuple[int, int, int, int]:
    if crop is None:
        return 0, 0, width, height
    x, y = crop[:2]
    if x >= width or y >= height:
        raise OptionError(f"crop: {crop} lies outside the picture of {width} x {height} pixels")
    return x, y, min(crop[2], width - x), min(crop[3], height - y)


def _make_film(
    aovs: tuple[str, ...], x: int, y: int, width: int, height: int, device: str
) -> tuple[Any, dict[str, wp.array]]:
    """Return ``kernels.structs.FilmData`` and its arrays by AOV."""
    film = structs.FilmData()
    film.x, film.y = x, y
    arrays = {"color": wp.zeros(shape=(height, width), dtype=wp.vec4, device=device)}
    film.color = arrays["color"]
    mask = 0
    for name, (field, bit, dtype, nothing) in _AOV_FIELDS.items():
        shape = (height, width) if name in aovs else (0, 0)
        array = wp.full(shape=shape, value=dtype(nothing), dtype=dtype, device=device)
        setattr(film, field, array)
        if name in aovs:
            arrays[name] = array
            mask |= int(bit)
    film.aov_mask = mask
    return film, arrays
