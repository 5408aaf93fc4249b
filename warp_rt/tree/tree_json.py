# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A ray tree as plain values, complete: what ``warp-rt tree --json`` prints."""

from __future__ import annotations

import math
from typing import Any

from warp_rt.tree.equation import nested_equation
from warp_rt.tree.nodes import Crossing, LightTerm, Place, TreeNode
from warp_rt.tree.pixel_tree import PixelTree
from warp_rt.tree.selection import select

EQUATION_NODES = 200
"""Nodes that an equation writes out; a longer one nobody reads, and nodes hold its numbers."""


def tree_object(tree: PixelTree) -> dict[str, Any]:
    """Return a tree as numbers, texts, lists and dictionaries; what is infinite or unknown is None.

    Nodes are a flat list, parents before children, which name each other by ``index``.
    """
    shown = select(tree.roots, nodes=EQUATION_NODES)
    parents = {child.index: node.index for node in tree for child in node.children}
    return {
        "source": tree.source,
        "camera": tree.camera,
        "time": tree.time,
        "x": tree.x,
        "y": tree.y,
        "width": tree.width,
        "height": tree.height,
        "spp": tree.spp,
        "depth": tree.depth,
        "threshold": tree.threshold,
        "value": list(tree.value),
        "alpha": tree.alpha,
        "exposure_scale": tree.exposure_scale,
        "rgb8": list(tree.rgb8),
        "rays": tree.counts,
        "samples": [
            {
                "sample": sample,
                "root": root.index,
                "value": list(root.value),
                "equation": [nested_equation(root, k, shown=shown, times=" * ", form=repr) for k in range(3)],
            }
            for sample, root in zip(tree.samples, tree.roots, strict=True)
        ],
        "nodes": [_node(node, parents.get(node.index)) for node in tree],
    }


def _node(node: TreeNode, parent: int | None) -> dict[str, Any]:
    return {
        "index": node.index,
        "parent": parent,
        "children": [child.index for child in node.children],
        "kind": node.kind.name.lower(),
        "depth": node.depth,
        "weight": node.weight,
        "coefficient": list(node.coefficient),
        "origin": list(node.origin),
        "direction": list(node.direction),
        "distance": _finite(node.distance),
        **_place(node.place),
        "model": node.model or None,
        "position": None if node.has_left else list(node.position),
        "normal": None if node.has_left else list(node.normal),
        "presence": node.presence,
        "local": list(node.local),
        "emission": list(node.emission),
        "ambient": list(node.ambient),
        "lights": [_light(light) for light in node.lights],
        "kr": list(node.kr),
        "kt": list(node.kt),
        "fresnel": None if node.fresnel is None else list(node.fresnel),
        "eta": node.eta,
        "total_internal_reflection": node.is_totally_reflected,
        "reflection": node.reflection.name.lower(),
        "refraction": node.refraction.name.lower(),
        "passage": node.passage.name.lower(),
        "end": node.end or None,
        "value": list(node.value),
        "contribution": list(node.contribution),
    }


def _light(light: LightTerm) -> dict[str, Any]:
    return {
        "light": light.light,
        "kind": light.kind,
        "cosine": light.cosine,
        "direction": list(light.direction) if any(light.direction) else None,
        "to_shadow": list(light.to_shadow) if any(light.to_shadow) else None,
        "distance": _finite(light.distance),
        "color": list(light.color),
        "visible": list(light.visible),
        "samples": light.samples,
        "shadow_ray": light.has_shadow_ray,
        "shadow_rays": light.shadow_rays,
        "linked": light.is_linked,
        "diffuse": list(light.diffuse),
        "specular": list(light.specular),
        "unshadowed_diffuse": list(light.unshadowed_diffuse),
        "unshadowed_specular": list(light.unshadowed_specular),
        "total": list(light.total),
        "crossings": [_crossing(crossing) for crossing in light.crossings],
    }


def _crossing(crossing: Crossing) -> dict[str, Any]:
    return {**_place(crossing.place), "distance": crossing.distance, "factor": list(crossing.factor)}


def _place(place: Place | None) -> dict[str, Any]:
    if place is None:
        return dict.fromkeys(("prim", "instance", "face", "material"))
    return {"prim": place.prim, "instance": place.instance or None, "face": place.face, "material": place.material}


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
