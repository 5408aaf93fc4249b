# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the layers and channels of an OpenEXR file are called."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from warp_rt.options import is_primvar_aov
from warp_rt.scene import RenderVar

_SUFFIXES = {
    "color": ("R", "G", "B"),
    "alpha": ("A",),
    "depth": ("Z",),
    "cameraDepth": ("Z",),
    "normal": ("X", "Y", "Z"),
    "Neye": ("X", "Y", "Z"),
    "position": ("X", "Y", "Z"),
    "Peye": ("X", "Y", "Z"),
    "uv": ("U", "V"),
}
_PRIMVAR_SUFFIXES = {1: ("X",), 2: ("U", "V"), 3: ("R", "G", "B"), 4: ("R", "G", "B", "A")}  # most are colours
_DEFAULT_LAYER = ("color", "alpha")  # without a prefix: every viewer shows R, G, B, A


def channels_of(aov: str, values: np.ndarray, layer: str) -> dict[str, np.ndarray]:
    """Return the planes of an AOV by the names of its channels: ``R G B``, ``A``, ``depth.Z``, ``normal.X ...``.

    Args:
        aov: What it is, which says how its components are called.
        values: float32, float16 or int32, shape [height, width] or [height, width, components].
        layer: Its name in the file; empty: the layer that every viewer shows.
    """
    planes = values[..., None] if values.ndim == 2 else values
    prefix = f"{layer}." if layer else ""
    suffixes = _PRIMVAR_SUFFIXES[planes.shape[2]] if is_primvar_aov(aov) else _SUFFIXES.get(aov, ("X",))
    names = (prefix + suffix for suffix in suffixes)
    # The format has no signed integers: ids are unsigned, and -1 (nothing) becomes 4294967295, its bits unchanged.
    bits = planes.view(np.uint32) if planes.dtype == np.int32 else planes
    return {name: np.ascontiguousarray(bits[..., component]) for component, name in enumerate(names)}


def layer_names(layers: Sequence[RenderVar]) -> list[str]:
    """Return what layers are called in a file, such that none has another's channel.

    The first colour, with alpha, is the layer that every viewer shows, and has no name. Where a name leads to a channel
    that is taken the prim's stands in, if need be with a number.
    """
    taken: set[str] = set()
    names = []
    for layer in layers:
        is_shown = layer.aov == "alpha" or (layer.aov == "color" and "R" not in taken)
        prim = layer.path.rsplit("/", 1)[-1]
        candidates = itertools.chain((layer.layer, prim), (f"{prim}_{number}" for number in itertools.count(2)))
        name = (
            "" if is_shown else next(one for one in candidates if taken.isdisjoint(_possible_channels(layer.aov, one)))
        )
        taken.update(_possible_channels(layer.aov, name), "A" if is_shown else ())
        names.append(name)
    return names


def _possible_channels(aov: str, layer: str) -> set[str]:
    """Return the channels that an AOV may have in a layer, whose number a primvar alone can tell."""
    suffixes = set().union(*_PRIMVAR_SUFFIXES.values()) if is_primvar_aov(aov) else _SUFFIXES.get(aov, ("X",))
    return {f"{layer}.{suffix}" if layer else suffix for suffix in suffixes}


def default_layer(aov: str) -> str:
    """Return an AOV's layer where nobody names it: its own name, but for colour and alpha, which viewers show."""
    return "" if aov in _DEFAULT_LAYER else aov
