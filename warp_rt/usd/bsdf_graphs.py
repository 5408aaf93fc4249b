# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""MaterialX surfaces built of BSDFs, ND_surface, as UsdPreviewSurfaces: what all their lobes add up to.

A graph of layers, mixtures, sums and products is a weighted sum of lobes. Diffuse lobes become ``diffuseColor``, those
that reflect ``specularColor``, by their reflectance head on, and a dielectric above others that reflect the clearcoat.

Reference: MaterialX Physically Based Shading Nodes 1.39.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from pxr import Usd, UsdShade

from warp_rt.report import Report
from warp_rt.scene import NormalFrame, OpacityMode
from warp_rt.usd.foreign_surfaces import APPROXIMATED_SURFACE
from warp_rt.usd.normal_networks import frame_of
from warp_rt.usd.preview_signals import ONE, PreviewSignals
from warp_rt.usd.shading_network import Node, find_source, read_token
from warp_rt.usd.signal_reader import UNKNOWN_NODE
from warp_rt.usd.signals import DoesNotFold, Signal, add, apply, multiply
from warp_rt.usd.surface_inputs import InputReader

SURFACE = "ND_surface"

_MAX_NODES = 128  # visited, those that several lead to as often; a circle ends there, too
_ZERO = Signal.constant((0.0,))
_BLACK = Signal.constant((0.0, 0.0, 0.0))
_GOLD = ((0.183, 0.421, 1.373), (3.424, 2.346, 1.770))  # ior and extinction where nothing is said
_SMOOTH = (0.05, 0.05)


@dataclass(frozen=True)
class _Lobe:
    """What light does at a surface in one way."""

    kind: str
    """``diffuse``, ``reflection`` or ``transmission``."""
    weight: Signal
    color: Signal
    """Of a reflection the reflectance head on."""
    roughness: Signal = ONE
    ior: Signal | None = None
    """Of a dielectric."""
    normal: UsdShade.Input | None = None
    is_coat: bool = False
    """Whether it lies over others that reflect."""


@dataclass
class _Graph:
    """What is found on the way through a graph."""

    material: Usd.Prim
    lost: dict[str, None] = field(default_factory=dict)
    """What the surface has and the material lacks, in order."""
    is_unknown: bool = False
    """Whether it has nodes that nobody knows."""
    visited: int = 0
    """Nodes so far."""


def _scaled(lobes: list[_Lobe], weight: Signal) -> list[_Lobe]:
    return [replace(lobe, weight=multiply(lobe.weight, weight)) for lobe in lobes]


def _reflectance(ior: np.ndarray, extinction: np.ndarray | float = 0.0) -> np.ndarray:
    """Return the reflectance head on of a medium in vacuum."""
    k2 = np.square(extinction)
    return np.asarray(((ior - 1) ** 2 + k2) / ((ior + 1) ** 2 + k2))


def _is_white(coat: _Lobe) -> bool:
    """Return whether a coat reflects all colours as its index of refraction says."""
    ior, color = coat.ior.value if coat.ior else None, coat.color.value
    return ior is not None and color is not None and np.allclose(color, _reflectance(np.array(ior[0])), rtol=1e-3)


class BsdfReader:
    """Reads surfaces that are graphs of BSDFs.

    Args:
        inputs: Reads the inputs of nodes.
        time: When.
        report: Takes the diagnostics.
    """

    def __init__(self, inputs: InputReader, time: Usd.TimeCode, report: Report) -> None:
        self._inputs = inputs
        self._time = time
        self._report = report

    def read(self, surface: UsdShade.Shader, material: Usd.Prim) -> PreviewSignals | None:
        """Return the UsdPreviewSurface that comes nearest, and report that it is not the same.

        None where no node is known.

        Args:
            surface: The ND_surface.
            material: The material's prim.
        """
        graph = _Graph(material)
        lobes = self._lobes(surface.GetInput("bsdf"), graph)
        emission = self._emission(surface.GetInput("edf"), graph)
        if not lobes and emission.value == _BLACK.value and (graph.lost or graph.is_unknown):
            return None
        parts = {kind: [lobe for lobe in lobes if lobe.kind == kind] for kind in ("diffuse", "reflection")}
        coats = [lobe for lobe in parts["reflection"] if lobe.is_coat]
        mirrors = [lobe for lobe in parts["reflection"] if not lobe.is_coat]
        clear = [lobe for lobe in lobes if lobe.kind == "transmission"]
        found = {
            "diffuseColor": self._sum(parts["diffuse"], surface),
            "specularColor": self._sum(mirrors, surface),
            "emissiveColor": emission,
            "roughness": mirrors[0].roughness if mirrors else ONE,
            # That of the base is in its reflectance.
            "ior": next((lobe.ior for lobe in (*clear, *coats, *mirrors) if lobe.ior), ONE),
        }
        if coats:
            found["clearcoat"] = coats[0].weight
            found["clearcoatRoughness"] = coats[0].roughness
            if clear and coats[0].ior and coats[0].ior.key != found["ior"].key:
                graph.lost["the index of refraction of its coat"] = None
            if not _is_white(coats[0]):
                graph.lost["the tint of its coat"] = None
        if len(mirrors) > 1 or len(coats) > 1:
            graph.lost["the roughness of each of its reflections"] = None
        mode = OpacityMode.TRANSPARENT
        presence = self._signal(surface, "opacity", ONE, graph)
        if clear:
            found["opacity"] = add(ONE, self._sum(clear, surface).resized(1), -1.0)
            if presence.value != (1.0,):
                graph.lost["opacity"] = None
        elif presence.value != (1.0,):
            found["opacity"], mode = presence, OpacityMode.PRESENCE
        normal = next((lobe.normal for lobe in lobes if lobe.normal), None)
        bent = self._inputs.signal(normal, material, (3,))
        if bent is not None:
            found["normal"] = bent
        frame = NormalFrame.PRIMVAR if normal is None else frame_of(normal, self._report)
        without = f", without {', '.join(graph.lost)}" if graph.lost else ""
        message = f"the surface {SURFACE!r} of BSDFs is approximated by a UsdPreviewSurface{without}"
        self._report.warn(APPROXIMATED_SURFACE, surface.GetPath(), message)
        port = surface.GetInput("bsdf") or surface.GetInput("edf")
        path = port.GetAttr().GetPath() if port else surface.GetPath()
        return PreviewSignals(
            found,
            dict.fromkeys(found, path),
            use_specular_workflow=True,
            opacity_mode=mode,
            normal_frame=frame,
        )

    def _sum(self, lobes: list[_Lobe], surface: UsdShade.Shader) -> Signal:
        """Return the sum of weight times colour; those that do not come down to one texture are left out, told."""
        total = _BLACK
        for lobe in lobes:
            try:
                total = add(total, multiply(lobe.color, lobe.weight).resized(3))
            except DoesNotFold:
                message = (
                    "of BSDFs that vary, and not by one set of coordinates, the first counts: the others are left out"
                )
                self._report.warn(UNKNOWN_NODE, surface.GetPath(), message)
        return total

    # --- graphs

    def _node(self, port: UsdShade.Input | None) -> Node | None:
        source = find_source(port, self._report) if port else None
        return source if isinstance(source, Node) else None

    def _visited(self, port: UsdShade.Input | None, graph: _Graph) -> Node | None:
        """Return the node on an input of a graph; None where there is none, or, told, after too many."""
        node = self._node(port)
        graph.visited += node is not None
        if node is None or graph.visited <= _MAX_NODES:
            return node
        graph.is_unknown = True
        message = f"a circle, or a graph of more than {_MAX_NODES} nodes: the rest is left out"
        self._report.warn(UNKNOWN_NODE, graph.material.GetPath(), message)
        return None

    def _lobes(self, port: UsdShade.Input | None, graph: _Graph) -> list[_Lobe]:
        """Return the lobes of a BSDF; what is not known of it is told."""
        node = self._visited(port, graph)
        if node is None:
            return []
        name, shader = node.id.removeprefix("ND_"), node.shader

        def below(given: str) -> list[_Lobe]:
            return self._lobes(shader.GetInput(given), graph)

        try:
            if name in ("layer_bsdf", "layer_vdf"):
                top, base = below("top"), below("base") if name == "layer_bsdf" else []
                covers = any(lobe.kind == "reflection" for lobe in base)
                return [replace(lobe, is_coat=covers and lobe.ior is not None) for lobe in top] + base
            if name == "mix_bsdf":
                share = self._signal(shader, "mix", _ZERO, graph)
                return _scaled(below("fg"), share) + _scaled(below("bg"), add(ONE, share, -1.0))
            if name == "add_bsdf":
                return below("in1") + below("in2")
            if name in ("multiply_bsdfF", "multiply_bsdfC"):
                return _scaled(below("in1"), self._signal(shader, "in2", ONE, graph))
        except DoesNotFold:
            self._report.warn(
                UNKNOWN_NODE,
                shader.GetPath(),
                f"{node.id!r}: its factors vary, and not by one set of coordinates; left out",
            )
            return []
        make = LOBES.get(name)
        if make is None:
            graph.is_unknown = True
            self._report.warn(UNKNOWN_NODE, shader.GetPath(), f"the node {node.id!r} is not supported; left out")
            return []
        return make(self, shader, graph)

    def _emission(self, port: UsdShade.Input | None, graph: _Graph) -> Signal:
        """Return the colour that an EDF sends out."""
        node = self._visited(port, graph)
        if node is None:
            return _BLACK
        name, shader = node.id.removeprefix("ND_"), node.shader

        def below(given: str) -> Signal:
            return self._emission(shader.GetInput(given), graph)

        try:
            if name in ("uniform_edf", "conical_edf"):
                if name == "conical_edf":
                    graph.lost["the cone of its emission"] = None
                return self._signal(shader, "color", Signal.constant((1.0, 1.0, 1.0)), graph)
            if name == "add_edf":
                return add(below("in1"), below("in2"))
            if name in ("multiply_edfF", "multiply_edfC"):
                return multiply(below("in1"), self._signal(shader, "in2", ONE, graph))
            if name == "mix_edf":
                share, background = self._signal(shader, "mix", _ZERO, graph), below("bg")
                return add(background, multiply(add(below("fg"), background, -1.0), share))
        except DoesNotFold:
            self._report.warn(
                UNKNOWN_NODE,
                shader.GetPath(),
                f"{node.id!r}: its factors vary, and not by one set of coordinates; left out",
            )
            return _BLACK
        graph.is_unknown = True
        self._report.warn(UNKNOWN_NODE, shader.GetPath(), f"the node {node.id!r} is not supported; left out")
        return _BLACK

    # --- inputs of BSDFs

    def _signal(self, shader: UsdShade.Shader, name: str, default: Signal, graph: _Graph) -> Signal:
        found = self._inputs.signal(shader.GetInput(name), graph.material, (1, 2, 3))
        return default if found is None else found

    def _constant(self, shader: UsdShade.Shader, name: str, default: tuple[float, ...], graph: _Graph) -> np.ndarray:
        """Return an input that has to be constant; the default, told, where it varies."""
        found = self._signal(shader, name, Signal.constant(default), graph).value
        if found is not None:
            return np.array(found)
        message = f"{name} varies, which is not supported; the default is used"
        self._report.warn(UNKNOWN_NODE, shader.GetPath(), message)
        return np.array(default)

    def _roughness(self, shader: UsdShade.Shader, graph: _Graph) -> Signal:
        """Return UsdPreviewSurface's roughness, the square root of a microfacet's alpha, which BSDFs are given."""
        node = self._node(shader.GetInput("roughness"))
        if node is not None and node.id in ("ND_roughness_anisotropy", "ND_glossiness_anisotropy"):
            if self._constant(node.shader, "anisotropy", (0.0,), graph)[0] != 0.0:
                graph.lost["anisotropy"] = None
            if node.id == "ND_glossiness_anisotropy":
                return add(ONE, self._signal(node.shader, "glossiness", ONE, graph), -1.0)
            return self._signal(node.shader, "roughness", _ZERO, graph)
        if node is not None and node.id == "ND_roughness_dual":
            return self._signal(node.shader, "roughness", _ZERO, graph).pick([0])
        alpha = self._constant(shader, "roughness", _SMOOTH, graph)
        if len(alpha) > 1 and alpha[0] != alpha[1]:
            graph.lost["anisotropy"] = None
        return Signal.constant((float(np.sqrt(max(alpha.mean(), 0.0))),))

    def _normal(self, shader: UsdShade.Shader) -> UsdShade.Input | None:
        port = shader.GetInput("normal")
        node = self._node(port)
        return port if node is not None and not node.id.startswith("ND_normal_") else None

    # --- lobes

    def _diffuse(self, shader: UsdShade.Shader, graph: _Graph) -> list[_Lobe]:
        grey = Signal.constant((0.18, 0.18, 0.18))
        weight, color = (self._signal(shader, *default, graph) for default in (("weight", ONE), ("color", grey)))
        kind = (shader.GetShaderId() or "").removeprefix("ND_")
        if kind == "subsurface_bsdf":
            graph.lost["the depth of its subsurface scattering"] = None
        if kind == "oren_nayar_diffuse_bsdf" and self._constant(shader, "roughness", (0.0,), graph)[0] != 0.0:
            graph.lost["the roughness of its diffuse reflection"] = None
        return [_Lobe("diffuse", weight, color, normal=self._normal(shader))]

    def _dielectric(self, shader: UsdShade.Shader, graph: _Graph) -> list[_Lobe]:
        white = Signal.constant((1.0, 1.0, 1.0))
        weight, tint = (self._signal(shader, *default, graph) for default in (("weight", ONE), ("tint", white)))
        ior = self._constant(shader, "ior", (1.5,), graph)
        return self._interface(
            shader,
            graph,
            weight,
            multiply(tint, Signal.constant(_reflectance(ior).tolist())),
            Signal.constant(ior.tolist()),
        )

    def _schlick(self, shader: UsdShade.Shader, graph: _Graph) -> list[_Lobe]:
        white = Signal.constant((1.0, 1.0, 1.0))
        weight, color = (self._signal(shader, *default, graph) for default in (("weight", ONE), ("color0", white)))
        edge = self._constant(shader, "color90", (1.0, 1.0, 1.0), graph)
        if (edge != 1.0).any():
            graph.lost["color90"] = None
        head_on = color.value
        r = np.sqrt(np.clip(np.mean(head_on), 0, 0.99)) if head_on is not None else 0.2
        return self._interface(shader, graph, weight, color, Signal.constant(((1 + r) / (1 - r),)))

    def _interface(
        self, shader: UsdShade.Shader, graph: _Graph, weight: Signal, reflectance: Signal, ior: Signal
    ) -> list[_Lobe]:
        """Return what a surface between two transparent media does, as far as its scatter mode says so."""
        scatter = read_token(shader, "scatter_mode", self._time, self._report) or "R"
        if self._constant(shader, "thinfilm_thickness", (0.0,), graph)[0] != 0.0:
            graph.lost["thinfilm_thickness"] = None
        roughness, normal = self._roughness(shader, graph), self._normal(shader)
        lobes = []
        if "R" in scatter:
            lobes.append(_Lobe("reflection", weight, reflectance, roughness, ior, normal))
        if "T" in scatter:
            tint = self._constant(shader, "tint", (1.0, 1.0, 1.0), graph)
            if (tint != 1.0).any():
                graph.lost["the tint of its transmission"] = None
            lobes.append(_Lobe("transmission", weight, ONE, roughness, ior, normal))
        return lobes

    def _conductor(self, shader: UsdShade.Shader, graph: _Graph) -> list[_Lobe]:
        weight = self._signal(shader, "weight", ONE, graph)
        node = self._node(shader.GetInput("ior"))
        if node is not None and node.id == "ND_artistic_ior":
            color = self._signal(node.shader, "reflectivity", Signal.constant((0.944, 0.776, 0.373)), graph)
        else:
            ior, extinction = (
                Signal.constant(self._constant(shader, name, default, graph).tolist())
                for name, default in zip(("ior", "extinction"), _GOLD, strict=True)
            )
            color = apply(_reflectance, ior, extinction)
        return [_Lobe("reflection", weight, color, self._roughness(shader, graph), normal=self._normal(shader))]

    def _sheen(self, shader: UsdShade.Shader, graph: _Graph) -> list[_Lobe]:
        if self._signal(shader, "weight", ONE, graph).value != (0.0,):
            graph.lost["sheen"] = None
        return []


LOBES: Mapping[str, Callable[[BsdfReader, UsdShade.Shader, _Graph], list[_Lobe]]] = {
    "oren_nayar_diffuse_bsdf": BsdfReader._diffuse,
    "burley_diffuse_bsdf": BsdfReader._diffuse,
    "subsurface_bsdf": BsdfReader._diffuse,
    "dielectric_bsdf": BsdfReader._dielectric,
    "generalized_schlick_bsdf": BsdfReader._schlick,
    "conductor_bsdf": BsdfReader._conductor,
    "sheen_bsdf": BsdfReader._sheen,
}
"""What becomes lobes; layers, mixtures, sums and products beside it."""
