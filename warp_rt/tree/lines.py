# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What is told about a node, as lines of styled words: terminals and notebooks show the same ones."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from warp_rt.report import counted
from warp_rt.stand_ins import shown_path
from warp_rt.tree.nodes import Color, Fate, LightTerm, Place, RayKind, TreeNode
from warp_rt.tree.numbers import color, number, percent, point
from warp_rt.tree.pixel_tree import PixelTree
from warp_rt.tree.selection import share_of

_NOTHING = 1e-9
"""Light that nobody would call any: highlights fade out into numbers like 1e-38."""

Span = tuple[str, str]
"""Text, and the name of its style: one of ``STYLES``, or empty."""
Line = tuple[int, tuple[Span, ...]]
"""Columns by which it is indented, and what it says."""

STYLES = {
    "eye": "#b8860b",
    "reflection": "#d1495b",
    "refraction": "#2e86ab",
    "passage": "#6a994e",
    "shadow": "#8d6a9f",
    "dim": "#808080",
    "strong": "",
}
"""Colour of each style; the first four are the kinds of rays. ``strong`` is bold instead."""

KIND_STYLES = {
    RayKind.EYE: "eye",
    RayKind.REFLECTION: "reflection",
    RayKind.REFRACTION: "refraction",
    RayKind.PASSAGE: "passage",
}
KIND_NAMES = {
    RayKind.EYE: "eye ray",
    RayKind.REFLECTION: "R reflection",
    RayKind.REFRACTION: "T refraction",
    RayKind.PASSAGE: "straight on",
}

LIGHTS_SHOWN = 8
"""Lights that are told of at one node; of more, those that add most, or would without their shadows."""


def heading(tree: PixelTree) -> list[Line]:
    """Return the lines about the pixel as a whole."""
    about = f"{shown_path(tree.source or 'scene')}, camera {shown_path(tree.camera)}"
    about += f", time {tree.time:g}" if tree.time is not None else ""
    red, green, blue = tree.rgb8
    lines: list[Line] = [
        (0, ((f"pixel ({tree.x}, {tree.y})", "strong"), (f" of {tree.width} x {tree.height}, {about}", ""))),
        (0, (("I = ", ""), (color(tree.value), "strong"), (f" linear, {red:g} {green:g} {blue:g} in 8 bits", ""))),
    ]
    scale = "" if tree.exposure_scale == 1 else f" times the camera's exposure {number(tree.exposure_scale)}"
    if not tree.is_whole:
        lines.append((0, ((f"sample {tree.samples[0]} of {tree.spp}{scale}", ""),)))
    elif tree.spp > 1 or scale:
        mean = f"the mean of {tree.spp} samples" if tree.spp > 1 else "the eye ray's I"
        lines.append((0, ((f"{mean}{scale}", ""),)))
    lines.append((0, ((_counts(tree), ""),)))
    if len(tree) > 3:
        lines.append((0, ((f"most of it: {_largest(tree)}", ""),)))
    return lines


def _counts(tree: PixelTree) -> str:
    counts = tree.counts
    parts = [
        counted(counts["nodes"], "node"),
        counted(counts["reflection"], "reflection"),
        counted(counts["refraction"], "refraction"),
        counted(counts["shadow"], "shadow ray"),
        f"deepest level {counts['deepest']} of {tree.depth}",
    ]
    if counts["passage"]:
        parts.append(f"{counts['passage']} passed straight on")
    if counts["total_internal_reflection"]:
        parts.append(counted(counts["total_internal_reflection"], "total internal reflection"))
    for reason in ("threshold", "depth"):
        if counts[f"dropped_by_{reason}"]:
            parts.append(f"{counts[f'dropped_by_{reason}']:,} dropped by {reason}")
    return ", ".join(parts)


def _largest(tree: PixelTree) -> str:
    """Return the three nodes whose own light is most of the pixel."""
    whole = _sum(root.value for root in tree.roots)
    nodes = sorted(tree, key=lambda node: -sum(map(abs, node.contribution)))[:3]
    parts = []
    for node in nodes:
        share = share_of(node.contribution, whole)
        if share:
            parts.append(f"#{node.index} {_met(node)} {percent(share)}")
    return ", ".join(parts) or "nothing, the pixel is black"


def _met(node: TreeNode) -> str:
    return shown_path(node.place.prim) if node.place else "background"


def node_title(node: TreeNode, whole: Color) -> tuple[Span, ...]:
    """Return one line on a node: what sent its ray, its value, and what that adds to the pixel.

    Args:
        node: The node.
        whole: Sum of all samples' values, which its share is of.
    """
    style = KIND_STYLES[node.kind]
    spans: list[Span] = [(KIND_NAMES[node.kind], style), (f" #{node.index}", "dim")]
    spans.append((f" level {node.depth}, weight {number(node.weight)}, ", ""))
    spans.append((f"I = {color(node.value)}", "strong"))
    if node.kind is not RayKind.EYE:
        share = percent(share_of(node.subtree_contribution, whole))
        spans.append((f", adds {color(node.subtree_contribution)}{f' ({share})' if share else ''}", ""))
    return tuple(spans)


def hidden_title(node: TreeNode, whole: Color) -> tuple[Span, ...]:
    """Return one line that stands for a node and all below it."""
    share = percent(share_of(node.subtree_contribution, whole))
    levels = f"level {node.depth}" if node.deepest == node.depth else f"levels {node.depth} to {node.deepest}"
    text = (
        f" #{node.index}, {counted(node.size, 'node')} on {levels}, not shown: adds {color(node.subtree_contribution)}"
    )
    return ((KIND_NAMES[node.kind], KIND_STYLES[node.kind]), (text + (f" ({share})" if share else ""), "dim"))


def node_lines(node: TreeNode, tree: PixelTree) -> list[Line]:
    """Return the lines below a node's title."""
    if node.place is None:
        return [(0, ((f"leaves the scene along {point(node.direction)} and brings back {color(node.local)}", ""),))]
    lines: list[Line] = [
        (0, (("meets ", ""), (_place(node.place), "strong"), (f", {_material(node)}", ""))),
        (0, ((f"P {point(node.position)}, {number(node.distance)} along the ray, N {point(node.normal)}", ""),)),
    ]
    if node.presence < 1:
        there = f"{percent(node.presence)} of the surface is there" if node.presence else "nothing is there: a cut-out"
        lines.append((0, ((there + _fate_of_passage(node), ""),)))
    if node.presence > 0:
        lines += _local(node)
        lines += _coefficients(node, tree)
    return lines


def _place(place: Place) -> str:
    instance = f" in {shown_path(place.instance)}" if place.instance else ""
    return f"{shown_path(place.prim)}{instance} face {place.face}"


def _material(node: TreeNode) -> str:
    path = shown_path(node.place.material) if node.place else ""
    return f"{node.model} {path}"


def _fate_of_passage(node: TreeNode) -> str:
    return "; the path has passed through too many surfaces" if node.passage is Fate.PASSES else ""


def _local(node: TreeNode) -> list[Line]:
    lines: list[Line] = [(0, (("I_local = ", ""), (color(node.local), "strong")))]
    if any(node.emission):
        lines.append((2, ((f"emission {color(node.emission)}", ""),)))
    lines.append((2, ((f"ambient ka Ia = {color(node.ambient)}", ""),)))
    if not node.lights:
        lines.append((2, (("no light adds to it: kd = ks = 0", ""),)))
    shown = _shown_lights(node.lights)
    for light in shown:
        lines += _light(light)
    if len(shown) < len(node.lights):
        rest = [light for light in node.lights if light not in shown]
        behind = sum(not light.is_facing for light in rest)
        shadowed = sum(light.is_facing and not any(light.visible) for light in rest)
        total = color(_sum(light.total for light in rest))
        what = f"{counted(len(rest), 'more light')}: {behind} behind the surface, {shadowed} in shadow, add {total}"
        lines.append((2, ((what, "dim"),)))
    return lines


def _shown_lights(lights: Sequence[LightTerm]) -> list[LightTerm]:
    if len(lights) <= LIGHTS_SHOWN:
        return list(lights)

    def amount(light: LightTerm) -> float:
        return sum(map(abs, light.unshadowed_diffuse)) + sum(map(abs, light.unshadowed_specular))

    chosen = {id(light) for light in sorted(lights, key=amount, reverse=True)[:LIGHTS_SHOWN]}
    return [light for light in lights if id(light) in chosen]


def _light(light: LightTerm) -> list[Line]:
    name: Span = (shown_path(light.light), "shadow")
    if light.cosine is None:
        return [(2, (name, (" all around", ""))), (4, ((_terms(light), ""),))]
    if not light.is_linked:
        return [(2, (name, (" is not linked to this prim", "dim")))]
    if light.cosine == 0:
        return [(2, (name, (" sends nothing this way", "dim")))]
    if light.cosine < 0:
        return [(2, (name, (f" is behind the surface, N.L = {number(light.cosine)}", "dim")))]
    about = f"N.L = {number(light.cosine)}, I_l = {color(light.color)}"
    if not light.has_shadow_ray:
        return [(2, (name, (f" casts no shadow, {about}", ""))), (4, ((_terms(light), ""),))]
    taken = f", {counted(light.samples, 'sample')}" if light.samples else ""
    lines: list[Line] = [(2, (name, (f" S = {color(light.visible)}, {about}{taken}", "")))]
    if any(light.visible):
        if light.crossings:
            through = ", ".join(f"{shown_path(c.place.prim)} ({color(c.factor)})" for c in light.crossings)
            way = "the first sample through" if light.samples else "through"
            lines.append((4, ((f"{way} {through}", ""),)))
        return [*lines, (4, ((_terms(light), ""),))]
    without = [a + b for a, b in zip(light.unshadowed_diffuse, light.unshadowed_specular, strict=True)]
    spans: list[Span] = [("shadowed by ", "")]
    if light.samples and not light.crossings:
        spans = [("in shadow", "")]
    elif light.crossings:
        last = light.crossings[-1]
        spans += [(_place(last.place), "shadow"), (f", {number(last.distance)} away", "")]
        if len(light.crossings) > 1:
            spans.append((f", the last of {len(light.crossings)} surfaces on the way", ""))
    else:
        spans.append(("too many surfaces", ""))
    if max(without) > _NOTHING:
        spans.append((f"; without it {color(without)}", "dim"))
    return [*lines, (4, tuple(spans))]


def _terms(light: LightTerm) -> str:
    terms = {"diffuse": light.diffuse, "specular": light.specular}
    told = [f"{name} {color(term)}" for name, term in terms.items() if max(term) > _NOTHING]
    return ", ".join(told) or "adds 0"


def _coefficients(node: TreeNode, tree: PixelTree) -> list[Line]:
    if not (any(node.kr) or any(node.kt)):
        fresnel = f" (specular {color(node.fresnel)}, too rough for a mirror ray)" if node.fresnel else ""
        return [(0, ((f"Kr = Kt = 0{fresnel}: the branch ends here", "dim"),))]
    text = f"Kr = {color(node.kr)}, Kt = {color(node.kt)}"
    if node.fresnel is not None:
        text += f", specular {color(node.fresnel)}"
    lines: list[Line] = [(0, ((text, ""),))]
    cosine = min(max(-sum(a * b for a, b in zip(node.normal, node.direction, strict=True)), -1.0), 1.0)
    angle = math.degrees(math.acos(cosine))
    if any(node.kt) and node.eta != 1:
        way = f"enters, n 1 to {number(1 / node.eta)}" if node.eta < 1 else f"leaves, n {number(node.eta)} to 1"
        if node.is_totally_reflected:
            critical = math.degrees(math.asin(min(1 / node.eta, 1.0)))
            total = f"total internal reflection: {angle:.1f}° is beyond the critical {critical:.1f}°"
            lines.append((0, ((f"{total}; R is weighted by Kr + Kt = {color(node.reflection_coefficient)}", ""),)))
        else:
            out = math.degrees(math.asin(min(node.eta * math.sin(math.radians(angle)), 1.0)))
            lines.append((0, ((f"{way}, {angle:.1f}° to {out:.1f}°", ""),)))
    for name, style, fate, coefficient in (
        ("R", "reflection", node.reflection, node.reflection_coefficient),
        ("T", "refraction", node.refraction, node.kt),
    ):
        if fate is Fate.THRESHOLD:
            weight = number(node.weight * node.presence * max(coefficient))
            why = f" is dropped, its weight {weight} being below the threshold {number(tree.threshold)}"
            lines.append((0, ((name, style), (why, "dim"))))
        elif fate is Fate.DEPTH:
            lines.append(
                (0, ((name, style), (f" is dropped, level {node.depth + 1} being deeper than {tree.depth}", "dim")))
            )
    return lines


def whole_of(tree: PixelTree) -> Color:
    """Return the sum of all samples' values, which shares are of."""
    return _sum(root.value for root in tree.roots)


def _sum(colors: Iterable[Color]) -> Color:
    red = green = blue = 0.0
    for r, g, b in colors:
        red, green, blue = red + r, green + g, blue + b
    return red, green, blue
