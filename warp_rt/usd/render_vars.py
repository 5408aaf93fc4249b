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

UNKNOWN_VAR = "W525"

_AOVS = {
    **dict.fromkeys(("color", "Ci", "RGBA", "RGB", "beauty"), "color"),
    **dict.fromkeys(("alpha", "a", "A"), "alpha"),
    **dict.fromkeys(("cameraDepth", "depth", "z", "Z"), "cameraDepth"),
    **dict.fromkeys(("normal", "normals", "N", "Nn"), "normal"),
    **dict.fromkeys(("position", "P"), "position"),
    **dict.fromkeys(("uv", "st", "primvars:st"), "uv"),
    **{name: name for name in ("distance", "Neye", "Peye", "primId", "instanceId", "elementId")},
}
# Light path expressions of all light that reaches the camera by any way.
_ALL_LIGHT = re.compile(r"(?:lpe:)?C(?:<?\.>?)?\*(?:\[<?L\.>?O\]|\[LO\]|L|O)?|(?:lpe:)?beauty")
_LAYER = "driver:parameters:aov:name"  # what hosts call the layer, where not as the prim


def read_render_var(prim: Usd.Prim, path: Sdf.Path, report: Report) -> RenderVar | None:
    """Return what a RenderVar asks for; None, with a diagnostic, where there is no such AOV.

    Args:
        prim: Target of a product's ``orderedVars``.
        path: Where it should be.
        report: Takes diagnostics.
    """
    if not prim or not prim.IsA(UsdRender.Var):
        report.warn(UNKNOWN_VAR, path, "is named as a render var, but is no RenderVar; left out")
        return None
    schema = UsdRender.Var(prim)
    kind, name = str(schema.GetSourceTypeAttr().Get()), str(schema.GetSourceNameAttr().Get() or "")
    # Exporters that leave the name to the prim, or write the type in its place.
    name = prim.GetName() if name in ("", "raw") and kind == "raw" else name
    aov = _aov_of(kind, name)
    if aov is None:
        report.warn(UNKNOWN_VAR, prim.GetPath(), f"there is no {kind} variable {shown(name)}; left out")
        return None
    layer = prim.GetAttribute(_LAYER).Get() if prim.HasAttribute(_LAYER) else None
    is_half = str(schema.GetDataTypeAttr().Get()).rstrip("1234").endswith(("half", "h"))
    return RenderVar(str(prim.GetPath()), str(layer or prim.GetName()), aov, is_half)


def _aov_of(kind: str, name: str) -> str | None:
    if kind == "lpe":
        return "color" if _ALL_LIGHT.fullmatch(name.replace(" ", "")) else None
    primvar = f"primvars:{name.removeprefix('primvars:')}"
    if kind == "primvar" or name.startswith("primvars:"):
        return _AOVS.get(primvar) or (primvar if is_primvar_aov(primvar) else None)
    return _AOVS.get(name)
