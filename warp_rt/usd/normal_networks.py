# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Which frame the normal is in that a MaterialX network gives: the world's, or that of a normal map.

MaterialX's surfaces take normals of the world, to which its normalmap node brings the texels of a map; here those stay
in the map's frame, as UsdPreviewSurface has it.
"""

from __future__ import annotations

from pxr import Sdf, UsdShade

from warp_rt.report import Report
from warp_rt.scene import NormalFrame
from warp_rt.usd.shading_network import Node, find_source

_MAPS = (
    *("ND_normalmap", "ND_gltf_normalmap", "ND_heighttonormal", "ND_bump"),
    *("ND_image", "ND_tiledimage", "ND_UsdUVTexture"),
)
_OF_WORLD = ("ND_normal_", "ND_tangent_", "ND_bitangent_", "ND_transformnormal_", "ND_transformvector_")
_UNRELATED = ("ND_triplanarprojection_",)  # whose normal merely weighs


def frame_of(port: UsdShade.Input, report: Report) -> NormalFrame:
    """Return the frame of a normal of MaterialX's, whose maps are in that of the primvar.

    Args:
        port: The normal's input of a surface.
        report: Takes a diagnostic for broken connections.
    """
    waiting, seen, found = [port], set[Sdf.Path](), False
    while waiting:
        source = find_source(waiting.pop(), report)
        if not isinstance(source, Node) or source.shader.GetPath() in seen:
            continue
        seen.add(source.shader.GetPath())
        if source.id.startswith(_MAPS):
            return NormalFrame.PRIMVAR
        found = found or source.id.startswith(_OF_WORLD)
        if not source.id.startswith((*_OF_WORLD, *_UNRELATED)):
            waiting += source.shader.GetInputs()
    return NormalFrame.WORLD if found else NormalFrame.PRIMVAR
