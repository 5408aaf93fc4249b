# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The ray counts of Haines' Standard Procedural Databases beside the published ones.

    python -m benchmarks spd                        all seven
    python -m benchmarks spd balls tree --save
    python -m benchmarks spd --picture spd.png      the seven pictures, beside one another

The databases are those of standard size, with exact spheres and cones: files NAME.nff or NAME.nff.gz in --folder, by
default in oracles/spd of the test data (WARP_RT_TEST_DATA). The databases' own testing procedures hold: 513 x 513 eye
rays through the corners of pixels, depth 5, no threshold, a reflection ray from whatever reflects or transmits, a
shadow ray only where the surface faces the light. Their author asks for counts within about 10 %.

Two readings, for the text leaves them open:

- The angle of view is that between the middles of the outer rows of pixels, as NFF defines it; so corners lie on a
  window larger by 512 / 511. Without this the counts come out up to 0.5 % higher.
- The published refraction rays count a ray for each total internal reflection too. This is inferred from the number of
  gears alone, the one database in which there are many.

Reference: Haines (1987), A Proposal for Standard Graphics Environments, IEEE CG&A 7(11); counts and procedures from the
Readme of version 3.14.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image as PillowImage

from warp_rt import Renderer, RenderOptions, Scene, load_scene, render
from warp_rt.rendering.film import RayCounts
from warp_rt.scene import Input, Material

from .command import make_parser, save_if_asked
from .meshes import find_test_data

PIXELS, DEPTH = 512, 5
COLUMNS = ("eye rays that hit", "reflection", "refraction", "shadow")
PUBLISHED = {
    "balls": (263169, 175095, 0, 954368),
    "gears": (245086, 304643, 207564, 2246955),
    "mount": (173125, 354769, 354769, 412922),
    "rings": (263169, 315236, 0, 1085002),
    "teapot": (161120, 225248, 0, 407656),
    "tetra": (49788, 0, 0, 46112),
    "tree": (169836, 0, 0, 1097419),
}
FAINTEST = 1e-6  # reflection that stands for none, which is traced all the same


def main(arguments: Sequence[str]) -> None:
    """Print a line for each count."""
    parser = make_parser("spd", __doc__, rounds=1)
    parser.add_argument("databases", nargs="*", metavar="NAME", help=", ".join(PUBLISHED))
    parser.add_argument("--folder", type=Path, help="where the files are")
    parser.add_argument("--picture", type=Path, help="write the pictures, each of 256 x 256 pixels")
    options = parser.parse_args(arguments)
    names = options.databases or list(PUBLISHED)
    unknown = [name for name in names if name not in PUBLISHED]
    if unknown:
        parser.error(f"no database {unknown[0]}; there are {', '.join(PUBLISHED)}")
    rows = []
    scenes = [load_scene(find_database(options.folder, name)) for name in names]
    for name, scene in zip(names, scenes, strict=True):
        for column, ours, published in zip(COLUMNS, count(scene), PUBLISHED[name], strict=True):
            relative = round(ours / published - 1, 6) if published else float(ours)
            rows.append({"database": name, "rays": column, "published": published, "ours": ours, "relative": relative})
            print(f"{name:<8}{column:<19}{published:>10,}{ours:>10,}{relative:>+10.3%}", flush=True)
    if options.picture:
        # Frame buffers of the time took these numbers as they are.
        pictures = [render(scene, width=256, height=256, spp=16, depth=DEPTH, tonemap="raw") for scene in scenes]
        montage([picture.to_srgb8() for picture in pictures]).save(options.picture)
    save_if_asked(options, "spd", rows, ("database", "rays"))


def find_database(folder: Path | None, name: str) -> Path:
    """Return the file of a database, from a folder or from the test data.

    Raises:
        SystemExit: There is none.
    """
    for file in (f"{name}.nff", f"{name}.nff.gz"):
        path = folder / file if folder else find_test_data(f"oracles/spd/{file}")
        if path is not None and path.is_file():
            return path
    where = folder or "oracles/spd of the test data, which WARP_RT_TEST_DATA names"
    sys.exit(f"spd: no {name}.nff in {where}")


def count(scene: Scene) -> tuple[int, int, int, int]:
    """Return the rays of a database by ``COLUMNS``, counted as the published ones are."""
    rays, hits = trace(scene, DEPTH)
    above, _ = trace(scene, DEPTH - 1)
    # At the last level nothing is spawned, so nothing there was counted either.
    return hits, rays.reflection, rays.refraction + above.total_internal_reflection, rays.shadow


def trace(scene: Scene, depth: int) -> tuple[RayCounts, int]:
    """Return the rays of a database, and how many eye rays hit."""
    camera = scene.cameras[0]
    # Pixels about the corners of pixels: one more in a row, on a window that is larger by one.
    left, right, bottom, top = (edge * (PIXELS + 1) / PIXELS for edge in camera.window)
    size = PIXELS + 1
    options = RenderOptions(
        width=size, height=size, depth=depth, threshold=0.0, shadows="opaque", aovs=("color", "primId")
    )
    traced = replace(scene, materials=tuple(map(reflecting, scene.materials)))
    film = Renderer(traced, options, device="cpu").render(camera=replace(camera, window=(left, right, bottom, top)))
    return film.rays, int((film.aovs["primId"] >= 0).sum())


def reflecting(material: Material) -> Material:
    """Return a material that reflects if it transmits, as testing procedure 8 has it; too little to be seen."""
    if "transmission" not in material.inputs or max(material.inputs["reflection"].value) > 0:
        return material
    return replace(material, inputs=dict(material.inputs) | {"reflection": Input((FAINTEST,) * 3 + (0.0,))})


def montage(pictures: Sequence[np.ndarray], columns: int = 4) -> PillowImage.Image:
    """Return pictures of one size in rows."""
    height, width = pictures[0].shape[:2]
    sheet = PillowImage.new("RGBA", (columns * width, -(-len(pictures) // columns) * height))
    for place, picture in enumerate(pictures):
        tile = PillowImage.fromarray(picture[..., :3])
        sheet.paste(tile, (place % columns * width, place // columns * height))
    return sheet
