# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A ray tree as a USD layer over its scene."""

from __future__ import annotations

from pathlib import Path

from warp_rt.errors import OptionError
from warp_rt.image.atomic import write_bytes
from warp_rt.tree.curves import CURVE_COLORS, WIDTH, ray_segments
from warp_rt.tree.numbers import color
from warp_rt.tree.pixel_tree import PixelTree

EXTENSIONS = (".usda", ".usdc", ".usd")


def check_layer_name(path: Path) -> None:
    """Return if a layer can be written under this name.

    Raises:
        OptionError: The extension is none of USD's.
    """
    if path.suffix.lower() not in EXTENSIONS:
        raise OptionError(f"{path}: a USD layer ends in {', '.join(EXTENSIONS)}")


def save_layer(tree: PixelTree, path: Path) -> None:
    """Write the layer, whole or not at all.

    Raises:
        OptionError: The extension is none of USD's, or the scene was not read from a file.
        OutputError: The file could not be written.
    """
    from warp_rt.usd.ray_curves import encode_ray_curves

    check_layer_name(path)
    if not tree.source or not Path(tree.source).is_file():
        raise OptionError(f"{path}: a layer lies over a stage's file, and the scene was not read from one")
    data = encode_ray_curves(
        path,
        tree.source,
        ray_segments(tree),
        CURVE_COLORS,
        name=f"RayTree_{tree.x}_{tree.y}",
        width=WIDTH * tree.scene_size,
        comment=f"Rays of pixel ({tree.x}, {tree.y}) of {tree.width} x {tree.height}, I = {color(tree.value)}",
    )
    write_bytes(path, data)
