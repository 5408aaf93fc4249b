# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Motion blur: one film, exposed to the scene as it is at several times while the shutter is open.

A picture is the mean of pictures at times within the shutter, so that whatever moves between them blurs: transforms,
points, topology, primvars, the camera; what lights and materials are, their inputs, is that of the frame. Each sample
of a pixel belongs to one of the times, which are stratified; its place in the pixel and on the lens is the one that it
has in a picture without motion.

Reference: Haeberli and Akeley (1990), The Accumulation Buffer: Hardware Support for High-Quality Rendering, SIGGRAPH.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from warp_rt.options import COSTS
from warp_rt.rendering.film import Film
from warp_rt.rendering.film_camera import choose_camera, shutter_of
from warp_rt.rendering.renderer import Renderer
from warp_rt.report import Diagnostic
from warp_rt.scene import Camera, Scene

View = tuple[Scene, "str | Camera | None"]
"""A scene, and the camera that sees it: its name, one of the caller's own, or None for the scene's."""


@dataclass(frozen=True)
class Moment:
    """A time, and the samples of every pixel that are taken then."""

    time: float
    """Time code."""
    samples: range


def plan_moments(frame: float | None, shutter: tuple[float, float], spp: int) -> tuple[Moment, ...]:
    """Return the moments of a picture; none where the frame's own time is all that it shows.

    A shutter that closes as it opens shows that time; one that stays open is divided into as many equal parts as there
    are samples, and the middle of each is a sample's time. A single sample shows the frame's time; so does a
    shutter that closes before it opens, which exposes nothing.

    Args:
        frame: Time code; None: the default time, at which nothing moves.
        shutter: Opening and closing, time codes from the frame's.
        spp: Samples a pixel.
    """
    opens, closes = shutter
    if frame is None or (opens, closes) == (0.0, 0.0) or (opens < closes and spp == 1) or closes < opens:
        return ()
    if opens == closes:
        return (Moment(frame + opens, range(spp)),)
    step = (closes - opens) / spp
    return tuple(Moment(frame + opens + (index + 0.5) * step, range(index, index + 1)) for index in range(spp))


def render_moments(
    renderer: Renderer,
    moments: Sequence[Moment],
    view: Callable[[float], View],
    *,
    camera: str | Camera | None = None,
    progress: Callable[[float], None] | None = None,
) -> Film:
    """Return the mean of the pictures at several moments.

    Colour, alpha and costs are of all moments, and so are the counts; the other AOVs are of the frame's own time, what
    its first sample meets. What the moments take is added to ``renderer.seconds``.

    Args:
        renderer: Of the frame: its scene, options and device. It decides the size of the film and its exposure.
        moments: Which; together they have every sample once.
        view: Gives the scene at a time code, and the camera.
        camera: Of the frame, as for ``Renderer.render``.
        progress: Called now and then from this thread with the finished fraction, 0 to 1.

    Raises:
        WarpRtError: As ``Renderer.render`` and whatever ``view`` raises.
    """
    wanted = renderer.options.aovs
    moving = renderer.start_film(camera, aovs=tuple(aov for aov in wanted if aov == "color" or aov in COSTS))
    aovs = {}
    if still := tuple(aov for aov in wanted if aov not in moving.options.aovs):
        at_frame = renderer.start_film(camera, aovs=still)
        renderer.expose(at_frame, range(1), camera=camera)
        developed = renderer.develop(at_frame).aovs
        aovs = {aov: developed[aov] for aov in still}
    latest, told = renderer, list[Diagnostic]()
    for index, moment in enumerate(moments):
        moving.deadline.check()
        scene, seen_by = view(moment.time)
        told += scene.diagnostics
        latest = Renderer(scene, renderer.options, device=renderer.device, previous=latest)
        latest.expose(moving, moment.samples, camera=seen_by)
        for stage, seconds in latest.seconds.items():
            renderer.seconds[stage] += seconds
        if progress is not None:
            progress((index + 1) / len(moments))
    film = renderer.develop(moving)
    return replace(film, aovs={**film.aovs, **aovs}, diagnostics=tuple(dict.fromkeys([*film.diagnostics, *told])))


def render_frame(
    renderer: Renderer,
    view: Callable[[float], View],
    *,
    camera: str | Camera | None = None,
    progress: Callable[[float], None] | None = None,
) -> tuple[Film, int]:
    """Return the picture of a frame, blurred by what moves while the shutter is open, and how many moments it shows.

    Args:
        renderer: Of the frame.
        view: Gives the scene at other times, and the camera.
        camera: As for ``Renderer.render``; likewise ``progress`` and what is raised.
        progress: Called now and then.
    """
    chosen = camera if isinstance(camera, Camera) else choose_camera(renderer.scene, camera)
    shutter = shutter_of(chosen, renderer.scene.settings) if chosen is not None else (0.0, 0.0)
    moments = plan_moments(renderer.scene.time, shutter, renderer.options.spp)
    if not moments:
        return renderer.render(camera=camera, progress=progress), 1
    return render_moments(renderer, moments, view, camera=camera, progress=progress), len(moments)
