# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Primvars and normals of many prims, as long as they are plain: floats that need no conversion and no diagnostic.

Those are nearly all there are. They are read with as few questions to USD as will do, and looked through together,
since NumPy takes a microsecond a call. What is not plain is left to those who read one at a time.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from pxr import Sdf, Tf, Usd, UsdGeom, Vt

from warp_rt.report import Report
from warp_rt.scene import Primvar
from warp_rt.usd.arrays import hold_throughout
from warp_rt.usd.authored import Authored
from warp_rt.usd.color_spaces import color_space_of
from warp_rt.usd.primvars import WIDTHS, Elements, is_declared_drawable
from warp_rt.usd.questions import get_attribute, get_metadata, get_value, has_authored_connections
from warp_rt.usd.sources import Source

_PRIMVARS = "primvars:"
_INDICES = ":indices"
_COLOR = Sdf.ValueRoleNames.Color
_COMPONENTS = {Vt.FloatArray: 1, Vt.Vec2fArray: 2, Vt.Vec3fArray: 3, Vt.Vec4fArray: 4}


class PlainRows(NamedTuple):
    """Values that fit the elements of their prim, or do not: that is all that can be wrong with them."""

    name: str
    """Of the primvar."""
    rows: np.ndarray
    """float32, shape [k, c], all finite."""
    indices: np.ndarray | None
    """int32, shape [e], row of each element, within range; None: the elements are the rows."""
    interpolation: str

    def lay_out(self, layout: Elements) -> Primvar | None:
        """Return them by triangle corner; None where there are more or fewer than elements."""
        count = len(self.rows if self.indices is None else self.indices)
        if count not in layout.element_counts(self.interpolation):
            return None
        return layout.primvar(self.rows, self.indices, self.interpolation)


class PlainValues(NamedTuple):
    """What of a prim is plain."""

    normals: PlainRows | None = None
    """None: there are no normals, or they are not plain."""
    primvars: tuple[PlainRows, ...] | None = None
    """None: one of them is not plain."""


_WITHOUT_PRIMVARS = PlainValues(primvars=())


def read_plain_values(sources: Sequence[Source], have_normals: Sequence[bool], report: Report) -> list[PlainValues]:
    """Return what prims hold of plain values.

    Args:
        sources: The prims.
        have_normals: Whether the normals of each count, if it has any.
        report: Takes the diagnostics that colour spaces give.
    """
    found = [
        _read(source, has_normals, report) if has_normals or source.authored.primvars else _WITHOUT_PRIMVARS
        for source, has_normals in zip(sources, have_normals, strict=True)
    ]
    bad = _damaged([rows for values in found for rows in (values.normals, *(values.primvars or ())) if rows])
    if not bad:
        return found
    return [
        PlainValues(
            None if id(values.normals) in bad else values.normals,
            None if any(id(rows) in bad for rows in values.primvars or ()) else values.primvars,
        )
        for values in found
    ]


def _damaged(found: Sequence[PlainRows]) -> set[int]:
    """Return the identities of what holds a number that is not finite, or an index out of range."""
    are_finite = hold_throughout([rows.rows.reshape(-1) for rows in found], np.isfinite)
    bad = {id(rows) for rows, is_finite in zip(found, are_finite, strict=True) if not is_finite}
    indexed = [rows for rows in found if rows.indices is not None]
    # Without a sign, those below zero are above all others.
    in_range = [np.asarray(rows.indices).view(np.uint32) < len(rows.rows) for rows in indexed]
    are_in_range = hold_throughout(in_range, np.asarray)
    return bad | {id(rows) for rows, is_good in zip(indexed, are_in_range, strict=True) if not is_good}


def _read(source: Source, has_normals: bool, report: Report) -> PlainValues:
    prim, authored, _, time, *_ = source
    try:
        return PlainValues(
            _read_normals(prim, authored, time) if has_normals else None,
            _read_primvars(prim, authored, time, report) if authored.primvars else (),
        )
    except (Tf.ErrorException, RuntimeError):  # which those who read one at a time will meet, and tell
        return PlainValues()


def _read_normals(prim: Usd.Prim, authored: Authored, time: Usd.TimeCode) -> PlainRows | None:
    if "primvars:normals" in authored.names:  # takes precedence, unless it is blocked
        return None
    attribute = get_attribute(prim, "normals")
    value = get_value(attribute, time)
    if type(value) is not Vt.Vec3fArray:
        return None
    interpolation = get_metadata(attribute, "interpolation") or UsdGeom.Tokens.vertex
    return PlainRows("normals", np.array(value), None, str(interpolation))


def _read_primvars(
    prim: Usd.Prim, authored: Authored, time: Usd.TimeCode, report: Report
) -> tuple[PlainRows, ...] | None:
    found = []
    for name in authored.primvars:
        if name.endswith(_INDICES):
            continue
        attribute = get_attribute(prim, name)
        if has_authored_connections(attribute):
            return None
        declared = UsdGeom.Primvar(attribute).GetDeclarationInfo()
        if name == "primvars:normals" or not is_declared_drawable(*declared):
            continue
        rows = _read_primvar(prim, attribute, authored, declared, time, report)
        if rows is None:
            return None
        found.append(rows)
    return tuple(found)


def _read_primvar(
    prim: Usd.Prim,
    attribute: Usd.Attribute,
    authored: Authored,
    declared: tuple[str, Sdf.ValueTypeName, str, int],
    time: Usd.TimeCode,
    report: Report,
) -> PlainRows | None:
    """Return the rows of a primvar, not looked through yet; None where they are not plain."""
    name, value_type, interpolation, _ = declared
    value = get_value(attribute, time)
    width = _COMPONENTS.get(type(value))
    if width is None or width != WIDTHS.get(name, width) or not len(value):
        return None
    if value_type.role == _COLOR and color_space_of(attribute, report) is not None:
        return None
    indices = None
    index_name = f"{_PRIMVARS}{name}{_INDICES}"
    if index_name in authored.names:
        held = get_value(get_attribute(prim, index_name), time)
        if type(held) is not Vt.IntArray:
            return None
        indices = np.array(held)
    return PlainRows(name, np.array(value).reshape(-1, width), indices, interpolation)
