# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A file in Haines' Neutral File Format to a Scene: exact spheres and cones, polygons, patches.

What the format leaves to the program is read as in the Standard Procedural Databases' own text; docs/nff.md says how.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence

import numpy as np

from warp_rt.nff.statements import Fill, LightStatement, NffFile, Primitives, Vector, View, read_nff
from warp_rt.report import Report
from warp_rt.scene import (
    Camera,
    Input,
    Instances,
    Light,
    LightKind,
    Material,
    MaterialModel,
    Mesh,
    Primvar,
    Scene,
    Settings,
    ShapeKind,
    Shapes,
)
from warp_rt.triangulate import triangulate

CAMERA = "/Camera"
NO_EXTENT = "W150"
NOTHING_DRAWN = "N905"


def load_nff(path: str | os.PathLike[str]) -> Scene:
    """Return the scene that a file holds.

    Args:
        path: A .nff or .nff.gz file.

    Raises:
        SceneError: The file cannot be read, or breaks the format; the text names file and line.
        LimitError: It is larger than can be meant.
    """
    file = read_nff(path)
    report = Report()
    bodies: list[tuple[str, int, Mesh | Shapes]] = []
    for row, (fill, primitives) in enumerate(file.primitives.items()):
        bodies += [(name, row, body) for name, body in _bodies(f"/Fill{row + 1}", fill, primitives, report)]
    strength = light_strength(len(file.lights))
    ambient = (strength, strength, strength)
    if not bodies:
        report.warn(NOTHING_DRAWN, os.fspath(path), "the file holds nothing that is drawn")
    rows = np.arange(len(bodies), dtype=np.int32)
    return Scene(
        meshes=tuple(body for _, _, body in bodies),
        instances=Instances(
            mesh=rows,
            world_from_local=np.tile(np.eye(4), (len(bodies), 1, 1)),
            material_offset=rows,
            material_table=np.array([row for _, row, _ in bodies], np.int32),
            prim=rows,
            instance_id=np.full(len(bodies), -1, np.int32),
        ),
        prims=tuple(name for name, _, _ in bodies),
        materials=tuple(_material(f"/Fill{row + 1}/Material", fill) for row, fill in enumerate(file.primitives)),
        lights=tuple(_light(f"/Light{row + 1}", light, strength) for row, light in enumerate(file.lights)),
        cameras=() if file.view is None else (_camera(file.view),),
        settings=_settings(file, ambient),
        up_axis="Z",
        source=os.fspath(path),
        diagnostics=tuple(report),
    )


def light_strength(count: int) -> float:
    """Return the intensity of each of ``count`` lights, and of the ambient light, as the databases' text proposes.

    Reference: Haines, Standard Procedural Databases, Readme, section File Structure.
    """
    return float(np.sqrt(max(count, 1))) / (2 * max(count, 1))


def _settings(file: NffFile, ambient: tuple[float, float, float]) -> Settings:
    red, green, blue = file.background or (0.0, 0.0, 0.0)
    resolution = None if file.view is None else file.view.resolution
    return Settings(resolution=resolution, ambient=ambient, background=(red, green, blue))


def _camera(view: View) -> Camera:
    """Return the camera. Its angle is that between the middles of the outer rows, so the window is half a row more."""
    eye = np.array(view.origin)
    back = eye - view.at
    back /= np.linalg.norm(back)
    right = np.cross(view.up, back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3] = np.column_stack([right, np.cross(back, right), back, eye])
    width, height = view.resolution
    half = float(np.tan(np.radians(view.angle) / 2)) * height / max(height - 1, 1)
    half_width = half * width / height
    return Camera(CAMERA, matrix, (-half_width, half_width, -half, half))


def _light(path: str, light: LightStatement, strength: float) -> Light:
    matrix = np.eye(4)
    matrix[:3, 3] = light.position
    red, green, blue = light.color or (strength, strength, strength)
    return Light(path, LightKind.POINT, matrix, (red, green, blue), has_falloff=False)


def _material(path: str, fill: Fill) -> Material:
    body = tuple(fill.kd * channel for channel in fill.color)
    inputs = {"ambient": body, "diffuse": body}
    inputs |= {"specular": (fill.ks,) * 3, "reflection": (fill.ks,) * 3, "shininess": (fill.shine,)}
    if fill.transmittance > 0:
        inputs |= {"transmission": (fill.transmittance,) * 3, "ior": (fill.index,)}
    return Material(path, MaterialModel.WHITTED, {name: _input(value) for name, value in inputs.items()})


def _input(value: Sequence[float]) -> Input:
    first, second, third, fourth = (*value, *[0.0] * (4 - len(value)))
    return Input((first, second, third, fourth))


def _bodies(path: str, fill: Fill, primitives: Primitives, report: Report) -> Iterator[tuple[str, Mesh | Shapes]]:
    """Yield prim path and geometry of all that has one fill.

    Light bends where it enters what transmits it, whether or not polygons close a volume: the format knows but
    surfaces with an outside.
    """
    bends = fill.transmittance > 0
    for name, polygons, size in (("Polygons", primitives.polygons, 3), ("Patches", primitives.patches, 6)):
        kept = [row for row, corners in enumerate(polygons) if len(corners) >= 3]
        if len(kept) < len(polygons):
            report.warn(NO_EXTENT, f"{path}/{name}", _left_out(len(polygons) - len(kept), "of fewer than 3 corners"))
        if kept:
            yield f"{path}/{name}", _mesh([polygons[row] for row in kept], np.array(kept), size, bends)
    spheres = np.array(primitives.spheres, float).reshape(-1, 1, 4)
    cones = np.array(primitives.cones, float).reshape(-1, 2, 4)
    for name, kind, rows in (("Spheres", ShapeKind.SPHERE, spheres), ("Cones", ShapeKind.FRUSTUM, cones)):
        points, radii = rows[..., :3], rows[..., 3]
        has_extent = (radii != 0).any(axis=1)
        if kind == ShapeKind.FRUSTUM:
            has_extent &= (points[:, 0] != points[:, 1]).any(axis=1)
        if not has_extent.all():
            report.warn(NO_EXTENT, f"{path}/{name}", _left_out(int((~has_extent).sum()), "without radius or length"))
        is_inside_out = radii.min(axis=1, initial=0) < 0
        for suffix, chosen in (("", has_extent & ~is_inside_out), ("InsideOut", has_extent & is_inside_out)):
            if chosen.any():
                yield (
                    f"{path}/{name}{suffix}",
                    Shapes(
                        kind,
                        points[chosen].astype(np.float32),
                        np.abs(radii[chosen]).astype(np.float32),
                        caps=(False, False),
                        face_ids=np.flatnonzero(chosen).astype(np.int32),
                        is_closed=bends,
                        is_inside_out=bool(suffix),
                    ),
                )


def _left_out(count: int, what: str) -> str:
    return f"{count} {what}: left out"


def _mesh(polygons: list[list[Vector]], ids: np.ndarray, size: int, bends: bool) -> Mesh:
    """Return polygons as triangles, with shared corners, and normals where a corner has six numbers."""
    counts = np.array([len(corners) for corners in polygons])
    corners = np.array([corner for polygon in polygons for corner in polygon], float)
    starts = np.cumsum(counts) - counts
    points, indices = np.unique(corners[:, :3].astype(np.float32), axis=0, return_inverse=True)
    indices = indices.reshape(-1)
    triangles, faces = triangulate(points, starts, counts, indices)
    normals = None
    if size == 6:
        normals = Primvar(corners[:, 3:].astype(np.float32), triangles.astype(np.int32))
    return Mesh(
        points,
        indices[triangles].astype(np.int32),
        normals,
        face_ids=ids[faces].astype(np.int32),
        is_closed=bends,
    )
