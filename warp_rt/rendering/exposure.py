# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A film while it is exposed, by one renderer or by several in turn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from warp_rt.device.launch import Deadline
from warp_rt.options import RenderOptions
from warp_rt.rendering.film_buffers import FilmBuffers
from warp_rt.scene import Camera


@dataclass
class Exposure:
    """What samples are added to, until the film is developed."""

    options: RenderOptions
    """Resolved."""
    camera: Camera
    """Of the frame: it gives the film its size and its exposure."""
    size: tuple[int, int]
    """Width and height of the whole picture [pixel]."""
    buffers: FilmBuffers
    deadline: Deadline
    """When to give up."""
    counts: Any = 0
    """Counter row: the rays so far."""
