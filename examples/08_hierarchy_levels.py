# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Producing the bounding volume hierarchy: levels of it as USD layers of boxes over the model, and a picture of four.

python examples/08_hierarchy_levels.py [folder]
"""

import argparse
from pathlib import Path

import numpy as np
import warp as wp
from PIL import Image
from pxr import Usd, UsdGeom, Vt

import warp_rt

MODEL = Path(wp.__file__).parent / "examples" / "assets" / "bunny.usd"
parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
parser.add_argument("folder", nargs="?", type=Path, default=Path("out"), help="for what it writes (default: out)")
folder = parser.parse_args().folder
folder.mkdir(parents=True, exist_ok=True)
COLORS = {1: (0.9, 0.1, 0.05), 3: (0.9, 0.4, 0.0), 5: (0.2, 0.55, 0.1), 7: (0.05, 0.3, 0.8)}


def split(corners):
    """Return the triangles in two groups, on either side of the middle of the longest side of their centroids' box."""
    centroids = corners.mean(axis=1)
    axis = np.ptp(centroids, axis=0).argmax()
    is_left = centroids[:, axis] < (centroids[:, axis].min() + centroids[:, axis].max()) / 2
    return [group for group in (corners[is_left], corners[~is_left]) if len(group)]


def write_layer(path, boxes, color, width):
    """Write a layer that shows the model and, as curves over it, the twelve edges of each box."""
    stage = Usd.Stage.CreateNew(path)
    stage.GetRootLayer().subLayerPaths.append(str(MODEL))
    edges = np.array([[np.insert((a, b), axis, end) for end in (0, 1)] for axis, a, b in np.ndindex(3, 2, 2)])
    curves = UsdGeom.BasisCurves.Define(stage, "/Boxes")
    curves.GetTypeAttr().Set("linear")
    curves.GetCurveVertexCountsAttr().Set([2] * 12 * len(boxes))
    curves.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(np.float32(boxes[:, edges, range(3)].reshape(-1, 3))))
    curves.GetWidthsAttr().Set([width])
    curves.SetWidthsInterpolation("constant")
    curves.GetDisplayColorAttr().Set([color])
    stage.Save()


mesh = warp_rt.load_scene(MODEL).meshes[0]
groups, pictures = [mesh.points[mesh.triangles]], []
for level in range(1, 8):
    groups = [half for group in groups for half in split(group)]
    boxes = np.array([(group.min(axis=(0, 1)), group.max(axis=(0, 1))) for group in groups])
    if level in COLORS:
        layer = str(folder / f"level_{level}.usda")
        write_layer(layer, boxes, COLORS[level], width=0.08 / (level + 1))
        shown = warp_rt.render(layer, width=400, height=360, spp=9, ambient=(0.3, 0.3, 0.3), background=(1, 1, 1))
        pictures.append(shown.to_srgb8()[..., :3])
        print(f"level {level}: {len(boxes)} boxes, {max(map(len, groups))} triangles in the fullest")
Image.fromarray(np.vstack([np.hstack(pictures[:2]), np.hstack(pictures[2:])])).save(folder / "hierarchy_levels.png")
