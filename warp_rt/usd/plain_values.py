# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Primvars and normals of many prims, as long as they are plain: floats that need no conversion and no diagnostic.

Those are nearly all there are. They are read with as few questions to USD as will do, and looked through together,
since NumPy takes a microsecond a call. What is not plain is left to those who read one at a time.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from pxr import Sdf, Tf, UsdGeom, Vt

from warp_rt.report import Report
from warp_rt.scene import Primvar
from warp_rt.usd.arrays import joined_slices, with_infinities
from warp_rt.usd.color_spaces import color_space_of
from warp_rt.usd.primvars import WIDTHS, Elements, is_declared_drawable
from warp_rt.usd.questions import (
    get_attribute,
    get_metadata,
    get_value,
    get_value_type,
    has_authored_connections,
    has_color_space,
)
from warp_rt.usd.sources import Source

_NORMALS = "normals"
_CONSTANT: str = UsdGeom.Tokens.constant
_COLOR = Sdf.ValueRoleNames.Color
_COLOR_WIDTH = 3  # components that a colour has at least
_COMPONENTS = {Vt.FloatArray: 1, Vt.Vec2fArray: 2, Vt.Vec3fArray: 3, Vt.Vec4fArray: 4}


@dataclass(slots=True, eq=False)
class PlainRows:
    """Values that fit the elements of their prim, or do not: that is all that can be wrong with them."""

    name: str
    """Of the primvar."""
    rows: np.ndarray
    """float32, shape [k, c], all finite. (USD's own array until all are joined.)"""
    indices: np.ndarray | None
    """int32, shape [e], row of each element, within range; None: the elements are the rows."""
    interpolation: str

    def lay_out(self, layout: Elements) -> Primvar | None:
        """Return them by triangle corner; None where there are more or fewer than elements."""
        count = len(self.rows if self.indices is None else self.indices)
        if count not in layout.element_counts(self.interpolation):
            return None
        return layout.primvar(self.rows, self.indices, self.interpolation)


@dataclass(slots=True, eq=False)
class PlainConstant:
    """One value for all of a prim, which the prims that have the same share."""

    name: str
    """Of the primvar."""
    primvar: Primvar | None = None
    """None: its value is not finite. (Of all, until they are joined.)"""

    def lay_out(self, layout: Elements) -> Primvar | None:
        """Return it by triangle corner: it is the same for all layouts."""
        return self.primvar


class _Constants(dict[tuple[str, bytes], PlainConstant]):
    """The constants of many prims, by their names and by the bytes of their values: float32, shape [c]."""

    def __missing__(self, key: tuple[str, bytes]) -> PlainConstant:
        constant = self[key] = PlainConstant(key[0])
        return constant

    def join(self) -> None:
        """Give the constants their values, which those of one length have one after the other in memory."""
        alike: dict[int, list[tuple[bytes, PlainConstant]]] = {}
        for (_, value), constant in self.items():
            alike.setdefault(len(value), []).append((value, constant))
        for size, members in alike.items():
            joined = np.frombuffer(bytearray().join([value for value, _ in members]), np.float32)
            rows = joined.reshape(len(members), 1, size // joined.itemsize)
            bad = set(np.flatnonzero(~np.isfinite(rows[:, 0]).all(axis=1)).tolist())
            for k, ((_, constant), row) in enumerate(zip(members, rows, strict=True)):
                constant.primvar = None if k in bad else Primvar(row)


class PlainValues(NamedTuple):
    """What of a prim is plain."""

    normals: PlainRows | None = None
    """None: there are no normals, or they are not plain."""
    primvars: tuple[PlainRows | PlainConstant, ...] | None = None
    """None: one of them is not plain."""


_WITHOUT_PRIMVARS = PlainValues(primvars=())


def read_plain_values(sources: Sequence[Source], have_normals: Sequence[bool], report: Report) -> list[PlainValues]:
    """Return what prims hold of plain values.

    Args:
        sources: The prims.
        have_normals: Whether the normals of each count, if it has any.
        report: Takes the diagnostics that colour spaces give.
    """
    constants = _Constants()
    found = [
        _read(source, has_normals, constants, report) if has_normals or source.authored.primvars else _WITHOUT_PRIMVARS
        for source, has_normals in zip(sources, have_normals, strict=True)
    ]
    constants.join()
    held = [values.normals for values in found if values.normals]
    held.extend([rows for values in found for rows in values.primvars or () if type(rows) is PlainRows])
    if not held:
        return found
    bad = _join(held)
    if not bad:
        return found
    return [
        PlainValues(
            None if values.normals in bad else values.normals,
            None if values.primvars and not bad.isdisjoint(values.primvars) else values.primvars,
        )
        for values in found
    ]


def _join(held: Sequence[PlainRows]) -> set[PlainRows]:
    """Make NumPy's arrays of USD's; return what holds a number that is not finite, or an index out of range."""
    bad: set[PlainRows] = set()
    alike: dict[type, list[PlainRows]] = {}
    for rows in held:
        alike.setdefault(type(rows.rows), []).append(rows)
    for members in alike.values():
        joined, slices = joined_slices([one.rows for one in members])
        for one, own in zip(members, slices, strict=True):
            one.rows = joined[own]
        bad.update([members[row] for row in with_infinities(joined, slices)])
    indexed = [rows for rows in held if rows.indices is not None]
    if indexed:
        joined, slices = joined_slices([rows.indices for rows in indexed])
        # Without a sign, those below zero are above all others.
        may_be_bad = joined.view(np.uint32).max(initial=0) >= min(len(rows.rows) for rows in indexed)
        for one, own in zip(indexed, slices, strict=True):
            one.indices = joined[own]
            if may_be_bad and (one.indices.view(np.uint32) >= len(one.rows)).any():
                bad.add(one)
    return bad


def _read(source: Source, has_normals: bool, constants: _Constants, report: Report) -> PlainValues:
    try:
        return PlainValues(
            _read_normals(source) if has_normals else None,
            _read_primvars(source, constants, report) if source.authored.primvars else (),
        )
    except (Tf.ErrorException, RuntimeError):  # which those who read one at a time will meet, and tell
        return PlainValues()


def _read_normals(source: Source) -> PlainRows | None:
    if "primvars:normals" in source.authored.names:  # takes precedence, unless it is blocked
        return None
    attribute = get_attribute(source.prim, "normals")
    value = get_value(attribute, source.time)
    if type(value) is not Vt.Vec3fArray:
        return None
    interpolation = get_metadata(attribute, "interpolation") or UsdGeom.Tokens.vertex
    return PlainRows("normals", value, None, interpolation)


def _read_primvars(
    source: Source, constants: _Constants, report: Report
) -> tuple[PlainRows | PlainConstant, ...] | None:
    """Return primvars, whose values are not looked through yet; None where one is not plain."""
    prim, authored, time, may_have_color_space = source.prim, source.authored, source.time, source.may_have_color_space
    found: list[PlainRows | PlainConstant] = []
    for name, base_name, indices_name in authored.primvar_names:
        attribute = get_attribute(prim, name)
        if has_authored_connections(attribute):
            return None
        interpolation = get_metadata(attribute, "interpolation") or _CONSTANT
        needed = WIDTHS.get(base_name)
        may_be_color = True
        if needed is None or base_name == _NORMALS:  # others are drawn whatever they are declared as
            value_type = get_value_type(attribute)
            size = get_metadata(attribute, "elementSize")
            is_drawable, may_be_color = _declared(base_name, value_type, interpolation, size)
            if not is_drawable:
                if not value_type:  # no attribute, but a relationship
                    return None
                if indices_name:  # they may show that it is drawn after all
                    return None
                continue
        value = get_value(attribute, time)
        width = _COMPONENTS.get(type(value))
        if width is None or width != (needed or width) or not len(value):
            return None
        has_space = may_be_color and width >= _COLOR_WIDTH and (may_have_color_space or has_color_space(attribute))
        if has_space and color_space_of(attribute, report) is not None:
            return None
        indices = None
        if indices_name:
            indices = get_value(get_attribute(prim, indices_name), time)
            if type(indices) is not Vt.IntArray:
                return None
        elif interpolation == _CONSTANT and len(value) == 1:
            found.append(constants[base_name, bytes(value)])
            continue
        found.append(PlainRows(base_name, value, indices, interpolation))
    return tuple(found)


@functools.lru_cache(maxsize=1024)
def _declared(
    name: str, value_type: Sdf.ValueTypeName, interpolation: str, element_size: int | None
) -> tuple[bool, bool]:
    """Return whether a primvar that is declared so is drawn, normals aside, and whether it is a colour."""
    size = 1 if element_size is None else element_size
    is_drawable = name != _NORMALS and is_declared_drawable(name, value_type, interpolation, size)
    return is_drawable, value_type.role == _COLOR
