# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The structs of a render: its camera, the terms of its ray trees, the film that takes its pixels."""

import warp as wp


@wp.struct
class CameraData:
    """Eye rays: from ``origin`` plus the window point along the view (orthographic) or through it (perspective)."""

    origin: wp.vec3
    corner: wp.vec3
    """Window's top left corner relative to ``origin``, world space."""
    right: wp.vec3
    """Across the window, left to right, world space; ``down`` likewise."""
    down: wp.vec3
    forward: wp.vec3
    """Unit normal of the window, along the view."""
    view: wp.vec3
    """Unit direction of an orthographic camera's rays; another one than ``forward`` where its transform shears."""
    is_perspective: wp.int32
    near: wp.float32
    far: wp.float32
    planes: wp.array[wp.vec4]
    """Clipping planes (a, b, c, d), world space, (a, b, c) unit: points where ax + by + cz + d < 0 are not seen."""
    plane_count: wp.int32
    lens_x: wp.vec3
    """Radius of the lens, along two axes at right angles in its plane, world space."""
    lens_y: wp.vec3
    focus: wp.float32
    """Distance of the plane in focus along the view; 0: there is no lens, all is sharp."""
    width: wp.int32
    """Of the whole image [pixel]; the film may be a crop of it."""
    height: wp.int32


@wp.struct
class FrameData:
    """A render: its camera and the terms of the ray tree."""

    camera: CameraData
    depth: wp.int32
    threshold: wp.float32
    ambient: wp.vec3
    background: wp.vec3
    background_alpha: wp.float32
    """1 where something stands behind the scene: a background colour that was asked for."""
    shadow_mode: wp.int32
    sample_count: wp.int32
    light_samples: wp.int32
    """Samples that each light with an extent, and each dome, takes at a node; 0: closed forms and sharp shadows."""
    lights_visible: wp.int32
    """1 where rays of the tree meet lights."""
    seed: wp.int32


@wp.struct
class FilmData:
    """Where pixels go. AOVs that nobody asked for have no elements and no bit in ``aov_mask``."""

    x: wp.int32
    """Position of the film's top left pixel in the whole image."""
    y: wp.int32
    aov_mask: wp.int32
    color: wp.array2d[wp.vec4]
    """Sum over samples of linear radiance and alpha."""
    depth: wp.array2d[wp.float32]
    distance: wp.array2d[wp.float32]
    normal: wp.array2d[wp.vec3]
    position: wp.array2d[wp.vec3]
    uv: wp.array2d[wp.vec2]
    prim: wp.array2d[wp.int32]
    instance: wp.array2d[wp.int32]
    element: wp.array2d[wp.int32]
    nodes_visited: wp.array2d[wp.int32]
    """Costs: sums over samples; ``deepest`` is the greatest of any."""
    triangle_tests: wp.array2d[wp.int32]
    tree_size: wp.array2d[wp.int32]
    deepest: wp.array2d[wp.int32]
    rays: wp.array2d[wp.int32]
    primvar_slots: wp.array[wp.int32]
    """Primvars that are AOVs: where ``SceneData.primvars`` has them."""
    primvars: wp.array3d[wp.vec4]
    """[which of them, row, column]."""
