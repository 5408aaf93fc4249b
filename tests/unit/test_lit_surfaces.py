# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What lights add to the surfaces of a group: sixteen at a time and one by one, to the last bit."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

from warp_rt.kernels.brdf import phong
from warp_rt.kernels.constants import DIRECTION_ROW, GROUP, GROUP_FLOATS, LIT_FLOATS, SURFACE_FLOATS
from warp_rt.kernels.group_surfaces import CLEARANCE_ROW, GEOMETRIC_ROW, POSITION_ROW
from warp_rt.kernels.light import KIND_DISTANT, KIND_POINT, KIND_SPHERE
from warp_rt.kernels.light_structs import LightData
from warp_rt.kernels.lit_surfaces import (
    DISTANCE_ROW,
    ORIGIN_ROW,
    SHADOW_ROW,
    TERM_ROW,
    await_light,
    is_point_or_direction,
    light_surfaces,
    set_arriving,
)
from warp_rt.kernels.number_rows import row_vector
from warp_rt.kernels.response import MODEL_WHITTED, Shading
from warp_rt.kernels.scene_structs import SceneData
from warp_rt.kernels.spawn import spawn_origin
from warp_rt.kernels.surface import Surface
from warp_rt.kernels.tile_structs import LitSurfaces
from warp_rt.kernels.whole_light import whole_light
from warp_rt.warp_setup import init_warp

init_warp()
wp.set_module_options({"enable_backward": False, "fuse_fp": False})

GROUPS = 40
OUTPUTS = 11
"""Numbers of a surface that are compared: whether it faces the light, origin, direction and reach, and the term."""


@wp.kernel
def compare(
    scene: wp.array[SceneData],
    light: wp.array[LightData],
    lits: wp.array[LitSurfaces],
    shadings: wp.array2d[Shading],
    rays: wp.array2d[float],
    surfaces: wp.array2d[float],
    waiting: wp.array[wp.uint32],
    out: wp.array4d[float],
):
    i = wp.tid()
    rows = lits[0].rows
    lits[0].set = wp.uint32(0)
    is_known = is_point_or_direction(light[0])
    for slot in range(wp.int32(GROUP)):
        if (waiting[i] & (wp.uint32(1) << wp.uint32(slot))) != wp.uint32(0):
            lits[0].slot = slot
            await_light(lits[0], shadings[i, slot], 1)
            if not is_known:
                arriving = whole_light(
                    scene[0], light[0], row_vector(surfaces[i], POSITION_ROW, slot), shadings[i, slot].n
                )
                set_arriving(rows, slot, arriving)
    facing = light_surfaces(light[0], is_known, rays[i], surfaces[i], lits[0].set, rows)
    for slot in range(wp.int32(GROUP)):
        if (facing & (wp.uint32(1) << wp.uint32(slot))) != wp.uint32(0):
            origin = row_vector(rows, ORIGIN_ROW, slot)
            direction = row_vector(rows, SHADOW_ROW, slot)
            term = row_vector(rows, TERM_ROW, slot)
            out[0, i, slot, 0] = 1.0
            for axis in range(3):
                out[0, i, slot, 1 + axis] = origin[axis]
                out[0, i, slot, 4 + axis] = direction[axis]
                out[0, i, slot, 7 + axis] = term[axis]
            out[0, i, slot, 10] = rows[DISTANCE_ROW * GROUP + slot]
        if (waiting[i] & (wp.uint32(1) << wp.uint32(slot))) != wp.uint32(0):
            s = shadings[i, slot]
            surface = Surface()
            surface.position = row_vector(surfaces[i], POSITION_ROW, slot)
            surface.n_geometric = row_vector(surfaces[i], GEOMETRIC_ROW, slot)
            surface.clearance = surfaces[i, CLEARANCE_ROW * GROUP + slot]
            surface.u = 0.25
            surface.v = 0.25
            arriving = whole_light(scene[0], light[0], surface.position, s.n)
            if wp.dot(s.n, arriving.wi) > 0.0:
                start = spawn_origin(scene[0], surface, arriving.to_shadow)
                color = arriving.irradiance * (1.0 / wp.pi)
                response = phong(
                    s.diffuse * light[0].diffuse, s.specular * light[0].specular, s.exponent, s.n, s.wo, arriving.wi
                )
                added = wp.cw_mul(color, response)
                out[1, i, slot, 0] = 1.0
                for axis in range(3):
                    out[1, i, slot, 1 + axis] = start[axis]
                    out[1, i, slot, 4 + axis] = arriving.to_shadow[axis]
                    out[1, i, slot, 7 + axis] = added[axis]
                out[1, i, slot, 10] = arriving.distance


def unit(values: np.ndarray) -> np.ndarray:
    return values / np.linalg.norm(values, axis=-1, keepdims=True)


@pytest.mark.parametrize("kind", ["point", "fading point", "direction", "sphere"])
def test_sixteen_at_a_time_or_one_by_one(kind: str) -> None:
    rng = np.random.default_rng(4)
    shape = (GROUPS, int(GROUP))
    light = np.zeros(1, LightData.numpy_dtype())
    light["kind"] = {"direction": int(KIND_DISTANT), "sphere": int(KIND_SPHERE)}.get(kind, int(KIND_POINT))
    light["position"], light["axis_z"] = rng.normal(size=3), unit(rng.normal(size=3))
    light["emission"], light["radius"], light["has_falloff"] = rng.uniform(size=3), 0.3, kind == "fading point"
    for axis, side in enumerate(("half_x", "half_y", "half_z")):
        light[side] = 0.3 * np.eye(3)[axis]
    light["diffuse"], light["specular"], light["cone_angle"] = 0.7, 1.3, 4.0
    for row in ("profile", "meridians", "texture", "mesh", "receivers", "shadow"):
        light[row] = -1
    normal, toward = unit(rng.normal(size=(*shape, 3))), unit(rng.normal(size=(*shape, 3)))
    shadings = np.zeros(shape, Shading.numpy_dtype())
    shadings["model"], shadings["n"], shadings["wo"] = int(MODEL_WHITTED), normal, toward
    shadings["diffuse"], shadings["specular"] = rng.uniform(size=(2, *shape, 3))
    shadings["specular"][::3] = 0.0
    shadings["exponent"] = 10 ** rng.uniform(0, 3, shape)
    rays, surfaces = np.zeros((GROUPS, int(GROUP_FLOATS))), rng.normal(size=(GROUPS, int(SURFACE_FLOATS)))
    surfaces = surfaces.astype(np.float32)
    columns = surfaces.reshape(GROUPS, -1, int(GROUP))
    first = int(POSITION_ROW)
    columns[0, first : first + 3, 5] = light["position"][0]  # at the light
    first = int(DIRECTION_ROW)
    rays.reshape(GROUPS, -1)[:, first * int(GROUP) : (first + 3) * int(GROUP)] = (
        -shadings["wo"].transpose(0, 2, 1).reshape(GROUPS, -1)
    )
    waiting = rng.integers(0, 2**32, GROUPS, dtype=np.uint32)
    waiting[:3] = 0, 0xFFFF0000, 0xFFFFFFFF
    lit = LitSurfaces()
    lit.rows = wp.empty(int(LIT_FLOATS), dtype=float, device="cpu")
    lit.depths = wp.empty(int(GROUP), dtype=int, device="cpu")
    out = wp.zeros((2, *shape, OUTPUTS), dtype=float, device="cpu")
    inputs = [
        wp.array([SceneData()], dtype=SceneData, device="cpu"),
        wp.array(light, dtype=LightData, device="cpu"),
        wp.array([lit], dtype=LitSurfaces, device="cpu"),
        wp.array(shadings, dtype=Shading, device="cpu"),
        wp.array(rays.astype(np.float32), dtype=float, device="cpu"),
        wp.array(surfaces, dtype=float, device="cpu"),
        wp.array(waiting, dtype=wp.uint32, device="cpu"),
    ]
    wp.launch(compare, GROUPS, inputs=inputs, outputs=[out], device="cpu")
    together, alone = out.numpy()
    assert 200 < alone[..., 0].sum() < 0.6 * waiting.size * int(GROUP)
    np.testing.assert_array_equal(together, alone)
