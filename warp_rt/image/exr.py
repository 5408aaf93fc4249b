# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""OpenEXR: linear float, one layer an AOV, everything in one part."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import OpenEXR

from warp_rt.errors import OutputError
from warp_rt.image.atomic import replacing

_REC_709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)  # x, y of red, green, blue and white: ITU-R BT.709-6

_SUFFIXES = {
    "color": ("R", "G", "B"),
    "alpha": ("A",),
    "depth": ("Z",),
    "normal": ("X", "Y", "Z"),
    "position": ("X", "Y", "Z"),
    "uv": ("U", "V"),
}
_DEFAULT_LAYER = ("color", "alpha")  # without a prefix: every viewer shows R, G, B, A


def channel_names(aov: str) -> tuple[str, ...]:
    """Return the names of an AOV's channels: ``R G B``, ``A``, ``depth.Z``, ``normal.X ...``, ``primId.X``."""
    suffixes = _SUFFIXES.get(aov, ("X",))
    return suffixes if aov in _DEFAULT_LAYER else tuple(f"{aov}.{suffix}" for suffix in suffixes)


def write_exr(path: Path, aovs: Mapping[str, np.ndarray], *, software: str, metadata: Mapping[str, object]) -> None:
    """Write an EXR file, whole or not at all.

    Colour is premultiplied, linear Rec. 709, and has 32 bits, so that what is written is what was computed. The
    format has no signed integers: ids are unsigned, and -1 (nothing) becomes 4294967295, its bits unchanged.

    Args:
        path: The file.
        aovs: By name: float32 or int32, shape [height, width] or [height, width, components], row 0 on top.
        software: Who made it, an attribute.
        metadata: Facts by name, attributes ``warp_rt:NAME`` of the type string, int or float.

    Raises:
        OutputError: The file could not be written.
    """
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "chromaticities": _REC_709,
        "software": software,
    }
    for name, value in metadata.items():
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        text = str(value).encode("utf-8", "backslashreplace").decode()
        header[f"warp_rt:{name}"] = value if is_number else text
    channels = {}
    for aov, values in aovs.items():
        planes = values[..., None] if values.ndim == 2 else values
        for component, name in enumerate(channel_names(aov)):
            plane = np.ascontiguousarray(planes[..., component])
            channels[name] = plane.view(np.uint32) if plane.dtype == np.int32 else plane
    with replacing(path) as temporary:
        try:
            with OpenEXR.File(header, channels) as file:
                file.write(os.fsencode(temporary))  # bytes: the name need not be valid Unicode
        except RuntimeError as error:  # the library's word for every failure
            reason = str(error).replace(str(temporary), path.name)
            raise OutputError(f"{path}: cannot write: {reason}") from error
