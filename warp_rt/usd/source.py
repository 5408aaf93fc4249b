# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A stage that is opened once and read at any number of times."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace

from pxr import Usd

from warp_rt.options import RECORD_PURPOSES
from warp_rt.report import Report
from warp_rt.scene import Product, Scene
from warp_rt.usd.image_cache import KeptImages
from warp_rt.usd.load import load_stage
from warp_rt.usd.settings import read_settings, settings_of_pass
from warp_rt.usd.stage import captured_warnings, open_stage


class StageSource:
    """The scenes of a stage, by time: a ``SceneSource``.

    Args:
        path_or_stage: A usda, usdc, usd or usdz file, or an open stage, which is read and not changed.
        mask: Prims that a file is composed of, see ``open_stage``.
        session_layer: Layer stronger than the file.
        default_time: Whether no time means the default time, not the stage's start.
        purposes: As for ``load_stage``; so too the arguments that follow.
        default_purposes: Those where nobody says which.
        settings_path: RenderSettings prim.
        pass_path: RenderPass prim.
        level: Refinements of subdivision surfaces.
        draw_modes: Whether models are replaced as their draw modes say.

    Raises:
        SceneError: The file is missing or is not USD.
        OptionError: The mask names no prim.
    """

    def __init__(
        self,
        path_or_stage: str | os.PathLike[str] | Usd.Stage,
        *,
        mask: Sequence[str] = (),
        session_layer: str | os.PathLike[str] | None = None,
        default_time: bool = False,
        purposes: tuple[str, ...] | None = None,
        default_purposes: tuple[str, ...] = RECORD_PURPOSES,
        settings_path: str | None = None,
        pass_path: str | None = None,
        level: int = 0,
        draw_modes: bool = True,
    ) -> None:
        report = Report()
        if isinstance(path_or_stage, Usd.Stage):
            self._stage, self._source = path_or_stage, path_or_stage.GetRootLayer().realPath
        else:
            with captured_warnings(report):
                self._stage, self._source = open_stage(path_or_stage, mask, session_layer), os.fspath(path_or_stage)
        self._told = tuple(report)
        self._is_own = not isinstance(path_or_stage, Usd.Stage)  # so that nobody changes it meanwhile
        self._latest: tuple[tuple[float | None, Mapping[str, int] | None], Scene] | None = None
        self._images = KeptImages()
        self._default_time = default_time
        self._purposes = purposes
        self._default_purposes = default_purposes
        self._settings_path = settings_path
        self._pass_path = pass_path
        self._level = level
        self._draw_modes = draw_modes

    def products(self) -> tuple[Product, ...]:
        """Return the products of the render settings, of which ``scene`` tells what is odd."""
        report = Report()
        with captured_warnings(report):
            path = self._settings_path
            if self._pass_path is not None:
                path = settings_of_pass(self._stage, self._pass_path, report)
            return read_settings(self._stage, report, path).products

    def scene(
        self, time: float | None = None, *, base_time: float | None = None, levels: Mapping[str, int] | None = None
    ) -> Scene:
        """Return the scene at a time; arguments and errors as ``load_stage`` has them.

        Its images are those of the scene before, the same objects, where the files are the same.
        """
        asked = (time, levels)
        if self._latest is not None and base_time is None and self._latest[0] == asked:
            return self._latest[1]  # another picture of the same frame
        scene = load_stage(
            self._stage,
            time=time,
            default_time=self._default_time,
            purposes=self._purposes,
            default_purposes=self._default_purposes,
            settings_path=self._settings_path,
            pass_path=self._pass_path,
            level=self._level,
            draw_modes=self._draw_modes,
            base_time=base_time,
            levels=levels,
            images=self._images,
        )
        self._images.end_scene()
        scene = replace(scene, source=self._source, diagnostics=(*self._told, *scene.diagnostics))
        if base_time is None and self._is_own:
            self._latest = asked, scene
        return scene
