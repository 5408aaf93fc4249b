# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the numbers in the fields of structs stand for: host and kernels agree on them here.

Apart from the functions that read them, as ``group_structs`` is.
"""

import warp as wp

# --- ``InstanceData.flags``

SEEN_BY_EYE = wp.constant(1)
"""Eye rays meet the instance."""
SEEN_BY_BOUNCES = wp.constant(2)
"""Reflection and refraction rays meet it."""
CASTS_SHADOW = wp.constant(4)
"""Shadow rays meet it."""
HOLDS_OUT = wp.constant(8)
"""Eye rays that meet it bring back neither light nor alpha."""

# --- ``LightData.varies``

UNEVEN = wp.constant(1)
"""Its shape is not what its radius says."""
VARIED = wp.constant(2)
"""Its radiance is not the same from all points in all directions."""

# --- rows of ``SceneData.inputs`` and of domes' irradiance

INPUT_COUNT = wp.constant(11)
"""Inputs that every material has room for; those of WhittedSurface come first in its rows."""

WHITTED_INPUTS = ("ambient", "diffuse", "specular", "shininess", "reflection", "transmission", "ior")
PREVIEW_INPUTS = (
    "diffuseColor",
    "emissiveColor",
    "specularColor",
    "metallic",
    "roughness",
    "clearcoat",
    "clearcoatRoughness",
    "opacity",
    "ior",
    "normal",
    "occlusion",
)

IRRADIANCE_WIDTH = wp.constant(64)
"""Columns of a dome's irradiance map; irradiance is a cosine-wide blur, so few suffice."""
IRRADIANCE_HEIGHT = wp.constant(33)
"""Its rows, which start and end at the poles: most floors face one. An odd number, for walls face the equator."""

# --- ``MaterialData.normal_frame``, those of ``scene.NormalFrame``; 0: there is no input ``normal``

IMAGE_FRAME = wp.constant(1)
PRIMVAR_FRAME = wp.constant(2)
WORLD_FRAME = wp.constant(3)

# --- ``FrameData.shadow_mode``

SHADOW_OPAQUE = wp.constant(0)
SHADOW_AUTO = wp.constant(1)
SHADOW_TRANSMIT = wp.constant(2)

# --- ``FilmData.aov_mask``

AOV_DEPTH = wp.constant(1)
AOV_DISTANCE = wp.constant(2)
AOV_NORMAL = wp.constant(4)
AOV_POSITION = wp.constant(8)
AOV_UV = wp.constant(16)
AOV_PRIM = wp.constant(32)
AOV_INSTANCE = wp.constant(64)
AOV_ELEMENT = wp.constant(128)
AOV_NODES_VISITED = wp.constant(256)
AOV_TRIANGLE_TESTS = wp.constant(512)
AOV_TREE_SIZE = wp.constant(1024)
AOV_DEEPEST = wp.constant(2048)
AOV_RAYS = wp.constant(4096)
AOV_PRIMVARS = wp.constant(8192)
