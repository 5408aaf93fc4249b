# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""From the records that a kernel wrote of one pixel to its ``RayTree``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from warp_rt.errors import LimitError
from warp_rt.kernels import tree_record
from warp_rt.kernels.observer import TreeRecorder
from warp_rt.rendering.task_stack import task_capacity
from warp_rt.scene import Dome, Light, MaterialModel, Scene
from warp_rt.tree.nodes import Color, Crossing, Fate, LightTerm, Place, RayKind, TreeNode, nested_value

MAX_NODES = 1 << 18
"""Nodes of a tree that are written down: some 100 MB of records."""
MAX_LIGHTS = 1 << 21
"""Records of lights, one a node and light; so too of surfaces that shadow rays cross."""

_MODELS = {MaterialModel.WHITTED: "WhittedSurface", MaterialModel.PREVIEW: "UsdPreviewSurface"}
_FIRST_ROOM = (512, 4096, 4096)
_BLACK: Color = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Records:
    """What the kernel wrote: structured arrays with the fields of ``kernels.tree_record``."""

    nodes: np.ndarray
    lights: np.ndarray
    crossings: np.ndarray


def record(launch: Callable[[Any], None], *, depth: int, stop: wp.array, device: str) -> Records:
    """Return the records of a pixel; it is traced again where they found too little room.

    Args:
        launch: Traces the pixel with a ``TreeRecorder``.
        depth: Levels that the tree may have.
        stop: Stop flag of the trace, which the recorder sets when there are too many nodes.
        device: Where it is traced.

    Raises:
        LimitError: The tree is larger than anybody would read.
    """
    slots = task_capacity(depth)
    room = _FIRST_ROOM
    while True:
        recorder = TreeRecorder()
        recorder.counts = wp.zeros(3, dtype=wp.int32, device=device)
        recorder.parents = wp.zeros(slots, dtype=wp.int32, device=device)
        recorder.kinds = wp.zeros(slots, dtype=wp.int32, device=device)
        # One row more each: it takes what there is no room for.
        recorder.nodes = wp.zeros(room[0] + 1, dtype=tree_record.NodeRecord, device=device)
        recorder.lights = wp.zeros(room[1] + 1, dtype=tree_record.LightRecord, device=device)
        recorder.crossings = wp.zeros(room[2] + 1, dtype=tree_record.CrossingRecord, device=device)
        recorder.limit = MAX_NODES
        recorder.stop = stop
        launch(recorder)
        counts = recorder.counts.numpy()
        if counts[0] > MAX_NODES or counts[1:].max() > MAX_LIGHTS:
            what = f"{MAX_NODES:,} nodes" if counts[0] > MAX_NODES else f"{MAX_LIGHTS:,} light terms"
            raise LimitError(
                f"the pixel's ray tree has more than {what}: a lower depth or a higher threshold prunes it"
            )
        if (counts <= room).all():
            arrays = (recorder.nodes, recorder.lights, recorder.crossings)
            return Records(*(array.numpy()[:count] for array, count in zip(arrays, counts, strict=True)))
        room = tuple(np.maximum(counts, room).tolist())


def make_roots(records: Records, scene: Scene, lights: Sequence[Light], origin: np.ndarray) -> tuple[TreeNode, ...]:
    """Return the eye ray's node of each sample that was recorded, with the trees below them.

    Args:
        records: As ``record`` returns them; a node comes after the one that sent its ray.
        scene: What was rendered.
        lights: The lights that it was rendered with, a headlight perhaps.
        origin: World point that the records' coordinates are relative to, shape [3].
    """
    return _Builder(records, scene, lights, origin).roots()


class _Builder:
    """Makes nodes, the last first, so that a node's children are there before it."""

    def __init__(self, records: Records, scene: Scene, lights: Sequence[Light], origin: np.ndarray) -> None:
        self.records = records
        self.scene = scene
        self.lights = lights
        self.origin = origin
        order = np.arange(len(records.nodes))
        # Light records lie node after node, crossings light after light.
        self.first_light = np.searchsorted(records.lights["node"], np.append(order, len(order)))
        rows = np.arange(len(records.lights) + 1)
        self.first_crossing = np.searchsorted(records.crossings["light"], rows)

    def roots(self) -> tuple[TreeNode, ...]:
        nodes = self.records.nodes
        children: list[list[TreeNode]] = [[] for _ in nodes]
        roots: list[TreeNode] = []
        for index in range(len(nodes) - 1, -1, -1):
            parent = nodes["parent"][index]
            node = self._node(index, tuple(reversed(children[index])))
            children[index].clear()
            (children[parent] if parent >= 0 else roots).append(node)
        return tuple(reversed(roots))

    def _node(self, index: int, children: tuple[TreeNode, ...]) -> TreeNode:
        row = self.records.nodes[index]
        has_left = row["instance"] < 0
        below = {child.kind: child.value for child in children}
        kr, kt, local = _triple(row["kr"]), _triple(row["kt"]), _triple(row["local"])
        refraction = Fate(int(row["refraction"]))
        is_total = refraction is Fate.TOTAL_REFLECTION
        presence = float(row["presence"])
        value = nested_value(
            local,
            _triple(row["kr"] + row["kt"]) if is_total else kr,
            below.get(RayKind.REFLECTION, _BLACK),
            kt,
            below.get(RayKind.REFRACTION, _BLACK),
            presence,
            below.get(RayKind.PASSAGE, _BLACK),
        )
        model = "" if has_left else _MODELS[MaterialModel(int(row["model"]))]
        is_preview = model == _MODELS[MaterialModel.PREVIEW]
        return TreeNode(
            index=index,
            kind=RayKind(int(row["kind"])),
            depth=int(row["depth"]),
            weight=float(row["weight"]),
            coefficient=_triple(row["coefficient"]),
            origin=_triple(row["origin"] + self.origin),
            direction=_triple(row["direction"]),
            distance=np.inf if has_left else float(row["t"]),
            place=None if has_left else self._place(row),
            model=model,
            position=(np.nan,) * 3 if has_left else _triple(row["position"] + self.origin),
            normal=_triple(row["n"]),
            presence=presence,
            emission=_triple(row["emission"]),
            ambient=_triple(row["ambient"]),
            lights=tuple(self._light(k) for k in range(self.first_light[index], self.first_light[index + 1])),
            local=local,
            kr=kr,
            kt=kt,
            fresnel=_triple(row["kr"] + row["gloss"]) if is_preview else None,
            eta=float(row["eta"]),
            reflection=Fate(int(row["reflection"])),
            refraction=refraction,
            passage=Fate(int(row["passage"])),
            children=children,
            value=value,
            size=1 + sum(child.size for child in children),
            deepest=max([int(row["depth"]), *(child.deepest for child in children)]),
        )

    def _light(self, index: int) -> LightTerm:
        row = self.records.lights[index]
        number = int(row["light"])
        diffuse, specular = row["diffuse"].astype(float), row["specular"].astype(float)
        if row["samples"]:
            return self._sampled(index)
        if number >= len(self.lights):
            return LightTerm(
                light=self.scene.domes[number - len(self.lights)].path,
                kind="dome",
                cosine=None,
                direction=_BLACK,
                to_shadow=_BLACK,
                distance=np.inf,
                color=_BLACK,
                visible=(1.0, 1.0, 1.0),
                samples=0,
                shadow_rays=0,
                unshadowed_diffuse=_triple(diffuse),
                unshadowed_specular=_triple(specular),
                total=_triple(diffuse + specular),
            )
        light = self.lights[number]
        color = row["color"].astype(float)
        is_facing = row["cosine"] > 0
        return LightTerm(
            light=light.path,
            kind=light.kind.name.lower(),
            cosine=float(row["cosine"]),
            direction=_triple(row["wi"]),
            to_shadow=_triple(row["to_shadow"]),
            distance=float(row["distance"]) if is_facing else np.nan,
            color=_triple(color),
            visible=_triple(row["visible"]),
            samples=0,
            shadow_rays=int(row["shadow_rays"]),
            unshadowed_diffuse=_triple(color * diffuse),
            unshadowed_specular=_triple(color * specular),
            total=_triple(row["term"]),
            crossings=self._crossings(index),
            is_linked=light.receivers is None or bool(light.receivers[self.records.nodes["instance"][row["node"]]]),
        )

    def _sampled(self, index: int) -> LightTerm:
        """Return the term of a light, or a dome, that was sampled."""
        row = self.records.lights[index]
        number = int(row["light"])
        is_dome = number >= len(self.lights)
        emitter = self.scene.domes[number - len(self.lights)] if is_dome else self.lights[number]
        return LightTerm(
            light=emitter.path,
            kind="dome" if isinstance(emitter, Dome) else emitter.kind.name.lower(),
            cosine=float(row["cosine"]),
            direction=_triple(row["wi"]),
            to_shadow=_triple(row["to_shadow"]),
            distance=float(row["distance"]) if row["cosine"] > 0 else np.nan,
            color=_triple(row["color"]),
            visible=_triple(row["visible"]),
            samples=int(row["samples"]),
            shadow_rays=int(row["shadow_rays"]),
            unshadowed_diffuse=_triple(row["diffuse"]),
            unshadowed_specular=_triple(row["specular"]),
            total=_triple(row["term"]),
            crossings=self._crossings(index),
        )

    def _crossings(self, light: int) -> tuple[Crossing, ...]:
        rows = self.records.crossings[self.first_crossing[light] : self.first_crossing[light + 1]]
        distances = np.cumsum(rows["t"].astype(float))
        return tuple(
            Crossing(self._place(row), float(distance), _triple(row["factor"]))
            for row, distance in zip(rows, distances, strict=True)
        )

    def _place(self, row: Any) -> Place:
        scene, instance = self.scene, int(row["instance"])
        placed = scene.instances
        number = int(placed.instance_id[instance])
        return Place(
            prim=scene.prims[placed.prim[instance]],
            instance=scene.instance_paths[number] if number >= 0 else "",
            face=int(row["element"]),
            material=scene.materials[int(row["material"])].path,
        )


def _triple(values: Any) -> tuple[float, float, float]:
    x, y, z = values
    return float(x), float(y), float(z)
