# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The structs of rays that wait to be traced: those of the tree, and shadow rays."""

import warp as wp


@wp.struct
class RayDifferential:
    """Derivatives of a ray by its sample's place in the picture: x across, y down, from one sample to the next."""

    origin_x: wp.vec3
    """Of the point that the ray leaves, world space."""
    origin_y: wp.vec3
    direction_x: wp.vec3
    """Of its unit direction."""
    direction_y: wp.vec3


@wp.struct
class RayTask:
    """A ray of the tree that waits to be traced, and what its value will be multiplied by."""

    origin: wp.vec3
    """Where its search begins."""
    offset: wp.vec3
    """From the point that it leaves to ``origin``."""
    direction: wp.vec3
    reach: wp.float32
    """Distance beyond which it sees nothing."""
    coefficient: wp.vec3
    """Product of the coefficients from the eye to here, per channel."""
    weight: wp.float32
    """Product of their largest channels: what the threshold is compared with."""
    depth: wp.int32
    key: wp.uint32
    """Scrambling of the light samples where it arrives; no two rays of a tree have the same."""
    passes: wp.int32
    """Straight alpha pass-throughs so far."""
    from_instance: wp.int32
    """Instance and triangle that the ray starts on; -1: it starts at the eye."""
    from_triangle: wp.int32
    sender: wp.int32
    """Instance that reflected or refracted it; -1: it comes from the eye."""
    leaked: wp.vec4i
    """Instances of whose surfaces the ray is on the wrong side, bent there by an interpolated normal; -1: none."""
    differential: RayDifferential
    """Zero in a scene without textures."""


@wp.struct
class ShadowRay:
    """A shadow ray that waits to be traced, and what it decides about."""

    origin: wp.vec3
    direction: wp.vec3
    reach: wp.float32
    """Distance beyond which nothing casts a shadow; -1: nothing casts one at all."""
    distance: wp.float32
    """Of the light."""
    from_instance: wp.int32
    """Instance and triangle that the ray starts on."""
    from_triangle: wp.int32
    light: wp.int32
    """Number of the light."""
    shadow: wp.int32
    """Row of ``SceneData.shadows``, or -1."""
    node: wp.int32
    """Of a tree: the one whose I_local it is part of."""
    sum: wp.int32
    """Number of the sum that the term belongs to: those of a light's samples are added up by themselves first."""
    term: wp.vec3
    """What the light adds if nothing is in the way."""
