# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``warp-rt info``: what a stage holds."""

from __future__ import annotations

import argparse
import time
from typing import TYPE_CHECKING, Any

from warp_rt.cli.frames import parse_frame
from warp_rt.cli.parser import Parser, add_json, add_scene
from warp_rt.cli.render_arguments import add_frame, add_view
from warp_rt.cli.stage_input import open_refined_stage
from warp_rt.cli.terminal import Terminal
from warp_rt.options import RenderOptions
from warp_rt.report import one_line
from warp_rt.stand_ins import shown_path

if TYPE_CHECKING:
    import numpy as np

    from warp_rt.scene import Primvar, Scene
    from warp_rt.scene.instance_transforms import LazyTransforms

_LISTED = 20
"""Names in a list for people; --json has them all."""

# Of the hierarchies, whose records kernels/bvh_structs.py describes: a packet of 320 bytes holds up to 8 triangles and
# is filled to about five sixths, a wide node of 256 bytes has about 7 children, an instance a record of 64 bytes.
_PACKET_FILL = 8 * 5 / 6
_BYTES_A_TRIANGLE = 320 / _PACKET_FILL + 256 / (7 * _PACKET_FILL)
_BYTES_A_SHAPE = 320 / 3 + 256 / (7 * 3) + 64
"""Packets of shapes hold up to four; pieces of curves take 64 more."""
_BYTES_AN_INSTANCE = 64 + 256 / 7
_BUILD_BYTES_A_TRIANGLE = 96
"""While it is being built: a reference and two binary nodes."""


def parser() -> Parser:
    """Return the parser of ``warp-rt info``."""
    result = Parser("info", "Tell what a stage holds, as a render would see it.")
    add_scene(result)
    add_frame(add_view(result))
    add_json(result, "all of it")
    return result


def run(args: argparse.Namespace, terminal: Terminal) -> int:
    """Read the stage and describe it; return the exit code."""
    options = RenderOptions(width=args.width, height=args.height, crop=args.crop)
    frame = parse_frame(args.frames)
    begin = time.perf_counter()
    scene = open_refined_stage(args, options).scene(frame)
    load = time.perf_counter() - begin
    facts = {"scene": args.scene, **_facts(scene, options, args.camera), "seconds": {"load": load}}
    if args.json:
        terminal.json(facts)
    else:
        terminal.data(_table(facts))
    return 0


def _facts(scene: Scene, options: RenderOptions, camera: str | None) -> dict[str, Any]:
    from warp_rt.scene import Mesh, Shapes

    is_mesh = [isinstance(mesh, Mesh) for mesh in scene.meshes]
    triangles = [len(mesh.triangles) if isinstance(mesh, Mesh) else 0 for mesh in scene.meshes]
    shapes = [len(mesh.points) if isinstance(mesh, Shapes) else 0 for mesh in scene.meshes]
    placed = scene.instances.mesh.tolist()
    return {
        "time": scene.time,
        "time_range": scene.time_range,
        "time_codes_per_second": scene.time_codes_per_second,
        "up_axis": scene.up_axis,
        "meters_per_unit": scene.meters_per_unit,
        "bounds": scene.bounds().tolist(),
        "prims": len(scene.prims),
        "instances": len(scene.instances),
        "meshes": sum(is_mesh),
        "meshes_placed": sum(is_mesh[mesh] for mesh in placed),
        "triangles": scene.triangle_count,
        "triangles_placed": sum(triangles[mesh] for mesh in placed),
        "shapes": scene.shape_count,
        "shapes_placed": sum(shapes[mesh] for mesh in placed),
        "cameras": [camera.path for camera in scene.cameras],
        "lights": [{"path": light.path, "kind": light.kind.name.lower()} for light in scene.lights]
        + [{"path": dome.path, "kind": "dome"} for dome in scene.domes],
        "materials": [{"path": material.path, "model": material.model.name.lower()} for material in scene.materials],
        "textures": [
            {"path": image.path, "width": image.pixels.shape[1], "height": image.pixels.shape[0]}
            for image in scene.images
        ],
        "settings": scene.settings.path or None,
        "picture": _picture(scene, options, camera),
        "memory": {
            "scene_bytes": scene_bytes(scene),
            "pyramid_bytes_estimate": sum(image.pixels.nbytes for image in scene.images) // 3,
            "hierarchy_bytes_estimate": hierarchy_bytes(scene),
        },
        "warnings": sum(record.is_warning for record in scene.diagnostics),
    }


def _picture(scene: Scene, options: RenderOptions, camera: str | None) -> dict[str, Any]:
    """Return the camera that a render with these options looks through, and the size of its picture [pixel]."""
    from warp_rt.rendering.rehearsal import rehearse

    picture = rehearse(scene, options, camera)
    return {"camera": picture.camera.path, "width": picture.width, "height": picture.height}


def scene_bytes(scene: Scene) -> int:
    """Return what the arrays of a scene take on the host [byte]; arrays that are shared count once."""
    from warp_rt.scene import Shapes

    placed = scene.instances
    arrays: list[np.ndarray | LazyTransforms | None] = [placed.mesh, placed.world_from_local, placed.material_offset]
    arrays += [placed.material_table, placed.prim, placed.instance_id, *placed.primvars.values()]
    arrays += [image.pixels for image in scene.images]
    for mesh in scene.meshes:
        arrays += [mesh.points, mesh.face_ids]
        primvars: list[Primvar | None] = list(mesh.primvars.values())
        if isinstance(mesh, Shapes):
            arrays.append(mesh.radii)
        else:
            arrays += [mesh.triangles, mesh.material_slots]
            primvars.append(mesh.normals)
        for primvar in primvars:
            arrays += [] if primvar is None else [primvar.values, primvar.indices]
    return sum({id(array): _bytes(array) for array in arrays if array is not None}.values())


def _bytes(array: np.ndarray | LazyTransforms) -> int:
    """Return what an array takes, of which one number may stand for all."""
    is_one = len(array) > 1 and not any(getattr(array, "strides", (1,)))
    return array.dtype.itemsize if is_one else array.nbytes


def hierarchy_bytes(scene: Scene) -> int:
    """Return about what the hierarchies will take at most, while the largest mesh's is being built [byte]."""
    from warp_rt.scene import primitive_count

    largest = max((primitive_count(mesh) for mesh in scene.meshes), default=0)
    kept = scene.triangle_count * _BYTES_A_TRIANGLE + len(scene.instances) * _BYTES_AN_INSTANCE
    kept += scene.shape_count * _BYTES_A_SHAPE
    return int(kept + largest * _BUILD_BYTES_A_TRIANGLE)


def _table(facts: dict[str, Any]) -> str:
    """Return the facts for people, a line each."""
    memory, picture = facts["memory"], facts["picture"]
    rows = [
        ("scene", facts["scene"]),
        ("time", "default" if facts["time"] is None else f"{facts['time']:g}"),
        ("frames", _frames(facts["time_range"], facts["time_codes_per_second"])),
        ("up axis", f"{facts['up_axis']}, {facts['meters_per_unit']:g} m a unit"),
        ("bounds", " to ".join(_point(corner) for corner in facts["bounds"]) if facts["instances"] else "none"),
        ("prims", f"{facts['prims']:,}"),
        *(
            (kind, f"{facts[kind]:,} in memory, {facts[f'{kind}_placed']:,} in the scene")
            for kind in ("meshes", "triangles", "shapes")
        ),
        *_listed("cameras", facts["cameras"]),
        *_listed("lights", [f"{light['path']} ({light['kind']})" for light in facts["lights"]]),
        *_listed(
            "materials", [f"{shown_path(material['path'])} ({material['model']})" for material in facts["materials"]]
        ),
        *_listed(
            "textures", [f"{image['path']} ({image['width']} x {image['height']})" for image in facts["textures"]]
        ),
        ("settings", facts["settings"] or "none"),
        ("picture", f"{picture['width']} x {picture['height']}, {shown_path(picture['camera'])}"),
        (
            "memory",
            f"{_size(memory['scene_bytes'])}, about {_size(memory['hierarchy_bytes_estimate'])} more for hierarchies, "
            f"{_size(memory['pyramid_bytes_estimate'])} for image pyramids",
        ),
        ("warnings", f"{facts['warnings']}{' (warp-rt check names them)' if facts['warnings'] else ''}"),
    ]
    return "\n".join(f"{name:<11}{one_line(value)}" for name, value in rows)


def _frames(time_range: tuple[float, float] | None, rate: float) -> str:
    """Return the frames that the stage names, as ``--frames`` takes them."""
    return "none named" if time_range is None else f"{time_range[0]:g}:{time_range[1]:g}, {rate:g} a second"


def _listed(name: str, items: list[str]) -> list[tuple[str, str]]:
    """Return the rows of a list: how many, then each on its own line, up to a bound."""
    rows = [(name, f"{len(items)}")] + [("", item) for item in items[:_LISTED]]
    return rows + ([("", f"and {len(items) - _LISTED} more")] if len(items) > _LISTED else [])


def _point(corner: list[float]) -> str:
    return "(" + ", ".join(f"{value:.6g}" for value in corner) + ")"


def _size(count: int) -> str:
    """Return a number of bytes in the unit that leaves it 1 to 4 digits before the point."""
    for unit, power in (("GiB", 30), ("MiB", 20), ("KiB", 10)):
        if count >= 1 << power:
            return f"{count / (1 << power):.1f} {unit}"
    return f"{count} B"
