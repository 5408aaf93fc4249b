# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The ray trees of a pixel's samples, the pixel's value, and how it was traced."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from warp_rt.image.color import display, unpremultiply
from warp_rt.image.tone import check_display
from warp_rt.tree.nodes import Color, Fate, RayKind, TreeNode


@dataclass(frozen=True)
class PixelTree:
    """What a ``RayTree`` holds: one root for each sample of a pixel."""

    x: int
    """Column of the pixel, 0 on the left; of the film, which may be a crop of the picture."""
    y: int
    """Row, 0 at the top."""
    width: int
    """Of the film [pixel]."""
    height: int
    roots: tuple[TreeNode, ...]
    """The eye ray's node of each sample."""
    samples: tuple[int, ...]
    """Which sample each root is of."""
    value: Color
    """What the film has in this pixel where all samples are here: their mean, camera exposure applied; float32."""
    alpha: float
    exposure_scale: float
    """Linear factor of the camera."""
    spp: int
    depth: int
    """Levels that the tree may have."""
    threshold: float
    camera: str
    """Path."""
    source: str
    """File that the scene was read from, or empty."""
    time: float | None
    exposure: float = 0.0
    """Stops, for :attr:`rgb8`."""
    tonemap: str = "srgb"
    scene_size: float = field(default=1.0, repr=False)
    """Diagonal of the scene's bounds."""

    def __post_init__(self) -> None:
        check_display(self.exposure, self.tonemap)

    @property
    def root(self) -> TreeNode:
        """The eye ray's node, of the first sample."""
        return self.roots[0]

    @property
    def is_whole(self) -> bool:
        """Whether all samples of the pixel are here."""
        return len(self.samples) == self.spp

    def __iter__(self) -> Iterator[TreeNode]:
        """Yield every node of every sample, in the order of tracing."""
        for root in self.roots:
            yield from root.walk()

    def __len__(self) -> int:
        """Return the number of nodes."""
        return sum(root.size for root in self.roots)

    @cached_property
    def rgb8(self) -> Color:
        """The pixel's value in a PNG: straight alpha, exposed and toned, 0 to 255."""
        straight = unpremultiply(np.array([[self.value]], np.float32), np.array([[self.alpha]], np.float32))
        red, green, blue = display(straight, exposure=self.exposure, tonemap=self.tonemap)[0, 0].tolist()
        return red, green, blue

    @cached_property
    def counts(self) -> dict[str, int]:
        """Rays by kind, total internal reflections, and children dropped by depth and by threshold."""
        result = dict.fromkeys(("nodes", "reflection", "refraction", "passage", "shadow"), 0)
        result |= {"total_internal_reflection": 0, "dropped_by_threshold": 0, "dropped_by_depth": 0, "deepest": 0}
        for node in self:
            result["nodes"] += 1
            if node.kind is not RayKind.EYE:
                result[node.kind.name.lower()] += 1
            result["shadow"] += sum(light.shadow_rays for light in node.lights)
            fates = (node.reflection, node.refraction)
            result["total_internal_reflection"] += node.is_totally_reflected
            result["dropped_by_threshold"] += fates.count(Fate.THRESHOLD)
            result["dropped_by_depth"] += fates.count(Fate.DEPTH)
            result["deepest"] = max(result["deepest"], node.depth)
        return result
