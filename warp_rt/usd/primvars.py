# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Primvars of every interpolation, indexed or not, as values looked up by triangle corner."""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from pxr import Sdf, Usd, UsdGeom

from warp_rt.report import Report, counted
from warp_rt.scene import Primvar
from warp_rt.usd.arrays import float_rows
from warp_rt.usd.color_spaces import color_space_of

WRONG_LENGTH = "W106"
BAD_INDEX = "W107"
WRONG_TYPE = "W108"
NOT_FINITE = "W109"
CONNECTED_PRIMVAR = "W112"

Values = Mapping[str, np.ndarray]
"""Values by primvar name: float32, shape [c], or [n, c] for n copies."""

BLOCKED = np.full(1, np.inf, np.float32)
"""In place of a value that is inherited: a prim on the way has one for its own elements, which hides those above."""

# Components that a name promises, where one does.
WIDTHS = {"displayColor": 3, "displayOpacity": 1, "normals": 3}
_SAME_FOR_INSTANCES = ("constant", "uniform")
# By what they hold, for old files have names of their own for types: Vec2f[] is float2[].
_NUMBER_TYPE = re.compile(r"GfHalf|GfVec[234][hfdi]|float|double|unsigned char|(unsigned )?int|u?int64_t")


class Elements(Protocol):
    """How a prim's elements are numbered, and how their values come to what is drawn of them."""

    def element_counts(self, interpolation: str) -> tuple[int, ...]:
        """Return the numbers of elements that fit an interpolation; none if there is no such interpolation."""

    def primvar(self, values: np.ndarray, indices: np.ndarray | None, interpolation: str) -> Primvar:
        """Return the primvar of values, shape [k, c]; ``indices`` say which of them each element takes."""


@dataclass(eq=False)  # every mesh has one: frozen, it would take three times as long to make
class Layout:
    """How the elements of a mesh's arrays are numbered, and which of them each triangle corner takes."""

    point_count: int
    face_count: int
    corner_count: int
    triangles: np.ndarray
    """int32, shape [m, 3], point of each triangle corner."""
    face_ids: np.ndarray
    """int32, shape [m], face of each triangle."""
    corners: np.ndarray
    """int32, shape [m, 3], face-vertex of each triangle corner."""

    def element_counts(self, interpolation: str) -> tuple[int, ...]:
        """Return the numbers of elements that fit an interpolation; none if there is no such interpolation."""
        if interpolation in ("vertex", "varying"):
            return (self.point_count,)
        if interpolation == "faceVarying":
            return (self.corner_count,)
        if interpolation == "uniform":
            return (self.face_count,)
        return (1,) if interpolation == "constant" else ()

    def elements(self, interpolation: str, count: int) -> np.ndarray | None:
        """Return which of ``count`` elements each triangle corner takes, int32, shape [m, 3]; None: the first."""
        if interpolation == "constant":
            return None
        if interpolation == "uniform":
            return np.repeat(self.face_ids[:, None], 3, axis=1)
        return self.corners if interpolation == "faceVarying" else self.triangles

    def primvar(self, values: np.ndarray, indices: np.ndarray | None, interpolation: str) -> Primvar:
        """Return values, shape [k, c], by triangle corner; ``indices`` say which of them each element takes."""
        elements = self.elements(interpolation, len(values if indices is None else indices))
        if indices is None:
            return Primvar(values[:1] if elements is None else values, elements)
        if elements is None:
            return Primvar(values[indices[0]][None], None)
        return Primvar(values, indices.astype(np.int32)[elements])


class _OneElement:
    """The elements of what has one value for all of it."""

    def element_counts(self, interpolation: str) -> tuple[int, ...]:
        return (1,)

    def primvar(self, values: np.ndarray, indices: np.ndarray | None, interpolation: str) -> Primvar:
        return Primvar(values[:1] if indices is None else values[indices[:1]], None)


_ONE_ELEMENT = _OneElement()


def read_primvars(prim: Usd.Prim, layout: Elements, time: Usd.TimeCode, report: Report) -> dict[str, Primvar]:
    """Return the prim's own primvars of numbers and vectors, by name; inherited ones and normals are not among them."""
    found = {}
    for primvar in _own_primvars(prim, report):
        name = primvar.GetPrimvarName()
        if name != "normals" and is_drawable(primvar):
            values = read_primvar(primvar, layout, time, report)
            if values is not None:
                found[name] = values
    return found


def _own_primvars(prim: Usd.Prim, report: Report) -> Iterator[UsdGeom.Primvar]:
    """Yield a prim's primvars that have values of their own; tell of those that are connected."""
    # Those of the schema too, which no layer may name and value clips hold.
    for primvar in UsdGeom.PrimvarsAPI(prim).GetPrimvars():
        _tell_connection(primvar, report)
        if primvar.HasAuthoredValue():
            yield primvar


def report_connected_constants(prim: Usd.Prim, report: Report) -> None:
    """Report a prim's constant primvars that are connected, which prims below it would inherit."""
    for primvar in UsdGeom.PrimvarsAPI(prim).GetAuthoredPrimvars():
        if primvar.GetInterpolation() == UsdGeom.Tokens.constant:
            _tell_connection(primvar, report)


def _tell_connection(primvar: UsdGeom.Primvar, report: Report) -> None:
    attribute = primvar.GetAttr()
    if attribute.HasAuthoredConnections():
        what = "its own value counts" if attribute.HasAuthoredValue() else "it has no value"
        report.warn(CONNECTED_PRIMVAR, attribute.GetPath(), f"connections of primvars are not followed; {what}")


def is_drawable(primvar: UsdGeom.Primvar) -> bool:
    """Return whether a primvar can hold a scalar or vector per element; joint weights and the like cannot."""
    name, value_type, interpolation, element_size = primvar.GetDeclarationInfo()
    if element_size > 1 and name not in WIDTHS and _indices_count_values(primvar, element_size):
        element_size = 1
    return is_declared_drawable(name, value_type, interpolation, element_size)


def _indices_count_values(primvar: UsdGeom.Primvar, element_size: int) -> bool:
    """Return whether a primvar's indices go beyond its elements, though not beyond its values.

    Some exporters declare all values as one element.
    """
    time = Usd.TimeCode.EarliestTime()
    values, indices = primvar.Get(time), primvar.GetIndices(time)
    if not indices or not hasattr(values, "__len__"):
        return False
    return len(values) // element_size <= max(indices) < len(values)


def is_declared_drawable(name: str, value_type: Sdf.ValueTypeName, interpolation: str, element_size: int) -> bool:
    """Return whether a primvar that is declared so can hold a scalar or vector per element."""
    if name in WIDTHS:
        return True
    return (
        element_size == 1
        and not name.startswith("skel:")
        and _holds_numbers(value_type)
        and (value_type.isArray or interpolation == "constant")
    )


@functools.cache
def _holds_numbers(value_type: Sdf.ValueTypeName) -> bool:
    return _NUMBER_TYPE.fullmatch(value_type.scalarType.cppTypeName) is not None


def read_primvar(
    primvar: UsdGeom.Primvar,
    layout: Elements,
    time: Usd.TimeCode,
    report: Report,
    interpolation: str | None = None,
) -> Primvar | None:
    """Return a primvar's values and what each triangle corner takes of them; None, with a diagnostic, if unusable.

    Args:
        primvar: The primvar.
        layout: Numbering of its prim's elements.
        time: When it is read.
        report: Takes the diagnostics.
        interpolation: What its elements belong to; None: as it says itself.
    """
    values = _values(primvar, time, report)
    if values is None:
        return None
    element_size = primvar.GetElementSize()
    if element_size > 1 and _indices_count_values(primvar, element_size):
        what = f"{primvar.GetName()}: its indices count values, not elements of {element_size}; read value by value"
        report.warn(WRONG_LENGTH, primvar.GetAttr().GetPrim().GetPath(), what)
    indices = primvar.GetIndices(time) if primvar.IsIndexed() else None
    return lay_out(
        values,
        None if indices is None else np.asarray(indices, np.int64).reshape(-1),
        interpolation or str(primvar.GetInterpolation()),
        layout,
        f"{primvar.GetAttr().GetPrim().GetPath()}",
        primvar.GetName(),
        report,
    )


def lay_out(
    values: np.ndarray,
    indices: np.ndarray | None,
    interpolation: str,
    layout: Elements,
    prim: str,
    name: str,
    report: Report,
) -> Primvar | None:
    """Return values by triangle corner; None, with a diagnostic, where lengths or indices do not fit.

    Args:
        values: Rows, shape [k, c].
        indices: Row of each element, shape [e]; None: the elements are the rows.
        interpolation: What the elements belong to.
        layout: Numbering of the mesh's elements.
        prim: Path, for diagnostics.
        name: Attribute, for diagnostics.
        report: Takes the diagnostics.
    """
    expected = layout.element_counts(interpolation)
    if not expected:
        report.warn(WRONG_LENGTH, prim, f"{name} left out: there is no interpolation {interpolation!r}")
        return None
    length = len(values) if indices is None else len(indices)
    if length not in expected:
        if interpolation != "constant" or not length:
            needed = " or ".join(map(str, expected))
            report.warn(WRONG_LENGTH, prim, f"{name} left out: {length} elements, {interpolation} needs {needed}")
            return None
        report.warn(WRONG_LENGTH, prim, f"{name}: {length} elements, constant takes the first")
    if indices is not None and (indices.min(initial=0) < 0 or indices.max(initial=-1) >= len(values)):
        report.warn(BAD_INDEX, prim, f"{name} left out: an index is outside 0..{len(values) - 1}")
        return None
    return layout.primvar(values, indices, interpolation)


def read_constants(prim: Usd.Prim, time: Usd.TimeCode, report: Report) -> dict[str, np.ndarray]:
    """Return the own primvars of a prim that has no elements, an implicit shape: float32, shape [c], by name."""
    found = {}
    for primvar in _own_primvars(prim, report):
        name = primvar.GetPrimvarName()
        if name == "normals" or not is_drawable(primvar):
            continue
        single = read_primvar(primvar, _ONE_ELEMENT, time, report)
        if single is not None:
            found[name] = single.values[0]
    return found


def inherited_constants(
    primvars: Sequence[UsdGeom.Primvar], time: Usd.TimeCode, report: Report
) -> dict[str, np.ndarray]:
    """Return the values of primvars that prims below inherit: float32, shape [c], by name."""
    found = {}
    for primvar in primvars:
        name = primvar.GetPrimvarName()
        if name == "normals" or not is_drawable(primvar):
            continue
        single = read_primvar(primvar, _ONE_ELEMENT, time, report)
        if single is not None:
            found[name] = single.values[0]
    return found


def merge_width(values: np.ndarray, width: int) -> np.ndarray:
    """Return values, shape [..., n], with ``width`` components: padded with zeros, or cut."""
    if values.shape[-1] >= width:
        return values[..., :width]
    padding = [(0, 0)] * (values.ndim - 1) + [(0, width - values.shape[-1])]
    return np.pad(values, padding)


def rows_by_instance(
    prim: Usd.Prim, instance_count: int, time: Usd.TimeCode, report: Report
) -> Mapping[str, np.ndarray]:
    """Return the primvars of a PointInstancer that give each instance its own value: float32, shape [n, c], by name.

    Others are those of ``constants_of_instances``.
    """
    found = {}
    element = np.arange(instance_count, dtype=np.int32)
    layout = Layout(
        instance_count,
        instance_count,
        instance_count,
        np.repeat(element[:, None], 3, axis=1),
        element,
        np.repeat(element[:, None], 3, axis=1),
    )
    for primvar in _own_primvars(prim, report):
        if primvar.GetInterpolation() in _SAME_FOR_INSTANCES or not is_drawable(primvar):
            continue
        laid_out = read_primvar(primvar, layout, time, report)
        if laid_out is not None and laid_out.indices is not None:
            found[primvar.GetPrimvarName()] = laid_out.values[laid_out.indices[:, 0]]
    return found


def constants_of_instances(prim: Usd.Prim, time: Usd.TimeCode, report: Report) -> dict[str, np.ndarray]:
    """Return the primvars of a PointInstancer that are the same for each instance: float32, shape [c], by name.

    Those are its constant and uniform ones, "applied exactly to each instance with constant interpolation at the root
    of the instance" (UsdGeomPointInstancer, "Primvars on PointInstancer").
    """
    found = {}
    for primvar in _own_primvars(prim, report):
        if primvar.GetInterpolation() in _SAME_FOR_INSTANCES and is_drawable(primvar):
            single = read_primvar(primvar, _ONE_ELEMENT, time, report, interpolation="constant")
            if single is not None:
                found[primvar.GetPrimvarName()] = single.values[0]
    return found


def _values(primvar: UsdGeom.Primvar, time: Usd.TimeCode, report: Report) -> np.ndarray | None:
    """Return finite rows, or None where the primvar is blocked or, with a diagnostic, of an unusable type."""
    value = primvar.Get(time)
    if value is None:
        return None
    held = type(value).__name__  # the attribute's type is the schema's, whatever a layer declares
    if type(value).__module__ != "pxr.Vt":  # not an array, which the attribute's type need not tell
        value = np.asarray(value)[None]
    values = float_rows(value)
    prim = primvar.GetAttr().GetPrim().GetPath()
    width = WIDTHS.get(primvar.GetPrimvarName())
    if values is None or (width and values.shape[1] != width):
        report.warn(WRONG_TYPE, prim, f"{primvar.GetName()} left out: it holds a {held}, which does not fit")
        return None
    is_bad = ~np.isfinite(values).all(axis=1)
    if is_bad.any():
        report.warn(
            NOT_FINITE, prim, f"{primvar.GetName()}: {counted(is_bad.sum(), 'value')} not finite: counted as zero"
        )
        values = np.where(is_bad[:, None], np.float32(0), values)
    space = color_space_of(primvar.GetAttr(), report)
    if space and values.shape[1] >= 3:
        values = np.concatenate([space.to_linear(values[:, :3]).astype(np.float32), values[:, 3:]], axis=1)
    return values
