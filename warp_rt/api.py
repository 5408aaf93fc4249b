# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The two calls that most people need: load a stage, render a stage."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields, replace
from inspect import Parameter, signature
from os import PathLike
from typing import TYPE_CHECKING, Any

from warp_rt.errors import OptionError, SceneError
from warp_rt.image.tone import check_display
from warp_rt.near_matches import near_matches
from warp_rt.nff.statements import is_nff
from warp_rt.options import (
    ADAPTIVE,
    COMPLEXITIES,
    DEFAULT_DEPTH,
    RECORD_PURPOSES,
    RenderOptions,
    check_depths,
    check_mask,
    check_purposes,
    refinement_level,
)
from warp_rt.report import abridged, one_line
from warp_rt.scene import Camera, Scene
from warp_rt.scene.source import RefinableSource, SceneSource, StillScene

if TYPE_CHECKING:
    from warp_rt.image.depth_series import DepthSeries
    from warp_rt.image.image import Image
    from warp_rt.tree.ray_tree import RayTree

_logger = logging.getLogger("warp_rt")


def open_scene(
    path_or_stage: str | PathLike[str] | Any,
    *,
    default_time: bool = False,
    purposes: tuple[str, ...] | None = None,
    default_purposes: tuple[str, ...] = RECORD_PURPOSES,
    complexity: str = COMPLEXITIES[0],
    mask: Sequence[str] = (),
    session_layer: str | PathLike[str] | None = None,
    render_settings: str | None = None,
    render_pass: str | None = None,
    draw_modes: bool = True,
) -> RefinableSource:
    """Open a USD stage, or a file in Haines' Neutral File Format, whose scenes of several times are wanted.

    ``open_scene("a.usda").scene(3)`` is ``load_scene("a.usda", time=3)``, but reads the file only once.

    Args:
        path_or_stage: A .usda, .usdc, .usd or .usdz file, an open ``Usd.Stage``, or a .nff or .nff.gz file, for which
            none of the other arguments count.
        default_time: Read the default values where no time is asked for; else those of the stage's start time code.
        purposes: Purposes to draw besides ``default``, from ``options.PURPOSES``; None: those that the render settings
            author, else ``default_purposes``.
        default_purposes: usdrecord's, ``default`` and ``proxy``; ``options.PRODUCT_PURPOSES`` are those of the schema.
        complexity: Of subdivision surfaces: ``low`` draws their cages, as usdrecord does by default; ``medium``,
            ``high`` and ``veryhigh`` refine them 1, 2 and 3 times, with points and normals of the limit surface.
            What renders takes ``auto`` too: each surface as often as its edges are large in the picture.
        mask: Paths of the prims that a file is composed of, with all above and below them; none: all of it.
        session_layer: A layer that a file is opened with, stronger than the file itself.
        render_settings: Path of the RenderSettings prim; None: the one that the stage's metadata name.
        render_pass: Path of a RenderPass prim, whose ``renderSource`` is the RenderSettings prim.
        draw_modes: Whether models are replaced by boxes, axes or cards as ``model:drawMode`` says.

    Raises:
        SceneError: The file cannot be read, or it is neither a path nor a stage.
        OptionError: A purpose or complexity is unknown, or the mask names no prim.
    """
    check_purposes(purposes)
    check_purposes(default_purposes)
    mask = check_mask(mask)
    level = refinement_level(complexity)
    for name, prim in (("render_settings", render_settings), ("render_pass", render_pass)):
        if prim is not None and not isinstance(prim, str):
            raise OptionError(f"{name}: the path of a prim expected, got {prim!r}")
    # What makes a stage is told by name, for pxr is not to be loaded here.
    if not isinstance(path_or_stage, str | PathLike) and not hasattr(path_or_stage, "GetPseudoRoot"):
        raise SceneError(f"a path or an open Usd.Stage expected, got {type(path_or_stage).__name__}")
    if isinstance(path_or_stage, str | PathLike) and is_nff(path_or_stage):
        from warp_rt.nff.load import load_nff

        asked = {"default_time": default_time, "purposes": purposes is not None}
        asked |= {"mask": bool(mask), "session_layer": session_layer is not None}
        asked |= {"render_settings": render_settings is not None, "render_pass": render_pass is not None}
        asked |= {"draw_modes": not draw_modes}
        options = {"draw_modes": "disable-draw-mode"}
        given = [
            f"{name} (--{options.get(name, name.replace('_', '-'))})" for name, is_given in asked.items() if is_given
        ]
        if given:
            raise OptionError(f"{path_or_stage}: {', '.join(given)}: only of USD stages")
        return StillScene(load_nff(path_or_stage), str(path_or_stage))
    from warp_rt.usd.source import StageSource

    return StageSource(
        path_or_stage,
        mask=mask,
        session_layer=session_layer,
        default_time=default_time,
        purposes=purposes,
        default_purposes=default_purposes,
        settings_path=render_settings,
        pass_path=render_pass,
        level=level,
        draw_modes=draw_modes,
    )


def load_scene(
    path_or_stage: str | PathLike[str] | Any,
    *,
    time: float | None = None,
    default_time: bool = False,
    purposes: tuple[str, ...] | None = None,
    complexity: str = COMPLEXITIES[0],
    mask: Sequence[str] = (),
    session_layer: str | PathLike[str] | None = None,
    render_settings: str | None = None,
    render_pass: str | None = None,
    draw_modes: bool = True,
) -> Scene:
    """Return the scene that a USD stage, or a file in Haines' Neutral File Format, holds at one time.

    What its pictures will not show as the stage says it is in ``Scene.diagnostics``, and goes to the log ``warp_rt``:
    warnings as such, notes as information.

    Args:
        path_or_stage: As for :func:`open_scene`; so too the arguments that are not here.
        time: Time code; None: the stage's start time code, as usdrecord does.
        default_time: Read the default values instead of a time code.

    Raises:
        SceneError: The file cannot be read, it is neither a path nor a stage, or there are no such settings.
        OptionError: A purpose or complexity is unknown, the mask names no prim, or the time makes no sense.
        LimitError: The stage holds more than can be meant.
    """
    source = open_scene(
        path_or_stage,
        default_time=default_time,
        purposes=purposes,
        complexity=complexity,
        mask=mask,
        session_layer=session_layer,
        render_settings=render_settings,
        render_pass=render_pass,
        draw_modes=draw_modes,
    )
    return _told(source.scene(time))


def render(
    scene: str | PathLike[str] | Scene | Any,
    *,
    camera: str | Camera | None = None,
    time: float | None = None,
    complexity: str = COMPLEXITIES[0],
    device: str = "auto",
    exposure: float = 0.0,
    tonemap: str = "srgb",
    **options: Any,
) -> Image:
    """Return the picture of a stage, blurred by what moves while the camera's shutter is open if ``spp`` is above 1.

    What it does not show as the stage says it is in ``image.film.diagnostics``, and is logged as by :func:`load_scene`.

    Args:
        scene: A USD file, an open ``Usd.Stage``, or a :class:`Scene`, which is a single moment: nothing blurs.
        camera: Path or name of the camera, or a camera of one's own.
        time: Time code; None: the stage's start.
        complexity: Of subdivision surfaces, see :func:`open_scene`.
        device: ``auto``, ``cpu`` or ``cuda:N``.
        exposure: Stops by which the picture is brightened when it is saved or shown.
        tonemap: Tone curve of 8-bit pictures, ``srgb`` or ``raw``.
        **options: Fields of :class:`RenderOptions`.

    Raises:
        WarpRtError: See the kinds in ``warp_rt.errors``.
    """
    from warp_rt.image.image import Image
    from warp_rt.rendering.renderer import Renderer
    from warp_rt.rendering.shutter import render_frame

    chosen = _options(options, render)
    if isinstance(scene, Scene):
        return Image(Renderer(scene, chosen, device=device).render(camera=camera), exposure=exposure, tonemap=tonemap)
    source = _open(scene, complexity, chosen, camera)
    frame = _told(source.scene(time))
    film, _ = render_frame(
        Renderer(frame, chosen, device=device),
        lambda moment: (source.scene(moment, base_time=frame.time), camera),
        camera=camera,
    )
    return Image(film, exposure=exposure, tonemap=tonemap)


def render_series(
    scene: str | PathLike[str] | Scene | Any,
    depths: Iterable[int] = range(1, DEFAULT_DEPTH + 1),
    *,
    camera: str | Camera | None = None,
    time: float | None = None,
    device: str = "auto",
    exposure: float = 0.0,
    tonemap: str = "srgb",
    **options: Any,
) -> DepthSeries:
    """Return the pictures of a stage at growing depth of the ray tree, each compared with the one before.

    The stage is read, uploaded and its hierarchies built once; each picture is the one that ``render`` gives.

    Args:
        scene: As for :func:`render`; so too the arguments that are not here.
        depths: Growing, from 1 on.
        camera: Path or name of the camera, or a camera of one's own.
        time: Time code; None: the stage's start.
        device: ``auto``, ``cpu`` or ``cuda:N``.
        exposure: Stops by which the pictures are brightened where they are saved or shown.
        tonemap: Tone curve of 8-bit pictures, ``srgb`` or ``raw``.
        **options: Fields of :class:`RenderOptions`, all but ``depth``.

    Raises:
        WarpRtError: See the kinds in ``warp_rt.errors``.
    """
    from warp_rt.image.depth_series import make_series
    from warp_rt.rendering.renderer import Renderer

    wanted = check_depths(tuple(depths))
    if "depth" in options:
        raise OptionError("depth: a series has many; give depths instead")
    check_display(exposure, tonemap)
    loaded = scene if isinstance(scene, Scene) else load_scene(scene, time=time)
    renderer = Renderer(loaded, _options(options, render_series), device=device)
    films = [renderer.render(camera=camera, depth=depth) for depth in wanted]
    return make_series(wanted, films, exposure=exposure, tonemap=tonemap)


def trace_tree(
    scene: str | PathLike[str] | Scene | Any,
    x: int,
    y: int,
    *,
    sample: int | None = None,
    camera: str | Camera | None = None,
    time: float | None = None,
    complexity: str = COMPLEXITIES[0],
    device: str = "auto",
    exposure: float = 0.0,
    tonemap: str = "srgb",
    **options: Any,
) -> RayTree:
    """Return the ray tree of a pixel of the picture that ``render`` gives with the same arguments.

    Args:
        scene: A USD file, an open ``Usd.Stage``, or a :class:`Scene`.
        x: Column of the pixel, 0 on the left; with ``crop``, of what it leaves.
        y: Row; 0 at the top.
        sample: Which of the pixel's ``spp`` samples; None: all, one tree each.
        camera: Path or name of the camera, or a camera of one's own.
        time: Time code; None: the stage's start.
        complexity: Of subdivision surfaces, see :func:`open_scene`.
        device: ``auto``, ``cpu`` or ``cuda:N``.
        exposure: Stops, for the 8-bit value.
        tonemap: Tone curve of the 8-bit value, ``srgb`` or ``raw``.
        **options: Fields of :class:`RenderOptions`.

    Raises:
        OptionError: There is no such pixel, sample or option.
        LimitError: The tree has more than 262,144 nodes.
        WarpRtError: See the kinds in ``warp_rt.errors``.
    """
    from warp_rt.rendering.renderer import Renderer
    from warp_rt.rendering.tree_pixel import check_pixel_of, check_request

    check_display(exposure, tonemap)
    chosen = _options(options, trace_tree)
    samples = None if sample is None else (sample,)
    check_request((x, y), samples, chosen)
    loaded = scene if isinstance(scene, Scene) else _told(_open(scene, complexity, chosen, camera).scene(time))
    check_pixel_of(loaded, (x, y), chosen, camera)
    tree = Renderer(loaded, chosen, device=device).trace_tree(x, y, camera=camera, samples=samples)
    return replace(tree, exposure=exposure, tonemap=tonemap)


def _open(
    scene: str | PathLike[str] | Any, complexity: str, options: RenderOptions, camera: str | Camera | None
) -> SceneSource:
    """Open a stage for pictures of one camera, which complexity ``auto`` refines surfaces for."""
    if complexity != ADAPTIVE:
        return open_scene(scene, complexity=complexity)
    from warp_rt.rendering.adaptive import AdaptiveSource

    return AdaptiveSource(open_scene(scene), options, lambda seen: (seen, camera))


def _told(scene: Scene) -> Scene:
    """Log what pictures of a scene will not show as the stage says it, and return the scene."""
    for record, more in abridged(scene.diagnostics):
        text = f"{record.code}: and {more} more of this kind (Scene.diagnostics names them all)" if more else record
        _logger.log(logging.WARNING if record.is_warning else logging.INFO, one_line(text))
    return scene


def _options(given: dict[str, Any], call: Callable[..., Any]) -> RenderOptions:
    """Return the options that a function of this file was given beside its own arguments.

    Raises:
        OptionError: One of them is none.
    """
    known = [field.name for field in fields(RenderOptions)]
    for name in given:
        if name in known:
            continue
        if name in _keywords(load_scene):
            raise OptionError(f"{name}: load_scene takes it, and {call.__name__} takes the scene that it returns")
        all_known = [*known, *_keywords(call)]
        hint = near_matches(name, all_known) or f"; there are {', '.join(all_known)}"
        raise OptionError(f"{name}: unknown option{hint}")
    return RenderOptions(**given)


def _keywords(call: Callable[..., Any]) -> list[str]:
    """Return the names of a function's arguments that are given by name."""
    return [name for name, parameter in signature(call).parameters.items() if parameter.kind is Parameter.KEYWORD_ONLY]
