# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Texture coordinates: which primvar they are, and what moves them before an image is read.

Reference: UsdPreviewSurface Specification, UsdTransform2d; MaterialX Specification 1.39, tiledimage.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pxr import Usd, UsdShade

from warp_rt.report import Report
from warp_rt.usd.shading_network import read_numbers


@dataclass(frozen=True)
class Coordinates:
    """Where texture coordinates come from."""

    primvar: str = "st"
    fallback: tuple[float, float] = (0.0, 0.0)
    transform: np.ndarray = field(default_factory=lambda: np.eye(3))
    """Affine map of (u, v, 1), shape [3, 3]."""

    @staticmethod
    def constant(u: float, v: float) -> Coordinates:
        """Return the same coordinates everywhere: a map that lets no primvar through."""
        return Coordinates(fallback=(u, v), transform=np.array([[0.0, 0.0, u], [0.0, 0.0, v], [0.0, 0.0, 1.0]]))


def transform_2d(shader: UsdShade.Shader, time: Usd.TimeCode, report: Report) -> np.ndarray:
    """Return what a UsdTransform2d does, scale, then counter-clockwise rotation, then translation: shape [3, 3]."""
    angle = read_numbers(shader, "rotation", (1,), time, report) or (0.0,)
    scale = read_numbers(shader, "scale", (1, 2), time, report) or (1.0, 1.0)
    translation = read_numbers(shader, "translation", (1, 2), time, report) or (0.0, 0.0)
    cosine, sine = np.cos(np.radians(angle[0])), np.sin(np.radians(angle[0]))
    linear = np.array([[cosine, -sine], [sine, cosine]]) * np.resize(scale, 2)
    return np.vstack([np.column_stack([linear, np.resize(translation, 2)]), [0.0, 0.0, 1.0]])


def tiling(shader: UsdShade.Shader, time: Usd.TimeCode, report: Report) -> np.ndarray:
    """Return what a tiledimage makes of coordinates: (st uvtiling - uvoffset) / realworldimagesize * tile size.

    As a matrix of homogeneous column vectors, float64, shape [3, 3].
    """
    repeats, offset, image, tile = (
        np.resize(read_numbers(shader, name, (1, 2), time, report) or (default,), 2)
        for name, default in (
            *(("uvtiling", 1.0), ("uvoffset", 0.0)),
            *(("realworldimagesize", 1.0), ("realworldtilesize", 1.0)),
        )
    )
    stretch = tile / np.where(image == 0, 1.0, image)
    return np.array(
        [
            [*(stretch * repeats * (1, 0)), -stretch[0] * offset[0]],
            [*(stretch * repeats * (0, 1)), -stretch[1] * offset[1]],
            [0, 0, 1],
        ]
    )


def gltf_placement(shader: UsdShade.Shader, time: Usd.TimeCode, report: Report) -> np.ndarray:
    """Return what glTF's image nodes make of coordinates, KHR_texture_transform about the top left: shape [3, 3].

    That is, about the pivot, offset, then turned, then scaled, by ``operationorder`` 0 scaled, turned, offset.
    """
    pivot, scale, offset = (
        np.resize(read_numbers(shader, name, (2,), time, report) or default, 2)
        for name, default in (("pivot", (0.0, 1.0)), ("scale", (1.0, 1.0)), ("offset", (0.0, 0.0)))
    )
    angle = (read_numbers(shader, "rotate", (1,), time, report) or (0.0,))[0]
    order = (read_numbers(shader, "operationorder", (1,), time, report) or (1.0,))[0]
    turned = rotation(-angle)
    shift = offset * (1, -1)
    if order == 0.0:
        linear = turned @ np.diag(scale)
        rest = shift + pivot - linear @ pivot
    else:
        linear = np.diag(scale) @ turned
        rest = linear @ (shift - pivot) + pivot
    return np.vstack([np.column_stack([linear, rest]), [0.0, 0.0, 1.0]])


def rotation(degrees: float) -> np.ndarray:
    """Return the matrix of MaterialX's rotate2d, which turns clockwise: shape [2, 2]."""
    cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[cosine, sine], [-sine, cosine]])


def rotation_in_space(degrees: float, axis: np.ndarray) -> np.ndarray:
    """Return the matrix of MaterialX's rotate3d, which turns clockwise as seen from the axis's tip: shape [3, 3].

    Reference: Rodrigues (1840); MaterialX multiplies rows by matrices.
    """
    x, y, z = axis / np.linalg.norm(axis)
    angle = np.radians(degrees)
    crossed = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) - np.sin(angle) * crossed + (1.0 - np.cos(angle)) * crossed @ crossed)


def coordinate_name(index: Any) -> str:
    """Return the primvar that a texcoord node with an index reads."""
    return f"st{index}" if isinstance(index, int) and index > 0 else "st"
