# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Inputs of MaterialX's nodes that do not count here, which is told where they say anything but the usual.

Reference: MaterialX Specification 1.39, image nodes, normalmap and bump.
"""

from __future__ import annotations

import re

from pxr import Usd, UsdShade

from warp_rt.report import Report
from warp_rt.usd.attribute_values import shown
from warp_rt.usd.shading_network import Node, find_source, read_constant

UNKNOWN_NODE = "W303"
_IMAGES = re.compile(r"ND_(?:(?:tiled|gltf_|gltf_color)?image|triplanarprojection)(?:_.*)?")
_FRAMED = re.compile(r"ND_(?:normalmap|bump)(?:_.*)?")
_OF_IMAGES = {"layer": "", "framerange": "", "frameoffset": 0, "frameendaction": "constant"}
_OF_FRAMES = ("normal", "tangent", "bitangent")


def note_left_out(node: Node, time: Usd.TimeCode, report: Report) -> None:
    """Report the inputs of a node that say something and do not count."""
    if _IMAGES.fullmatch(node.id):
        for name, usual in _OF_IMAGES.items():
            value = read_constant(node.shader, name, time, report)
            if value is not None and value != usual:
                report.warn(UNKNOWN_NODE, node.shader.GetPath(), f"its {name}, {shown(value)}, is left out")
    if _FRAMED.fullmatch(node.id):
        for name in _OF_FRAMES:
            if _is_own(node.shader.GetInput(name), name, report):
                continue
            report.warn(UNKNOWN_NODE, node.shader.GetPath(), f"its {name} is left out: that of the surface counts")


def _is_own(port: UsdShade.Input | None, name: str, report: Report) -> bool:
    """Return whether an input says nothing, or what a node of its name gives, which is the surface's own."""
    source = find_source(port, report) if port else None
    return source is None or (isinstance(source, Node) and source.id.startswith(f"ND_{name}_"))
