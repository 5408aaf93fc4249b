# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Primvars that materials ask for and prims do not have: found once all is placed, as instancers give them, too."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pxr import Usd, UsdGeom

from warp_rt.report import Report, first_of
from warp_rt.scene import Material, Mesh, Shapes, Texture
from warp_rt.scene.programs import Op
from warp_rt.usd.gprims import Gprims
from warp_rt.usd.placement import Group
from warp_rt.usd.primvars import WIDTHS, WRONG_TYPE, is_drawable

NO_SUCH_PRIMVAR = "N912"
NARROW_PRIMVAR = "N927"


def report_missing_primvars(
    stage: Usd.Stage,
    group: Group,
    gprims: Gprims,
    materials: Sequence[Material],
    textures: Sequence[Texture],
    report: Report,
) -> None:
    """Report primvars of a type that no material can read, and textures whose coordinates a prim does not have.

    That a primvar reader's fallback steps in is what fallbacks are for; a texture then shows one texel everywhere,
    which nobody means.
    """
    asked = [_asked(material, textures) for material in materials]
    users: dict[int, list[int]] = {}
    for row, material_set in enumerate(gprims.material_sets):
        for material in set(material_set):
            if asked[material]:
                users.setdefault(material, []).append(row)
    for material, sets in users.items():
        rows = np.flatnonzero(np.isin(gprims.materials[group.gprim], sets))
        for name, (width, is_coordinate) in asked[material].items():
            narrow = rows[_is_narrow(name, width, group, gprims, rows)]
            if len(narrow):
                paths = _paths(narrow, group, gprims)
                named = f"{first_of(paths)} {'have' if len(paths) > 1 else 'has'}"
                message = f"reads {width} components of {name}, of which {named} fewer: the others count as 0"
                report.warn(NARROW_PRIMVAR, materials[material].path, message)
            lacking = rows[~_has_value(name, group, gprims, rows)]
            missing = []
            for path in _paths(lacking, group, gprims):
                primvar = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath(path)).FindPrimvarWithInheritance(name)
                if not primvar or not primvar.HasAuthoredValue():
                    missing.append(path)
                elif not is_drawable(primvar):
                    report.warn(WRONG_TYPE, path, f"primvars:{name} left out: no material can read {_kind(primvar)}")
            if missing and is_coordinate:
                what = f"the primvar {name} that a texture's coordinates come from"
                message = f"{first_of(missing)} {'lack' if len(missing) > 1 else 'lacks'} {what}: one texel is shown"
                report.warn(NO_SUCH_PRIMVAR, materials[material].path, message)


def _paths(rows: np.ndarray, group: Group, gprims: Gprims) -> list[str]:
    """Return the prims of rows of a group, each once."""
    return list(dict.fromkeys(gprims.prims[row] for row in np.unique(gprims.prim[group.gprim[rows]])))


def _asked(material: Material, textures: Sequence[Texture]) -> dict[str, tuple[int, bool]]:
    """Return the primvars that a material reads, by name: how many components, whether they are coordinates."""
    names: dict[str, tuple[int, bool]] = {}

    def ask(name: str, width: int, is_coordinate: bool) -> None:
        before = names.get(name, (0, False))
        names[name] = max(before[0], width), before[1] or is_coordinate

    def ask_for_coordinates(row: int) -> None:
        if textures[row].image >= 0 and np.any(textures[row].uv_transform[:, :2]):
            ask(textures[row].primvar, 2, True)

    for value in material.inputs.values():
        if value.program is not None:
            for step in value.program.steps:
                if step.op is Op.PRIMVAR:
                    ask(step.primvar, 1, False)
                elif step.op is Op.TEXTURE:
                    ask_for_coordinates(step.texture)
                elif step.primvar:
                    ask(step.primvar, 2, True)
            continue
        if value.texture < 0:
            if value.primvar and value.primvar not in WIDTHS:  # whose types are checked where they are read
                read = np.flatnonzero(value.scale[:3])  # of a vector
                ask(value.primvar, value.channel + 1 if value.channel >= 0 else int(read.max(initial=0)) + 1, False)
            continue
        ask_for_coordinates(value.texture)
    return names


def _kind(primvar: UsdGeom.Primvar) -> str:
    size, kind = primvar.GetElementSize(), primvar.GetTypeName()
    return f"the type {kind}" if size == 1 else f"elements of {size} {kind.scalarType}"


def _has_value(name: str, group: Group, gprims: Gprims, rows: np.ndarray) -> np.ndarray:
    """Return which rows of a group have a primvar, of their mesh or from above: bool."""
    has_own = np.array([_has_own(name, mesh) for mesh in gprims.meshes] or [False])[gprims.mesh[group.gprim[rows]]]
    return has_own | ~np.isnan(group.values[name][rows, 0]) if name in group.values else has_own


def _is_narrow(name: str, width: int, group: Group, gprims: Gprims, rows: np.ndarray) -> np.ndarray:
    """Return which rows of a group take a primvar of fewer components, of their mesh or from above: bool."""
    own = [name in mesh.primvars and mesh.primvars[name].values.shape[-1] < width for mesh in gprims.meshes]
    is_narrow = np.array(own or [False])[gprims.mesh[group.gprim[rows]]]
    if name not in group.values:
        return is_narrow
    values = group.values[name]
    return np.where(np.isnan(values[rows, 0]), is_narrow, values.shape[1] < width)


def _has_own(name: str, geometry: Mesh | Shapes) -> bool:
    is_parametric = name == "st" and isinstance(geometry, Shapes) and geometry.has_st
    return name in geometry.primvars or is_parametric
