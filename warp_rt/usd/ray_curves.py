# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A layer of curves over a stage: rays that any viewer can show in the scene they were traced in."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdShade, Vt

from warp_rt.errors import SceneError

_NOT_COPIED = ("subLayers", "subLayerOffsets", "primChildren", "primOrder", "comment", "documentation")
"""Metadata of the stage's root layer that mean something else in another layer."""


def encode_ray_curves(
    target: Path,
    source: str,
    segments: Mapping[str, np.ndarray],
    colors: Mapping[str, tuple[float, float, float]],
    *,
    name: str,
    width: float,
    comment: str,
) -> bytes:
    """Return the file of a layer that has the stage as its sublayer, and one BasisCurves prim a kind of ray.

    Stage metadata count in the root layer alone, so those of the stage are repeated: up axis, units, time codes.

    Args:
        target: Where the file will lie, with one of USD's extensions: its path to the stage starts from there.
        source: File of the stage.
        segments: By kind: float64, shape [n, 2, 3], world space, from and to.
        colors: Linear colour of each kind.
        name: Of the prim at the root that holds the curves; a number is added where the stage has one of that name.
        width: Of the curves, in world units.
        comment: About the file.

    Raises:
        SceneError: The stage cannot be opened.
    """
    try:
        stage_layer = Sdf.Layer.FindOrOpen(source)
    except Tf.ErrorException:
        stage_layer = None
    if stage_layer is None:
        raise SceneError(f"{source}: cannot be read as a USD layer, over which curves could lie")
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.comment = comment
    for key in stage_layer.pseudoRoot.ListInfoKeys():
        if key not in _NOT_COPIED:
            layer.pseudoRoot.SetInfo(key, stage_layer.pseudoRoot.GetInfo(key))
    root = Sdf.Path("/" + _free_name(stage_layer, re.sub(r"\W", "_", name)))
    alone = Usd.Stage.Open(layer)  # not yet over the scene
    UsdGeom.Scope.Define(alone, root)
    for kind, ends in segments.items():
        _define_curves(alone, root.AppendChild(kind), ends, colors[kind], width)
    del alone
    layer.subLayerPaths.append(_relative(source, target))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, f"curves{target.suffix.lower()}")
        layer.Export(str(file))
        return file.read_bytes()


def _define_curves(
    stage: Usd.Stage, path: Sdf.Path, ends: np.ndarray, color: tuple[float, float, float], width: float
) -> None:
    """Write straight curves of one colour that needs no light to be seen."""
    points = np.ascontiguousarray(ends.reshape(-1, 3), np.float32)
    curves = UsdGeom.BasisCurves.Define(stage, path)
    curves.CreateTypeAttr(UsdGeom.Tokens.linear)
    curves.CreateCurveVertexCountsAttr(Vt.IntArray([2] * len(ends)))
    curves.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    curves.CreateWidthsAttr(Vt.FloatArray([width]))
    curves.SetWidthsInterpolation(UsdGeom.Tokens.constant)
    curves.CreateDisplayColorAttr(Vt.Vec3fArray([Gf.Vec3f(*color)]))
    half = np.float32(width / 2)
    extent = np.stack([points.min(axis=0) - half, points.max(axis=0) + half])
    curves.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(extent))
    material = UsdShade.Material.Define(stage, path.GetParentPath().AppendChild(f"{path.name}_material"))
    shader = UsdShade.Shader.Define(stage, material.GetPath().AppendChild("surface"))
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(0.0))
    shader.CreateInput("emissiveColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*color))
    shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(1.0)
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    UsdShade.MaterialBindingAPI.Apply(curves.GetPrim()).Bind(material)


def _relative(source: str, target: Path) -> str:
    """Return the path of the stage as the new layer has to name it."""
    try:
        path = os.path.relpath(source, target.absolute().parent)
    except ValueError:  # on another drive
        return Path(source).absolute().as_posix()
    path = Path(path).as_posix()
    return path if path.startswith("../") else f"./{path}"


def _free_name(layer: Sdf.Layer, name: str) -> str:
    stage = Usd.Stage.Open(layer, Usd.Stage.LoadNone)
    free, number = name, 1
    while stage.GetPrimAtPath(f"/{free}"):
        free, number = f"{name}_{number}", number + 1
    return free
