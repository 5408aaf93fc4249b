# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What lights, and what stands before them, tell an observer at a node, as ``tree_hooks`` does for the node itself."""

import warp as wp

from .bvh_structs import AccelData, Stack
from .bvh_traverse import closest_hit_from
from .light import LightSample
from .observer import CostCounter, Observer, TreeRecorder, observed
from .response import Shading, eval_response
from .sample_emitter import Emitter, EmitterSample, emitter_response
from .scene_structs import SceneData
from .surface import Surface, element_of, make_surface
from .tree_record import CrossingRecord, LightRecord
from .vector import max_component


@wp.func
def append_light(observer: wp.ref[TreeRecorder], record: LightRecord):
    """Write a record of what a light does at the node at work."""
    count = observer.counts[1]
    observer.counts[1] = count + 1
    observer.lights[wp.min(count, observer.lights.shape[0] - 1)] = record


@observed
def tell_own_light(observer: Observer, emission: wp.vec3, ambient: wp.vec3):
    """The terms of I_local that no light has a part in."""
    pass


@wp.func
def tell_own_light(observer: wp.ref[TreeRecorder], emission: wp.vec3, ambient: wp.vec3):
    """Keep both."""
    observer.nodes[observer.node].emission = emission
    observer.nodes[observer.node].ambient = ambient


@observed
def tell_shadow_ray(observer: Observer):
    """A shadow ray is cast from the node at work."""
    pass


@wp.func
def tell_shadow_ray(observer: wp.ref[CostCounter]):
    """Count it."""
    observer.rays += 1


@observed
def tell_crossing(observer: Observer, scene: wp.ref[SceneData], crossed: wp.ref[Surface], t: float, factor: wp.vec3):
    """A shadow ray crosses a surface, which lets ``factor`` of the light through."""
    pass


@wp.func
def tell_crossing(
    observer: wp.ref[TreeRecorder], scene: wp.ref[SceneData], crossed: wp.ref[Surface], t: float, factor: wp.vec3
):
    """Keep it for the light whose record comes next."""
    if observer.samples > 0:
        return
    count = observer.counts[2]
    observer.counts[2] = count + 1
    record = CrossingRecord()
    record.light = observer.counts[1]
    record.instance = crossed.instance
    record.element = element_of(scene, crossed)
    record.material = crossed.material
    record.t = t
    record.factor = factor
    observer.crossings[wp.min(count, observer.crossings.shape[0] - 1)] = record


@observed
def tell_blocked(
    observer: Observer,
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    origin: wp.vec3,
    direction: wp.vec3,
    distance: float,
    from_instance: int,
    from_triangle: int,
    stack: wp.ref[Stack],
):
    """Something stands between a surface and a light."""
    pass


@wp.func
def tell_blocked(
    observer: wp.ref[TreeRecorder],
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    origin: wp.vec3,
    direction: wp.vec3,
    distance: float,
    from_instance: int,
    from_triangle: int,
    stack: wp.ref[Stack],
):
    """Find out what: of all that a shadow ray may have met first, what stands nearest to the surface."""
    hit = closest_hit_from(accel, origin, direction, distance, from_instance, from_triangle, stack, observer)
    blocker = make_surface(scene, hit, origin, direction)
    tell_crossing(observer, scene, blocker, hit.t, wp.vec3(0.0, 0.0, 0.0))


@observed
def tell_light(
    observer: Observer,
    row: int,
    casts_shadow: int,
    scales: wp.vec3,
    sample: wp.ref[LightSample],
    shading: wp.ref[Shading],
    color: wp.vec3,
    visible: wp.vec3,
    term: wp.vec3,
):
    """A light above the horizon has added ``term`` to I_local, which is 0 where nothing of it is visible."""
    pass


@wp.func
def tell_light(
    observer: wp.ref[TreeRecorder],
    row: int,
    casts_shadow: int,
    scales: wp.vec3,
    sample: wp.ref[LightSample],
    shading: wp.ref[Shading],
    color: wp.vec3,
    visible: wp.vec3,
    term: wp.vec3,
):
    """Write the light's record, with the response split in two by asking for each part alone."""
    record = LightRecord()
    record.node = observer.node
    record.light = row
    record.cosine = wp.dot(shading.n, sample.wi)
    record.wi = sample.wi
    record.to_shadow = sample.to_shadow
    record.distance = sample.distance
    record.shadow_rays = casts_shadow
    record.color = color
    record.visible = visible
    record.diffuse = eval_response(shading, sample.wi, wp.vec3(scales[0], 0.0, 0.0))
    record.specular = eval_response(shading, sample.wi, wp.vec3(0.0, scales[1], scales[2]))
    record.term = term
    append_light(observer, record)


@observed
def tell_samples(observer: Observer):
    """A light or a dome is going to be sampled."""
    pass


@wp.func
def tell_samples(observer: wp.ref[TreeRecorder]):
    """Begin its record."""
    observer.sampled = LightRecord()
    observer.samples = 0


@observed
def tell_sample(
    observer: Observer,
    emitter: wp.ref[Emitter],
    sample: wp.ref[EmitterSample],
    shading: wp.ref[Shading],
    color: wp.vec3,
):
    """A sample of a light or a dome lies above the horizon, and its shadow ray, if any, has been cast."""
    pass


@wp.func
def tell_sample(
    observer: wp.ref[TreeRecorder],
    emitter: wp.ref[Emitter],
    sample: wp.ref[EmitterSample],
    shading: wp.ref[Shading],
    color: wp.vec3,
):
    """Add it up, directions and distances by how bright it is."""
    weight = max_component(color)
    observer.samples += 1
    observer.sampled.cosine += weight
    observer.sampled.wi += sample.wi * weight
    observer.sampled.distance += sample.distance * weight
    observer.sampled.shadow_rays += emitter.casts_shadow
    observer.sampled.color += color
    whole = emitter_response(emitter, shading, sample.wi)
    diffuse_only = Emitter()
    diffuse_only.diffuse = emitter.diffuse
    diffuse = emitter_response(diffuse_only, shading, sample.wi)
    observer.sampled.diffuse += wp.cw_mul(color, diffuse)
    observer.sampled.specular += wp.cw_mul(color, whole - diffuse)


@observed
def tell_samples_done(
    observer: Observer, emitter: wp.ref[Emitter], samples: int, shading: wp.ref[Shading], term: wp.vec3
):
    """The samples of a light or a dome, so many, have added ``term`` to I_local."""
    pass


@wp.func
def tell_samples_done(
    observer: wp.ref[TreeRecorder], emitter: wp.ref[Emitter], samples: int, shading: wp.ref[Shading], term: wp.vec3
):
    """Write their record: S is the share of their light that arrives, as the surface answers to it."""
    record = observer.sampled
    record.node = observer.node
    record.light = emitter.row
    record.samples = samples
    record.term = term
    if record.cosine > 0.0:
        record.distance = record.distance / record.cosine
        record.wi = wp.normalize(record.wi)
    record.to_shadow = record.wi
    record.cosine = wp.dot(shading.n, record.wi)
    unshadowed = record.diffuse + record.specular
    for channel in range(3):
        if unshadowed[channel] > 0.0:
            record.visible[channel] = term[channel] / unshadowed[channel]
    append_light(observer, record)
    observer.samples = 0


@observed
def tell_dark_light(observer: Observer, row: int, cosine: float):
    """A light is not above the surface's horizon, or sends nothing this way."""
    pass


@wp.func
def tell_dark_light(observer: wp.ref[TreeRecorder], row: int, cosine: float):
    """Write that into its record."""
    record = LightRecord()
    record.node = observer.node
    record.light = row
    record.cosine = cosine
    append_light(observer, record)


@observed
def tell_dome(observer: Observer, row: int, diffuse: wp.vec3, specular: wp.vec3):
    """A dome has added two terms to I_local."""
    pass


@wp.func
def tell_dome(observer: wp.ref[TreeRecorder], row: int, diffuse: wp.vec3, specular: wp.vec3):
    """Write the dome's record."""
    record = LightRecord()
    record.node = observer.node
    record.light = row
    record.diffuse = diffuse
    record.specular = specular
    append_light(observer, record)
