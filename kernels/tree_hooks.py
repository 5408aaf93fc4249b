# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a ray tree tells its observer, event by event: for all types of observers nothing, and what some do instead."""

import warp as wp

from .bvh_structs import Hit
from .observer import CostCounter, Observer, TreeRecorder, observed
from .ray_structs import RayTask
from .response import Shading
from .scene_structs import SceneData
from .surface import Surface, element_of
from .tree_record import EYE, PASSAGE, REFLECTION, REFRACTION, TRACED, NodeRecord


@observed
def tell_eye(observer: Observer):
    """The eye ray waits in slot 0 of the task stack."""
    pass


@wp.func
def tell_eye(observer: wp.ref[TreeRecorder]):
    """Remember for its record that nobody sent it."""
    observer.kinds[0] = EYE
    observer.parents[0] = -1


@wp.func
def tell_eye(observer: wp.ref[CostCounter]):
    """Count it."""
    observer.rays += 1
    observer.tree_size += 1


@observed
def tell_child(observer: Observer, kind: int, fate: int):
    """The node at work has no child of this kind, and why."""
    pass


@wp.func
def tell_child(observer: wp.ref[TreeRecorder], kind: int, fate: int):
    """Keep it."""
    if kind == REFLECTION:
        observer.nodes[observer.node].reflection = fate
    elif kind == REFRACTION:
        observer.nodes[observer.node].refraction = fate
    else:
        observer.nodes[observer.node].passage = fate


@observed
def tell_push(observer: Observer, slot: int, kind: int):
    """A child of the node at work waits in a slot of the task stack."""
    pass


@wp.func
def tell_push(observer: wp.ref[TreeRecorder], slot: int, kind: int):
    """Remember for its record who sent it."""
    observer.kinds[slot] = kind
    observer.parents[slot] = observer.node
    tell_child(observer, kind, TRACED)


@wp.func
def tell_push(observer: wp.ref[CostCounter], slot: int, kind: int):
    """Count it, unless the ray goes straight on: that is no bounce."""
    if kind != PASSAGE:
        observer.rays += 1
        observer.tree_size += 1


@observed
def tell_ray(observer: Observer, slot: int, task: wp.ref[RayTask], hit: wp.ref[Hit]):
    """The ray of a slot has been traced; ``hit`` is what it met."""
    pass


@wp.func
def tell_ray(observer: wp.ref[TreeRecorder], slot: int, task: wp.ref[RayTask], hit: wp.ref[Hit]):
    """Begin a node's record."""
    count = observer.counts[0]
    observer.counts[0] = count + 1
    if count >= observer.limit:
        observer.stop[0] = 1
    observer.node = wp.min(count, observer.nodes.shape[0] - 1)
    record = NodeRecord()
    record.sample = observer.sample
    record.parent = observer.parents[slot]
    record.kind = observer.kinds[slot]
    record.depth = task.depth
    record.passes = task.passes
    record.weight = task.weight
    record.coefficient = task.coefficient
    record.origin = task.origin
    record.direction = task.direction
    record.t = hit.t
    record.instance = hit.instance
    record.presence = 1.0
    observer.nodes[observer.node] = record


@wp.func
def tell_ray(observer: wp.ref[CostCounter], slot: int, task: wp.ref[RayTask], hit: wp.ref[Hit]):
    """Remember how deep it is."""
    observer.deepest = wp.max(observer.deepest, task.depth)


@observed
def tell_background(observer: Observer, value: wp.vec3):
    """The ray left the scene and brings ``value`` back."""
    pass


@wp.func
def tell_background(observer: wp.ref[TreeRecorder], value: wp.vec3):
    """Keep it as the node's light."""
    observer.nodes[observer.node].local = value


@observed
def tell_surface(observer: Observer, scene: wp.ref[SceneData], surface: wp.ref[Surface], shading: wp.ref[Shading]):
    """The ray met a surface."""
    pass


@wp.func
def tell_surface(
    observer: wp.ref[TreeRecorder], scene: wp.ref[SceneData], surface: wp.ref[Surface], shading: wp.ref[Shading]
):
    """Keep the point and its material."""
    node = observer.node
    observer.nodes[node].element = element_of(scene, surface)
    observer.nodes[node].material = surface.material
    observer.nodes[node].model = shading.model
    observer.nodes[node].position = surface.position
    observer.nodes[node].n = shading.n
    observer.nodes[node].n_geometric = surface.n_geometric
    observer.nodes[node].presence = shading.presence
    observer.nodes[node].has_local = shading.has_local
    observer.nodes[node].kr = shading.kr
    observer.nodes[node].kt = shading.kt
    observer.nodes[node].gloss = shading.gloss
    observer.nodes[node].eta = shading.eta


@observed
def tell_local(observer: Observer, local: wp.vec3):
    """I_local is complete."""
    pass


@wp.func
def tell_local(observer: wp.ref[TreeRecorder], local: wp.vec3):
    """Keep it."""
    observer.nodes[observer.node].local = local
