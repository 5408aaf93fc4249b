# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""How reference pictures were made where neither their tests' options nor the schemas say it.

Each entry has its reason. What it changes is the stage that the benchmark renders, or how two silhouettes are compared,
so that a pair tests what both renderers are to agree on.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pxr import Gf, Usd, UsdGeom, Vt

POLYGON_SIDES = 10  # of implicit shapes that Hydra and arnold-usd draw as meshes, round the axis and along a sphere's
CAP_RINGS = 4  # of a capsule's ends


@dataclass(frozen=True)
class Setting:
    """What a picture was made with."""

    reason: str
    complexity: str = ""
    """That it was refined to; empty: what the test says."""
    edit: Callable[[Usd.Stage, Usd.TimeCode], None] | None = None
    """Changes a flattened copy of the stage."""
    smoothing: float = 0.0
    """Standard deviation of the Gaussian that both alphas are smoothed by before silhouettes are taken [pixel]."""
    samples: int = 0
    """A pixel of the reference has, of which its noise is; 0: not known."""
    has_no_outline: bool = False
    """What is drawn has the colour of what is behind."""
    frames_before: tuple[float, ...] = ()
    """That were drawn into the same picture."""


def as_polygons(stage: Usd.Stage, time: Usd.TimeCode) -> None:
    """Replace implicit shapes by the subdivision cages that are drawn for them, NURBS patches by their control nets."""
    for prim in Usd.PrimRange(stage.GetPseudoRoot(), Usd.PrimAllPrimsPredicate):
        cage = _cage(prim, time)
        if cage is None:
            continue
        points, faces = cage
        prim.RemoveProperty("points")
        prim.SetTypeName("Mesh")
        mesh = UsdGeom.Mesh(prim)
        mesh.GetPointsAttr().Set(Vt.Vec3fArray([Gf.Vec3f(*point) for point in points]))
        mesh.GetFaceVertexCountsAttr().Set(Vt.IntArray([len(face) for face in faces]))
        mesh.GetFaceVertexIndicesAttr().Set(Vt.IntArray([index for face in faces for index in face]))
        mesh.GetSubdivisionSchemeAttr().Set(UsdGeom.Tokens.catmullClark)


def _cage(prim: Usd.Prim, time: Usd.TimeCode) -> tuple[list[tuple[float, ...]], list[list[int]]] | None:
    def value(name: str) -> float:
        return float(prim.GetAttribute(name).Get(time))

    kind = prim.GetTypeName()
    if kind == "NurbsPatch":
        patch = UsdGeom.NurbsPatch(prim)
        points = [tuple(map(float, point)) for point in patch.GetPointsAttr().Get(time)]
        columns, rows = patch.GetUVertexCountAttr().Get(time), patch.GetVVertexCountAttr().Get(time)
        corners = [row * columns + column for row in range(rows - 1) for column in range(columns - 1)]
        return points, [[first, first + 1, first + columns + 1, first + columns] for first in corners]
    if kind == "Sphere":
        radius = value("radius")
        angles = [math.pi * (ring / POLYGON_SIDES - 0.5) for ring in range(1, POLYGON_SIDES)]
        profile = [(radius * math.cos(angle), radius * math.sin(angle)) for angle in angles]
        return _turned([(0.0, -radius), *profile, (0.0, radius)], "Z")
    if kind not in ("Cylinder", "Cone", "Capsule"):
        return None
    radius, half = value("radius"), value("height") / 2
    axis = str(prim.GetAttribute("axis").Get(time))
    if kind == "Cylinder":
        return _turned([(0.0, -half), (radius, -half), (radius, half), (0.0, half)], axis)
    if kind == "Cone":
        return _turned([(0.0, -half), (radius, -half), (0.0, half)], axis)
    quarter = [math.pi / 2 * ring / CAP_RINGS for ring in range(CAP_RINGS)]
    top = [(radius * math.cos(angle), half + radius * math.sin(angle)) for angle in quarter] + [(0.0, half + radius)]
    return _turned([(distance, -height) for distance, height in reversed(top)] + top, axis)


def with_flat_ends(stage: Usd.Stage, time: Usd.TimeCode) -> None:
    """Replace linear BasisCurves of one width by a cylinder a segment, which ends where the segment does."""
    for prim in [prim for prim in stage.TraverseAll() if prim.IsA(UsdGeom.BasisCurves)]:
        curves = UsdGeom.BasisCurves(prim)
        points, radius = curves.GetPointsAttr().Get(time), curves.GetWidthsAttr().Get(time)[0] / 2
        ends = np.cumsum(curves.GetCurveVertexCountsAttr().Get(time))
        prim.SetTypeName("Xform")
        for last, (start, end) in enumerate(itertools.pairwise(points), start=1):
            if last in ends:  # of one curve to the first of another
                continue
            cylinder = UsdGeom.Cylinder.Define(stage, prim.GetPath().AppendChild(f"segment_{last}"))
            cylinder.GetRadiusAttr().Set(radius)
            cylinder.GetHeightAttr().Set((end - start).GetLength())
            turn = Gf.Rotation(Gf.Vec3d.ZAxis(), Gf.Vec3d(end - start))
            cylinder.AddTransformOp().Set(Gf.Matrix4d(turn, Gf.Vec3d(start + end) / 2))


def _turned(profile: list[tuple[float, float]], axis: str) -> tuple[list[tuple[float, ...]], list[list[int]]]:
    """Return points and faces of a profile, pairs of distance from the axis and height, turned about an axis."""
    points: list[tuple[float, ...]] = []
    rings = []
    for distance, height in profile:
        count = POLYGON_SIDES if distance else 1
        rings.append([len(points) + side % count for side in range(POLYGON_SIDES + 1)])
        for side in range(count):
            angle = 2 * math.pi * side / POLYGON_SIDES
            point = (distance * math.cos(angle), distance * math.sin(angle), height)
            points.append(point if axis == "Z" else point[1:] + point[:1] if axis == "Y" else point[2:] + point[:2])
    quads = [
        (lower[side], lower[side + 1], upper[side + 1], upper[side])
        for lower, upper in itertools.pairwise(rings)
        for side in range(POLYGON_SIDES)
    ]
    return points, [list(dict.fromkeys(quad)) for quad in quads]


def _without(*paths: str) -> Callable[[Usd.Stage, Usd.TimeCode], None]:
    def edit(stage: Usd.Stage, time: Usd.TimeCode) -> None:
        for path in paths:
            stage.GetPrimAtPath(path).SetActive(False)

    return edit


def _subdivided(stage: Usd.Stage, time: Usd.TimeCode) -> None:
    for prim in stage.TraverseAll():
        if prim.IsA(UsdGeom.Mesh):
            UsdGeom.Mesh(prim).GetSubdivisionSchemeAttr().Set(UsdGeom.Tokens.catmullClark)


def as_sampled_now(stage: Usd.Stage, time: Usd.TimeCode) -> None:
    """Give PointInstancers' positions and velocities a time sample at ``time``, and no other."""
    for instancer in map(UsdGeom.PointInstancer, stage.TraverseAll()):
        for attribute in (instancer.GetPositionsAttr(), instancer.GetVelocitiesAttr()):
            value = attribute.Get(time) if attribute else None
            if value is not None:
                attribute.Clear()
                attribute.Set(value, time)


def _with_settings_and_polygons(stage: Usd.Stage, time: Usd.TimeCode) -> None:
    stage.SetMetadata("renderSettingsPrimPath", "/Render/rendersettings1")
    as_polygons(stage, time)


_POLYGONS = Setting("implicit shapes are cages of ten sides, not refined", edit=as_polygons)
_NET = Setting("the patch's control net is drawn as a subdivision cage, not refined", edit=as_polygons)
_NOISE_OF_ONE = Setting("AA_samples is 1: one time a pixel", smoothing=3.0, samples=1)
_NOISE = Setting("alpha is one of few times, each pixel its own: noise", smoothing=3.0)
_WHITE = Setting("a white floor before a white dome", has_no_outline=True)

SETTINGS = {
    "testUsdImagingGLSphere_": _POLYGONS,
    "InstancingWithMaterials_ni_ni_material_outside_prototype": _POLYGONS,
    "testUsdImagingGLNurbsPatch_": _NET,
    "testUsdImagingGLComposite_001": Setting("frames are drawn over one another", frames_before=(0.0,)),
    "testUsdImagingGLComposite_002": Setting("frames are drawn over one another", frames_before=(0.0, 1.0)),
    "test_0133/": _WHITE,
    "test_0180/": _WHITE,
    "test_1593/": _POLYGONS,
    "test_2715/": _POLYGONS,
    "test_1459/": Setting("spheres are cages of ten sides, refined", complexity="veryhigh", edit=as_polygons),
    "test_1468.2/": Setting(
        "primvars:arnold:subdiv_type and subdiv_iterations: Catmull-Clark, of which 6 times were asked for and 3 are"
        " drawn here, of a mesh whose subdivisionScheme is none",
        complexity="veryhigh",
        edit=_subdivided,
    ),
    "test_13221.3/": Setting("curves end flat, not round", edit=with_flat_ends),
    "test_0202/": Setting(
        "the only RenderSettings count, whose pixelAspectRatio is 1.333, though renderSettingsPrimPath is not set;"
        " implicit shapes are cages of ten sides",
        edit=_with_settings_and_polygons,
    ),
    "test_0237/": Setting("the labels are white before white", edit=_without("/labels")),
    "test_1547.2/": Setting(
        "the sphere is a light by primvars:arnold:light, and not drawn", edit=_without("/sphereLight")
    ),
    "test_1657/": _NOISE_OF_ONE,
    "test_1868/": Setting(
        "velocities carry positions that have no time sample, as if both had one at the frame; AA_samples is 4",
        edit=as_sampled_now,
        smoothing=3.0,
        samples=16,
    ),
    "test_2127/": Setting("AA_samples is 4: 16 times a pixel", samples=16),
    "test_2231/": _NOISE,
    "test_2254/": _NOISE_OF_ONE,
    "test_2268/": _NOISE,
    "test_2544/": _NOISE,
}
"""By a part of the picture's path."""


def setting_of(image: str) -> Setting | None:
    """Return what a picture was made with, where that is not the ordinary."""
    return next((setting for part, setting in SETTINGS.items() if part in image), None)
