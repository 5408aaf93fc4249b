# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The film: what a render leaves behind, as NumPy arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import warp as wp

from warp_rt.kernels import ray_counts as elements
from warp_rt.report import Diagnostic
from warp_rt.scene import Camera


@dataclass(frozen=True)
class DepthCounts:
    """The rays of one level of the ray tree."""

    depth: int
    nodes: int
    """Rays traced at this depth: the eye rays at depth 1, else reflection and refraction rays."""
    reflection: int
    refraction: int
    shadow: int
    """Shadow rays cast from the nodes of this depth."""
    dropped_by_threshold: int
    """Children of the nodes of this depth that were not traced; so too ``dropped_by_depth``."""
    dropped_by_depth: int


@dataclass(frozen=True)
class RayCounts:
    """Exact ray counts of a render."""

    primary: int
    reflection: int
    refraction: int
    shadow: int
    total_internal_reflection: int
    dropped_by_depth: int
    dropped_by_threshold: int
    passed: int
    """Straight alpha pass-throughs, which are no bounces."""
    deepest: int
    """Deepest level that a ray was traced at."""
    per_depth: tuple[DepthCounts, ...]

    @property
    def total(self) -> int:
        """Rays of all kinds."""
        return self.primary + self.reflection + self.refraction + self.shadow

    @staticmethod
    def from_row(row: np.ndarray) -> RayCounts:
        """Return the counts that a counter row of the kernel holds: int64, shape [LEVELS + depth * PER_LEVEL]."""
        levels = row[int(elements.LEVELS) :].reshape(-1, int(elements.PER_LEVEL))
        primary = int(row[int(elements.PRIMARY)])
        beyond = int(row[int(elements.DROPPED_BY_DEPTH)])
        per_depth = []
        for depth, (reflection, refraction, shadow, below) in enumerate(levels.tolist(), start=1):
            nodes = reflection + refraction + (primary if depth == 1 else 0)
            too_deep = beyond if depth == len(levels) else 0  # only the last level's children are
            per_depth.append(DepthCounts(depth, nodes, reflection, refraction, shadow, below, too_deep))
        while per_depth and not per_depth[-1].nodes:
            per_depth.pop()
        return RayCounts(
            primary=primary,
            reflection=sum(level.reflection for level in per_depth),
            refraction=sum(level.refraction for level in per_depth),
            shadow=sum(level.shadow for level in per_depth),
            total_internal_reflection=int(row[int(elements.TOTAL_INTERNAL_REFLECTION)]),
            dropped_by_depth=beyond,
            dropped_by_threshold=sum(level.dropped_by_threshold for level in per_depth),
            passed=int(row[int(elements.PASSED)]),
            deepest=len(per_depth),
            per_depth=tuple(per_depth),
        )

    def to_json(self) -> dict[str, Any]:
        """Return the counts as the ``rays`` object of ``render --json``."""
        return {
            "primary": self.primary,
            "reflection": self.reflection,
            "refraction": self.refraction,
            "shadow": self.shadow,
            "total_internal_reflection": self.total_internal_reflection,
            "dropped_by_depth": self.dropped_by_depth,
            "dropped_by_threshold": self.dropped_by_threshold,
            "passed": self.passed,
            "deepest": self.deepest,
            "per_depth": [vars(level) for level in self.per_depth],
        }


@dataclass(frozen=True)
class Film:
    """A finished picture and its AOVs, linear and unclamped, row 0 at the top."""

    width: int
    height: int
    aovs: Mapping[str, np.ndarray]
    """By the names of ``options.AOVS``, shape [height, width] or [height, width, n].

    Always there: ``color``, float32, n = 3, linear Rec. 709, premultiplied by ``alpha``, camera exposure applied; and
    ``alpha``, float32. On demand: ``depth``, also called ``cameraDepth``, along the view axis, and ``distance`` along
    the eye ray [scene unit], float32, infinite where nothing was met; ``normal`` (unit shading normal) and
    ``position``, n = 3, world space, ``Neye`` and ``Peye``, the same in the camera's space, and ``uv``, n = 2, float32,
    zero where nothing was met; ``primId``, ``instanceId``, ``elementId`` (the face), int32, -1 where nothing was met;
    ``primvars:NAME``, float32, n = 1 to 4, zero where there is none; ``nodesVisited``, ``triangleTests``, ``treeSize``
    and ``rays``, sums over the pixel's samples, and ``deepest``, the deepest level of any, int32."""
    rays: RayCounts
    prims: tuple[str, ...] = ()
    """Path of each primId."""
    instance_paths: Sequence[str] = ()
    """Path of each instanceId."""
    labels: Mapping[str, Mapping[str, tuple[str, ...]]] = field(default_factory=dict)
    facts: Mapping[str, object] = field(default_factory=dict)
    """How it was made: source, camera, time, integrator, spp, light samples, seed, depth, threshold. No clock:
    equal renders, equal files."""
    data_window: tuple[int, int, int, int] | None = None
    """Where it lies in the picture, of which the render settings ask for a part, or for more: x and y of its top left
    pixel, width and height of the picture [pixel]. None: it is the picture."""
    pixel_aspect_ratio: float = 1.0
    """Width by height of a pixel as it is to be shown."""
    camera: Camera | None = None
    """What it was seen through, whose window is what the film shows: rendered with it, and the film's width and height,
    the scene gives this film. ``camera.intrinsics(width, height)`` is its calibration matrix."""
    diagnostics: tuple[Diagnostic, ...] = ()
    """Everything that it does not show as the stage says it, and the defaults that stepped in."""

    @property
    def color(self) -> np.ndarray:
        """Linear colour: float32, shape [height, width, 3]."""
        return self.aovs["color"]

    def as_warp(self, aov: str) -> wp.array:
        """Return an AOV as a Warp array over the same memory, on the CPU: [height, width] of scalars or vectors."""
        array = self.aovs[aov]
        scalar = wp.int32 if array.dtype == np.int32 else wp.float32
        dtype = scalar if array.ndim == 2 else wp.types.vector(length=array.shape[2], dtype=scalar)
        return wp.array(np.ascontiguousarray(array), dtype=dtype, device="cpu", copy=False)

    @property
    def alpha(self) -> np.ndarray:
        """Coverage: float32, shape [height, width]."""
        return self.aovs["alpha"]

    def __repr__(self) -> str:
        return f"<warp_rt.Film {self.width} x {self.height}: {', '.join(self.aovs)}; {self.rays.total:,} rays>"
