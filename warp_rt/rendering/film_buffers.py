# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The film while it is exposed: arrays on the device that kernels add to, and their development into AOVs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from warp_rt.device.arrays import filled
from warp_rt.errors import LimitError, OptionError, SceneError
from warp_rt.kernels import codes, frame_structs
from warp_rt.options import MAX_SIZE
from warp_rt.scene import Camera, Settings
from warp_rt.upload.device_scene import AovPrimvar

Rectangle = tuple[int, int, int, int]
"""x, y, width, height [pixel], from the picture's top left corner."""

# AOV: the field of FilmData it is written to, its bit, its type there, and what it holds before the first ray.
_FIELDS: dict[str, tuple[str, int, Any, float]] = {
    "depth": ("depth", codes.AOV_DEPTH, wp.float32, np.inf),
    "distance": ("distance", codes.AOV_DISTANCE, wp.float32, np.inf),
    "normal": ("normal", codes.AOV_NORMAL, wp.vec3, 0.0),
    "position": ("position", codes.AOV_POSITION, wp.vec3, np.nan),  # 0 once developed
    "uv": ("uv", codes.AOV_UV, wp.vec2, 0.0),
    "primId": ("prim", codes.AOV_PRIM, wp.int32, -1),
    "instanceId": ("instance", codes.AOV_INSTANCE, wp.int32, -1),
    "elementId": ("element", codes.AOV_ELEMENT, wp.int32, -1),
    "nodesVisited": ("nodes_visited", codes.AOV_NODES_VISITED, wp.int32, 0),
    "triangleTests": ("triangle_tests", codes.AOV_TRIANGLE_TESTS, wp.int32, 0),
    "treeSize": ("tree_size", codes.AOV_TREE_SIZE, wp.int32, 0),
    "deepest": ("deepest", codes.AOV_DEEPEST, wp.int32, 0),
    "rays": ("rays", codes.AOV_RAYS, wp.int32, 0),
}
_ROWS = 16  # of a picture that are developed at once, in cache
# AOVs that follow from another one.
_SOURCES = {"cameraDepth": "depth", "Neye": "normal", "Peye": "position"}


@dataclass(frozen=True)
class FilmBuffers:
    """What the pixels of one render are written to."""

    data: Any
    """``kernels.frame_structs.FilmData``."""
    arrays: dict[str, wp.array]
    """By AOV; ``color`` is the sum over samples of radiance and alpha."""
    area: Rectangle
    """The part of the picture that is rendered."""
    wanted: tuple[str, ...]
    """AOVs that were asked for."""
    primvars: Mapping[str, AovPrimvar]
    """Those of them that are primvars, in the order of ``data.primvars``."""

    def develop(self, *, spp: int, camera: Camera, origin: np.ndarray) -> dict[str, np.ndarray]:
        """Return the AOVs: samples averaged, the camera's exposure applied, positions in world or eye space.

        Args:
            spp: Samples that each pixel has taken.
            camera: Its exposure is a factor on colour.
            origin: World point that positions are relative to, shape [3].
        """
        aovs = {name: array.numpy() for name, array in self.arrays.items()}
        aovs["color"], aovs["alpha"] = _mean_color(aovs["color"], spp, camera.exposure_scale)
        for k, (name, primvar) in enumerate(self.primvars.items()):
            # Components that an instance's value does not have are NaN.
            values = np.nan_to_num(aovs["primvars"][k, ..., : max(primvar.size, 1)])
            aovs[name] = values[..., 0] if primvar.size < 2 else values
        axes = _axes(camera)
        eye_from_world = np.linalg.inv(axes)
        if "cameraDepth" in self.wanted:
            aovs["cameraDepth"] = aovs["depth"].copy()
        if "Neye" in self.wanted:
            aovs["Neye"] = _unit(aovs["normal"] @ axes).astype(np.float32)  # by the inverse transpose, as normals are
        if "position" in aovs:
            world = aovs["position"] + origin
            eye = (world - camera.world_from_camera[:3, 3]) @ eye_from_world.T
            aovs["position"], in_eye = (np.nan_to_num(points, nan=0.0).astype(np.float32) for points in (world, eye))
            if "Peye" in self.wanted:
                aovs["Peye"] = in_eye
        return {name: values for name, values in aovs.items() if name in ("color", "alpha", *self.wanted)}


def _mean_color(sums: np.ndarray, spp: int, exposure: float) -> tuple[np.ndarray, np.ndarray]:
    """Return colour, shape [height, width, 3], and alpha, [height, width], of sums over samples [height, width, 4]."""
    color, alpha = np.empty((*sums.shape[:2], 3), np.float32), np.empty(sums.shape[:2], np.float32)
    for row in range(0, len(sums), _ROWS):
        part = slice(row, row + _ROWS)
        for k in range(3):  # channel by channel: NumPy takes twice as long over axes of three
            np.divide(sums[part, :, k], np.float32(spp), out=color[part, :, k])
        with np.errstate(over="ignore"):  # too bright for single precision: infinite
            color[part] *= np.float32(exposure)
        np.divide(sums[part, :, 3], np.float32(spp), out=alpha[part])
    return color, alpha


def _unit(vectors: np.ndarray) -> np.ndarray:
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(lengths > 0, lengths, 1.0)


def _axes(camera: Camera) -> np.ndarray:
    """Return the camera's axes of unit length as columns, world space: float64, shape [3, 3]."""
    linear = camera.world_from_camera[:3, :3]
    return linear / np.linalg.norm(linear, axis=0)


def make_film_buffers(
    aovs: tuple[str, ...], area: Rectangle, device: str, primvars: Mapping[str, AovPrimvar] | None = None
) -> FilmBuffers:
    """Return empty buffers for a part of a picture; AOVs that nobody asked for have no elements.

    Args:
        aovs: What is asked for.
        area: The part of the picture.
        device: Where.
        primvars: Where the scene has the primvars among ``aovs``.

    Raises:
        LimitError: The device has not enough memory.
    """
    x, y, width, height = area
    data = frame_structs.FilmData()
    data.x, data.y = x, y
    needed = {_SOURCES.get(name, name) for name in aovs}
    wanted = [name for name in _FIELDS if name in needed]
    shown = {name: primvar for name, primvar in (primvars or {}).items() if name in needed}
    try:
        arrays = {"color": filled((height, width), 0.0, wp.vec4, device)}
        for name, (field, _, dtype, nothing) in _FIELDS.items():
            shape = (height, width) if name in wanted else (0, 0)
            array = filled(shape, nothing, dtype, device)
            setattr(data, field, array)
            if name in wanted:
                arrays[name] = array
        layers = (len(shown), height, width) if shown else (0, 0, 0)
        arrays["primvars"] = data.primvars = filled(layers, 0.0, wp.vec4, device)
        slots = [primvar.slot for primvar in shown.values()]
        data.primvar_slots = wp.array(slots, dtype=wp.int32, device=device)
    except (RuntimeError, MemoryError) as error:  # Warp's and NumPy's word for a failed allocation
        types = (wp.vec4, *(_FIELDS[name][2] for name in wanted), *(wp.vec4 for _ in shown))
        pixel = sum(wp.types.type_size_in_bytes(dtype) for dtype in types)
        size = f"{pixel * width * height / 2**30:.1f} GiB"
        raise LimitError(f"film: {width} x {height} pixels need {size}, more than {device} can give") from error
    data.color = arrays["color"]
    data.aov_mask = sum(int(_FIELDS[name][1]) for name in wanted) + (int(codes.AOV_PRIMVARS) if shown else 0)
    return FilmBuffers(data, arrays, area, aovs, shown)


def film_area(crop: Rectangle | None, camera: Camera, settings: Settings, width: int, height: int) -> Rectangle:
    """Return the part of a picture that is made.

    A crop is cut off at the picture's edges. Without one it is the render settings' data window, which may reach beyond
    them: the pixels whose centre it holds (UsdRenderSettingsBase, dataWindowNDC); of a camera whose window is that of
    the picture already, all.

    Args:
        crop: What is asked for; None: nothing.
        camera: Of the picture.
        settings: Of the stage.
        width: Of the whole picture [pixel].
        height: Likewise.

    Raises:
        OptionError: Nothing is left of the crop.
        SceneError: Nothing is left of the data window, or it is too large.
    """
    if crop is None:
        left, bottom, right, top = (0.0, 0.0, 1.0, 1.0) if camera.is_conformed else settings.data_window
        x, x_end = (math.ceil(share * width - 0.5) for share in (left, right))
        y, y_end = (math.ceil((1 - share) * height - 0.5) for share in (top, bottom))
        if x < x_end <= x + MAX_SIZE and y < y_end <= y + MAX_SIZE:
            return x, y, x_end - x, y_end - y
        raise SceneError(f"{settings.path}: dataWindowNDC {settings.data_window} leaves no picture, or one too large")
    x, y = crop[:2]
    if x >= width or y >= height:
        raise OptionError(f"crop: {crop} lies outside the picture of {width} x {height} pixels")
    return x, y, min(crop[2], width - x), min(crop[3], height - y)
