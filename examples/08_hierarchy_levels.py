# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Producing the bounding volume hierarchy: levels of it as USD layers of boxes over the model, and a picture of four.

python examples/08_hierarchy_levels.py [folder]
"""

import sys
from pathlib import Path

import numpy as np
import warp as wp
from PIL import Image
from pxr import Gf, Usd, UsdGeom, Vt

import warp_rt

MODEL = Path(wp.__file__).parent / "examples" / "assets" / "bunny.usd"
folder = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
folder.mkdir(parents=True, exist_ok=True)
COLORS = {1: (0.9, 0.1, 0.05), 3: (0.9, 0.4, 0.0), 5: (0.2, 0.55, 0.1), 7: (0.05, 0.3, 0.8)}


def split(corners):
    """Return the triangles in two groups, on either side of the middle of the longest side of their centroids' box."""
    centroids = corners.mean(axis=1)
    low, high = centroids.min(axis=0), centroids.max(axis=0)
    axis = (high - low).argmax()
    is_left = centroids[:, axis] < (low + high)[axis] / 2
    return [group for group in (corners[is_left], corners[~is_left]) if len(group)]


def write_layer(path, boxes, color, width):
    """Write a layer that shows the model and, as instances of one frame of twelve beams, boxes over it."""
    stage = Usd.Stage.CreateNew(path)
    stage.GetRootLayer().subLayerPaths.append(str(MODEL))
    instancer = UsdGeom.PointInstancer.Define(stage, "/Boxes")
    instancer.GetPrototypesRel().AddTarget(UsdGeom.Xform.Define(stage, "/Boxes/Frame").GetPath())
    for beam, (axis, a, b) in enumerate(np.ndindex(3, 2, 2)):
        cube = UsdGeom.Cube.Define(stage, f"/Boxes/Frame/Beam{beam}")
        cube.GetSizeAttr().Set(1.0)
        cube.GetDisplayColorAttr().Set([color])
        cube.AddTranslateOp().Set(Gf.Vec3d(*np.roll([0.0, a - 0.5, b - 0.5], axis)))
        cube.AddScaleOp().Set(Gf.Vec3f(*np.roll([1 + width, width, width], axis)))
    instancer.GetProtoIndicesAttr().Set([0] * len(boxes))
    instancer.GetPositionsAttr().Set(Vt.Vec3fArray.FromNumpy(boxes.mean(axis=1)))
    instancer.GetScalesAttr().Set(Vt.Vec3fArray.FromNumpy(np.ptp(boxes, axis=1)))
    stage.Save()


mesh = warp_rt.load_scene(MODEL).meshes[0]
groups, pictures = [mesh.points[mesh.triangles]], []
for level in range(1, 8):
    groups = [half for group in groups for half in split(group)]
    boxes = np.array([(group.min(axis=(0, 1)), group.max(axis=(0, 1))) for group in groups], np.float32)
    if level in COLORS:
        write_layer(str(folder / f"level_{level}.usda"), boxes, COLORS[level], width=0.01 + 0.005 * level)
        pictures.append(warp_rt.render(folder / f"level_{level}.usda", width=400, height=360, spp=4).to_srgb8())
        print(f"level {level}: {len(boxes)} boxes, {max(map(len, groups))} triangles in the fullest")
Image.fromarray(np.vstack([np.hstack(pictures[:2]), np.hstack(pictures[2:])])).save(folder / "hierarchy_levels.png")
