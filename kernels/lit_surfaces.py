# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Surfaces of a group that wait for their light: what a light adds to each, sixteen at a time, by vectors.

``light_illumination.whole_illumination`` says what is computed, operation by operation in the same order.
"""

import warp as wp

from .constants import DIRECTION_ROW, GROUP
from .group_surfaces import CLEARANCE_ROW, GEOMETRIC_ROW, POSITION_ROW
from .light import KIND_DISTANT, KIND_POINT, LightSample
from .light_structs import LightData
from .native import spell_out
from .number_rows import NUMBERS, set_row
from .response import Shading
from .tile_structs import LitSurfaces

# Rows of GROUP numbers in which surfaces wait: three each of vectors.
NORMAL_ROW = wp.constant(0)
"""Shading normals."""
DIFFUSE_ROW = wp.constant(3)
"""Diffuse reflectances."""
SPECULAR_ROW = wp.constant(6)
"""Specular reflectances."""
EXPONENT_ROW = wp.constant(9)
"""Phong exponents."""
LIGHT_ROW = wp.constant(10)
"""Directions from which the light arrives."""
SHADOW_ROW = wp.constant(13)
"""Directions of the shadow rays."""
DISTANCE_ROW = wp.constant(16)
"""Lengths of the shadow rays."""
IRRADIANCE_ROW = wp.constant(17)
"""Irradiances of surfaces that face the light."""
ORIGIN_ROW = wp.constant(20)
"""Origins of the shadow rays."""
TERM_ROW = wp.constant(23)
"""What the light adds unless it is occluded."""


@wp.func
def await_light(lit: wp.ref[LitSurfaces], shading: wp.ref[Shading], depth: int):
    """Let the surface at work, of the lecture's material, wait for its light."""
    slot = lit.slot
    rows = lit.rows
    set_row(rows, NORMAL_ROW, slot, shading.n)
    set_row(rows, DIFFUSE_ROW, slot, shading.diffuse)
    set_row(rows, SPECULAR_ROW, slot, shading.specular)
    rows[EXPONENT_ROW * GROUP + slot] = shading.exponent
    lit.depths[slot] = depth
    lit.set = lit.set | (wp.uint32(1) << wp.uint32(slot))


@wp.func
def is_point_or_direction(light: wp.ref[LightData]) -> bool:
    """Return whether ``light_surfaces`` knows by itself how a light arrives."""
    if light.kind == KIND_DISTANT:
        return light.cap == 0.0 and light.profile < 0
    return light.kind == KIND_POINT and light.profile < 0 and light.focus <= 0.0 and light.cone_angle >= wp.pi


@wp.func
def set_arriving(rows: wp.array[float], slot: int, arriving: wp.ref[LightSample]):
    """Write how a light arrives that is no point and no direction."""
    set_row(rows, LIGHT_ROW, slot, arriving.wi)
    set_row(rows, SHADOW_ROW, slot, arriving.to_shadow)
    rows[DISTANCE_ROW * GROUP + slot] = arriving.distance
    set_row(rows, IRRADIANCE_ROW, slot, arriving.irradiance)


_LIGHT = (
    "{\n"
    + NUMBERS
    + r"""
    uint32_t facing = 0;
    const auto splat = [](const auto& v) { return vector((number)v[0], (number)v[1], (number)v[2]); };
    for (int block = 0; block < GROUP; block += LANES) {
        const uint32_t waiting = set >> block & (uint32_t)((1u << LANES) - 1);
        if (waiting == 0)
            continue;
        const float *direction = (const float*)rays.data + DIRECTION_ROW * GROUP + block;
        const float *surface = (const float*)surfaces.data + block;
        float* at = (float*)rows.data + block;
        const auto row = [&](int k) { return WARP_RT_VECTOR(at + k * GROUP, GROUP); };
        const vector position = WARP_RT_VECTOR(surface + POSITION_ROW * GROUP, GROUP), n = row(NORMAL_ROW);
        const vector n_geometric = WARP_RT_VECTOR(surface + GEOMETRIC_ROW * GROUP, GROUP);
        const number clearance = WARP_RT_NUMBER(surface + CLEARANCE_ROW * GROUP);
        if (is_known) {
            vector wi = splat(light.axis_z), irradiance = splat(light.emission);
            number distance = (number)INFINITY;
            if (light.kind == KIND_POINT) {
                const vector to_center = sub(splat(light.position), position);
                distance = WARP_RT_SQRT(dot(to_center, to_center));
                wi = div(to_center, WARP_RT_CHOOSE(distance == 0.0f, (number)1.0f, distance));
                if (light.has_falloff)
                    irradiance = mul(irradiance, PI * light.radius * light.radius / (distance * distance));
            }
            WARP_RT_KEEP_VECTOR(at + LIGHT_ROW * GROUP, GROUP, wi);
            WARP_RT_KEEP_VECTOR(at + SHADOW_ROW * GROUP, GROUP, wi);
            WARP_RT_KEEP(at + DISTANCE_ROW * GROUP, distance);
            WARP_RT_KEEP_VECTOR(at + IRRADIANCE_ROW * GROUP, GROUP, irradiance);
        }
        const vector wi = row(LIGHT_ROW), to_shadow = row(SHADOW_ROW);
        const number n_wi = dot(n, wi), side = dot(n_geometric, to_shadow);
        for (int axis = 0; axis < 3; ++axis) {
            const number outward = WARP_RT_CHOOSE(side < 0.0f, -n_geometric[axis], n_geometric[axis]);
            WARP_RT_KEEP(at + (ORIGIN_ROW + axis) * GROUP, position[axis] + outward * clearance);
        }
        const number r_wo = dot(sub(mul(n, 2.0f * n_wi), wi), neg(WARP_RT_VECTOR(direction, GROUP)));
        float cosines[LANES], highlights[LANES];
        WARP_RT_KEEP(cosines, n_wi);
        WARP_RT_KEEP(highlights, r_wo);
        for (int lane = 0; lane < LANES; ++lane) {
            const bool is_facing = (waiting >> lane & 1) && !(cosines[lane] <= 0.0f);
            const float exponent = at[EXPONENT_ROW * GROUP + lane];
            facing |= (uint32_t)is_facing << (block + lane);
            highlights[lane] = is_facing && highlights[lane] > 0.0f ? wp::pow(highlights[lane], exponent) : 0.0f;
        }
        const vector response = add(mul(mul(row(DIFFUSE_ROW), (number)light.diffuse), n_wi),
            mul(mul(row(SPECULAR_ROW), (number)light.specular), WARP_RT_NUMBER(highlights)));
        const vector color = mul(row(IRRADIANCE_ROW), (number)(1.0f / PI));
        WARP_RT_KEEP_VECTOR(at + TERM_ROW * GROUP, GROUP, cw_mul(color, response));
    }
    return facing;
}
"""
)
_LIGHT = spell_out(
    _LIGHT,
    GROUP=GROUP,
    KIND_POINT=KIND_POINT,
    PI=float(wp.pi),
    CLEARANCE_ROW=CLEARANCE_ROW,
    DIFFUSE_ROW=DIFFUSE_ROW,
    DIRECTION_ROW=DIRECTION_ROW,
    DISTANCE_ROW=DISTANCE_ROW,
    EXPONENT_ROW=EXPONENT_ROW,
    GEOMETRIC_ROW=GEOMETRIC_ROW,
    IRRADIANCE_ROW=IRRADIANCE_ROW,
    LIGHT_ROW=LIGHT_ROW,
    NORMAL_ROW=NORMAL_ROW,
    ORIGIN_ROW=ORIGIN_ROW,
    POSITION_ROW=POSITION_ROW,
    SHADOW_ROW=SHADOW_ROW,
    SPECULAR_ROW=SPECULAR_ROW,
    TERM_ROW=TERM_ROW,
)


@wp.func_native(_LIGHT)
def light_surfaces(
    light: wp.ref[LightData],
    is_known: bool,
    rays: wp.array[float],
    surfaces: wp.array[float],
    set: wp.uint32,
    rows: wp.array[float],
) -> wp.uint32:
    """Write the origins of shadow rays to a light and what it adds to surfaces; return those of them that face it.

    Args:
        light: The light.
        is_known: Whether it is a point or a direction, and how it arrives is to be written, too.
        rays: The group whose rays have met the surfaces.
        surfaces: As ``find_surfaces`` writes them.
        set: Those that wait.
        rows: What else is known of them, as in ``LitSurfaces``.
    """
    ...
