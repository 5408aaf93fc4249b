# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""How to render: one frozen dataclass, validated when it is made."""

from __future__ import annotations

import math
from dataclasses import dataclass

from warp_rt.errors import OptionError

INTEGRATORS = ("whitted",)
SHADOWS = ("auto", "opaque", "transmit")
BUILDERS = ("sah", "median", "midpoint", "lbvh")
INTERSECTORS = ("watertight", "moller-trumbore", "plane-projection")
AOVS = ("color", "depth", "distance", "normal", "position", "uv", "primId", "instanceId", "elementId")

DEFAULT_WIDTH = 960  # usdrecord's
DEFAULT_DEPTH = 7
DEFAULT_THRESHOLD = 1.0 / 255.0
MAX_SIZE = 65536  # a side of the image [pixel]
MAX_DEPTH = 1024


@dataclass(frozen=True, kw_only=True)
class RenderOptions:
    """Options of a render. None means: as the stage's render settings say, else the default given here."""

    width: int | None = None
    """Image width [pixel]; default 960. With only one side given, the other follows from the camera's aspect."""
    height: int | None = None
    """Image height [pixel]; default from the camera's aspect ratio, truncated as usdrecord does."""
    spp: int = 1
    """Samples a pixel; one goes through the pixel's centre."""
    integrator: str = "whitted"
    """One of ``INTEGRATORS``."""
    depth: int | None = None
    """Levels of the ray tree; the eye ray is level 1; default 7."""
    threshold: float | None = None
    """Children of the tree whose weight is strictly below are dropped; 0: never; default 1/255."""
    shadows: str = "auto"
    """One of ``SHADOWS``: what a transparent surface does to a shadow ray."""
    ambient: tuple[float, float, float] | None = None
    """Ambient light Ia, linear Rec. 709; default black."""
    background: tuple[float, float, float] | None = None
    """Colour of rays that leave the scene; default black; a visible dome light takes precedence."""
    aovs: tuple[str, ...] = ("color",)
    """Outputs, from ``AOVS``."""
    seed: int = 0
    """Of the sample positions."""
    crop: tuple[int, int, int, int] | None = None
    """x, y, width, height of the part that is rendered, from the top left corner [pixel]; the film has that size."""
    bvh: str = "sah"
    """One of ``BUILDERS``."""
    intersector: str = "watertight"
    """One of ``INTERSECTORS``."""
    threads: int | None = None
    """CPU threads; default: one a core."""
    tile_size: int = 32
    """Side of the square tiles that threads work on [pixel]; never changes the image."""
    time_limit: float | None = None
    """Wall-clock seconds after which rendering ends with a LimitError."""

    def __post_init__(self) -> None:
        _in_range("width", self.width, 1, MAX_SIZE)
        _in_range("height", self.height, 1, MAX_SIZE)
        _in_range("spp", self.spp, 1, 1 << 20)
        _in_range("depth", self.depth, 1, MAX_DEPTH)
        _in_range("threshold", self.threshold, 0.0, math.inf)
        _in_range("seed", self.seed, 0, (1 << 31) - 1)
        _in_range("threads", self.threads, 1, 4096)
        _in_range("tile_size", self.tile_size, 1, MAX_SIZE)
        _in_range("time_limit", self.time_limit, 0.0, math.inf)
        _one_of("integrator", self.integrator, INTEGRATORS)
        _one_of("shadows", self.shadows, SHADOWS)
        _one_of("bvh", self.bvh, BUILDERS)
        _one_of("intersector", self.intersector, INTERSECTORS)
        for aov in self.aovs:
            _one_of("aov", aov, AOVS)
        for name in ("ambient", "background"):
            color = getattr(self, name)
            if color is not None and (len(color) != 3 or not all(math.isfinite(c) for c in color)):
                raise OptionError(f"{name}: three finite numbers expected, got {color!r}")
        if self.crop is not None:
            x, y, width, height = self.crop
            if min(x, y) < 0 or min(width, height) < 1:
                raise OptionError(f"crop: x, y >= 0 and width, height >= 1 expected, got {self.crop!r}")


def _in_range(name: str, value: float | None, low: float, high: float) -> None:
    if value is not None and not low <= value <= high:
        raise OptionError(f"{name}: {value} is outside {low}..{high}")


def _one_of(name: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise OptionError(f"{name}: {value!r} is none of {', '.join(choices)}")
