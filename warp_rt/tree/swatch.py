# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Colours of a tree as screens show them, and what can be read upon them."""

from __future__ import annotations

import numpy as np

from warp_rt.image.color import display
from warp_rt.tree.nodes import Color
from warp_rt.tree.pixel_tree import PixelTree


def swatch(value: Color, tree: PixelTree) -> str:
    """Return a linear colour as ``#rrggbb``, shown as the tree's pixel is."""
    linear = np.array(value) * tree.exposure_scale
    red, green, blue = display(linear, exposure=tree.exposure, tonemap=tree.tonemap).tolist()
    return f"#{red:02x}{green:02x}{blue:02x}"


def shown_color(tree: PixelTree) -> str:
    """Return the pixel's own colour as ``#rrggbb``."""
    red, green, blue = (int(channel) for channel in tree.rgb8)
    return f"#{red:02x}{green:02x}{blue:02x}"


def ink_on(background: str) -> str:
    """Return black or white, whichever is read better on ``#rrggbb``."""
    red, green, blue = (int(background[k : k + 2], 16) for k in (1, 3, 5))
    return "#000000" if 0.299 * red + 0.587 * green + 0.114 * blue > 140 else "#ffffff"  # Rec. 601 luma
