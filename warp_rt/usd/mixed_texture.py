# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Textures whose channels are mixed: the matrix goes into the image's texels, before anything is filtered."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from warp_rt.scene import Texture

Mix = Callable[[int, bool, np.ndarray], int]
"""Gives the row of an image whose decoded texels are multiplied by a matrix, shape [4, 4]: ``ImageCache.mixed``."""


def mixed_texture(texture: Texture, linear: np.ndarray, offset: np.ndarray, mix: Mix) -> Texture:
    """Return the texture that gives linear @ (what a texture gives) + offset.

    Filtering, and what lies outside a black border, are the same before the channels are mixed and after.

    Args:
        texture: Of whose channels sums are taken; its fallback is mixed likewise.
        linear: Shape [4, 4].
        offset: Shape [4].
        mix: Makes images.
    """

    def mixed(image: int) -> int:
        return image if image < 0 else mix(image, texture.is_srgb, linear * texture.scale)

    return replace(
        texture,
        image=mixed(texture.image),
        tiles=None if texture.tiles is None else texture.tiles.map(mixed),
        is_srgb=False,
        scale=(1.0, 1.0, 1.0, 1.0),
        bias=tuple((linear @ texture.bias + offset).tolist()),
        fallback=tuple((linear @ texture.fallback + offset).tolist()),
    )
