# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A USD stage to a Scene."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from pxr import Tf, Usd

from warp_rt.errors import LimitError, SceneError
from warp_rt.options import RECORD_PURPOSES
from warp_rt.report import Report
from warp_rt.scene import Camera, Dome, Instances, Light, Material, Mesh, Scene, Shapes
from warp_rt.usd.cameras import read_camera, report_hidden, report_unexposed
from warp_rt.usd.draw_modes import StandInReader
from warp_rt.usd.drawable import drawable_instances
from warp_rt.usd.gprims import GprimReader, Gprims
from warp_rt.usd.ies import ProfileCache
from warp_rt.usd.image_cache import KeptImages
from warp_rt.usd.image_reach import report_beyond_images
from warp_rt.usd.lights import read_lights
from warp_rt.usd.linking import LinkReader
from warp_rt.usd.materials import MaterialReader
from warp_rt.usd.mesh_lights import MeshLightReader
from warp_rt.usd.missing_primvars import report_missing_primvars
from warp_rt.usd.motion import without_idle_shutters
from warp_rt.usd.placement import Group, PlacedPrim
from warp_rt.usd.render_pass import PassCollections, without_unused
from warp_rt.usd.rendering_space import RenderingSpace
from warp_rt.usd.settings import RenderTerms, read_settings, report_missing_camera, report_unused, settings_of_pass
from warp_rt.usd.stage import (
    captured_warnings,
    error_text,
    open_stage,
    report_composition,
    report_frame_outside,
    stage_meters_per_unit,
    stage_name,
    stage_time,
    stage_time_range,
    stage_up_axis,
)
from warp_rt.usd.walk import StageWalk

UNREADABLE = "W420"
NOTHING_DRAWN = "N905"


@contextmanager
def _without_collector() -> Iterator[None]:
    """Keep Python's cycle collector from looking through all prims again and again: nothing here makes cycles.

    Around a function, so that it finds what is returned, and no longer what was needed on the way.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            if not gc.get_freeze_count():
                # What was read is old at once, and not looked through by the next collections of young objects.
                gc.freeze()
                gc.unfreeze()
            gc.enable()


@_without_collector()
def load_stage(
    path_or_stage: str | os.PathLike[str] | Usd.Stage,
    *,
    time: float | None = None,
    default_time: bool = False,
    purposes: tuple[str, ...] | None = None,
    default_purposes: tuple[str, ...] = RECORD_PURPOSES,
    mask: Sequence[str] = (),
    session_layer: str | os.PathLike[str] | None = None,
    settings_path: str | None = None,
    pass_path: str | None = None,
    level: int = 0,
    draw_modes: bool = True,
    base_time: float | None = None,
    levels: Mapping[str, int] | None = None,
    images: KeptImages | None = None,
) -> Scene:
    """Return the scene that a stage shows at one time.

    Args:
        path_or_stage: A usda, usdc, usd or usdz file, or an open stage, which is read and not changed.
        time: Time code; None: the stage's startTimeCode, or 0.
        default_time: Read default values, those of no time, instead.
        purposes: Purposes that are drawn, with ``default`` in any case; None: those of the render settings where
            they are authored, else ``default_purposes``.
        default_purposes: Purposes that are drawn where neither the caller nor the render settings say which.
        mask: Prims that a file is composed of, see ``open_stage``.
        session_layer: Layer stronger than the file.
        settings_path: RenderSettings prim; None: the one that the stage's metadata name.
        pass_path: RenderPass prim, whose ``renderSource`` is the RenderSettings prim.
        level: Refinements of subdivision surfaces.
        draw_modes: Whether models are replaced as their draw modes say.
        base_time: The frame that ``time`` is a moment of, while its shutter is open: velocities carry points from the
            sample at or before the frame. None: ``time`` is a frame itself.
        levels: Refinements of the surfaces of some prims, by path.
        images: What scenes before have read of image files.

    Raises:
        SceneError: The file is missing or is not USD, or there are no such settings.
        LimitError: The stage holds more prims or instances than can be meant.
        OptionError: ``time`` makes no sense.
    """
    report = Report()
    with captured_warnings(report), _readable(path_or_stage):
        stage, source = _opened(path_or_stage, mask, session_layer)
        report_composition(stage, report)
        code = stage_time(stage, time, default_time, report)
        if base_time is None:
            report_frame_outside(stage, code, report)
        if pass_path is not None:
            settings_path = settings_of_pass(stage, pass_path, report)
        terms = read_settings(stage, report, settings_path)
        chosen = {"default", *purposes} if purposes is not None else terms.purposes or default_purposes
        # Hydra's sense of motion: what moves blurs, but lights and materials are as they are at the frame.
        base = code if base_time is None else Usd.TimeCode(base_time)
        materials = MaterialReader(stage, base, report, terms.binding_purposes, images)
        reader = GprimReader(code, materials, report, level, base, levels)
        stand_ins = StandInReader(stage, code, materials, report) if draw_modes else None
        walk = StageWalk(stage, code, frozenset(chosen), reader, stand_ins, report, base_time=base)
        placed = walk.walk()
        gprims = reader.read()
        group = placed.build(gprims).unblocked()
        instances = drawable_instances(group, gprims, report)
        reader.report_unreached(instances, gprims.prims)
        collections = None if pass_path is None else PassCollections(stage.GetPrimAtPath(pass_path), report)
        part = _part(stage, group, gprims, instances, collections, code, report)
        shining = MeshLightReader(
            part.meshes, part.instances, gprims.prims, materials.materials, materials.textures, materials.images
        )
        from_rec709 = terms.rendering_from_rec709
        lights, domes = _read_lights(part, materials, shining, base, report, from_rec709)
        instances, surfaces = shining.surfaces()
        if collections is not None:
            lights, domes = collections.seen(lights, part.links), collections.seen(domes, part.links)
        cameras = _read_cameras(group, code, report)
        if base_time is None:
            cameras = without_idle_shutters(stage, cameras, code)
        report_missing_primvars(stage, group, gprims, materials.materials, materials.textures, report)
        report_beyond_images(group, gprims, materials.materials, materials.textures, materials.unknown_beyond, report)
        _report_settings(terms, cameras, walk.render_prims, stage, pass_path, report)
        if not len(instances):
            message = f"no geometry is drawn at this time for the purposes {', '.join(sorted(chosen))}"
            report.warn(NOTHING_DRAWN, stage_name(stage), message)
        up_axis, meters_per_unit = stage_up_axis(stage, report), stage_meters_per_unit(stage, report)
    scene = Scene(
        meshes=part.meshes,
        instances=instances,
        prims=gprims.prims,
        instance_paths=group.names,
        object_from_local=gprims.object_from_local if any(map(_has_program, surfaces)) else {},
        labels=walk.labels,
        materials=surfaces,
        textures=tuple(materials.textures),
        images=tuple(materials.images),
        lights=tuple(lights),
        domes=tuple(domes),
        cameras=tuple(cameras),
        settings=terms.settings,
        products=terms.products,
        up_axis=up_axis,
        meters_per_unit=meters_per_unit,
        source=source,
        time=None if code.IsDefault() else code.GetValue(),
        time_range=stage_time_range(stage),
        time_codes_per_second=stage.GetTimeCodesPerSecond(),
    )
    if from_rec709 is not None:
        scene = RenderingSpace(from_rec709, materials.mixed).scene(scene)
        scene = replace(scene, images=tuple(materials.images))
    if scene.cameras:
        report_hidden(scene.cameras, scene.bounds(), report)
    return replace(scene, diagnostics=tuple(report))


def _opened(
    path_or_stage: str | os.PathLike[str] | Usd.Stage,
    mask: Sequence[str],
    session_layer: str | os.PathLike[str] | None,
) -> tuple[Usd.Stage, str]:
    """Return the stage and the file that it is of; an open one as it is."""
    if isinstance(path_or_stage, Usd.Stage):
        return path_or_stage, path_or_stage.GetRootLayer().realPath
    return open_stage(path_or_stage, mask, session_layer), os.fspath(path_or_stage)


@dataclass(frozen=True)
class _Part:
    """What of a stage's geometry and lights takes part: all that can be drawn, or what of it a pass renders."""

    meshes: tuple[Mesh | Shapes, ...]
    instances: Instances
    lights: Sequence[PlacedPrim]
    links: LinkReader
    """Of the instances."""


def _part(
    stage: Usd.Stage,
    group: Group,
    gprims: Gprims,
    instances: Instances,
    collections: PassCollections | None,
    time: Usd.TimeCode,
    report: Report,
) -> _Part:
    def links_of(placed: Instances) -> LinkReader:
        return LinkReader(stage, placed, gprims.prims, gprims.tail_starts, group.names, time, report)

    meshes, lights = gprims.meshes, group.lights
    if collections is not None:
        links = links_of(instances)
        instances, lights = collections.geometry(instances, links), collections.lights(lights, links)
    if collections is not None or len(instances) < len(group):  # what is too large to be placed cannot be uploaded
        meshes, instances = without_unused(meshes, instances)
    return _Part(meshes, instances, lights, links_of(instances))


@contextmanager
def _readable(path_or_stage: str | os.PathLike[str] | Usd.Stage) -> Iterator[None]:
    """Name the stage that is refused: beyond a limit, or its names or tokens no text, which Python cannot be given."""
    stage = path_or_stage if isinstance(path_or_stage, Usd.Stage) else None
    name = stage.GetRootLayer().identifier if stage else os.fspath(path_or_stage)
    try:
        yield
    except LimitError as error:
        raise LimitError(f"{name}: {error}") from error
    except UnicodeDecodeError as error:
        raise SceneError(f"{name}: the file is damaged: it holds text that is not UTF-8") from error
    except Tf.ErrorException as error:
        raise SceneError(f"{name}: USD cannot read it: {error_text(error)}") from error


def _report_settings(
    terms: RenderTerms,
    cameras: Sequence[Camera],
    render_prims: Sequence[str],
    stage: Usd.Stage,
    pass_path: str | None,
    report: Report,
) -> None:
    """Report what render settings, and those of their products, ask for and the stage has not, or that goes unused."""
    in_force = tuple(dict.fromkeys((terms.settings, *(product.settings for product in terms.products))))
    for settings in in_force:
        report_missing_camera(settings, cameras, report)
    report_unexposed(cameras, in_force, report)
    report_unused(terms.settings, render_prims, stage, report, pass_path)


def _has_program(material: Material) -> bool:
    return any(source.program is not None for source in material.inputs.values())


def _read_lights(
    part: _Part,
    materials: MaterialReader,
    shining: MeshLightReader,
    time: Usd.TimeCode,
    report: Report,
    from_rec709: np.ndarray | None,
) -> tuple[list[Light], list[Dome]]:
    profiles = ProfileCache(report)
    lights: list[Light] = []
    domes: list[Dome] = []
    for placed in part.lights:
        try:
            found = read_lights(placed.prim, placed.matrix, time, report, materials, profiles, shining, from_rec709)
            receivers, casters = (
                part.links.read(placed.prim, placed.path, name) for name in ("lightLink", "shadowLink")
            )
        except Tf.ErrorException as error:
            report.warn(UNREADABLE, placed.path, f"light left out: {error_text(error)}")
            continue
        for light in found:
            shadow = replace(light.shadow, casters=casters)
            if isinstance(light, Dome):
                domes.append(replace(light, path=placed.path, receivers=receivers, shadow=shadow))
            else:
                lights.append(replace(light, path=placed.path, receivers=receivers, shadow=shadow))
    return lights, domes


def _read_cameras(group: Group, time: Usd.TimeCode, report: Report) -> list[Camera]:
    cameras = []
    for placed in group.cameras:
        try:
            camera = read_camera(placed.prim, placed.matrix, time, report)
        except Tf.ErrorException as error:
            report.warn(UNREADABLE, placed.path, f"camera left out: {error_text(error)}")
            continue
        cameras.append(replace(camera, path=placed.path))
    return cameras
