# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdRenderVars to AOVs.

Reference: UsdRenderVar schema documentation; the names of raw variables are Hydra's (HdAovTokens), beside which those
that RenderMan and Arnold have for the same are known.
"""

from __future__ import annotations

import re

from pxr import Sdf, Usd, UsdRender

from warp_rt.options import is_primvar_aov
from warp_rt.report import Report
from warp_rt.scene import RenderVar
from warp_rt.usd.attribute_values import shown
from warp_rt.usd.context import SHOWN
from warp_rt.usd.setting_values import steady_value

UNKNOWN_VAR = "W525"
OTHER_TYPE = "N941"

_AOVS = {
    **dict.fromkeys(("color", "Ci", "RGBA", "RGB", "beauty"), "color"),
    **dict.fromkeys(("alpha", "a", "A"), "alpha"),
    **dict.fromkeys(("cameraDepth", "depth", "z", "Z"), "cameraDepth"),
    **dict.fromkeys(("normal", "normals", "N", "Nn"), "normal"),
    **dict.fromkeys(("position", "P"), "position"),
    **dict.fromkeys(("uv", "st", "primvars:st"), "uv"),
    **{name: name for name in ("distance", "Neye", "Peye", "primId", "instanceId", "elementId")},
}
_KINDS = ("raw", "primvar", "lpe", "intrinsic")
_IDS = ("primId", "instanceId", "elementId")
_COMPONENTS = {  # that a type may have; those of a primvar are not known yet
    "color": (3, 4),
    **dict.fromkeys(("alpha", "cameraDepth", "distance", *_IDS), (1,)),
    **dict.fromkeys(("normal", "Neye", "position", "Peye"), (3,)),
    "uv": (2,),
}
# C++ types of those that hold whole numbers and floats.
_WHOLE = re.compile(r"GfVec(\d)i|(?:unsigned )?(?:int|long)")
_FLOATS = re.compile(r"GfVec(\d)[fdh]|float|double|pxr_half::half")
# Light path expressions of all light that reaches the camera by any way.
_ALL_LIGHT = re.compile(r"(?:lpe:)?C(?:<?\.>?)?\*(?:\[<?L\.>?O\]|\[LO\]|L|O)?|(?:lpe:)?beauty")
LAYER_NAME = "driver:parameters:aov:name"  # what hosts call the layer, where not as the prim


def read_render_var(prim: Usd.Prim, path: Sdf.Path, report: Report) -> RenderVar | None:
    """Return what a RenderVar asks for; None, with a diagnostic, where there is no such AOV.

    Args:
        prim: Target of a product's ``orderedVars``.
        path: Where it should be.
        report: Takes diagnostics.
    """
    if not prim or not prim.IsA(UsdRender.Var) or not SHOWN(prim):
        report.warn(UNKNOWN_VAR, path, "is named as a render var, but is no RenderVar that is active; left out")
        return None
    schema = UsdRender.Var(prim)
    kind, name = str(steady_value(schema.GetSourceTypeAttr())), str(steady_value(schema.GetSourceNameAttr()) or "")
    # Exporters that leave the name to the prim, or write the type in its place.
    name = prim.GetName() if name in ("", "raw") and kind == "raw" else name
    aov = _aov_of(kind, name)
    if aov is None:
        report.warn(UNKNOWN_VAR, prim.GetPath(), f"there is no {kind or 'such'} variable {shown(name)}; left out")
        return None
    layer = prim.GetAttribute(LAYER_NAME).Get() if prim.HasAttribute(LAYER_NAME) else None
    data_type = schema.GetDataTypeAttr()
    asked = str(steady_value(data_type))
    if data_type.HasAuthoredValue() and not _is_type_of(asked, aov):
        what, count = "whole number" if aov in _IDS else "float", _COMPONENTS.get(aov, (0,))[0]
        number = f"{count} {what}s" if count > 1 else f"a {what}" if count else f"{what}s"
        report.warn(OTHER_TYPE, prim.GetPath(), f"dataType {shown(asked)}: {aov} is written as {number}")
    is_half = asked.rstrip("1234").endswith(("half", "h"))
    return RenderVar(str(prim.GetPath()), str(layer or prim.GetName()), aov, is_half)


def _is_type_of(data_type: str, aov: str) -> bool:
    """Return whether a USD type is that of an AOV, whatever its precision and role."""
    found = (_WHOLE if aov in _IDS else _FLOATS).fullmatch(Sdf.ValueTypeNames.Find(data_type).type.typeName)
    count = int(found[1] or 1) if found else 0
    return count > 0 and count in _COMPONENTS.get(aov, (count,))


def _aov_of(kind: str, name: str) -> str | None:
    if kind not in _KINDS:
        return None
    if kind == "lpe":
        return "color" if _ALL_LIGHT.fullmatch(name.replace(" ", "")) else None
    primvar = f"primvars:{name.removeprefix('primvars:')}"
    if kind == "primvar" or name.startswith("primvars:"):
        return _AOVS.get(primvar) or (primvar if is_primvar_aov(primvar) else None)
    return _AOVS.get(name)
