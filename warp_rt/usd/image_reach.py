# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Prims whose coordinates reach beyond an image that is right within its window alone: found once all is placed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from warp_rt.report import Report
from warp_rt.scene import Material, Texture
from warp_rt.usd.gprims import Gprims
from warp_rt.usd.input_rows import LOSSY, Unknown
from warp_rt.usd.placement import Group

_SLACK = 1e-5  # of the image


def report_beyond_images(
    group: Group,
    gprims: Gprims,
    materials: Sequence[Material],
    textures: Sequence[Texture],
    unknown: Mapping[int, Unknown],
    report: Report,
) -> None:
    """Report images that are repeated for want of anything better, where prims have coordinates beyond them.

    Args:
        group: What is drawn.
        gprims: Whose rows it counts.
        materials: Of the scene.
        textures: Of the scene.
        unknown: Rows of ``textures`` whose images are so.
        report: Takes the diagnostics.
    """
    told: dict[str, set[str]] = {}
    for material, row in _users(materials, unknown):
        sets = [k for k, of_mesh in enumerate(gprims.material_sets) if material in of_mesh]
        rows = np.flatnonzero(np.isin(gprims.materials[group.gprim], sets))
        reaching = _reaching(textures[row], unknown[row].is_continued, group, gprims, rows)
        reached = {gprims.prims[prim] for prim in np.unique(gprims.prim[group.gprim[reaching]])}
        told.setdefault(unknown[row].path, set()).update(reached)
    for path, prims in told.items():
        if prims:
            more = f" and {len(prims) - 1} more" if len(prims) > 1 else ""
            message = f"its image is repeated beyond its window, where {min(prims)}{more} has coordinates"
            report.warn(LOSSY, path, message)


def _users(materials: Sequence[Material], unknown: Mapping[int, Unknown]) -> list[tuple[int, int]]:
    """Return materials and the textures in question that they read."""
    return [
        (k, value.texture)
        for k, material in enumerate(materials)
        for value in material.inputs.values()
        if value.texture in unknown
    ]


def _reaching(
    texture: Texture, is_continued: tuple[bool, bool], group: Group, gprims: Gprims, rows: np.ndarray
) -> np.ndarray:
    """Return which rows of a group have texture coordinates beyond an image."""
    name = texture.primvar
    own = [
        _lies_beyond(mesh.primvars[name].values, texture, is_continued) if name in mesh.primvars else False
        for mesh in gprims.meshes
    ]
    reaches = np.array(own or [False])[gprims.mesh[group.gprim[rows]]]
    if name in group.values:
        given = group.values[name][rows]
        of_each = np.array([_lies_beyond(value[None], texture, is_continued) for value in given], bool)
        reaches = np.where(np.isnan(given[:, 0]), reaches, of_each)
    return rows[reaches]


def _lies_beyond(st: np.ndarray, texture: Texture, is_continued: tuple[bool, bool]) -> bool:
    """Return whether any of some texture coordinates, shape [n, c], lies beyond an image where it does not go on."""
    if st.shape[1] < 2 or not len(st):
        return False
    place = st[:, :2].astype(np.float64) @ texture.uv_transform[:, :2].T + texture.uv_transform[:, 2]
    is_beyond = ((place < -_SLACK) | (place > 1.0 + _SLACK)).any(axis=0)
    return bool((is_beyond & ~np.array(is_continued)).any())
