# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Views for computer vision: calibrated cameras all round, each picture with depth, ids and classes; EXR read back.

python examples/10_views.py [folder]
"""

import argparse
from pathlib import Path

import numpy as np
import OpenEXR
from PIL import Image

import warp_rt
from warp_rt.scene import Camera, look_at

parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
parser.add_argument("folder", nargs="?", type=Path, default=Path("out"), help="for what it writes (default: out)")
folder = parser.parse_args().folder
folder.mkdir(parents=True, exist_ok=True)

STAGE = Path(__file__).parent.parent / "scenes" / "instancing.usda"
VIEWS, WIDTH, HEIGHT = 4, 320, 240
K = np.array([[300.0, 0.0, 160.0], [0.0, 302.0, 118.0], [0.0, 0.0, 1.0]])  # fx, fy, cx, cy [pixel]

aovs = ("color", "depth", "normal", "position", "primId", "instanceId")
options = warp_rt.RenderOptions(width=WIDTH, height=HEIGHT, aovs=aovs)
renderer = warp_rt.Renderer(warp_rt.load_scene(STAGE), options, device="cpu")  # read and built once
rows = []
for view in range(VIEWS):
    angle = np.radians(20) + 2 * np.pi * view / VIEWS
    pose = look_at(eye=(9 * np.sin(angle), 5, 9 * np.cos(angle)), target=(0, 0.5, 0), up=(0, 1, 0))
    film = renderer.render(camera=Camera.from_intrinsics(K, WIDTH, HEIGHT, pose))
    image = warp_rt.Image(film)
    image.save(folder / f"view_{view}.exr")
    classes = np.array([labels.get("class", ("none",))[0] for labels in image.labels("primId")] + ["none"])
    found = classes[image["primId"]]  # the id of nothing is -1: the last one
    shares = ", ".join(f"{name} {(found == name).mean():.1%}" for name in np.unique(found))
    print(f"view {view}: {len(np.unique(image['instanceId'])) - 1} instances; {shares}")
    instances = np.random.default_rng(7).integers(64, 256, (len(film.instance_paths) + 1, 3), np.uint8)
    instances[-1] = 0
    rows.append(np.hstack([image.to_srgb8()[..., :3], instances[image["instanceId"]]]))
Image.fromarray(np.vstack(rows[:2])).save(folder / "views.png")

with OpenEXR.File(str(folder / f"view_{VIEWS - 1}.exr"), separate_channels=True) as file:
    plane = {name: channel.pixels for name, channel in file.channels().items()}
ids = plane["primId.X"].view(np.int32)  # EXR has no signed integers
assert np.array_equal(ids, image["primId"])

# Depth and calibration give the points back that the rays have met.
x, y = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
seen = ids >= 0
rays = np.linalg.inv(film.camera.intrinsics(WIDTH, HEIGHT)) @ np.stack([x[seen], y[seen], np.ones(seen.sum())])
points = pose[:3, :3] @ (rays * plane["depth.Z"][seen] * [[1], [-1], [-1]]) + pose[:3, 3:]
print(f"points are {np.abs(points.T - image['position'][seen]).max():.0e} away from where they were met")
