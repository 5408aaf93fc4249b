# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The film while it is exposed: arrays on the device that kernels add to, and their development into AOVs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from warp_rt.errors import LimitError, OptionError
from warp_rt.kernels import aov, structs

Rectangle = tuple[int, int, int, int]
"""x, y, width, height [pixel], from the picture's top left corner."""

# AOV: the field of FilmData it is written to, its bit, its type there, and what it holds before the first ray.
_FIELDS: dict[str, tuple[str, int, Any, float]] = {
    "depth": ("depth", aov.AOV_DEPTH, wp.float32, np.inf),
    "distance": ("distance", aov.AOV_DISTANCE, wp.float32, np.inf),
    "normal": ("normal", aov.AOV_NORMAL, wp.vec3, 0.0),
    "position": ("position", aov.AOV_POSITION, wp.vec3, np.nan),  # 0 once developed
    "uv": ("uv", aov.AOV_UV, wp.vec2, 0.0),
    "primId": ("prim", aov.AOV_PRIM, wp.int32, -1),
    "instanceId": ("instance", aov.AOV_INSTANCE, wp.int32, -1),
    "elementId": ("element", aov.AOV_ELEMENT, wp.int32, -1),
    "nodesVisited": ("nodes_visited", aov.AOV_NODES_VISITED, wp.int32, 0),
    "triangleTests": ("triangle_tests", aov.AOV_TRIANGLE_TESTS, wp.int32, 0),
    "treeSize": ("tree_size", aov.AOV_TREE_SIZE, wp.int32, 0),
    "deepest": ("deepest", aov.AOV_DEEPEST, wp.int32, 0),
    "rays": ("rays", aov.AOV_RAYS, wp.int32, 0),
}


@dataclass(frozen=True)
class FilmBuffers:
    """What the pixels of one render are written to."""

    data: Any
    """``kernels.structs.FilmData``."""
    arrays: dict[str, wp.array]
    """By AOV; ``color`` is the sum over samples of radiance and alpha."""
    area: Rectangle
    """The part of the picture that is rendered."""

    def develop(self, *, spp: int, exposure: float, origin: np.ndarray) -> dict[str, np.ndarray]:
        """Return the AOVs: samples averaged, the camera's exposure applied, positions in world space.

        Args:
            spp: Samples that each pixel has taken.
            exposure: Linear factor on colour.
            origin: World point that positions are relative to, shape [3].
        """
        aovs = {name: array.numpy() for name, array in self.arrays.items()}
        color = aovs["color"] / np.float32(spp)
        aovs["color"] = color[..., :3] * np.float32(exposure)
        aovs["alpha"] = color[..., 3].copy()
        if "position" in aovs:
            aovs["position"] = np.nan_to_num(aovs["position"] + origin, nan=0.0).astype(np.float32)
        return aovs


def make_film_buffers(aovs: tuple[str, ...], area: Rectangle, device: str) -> FilmBuffers:
    """Return empty buffers for a part of a picture; AOVs that nobody asked for have no elements.

    Raises:
        LimitError: The device has not enough memory.
    """
    x, y, width, height = area
    data = structs.FilmData()
    data.x, data.y = x, y
    wanted = [name for name in _FIELDS if name in aovs]
    try:
        arrays = {"color": wp.zeros(shape=(height, width), dtype=wp.vec4, device=device)}
        for name, (field, _, dtype, nothing) in _FIELDS.items():
            shape = (height, width) if name in wanted else (0, 0)
            array = wp.full(shape=shape, value=dtype(nothing), dtype=dtype, device=device)
            setattr(data, field, array)
            if name in wanted:
                arrays[name] = array
    except RuntimeError as error:  # Warp's word for a failed allocation
        pixel = sum(wp.types.type_size_in_bytes(dtype) for dtype in (wp.vec4, *(_FIELDS[name][2] for name in wanted)))
        size = f"{pixel * width * height / 2**30:.1f} GiB"
        raise LimitError(f"film: {width} x {height} pixels need {size}, more than {device} can give") from error
    data.color = arrays["color"]
    data.aov_mask = sum(int(_FIELDS[name][1]) for name in wanted)
    return FilmBuffers(data, arrays, area)


def crop_area(crop: Rectangle | None, width: int, height: int) -> Rectangle:
    """Return the part of a picture that a crop leaves, cut off at the picture's edges.

    Raises:
        OptionError: Nothing is left.
    """
    if crop is None:
        return 0, 0, width, height
    x, y = crop[:2]
    if x >= width or y >= height:
        raise OptionError(f"crop: {crop} lies outside the picture of {width} x {height} pixels")
    return x, y, min(crop[2], width - x), min(crop[3], height - y)
