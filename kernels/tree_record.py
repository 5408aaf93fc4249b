# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The records of a ray tree: what ``observer.TreeRecorder`` writes down while a pixel is traced."""

import warp as wp

EYE = wp.constant(0)
"""Kind of a ray: from the eye."""
REFLECTION = wp.constant(1)
REFRACTION = wp.constant(2)
PASSAGE = wp.constant(3)
"""Kind of a ray: straight on through what is missing of a surface."""

NOT_ASKED = wp.constant(0)
"""Fate of a child: its coefficient is 0, so nobody asks for it."""
TRACED = wp.constant(1)
STOPPED_BY_THRESHOLD = wp.constant(2)
STOPPED_BY_DEPTH = wp.constant(3)
TOTALLY_REFLECTED = wp.constant(4)
"""Fate of a refraction ray: there is none, its share goes to the reflection ray."""
STOPPED_BY_PASSES = wp.constant(5)


@wp.struct
class NodeRecord:
    """One ray of the tree and what it met. Lengths and points are the device's, relative to ``Scene.origin()``."""

    sample: wp.int32
    parent: wp.int32
    """Row of the node that sent the ray; -1: the eye."""
    kind: wp.int32
    """EYE, REFLECTION, REFRACTION or PASSAGE."""
    depth: wp.int32
    passes: wp.int32
    weight: wp.float32
    """Of the ray: what the threshold is compared with."""
    coefficient: wp.vec3
    """Of the ray: product of the coefficients from the eye to here."""
    origin: wp.vec3
    direction: wp.vec3
    t: wp.float32
    instance: wp.int32
    """-1: the ray left the scene; then ``local`` is what it brought back from there."""
    element: wp.int32
    """elementId."""
    material: wp.int32
    model: wp.int32
    position: wp.vec3
    n: wp.vec3
    """Unit shading normal on the side that the ray came from."""
    n_geometric: wp.vec3
    presence: wp.float32
    has_local: wp.int32
    emission: wp.vec3
    ambient: wp.vec3
    """The term ka Ia."""
    local: wp.vec3
    """I_local as it entered the sum, before ``presence`` and ``coefficient``."""
    kr: wp.vec3
    kt: wp.vec3
    gloss: wp.vec3
    eta: wp.float32
    reflection: wp.int32
    """Fate of the reflection ray: NOT_ASKED, TRACED or what stopped it; so too the next two."""
    refraction: wp.int32
    passage: wp.int32


@wp.struct
class LightRecord:
    """What one light, or one dome, does at a node."""

    node: wp.int32
    light: wp.int32
    """Row of ``SceneData.lights``; the domes' rows follow, from ``light_count`` on."""
    cosine: wp.float32
    """N.L; up to 0 the light adds nothing, and nothing else is known of it."""
    wi: wp.vec3
    to_shadow: wp.vec3
    """Unit direction of its shadow ray."""
    distance: wp.float32
    """Length of its shadow ray."""
    samples: wp.int32
    """Samples that were taken of it; 0: it counts as a whole. Of samples, directions, distance and I_l are means over
    those that arrive from above the horizon."""
    shadow_rays: wp.int32
    """That were cast."""
    color: wp.vec3
    """I_l."""
    visible: wp.vec3
    """S."""
    diffuse: wp.vec3
    """Response to a light of colour 1 by diffuse reflection, so too ``specular``. Of samples: the terms themselves,
    without shadows. Of a dome that is not sampled: its terms, which are added one after the other."""
    specular: wp.vec3
    term: wp.vec3
    """What a light added to I_local: S I_l times the whole response."""


@wp.struct
class CrossingRecord:
    """A surface between a node and a light."""

    light: wp.int32
    """Row of the light's record."""
    instance: wp.int32
    element: wp.int32
    """elementId."""
    material: wp.int32
    t: wp.float32
    """From the node, or from the surface that was crossed before."""
    factor: wp.vec3
    """Share of the light that it lets through."""
