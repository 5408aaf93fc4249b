# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Which rays an instance is there for, and which lights."""

import warp as wp

from .codes import HOLDS_OUT, SEEN_BY_BOUNCES, SEEN_BY_EYE
from .features import Features, PlainScene
from .per_type import per_type
from .scene_structs import SceneData


@wp.func
def is_present(scene: wp.ref[SceneData], instance: int, flag: int) -> bool:
    """Return whether an instance is there for rays of a kind."""
    return scene.instances[instance].flags & flag != 0


@per_type
def is_seen(scene: wp.ref[SceneData], instance: int, depth: int, features: Features) -> bool:
    """Return whether a ray of the tree meets an instance; at depth 1 it comes from the eye."""
    if scene.has_hidden == 0:
        return True
    flag = int(SEEN_BY_BOUNCES)
    if depth == 1:
        flag = int(SEEN_BY_EYE)
    return is_present(scene, instance, flag)


@wp.func
def is_seen(scene: wp.ref[SceneData], instance: int, depth: int, features: wp.ref[PlainScene]) -> bool:
    """Return that it does."""
    return True


@per_type
def is_held_out(scene: wp.ref[SceneData], instance: int, depth: int, features: Features) -> bool:
    """Return whether a ray from the eye ends at an instance that holds out what is behind it."""
    if scene.has_hidden == 0 or depth != 1:  # by itself: `and` would read the instance in any case
        return False
    return is_present(scene, instance, HOLDS_OUT)


@wp.func
def is_held_out(scene: wp.ref[SceneData], instance: int, depth: int, features: wp.ref[PlainScene]) -> bool:
    """Return that it does not."""
    return False


@wp.func
def holds(links: wp.array[wp.uint32], offset: int, instance: int) -> bool:
    """Return whether a set of instances holds one of them.

    Args:
        links: A bit an instance, the lowest first, for each set.
        offset: First word of the set; -1: it holds all.
        instance: Row of ``SceneData.instances``.
    """
    if offset < 0:
        return True
    word = links[offset + (instance >> 5)]
    return (word >> wp.uint32(instance & 31)) & wp.uint32(1) != wp.uint32(0)
