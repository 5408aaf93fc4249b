# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a stage's render settings ask for: terms of the model, products and their layers."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Settings:
    """What the stage's RenderSettings ask for; None where they say nothing."""

    path: str = ""
    """Of the RenderSettings, or of the RenderProduct whose settings they are."""
    resolution: tuple[int, int] | None = None
    data_window: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 1.0)
    """Part of the picture that is made: left, bottom, right, top, as shares of its sides from the bottom left."""
    pixel_aspect_ratio: float = 1.0
    aspect_policy: str = "expandAperture"
    camera: str | None = None
    ambient: tuple[float, float, float] | None = None
    background: tuple[float, float, float] | None = None
    depth: int | None = None
    threshold: float | None = None
    disables_depth_of_field: bool = False
    light_samples: int | None = None
    disables_motion_blur: bool = False
    has_instantaneous_shutter: bool = False
    """Whether shutters close as soon as they open."""


@dataclass(frozen=True)
class RenderVar:
    """A layer of a product."""

    path: str
    layer: str
    """Its name in the file."""
    aov: str
    """Of ``options.AOVS``, ``primvars:NAME``, or ``alpha``."""
    is_half: bool = False
    """Whether 16-bit floats are asked for."""


@dataclass(frozen=True)
class Product:
    """A picture that the render settings ask for."""

    path: str
    name: str
    """Its file, as the stage says it; empty: the stage does not."""
    settings: Settings
    """What the product authors itself, else the render settings."""
    variables: tuple[RenderVar, ...] = ()
    """In order; none: colour."""
    names: tuple[tuple[float, str], ...] = ()
    """Where the stage says the file for times: time codes, ascending, and the name from then on. Else ``name`` is that
    of all times."""

    def name_at(self, time: float | None) -> str:
        """Return its file at a time code, as the stage says it; None: at the default time."""
        if time is None or not self.names:
            return self.name
        return next((name for begin, name in reversed(self.names) if begin <= time), self.names[0][1])
