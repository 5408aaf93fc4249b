# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Where the scenes of different times come from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from warp_rt.errors import OptionError
from warp_rt.scene import Product, Scene


class SceneSource(Protocol):
    """A stage that is open: it has a scene for every time."""

    def scene(self, time: float | None = None, *, base_time: float | None = None) -> Scene:
        """Return the scene at a time.

        Args:
            time: Time code; None: the stage's start, or its default time where that was asked for.
            base_time: The frame that ``time`` is a moment of, while its shutter is open: points that velocities carry
                are carried from the sample at or before the frame. None: ``time`` is a frame itself.

        Raises:
            OptionError: The time makes no sense.
            LimitError: The stage holds more than can be meant.
        """

    def products(self) -> tuple[Product, ...]:
        """Return the pictures that the render settings ask for.

        Raises:
            SceneError: There are no such settings.
        """


class RefinableSource(SceneSource, Protocol):
    """A stage that is open, whose surfaces may be refined by prim."""

    def scene(
        self, time: float | None = None, *, base_time: float | None = None, levels: Mapping[str, int] | None = None
    ) -> Scene:
        """Return the scene at a time.

        Args:
            time: As for a ``SceneSource``; so too ``base_time`` and the errors.
            base_time: Likewise.
            levels: Refinements of the surfaces of some prims, by path; None: all are refined as the source says.
        """


@dataclass(frozen=True)
class StillScene:
    """A scene without time, as a source."""

    still: Scene
    name: str
    """Of its file."""

    def scene(
        self, time: float | None = None, *, base_time: float | None = None, levels: Mapping[str, int] | None = None
    ) -> Scene:
        """Return the scene, in which there is no surface to refine.

        Raises:
            OptionError: A time is asked for.
        """
        if time is not None:
            raise OptionError(f"{self.name}: time: only of USD stages")
        return self.still

    def products(self) -> tuple[Product, ...]:
        """Return that it asks for none."""
        return ()
