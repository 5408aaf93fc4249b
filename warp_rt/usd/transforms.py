# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Transforms of prims, and those that place nothing anywhere."""

from __future__ import annotations

import math

import numpy as np
from pxr import Gf, Tf, Usd, UsdGeom, Vt

from warp_rt.report import Report
from warp_rt.usd.attribute_values import shown
from warp_rt.usd.authored import Authored
from warp_rt.usd.questions import UNTIMED, get_attribute, get_value

BAD_TRANSFORM = "W105"
IDLE_OPERATION = "N921"

_UNMOVED = np.eye(4)
_AFFINE = Gf.Vec4d(0, 0, 0, 1)  # last column of a matrix that acts on rows
_TRANSLATION = "xformOp:translate"
_ONLY_TRANSLATION = Vt.TokenArray([_TRANSLATION])
_PLAINLY = 1e-6  # of a box's volume: far above the limit of is_regular, whichever axes it measures
_BLOCK = 1 << 14  # matrices at a time: what is computed on the way takes little memory
_RESET = "!resetXformStack!"
_INVERT = "!invert!"


class TransformReader:
    """Reads the transforms of prims at one time.

    Args:
        time: When.
        report: Takes the diagnostics.
    """

    def __init__(self, time: Usd.TimeCode, report: Report) -> None:
        self._time = time
        self._cache = UsdGeom.XformCache(time)
        self._report = report
        self._complete: dict[Authored, Vt.TokenArray] = {}
        """The latest order that names just the operations which prims author that author the same."""

    def read(self, prim: Usd.Prim, authored: Authored) -> tuple[np.ndarray, bool] | None:
        """Return the transform of a prim; None, with a diagnostic, where nothing below it could be drawn.

        Args:
            prim: An Xformable.
            authored: What it authors.

        Returns:
            Parent from local, float64, shape [4, 4]; whether it stands in the world instead, whatever is above it.
        """
        order = get_value(get_attribute(prim, "xformOpOrder"), UNTIMED)
        if order == _ONLY_TRANSLATION and authored.operations == (_TRANSLATION,):
            offset = get_value(get_attribute(prim, _TRANSLATION), self._time)
            if isinstance(offset, Gf.Vec3d) and math.isfinite(offset * offset):
                matrix = _UNMOVED.copy()
                matrix[:3, 3] = offset
                return matrix, False
        elif order is None or order != self._complete.get(authored):
            self._check_operations(prim, order, authored)
        local, resets = self._cache.GetLocalTransformation(prim)
        if local.GetColumn(3) != _AFFINE:
            local = self._affine(prim, local)
        matrix = np.array(local).T
        if not (_is_plainly_regular(local) or is_regular(matrix[None])[0]):
            message = "left out with all below it: its transform is singular or not finite"
            self._report.warn(BAD_TRANSFORM, prim.GetPath(), message)
            return None
        return matrix, resets

    def _affine(self, prim: Usd.Prim, local: Gf.Matrix4d) -> Gf.Matrix4d:
        """Return what of a matrix is no projection: all of it, where it only divides everything by the same number."""
        x, y, z, scale = local.GetColumn(3)
        if (x, y, z) == (0, 0, 0) and scale != 0 and math.isfinite(scale):
            return local * Gf.Matrix4d(1 / scale)
        if all(map(math.isfinite, (x, y, z, scale))):
            self._report.warn(BAD_TRANSFORM, prim.GetPath(), "the last column of its matrix, a projection, is ignored")
            local.SetColumn(3, _AFFINE)
        return local

    def world_from_local(self, prim: Usd.Prim) -> np.ndarray:
        """Return where a prim stands in the world: float64, shape [4, 4], acting on column vectors."""
        return np.array(self._cache.GetLocalToWorldTransform(prim)).T

    def _check_operations(self, prim: Usd.Prim, order: object, authored: Authored) -> None:
        """Report entries of ``xformOpOrder`` for which there is no operation, and operations without an entry."""
        if order is not None and not isinstance(order, Vt.TokenArray):
            self._report.warn(BAD_TRANSFORM, prim.GetPath(), f"not moved: xformOpOrder is {shown(order)}")
            return
        # A Vt array's own iterator takes ten times as long.
        listed = [] if order is None else [order[index] for index in range(len(order))]
        missing = [
            operation
            for operation in listed
            if not (operation == _RESET or {operation, operation.removeprefix(_INVERT)} & authored.names)
        ]
        for operation in missing:
            self._report.warn(BAD_TRANSFORM, prim.GetPath(), f"moved without {operation}, which it does not have")
        idle = [name for name in authored.operations if name not in listed and _INVERT + name not in listed]
        if effective := [name for name in idle if self._moves(prim, name)]:
            message = f"not moved by {', '.join(effective)}, which its xformOpOrder does not name"
            self._report.warn(IDLE_OPERATION, prim.GetPath(), message)
        if order is not None and not (missing or idle):
            self._complete[authored] = order

    def _moves(self, prim: Usd.Prim, name: str) -> bool:
        """Return whether an operation would move the prim, if its order named it."""
        try:
            return bool(UsdGeom.XformOp(prim.GetAttribute(name)).GetOpTransform(self._time) != Gf.Matrix4d(1))
        except Tf.ErrorException:  # it is no operation, or has a value of another type
            return True


def _is_plainly_regular(local: Gf.Matrix4d) -> bool:
    """Return whether a transform is far from being singular: a tenth of the time of asking ``is_regular`` about one."""
    volume = local.GetRow3(0).GetLength() * local.GetRow3(1).GetLength() * local.GetRow3(2).GetLength()
    # Each number is a factor of the whole determinant, if with zeros: none that is not finite leaves it finite.
    return abs(local.GetDeterminant3()) > _PLAINLY * volume and math.isfinite(local.GetDeterminant())


def is_regular(matrices: np.ndarray) -> np.ndarray:
    """Return which transforms are finite and can be inverted: bool, shape [n].

    The determinant is compared with the product of the lengths of the axes, so that the size of the object does not
    matter; below 1e-12 of it, float64 rounding of a product with a singular matrix looks the same. Where one axis is
    1e-30 of another, the inverse leaves float32's range.

    Args:
        matrices: float64, shape [n, 4, 4].
    """
    if len(matrices) > _BLOCK:
        starts = range(0, len(matrices), _BLOCK)
        return np.concatenate([is_regular(matrices[start : start + _BLOCK]) for start in starts])
    is_finite = np.isfinite(matrices).all(axis=(1, 2))
    axes = np.where(is_finite[:, None, None], matrices[:, :3, :3], 0.0)
    lengths = np.linalg.norm(axes, axis=1)
    has_extent = (lengths > 1e-30 * lengths.max(axis=1, keepdims=True)).all(axis=1)
    unit = axes / np.where(lengths > 0, lengths, 1.0)[:, None]
    return is_finite & has_extent & (np.abs(np.linalg.det(unit)) > 1e-12)
