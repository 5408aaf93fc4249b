# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Where the rays of a group meet triangles: the surface points of sixteen hits at a time, by vectors.

``line_hit.surface_on_line`` says what is computed, operation by operation in the same order, so that a surface has the
same bits whether its ray came alone or in a group. Triangles are read hit by hit, one's memory being waited for beside
the others'.
"""

import warp as wp

from .bvh_structs import AccelData, Hit
from .constants import DIRECTION_ROW, GREAT_TRIANGLE, GROUP, LEAST_DIVISOR, SPAWN_OFFSET, SPAWN_OFFSET_MIN, TRIANGLES
from .group_structs import RayGroup
from .line_hit import surface_on_line
from .native import spell_out
from .number_rows import NUMBERS, row_int, row_vector, set_row
from .primvar import NORMALS_SLOT
from .ray_structs import RayTask
from .scene_structs import SceneData
from .surface import Surface

# Rows of GROUP numbers in which surfaces stand: three each of vectors.
POSITION_ROW = wp.constant(0)
GEOMETRIC_ROW = wp.constant(3)
SHADING_ROW = wp.constant(6)
CLEARANCE_ROW = wp.constant(9)
U_ROW = wp.constant(10)
V_ROW = wp.constant(11)
T_ROW = wp.constant(12)
# From here on the bits of int32.
INSTANCE_ROW = wp.constant(13)
"""Instances; -1 of rays that have met no triangle."""
TRIANGLE_ROW = wp.constant(14)
MESH_ROW = wp.constant(15)
MATERIAL_ROW = wp.constant(16)

_HELPERS = r"""
    const auto largest = [](const vector& v) {
        const number x = WARP_RT_ABS(v[0]), y = WARP_RT_ABS(v[1]), z = WARP_RT_ABS(v[2]), yz = WARP_RT_GREATER(y, z);
        return (number)WARP_RT_GREATER(x, yz);
    };
    const auto magnitudes = [](const vector& v) {
        return vector(WARP_RT_ABS(v[0]), WARP_RT_ABS(v[1]), WARP_RT_ABS(v[2]));
    };
    const auto chosen = [](auto test, const vector& x, const vector& y) {
        return vector(test ? x[0] : y[0], test ? x[1] : y[1], test ? x[2] : y[2]);
    };
"""
"""Functions of vectors, a number for each lane, that Warp has for one only."""

_READ_HITS = r"""
        enum { CORNERS = 0, OFFSET = 9, NORMALS = 12, IS_SMOOTH = 21 };
        float read[22][LANES] = {};
        decltype(scene.instances.data) instances[LANES], first = nullptr;
        bool is_alone = true;
        for (int lane = 0; lane < LANES; ++lane) {
            const int index = block + lane, word = index < count ? group.words.data[index] : -1;
            instances[lane] = first;
            words_[INSTANCE_ROW * GROUP + index] = -1;
            if (word < 0)
                continue;
            const auto& record = accel.instances.data[group.records.data[index]];
            if ((int)record.kind != TRIANGLES)
                continue;
            auto& instance = scene.instances.data[record.instance];
            const auto& mesh = scene.meshes.data[instance.mesh];
            const int triangle = ((const int*)accel.leaves.data)[word];
            const auto& corners = scene.corners.data[mesh.triangle_offset + triangle];
            const auto& offset = tasks.data[order.data[start + index]].offset;
            const auto& normals = scene.primvars.data[instance.mesh * scene.primvar_count + NORMALS_SLOT];
            for (int axis = 0; axis < 3; ++axis)
                read[OFFSET + axis][lane] = offset[axis];
            for (int k = 0; k < 3; ++k)
                for (int axis = 0; axis < 3; ++axis)
                    read[CORNERS + 3 * k + axis][lane] = scene.points.data[mesh.point_offset + corners[k]][axis];
            if (normals.component_count > 0) {
                read[IS_SMOOTH][lane] = 1.0f;
                for (int k = 0; k < 3; ++k) {
                    const int row = normals.corner_offset < 0 ? 0
                        : scene.corners.data[normals.corner_offset + triangle][k];
                    for (int axis = 0; axis < 3 && axis < normals.component_count; ++axis)
                        read[NORMALS + 3 * k + axis][lane]
                            = scene.primvar_values.data[normals.value_offset + row * normals.component_count + axis];
                }
            }
            const int slot = mesh.slot_offset < 0 ? 0 : scene.material_slots.data[mesh.slot_offset + triangle];
            words_[INSTANCE_ROW * GROUP + index] = record.instance;
            words_[TRIANGLE_ROW * GROUP + index] = triangle;
            words_[MESH_ROW * GROUP + index] = instance.mesh;
            words_[MATERIAL_ROW * GROUP + index] = scene.material_table.data[instance.material_offset + slot];
            first = first ? first : &instance;
            is_alone &= first == &instance;
            instances[lane] = &instance;
        }
        if (!first)
            continue;
"""
"""What a block's hits need of the scene, read hit by hit: corners, normals, the way that the search began off the
line, and which mesh and material it is. A block without a triangle is left."""

_TO_INSTANCES = r"""
        number placed[24];
        for (int k = 0; k < 24; ++k)
            placed[k] = (number)((const float*)first)[k];
        if (!is_alone)
            for (int k = 0; k < 24; ++k) {
                float each[LANES];
                for (int lane = 0; lane < LANES; ++lane)
                    each[lane] = ((const float*)(instances[lane] ? instances[lane] : first))[k];
                placed[k] = WARP_RT_NUMBER(each);
            }
        const number *world = placed, *local = placed + 12;
        const auto to_local = [&](const vector& v) {
            return vector(local[0] * v[0] + local[1] * v[1] + local[2] * v[2],
                local[4] * v[0] + local[5] * v[1] + local[6] * v[2],
                local[8] * v[0] + local[9] * v[1] + local[10] * v[2]);
        };
        const auto to_place = [](const number* m, const vector& p) {
            return vector(m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3],
                m[4] * p[0] + m[5] * p[1] + m[6] * p[2] + m[7], m[8] * p[0] + m[9] * p[1] + m[10] * p[2] + m[11]);
        };
        const auto to_world_normal = [&](const vector& n) {
            return vector(local[0] * n[0] + local[4] * n[1] + local[8] * n[2],
                local[1] * n[0] + local[5] * n[1] + local[9] * n[2],
                local[2] * n[0] + local[6] * n[1] + local[10] * n[2]);
        };
"""
"""The ways between world and instances: those of one where all hits are its own, else a lane for each."""

_LOAD_TRIANGLE = r"""
        const vector p0 = WARP_RT_VECTOR(read[CORNERS], LANES), p1 = WARP_RT_VECTOR(read[CORNERS + 3], LANES);
        const vector p2 = WARP_RT_VECTOR(read[CORNERS + 6], LANES), offset = WARP_RT_VECTOR(read[OFFSET], LANES);
        const vector side1 = sub(p1, p0), side2 = sub(p2, p0);
        const number size1 = largest(side1), size2 = largest(side2), size12 = WARP_RT_GREATER(size1, size2);
        const number size = WARP_RT_GREATER(size12, (number)LEAST_DIVISOR);
        const vector e1 = div(side1, size), e2 = div(side2, size), across = cross(e1, e2);
"""
"""``load_triangle``: edges and normal, scaled to keep within float32."""

_CORRECT_HIT = r"""
        const vector world_direction = WARP_RT_VECTOR(lines + DIRECTION_ROW * GROUP + block, GROUP);
        const vector direction = to_local(world_direction), local_offset = to_local(offset);
        const number found_t = WARP_RT_NUMBER((const float*)group.ends.data + block);
        const number found_u = WARP_RT_NUMBER((const float*)group.u.data + block);
        const number found_v = WARP_RT_NUMBER((const float*)group.v.data + block);
        const number facing = dot(across, direction), shift = dot(across, local_offset);
        const auto is_moved = WARP_RT_ABS(shift) < 0.5f * found_t * WARP_RT_ABS(facing);
        const number dt = shift / facing;
        const vector moved = div(sub(mul(direction, dt), local_offset), size);
        const number scale = 1.0f / dot(across, across);
        const number moved_u = found_u + dot(cross(moved, e2), across) * scale;
        const number positive_u = WARP_RT_CHOOSE(moved_u > 0.0f, moved_u, (number)0.0f);
        const number u = WARP_RT_CHOOSE(is_moved, WARP_RT_CHOOSE(positive_u < 1.0f, positive_u, (number)1.0f), found_u);
        const number moved_v = found_v + dot(cross(e1, moved), across) * scale;
        const number positive_v = WARP_RT_CHOOSE(moved_v > 0.0f, moved_v, (number)0.0f), rest = 1.0f - u;
        const number v = WARP_RT_CHOOSE(is_moved, WARP_RT_CHOOSE(positive_v < rest, positive_v, rest), found_v);
        const number t = WARP_RT_CHOOSE(is_moved, found_t + dt, found_t);
"""
"""``correct_hit``: where the line itself meets the triangle's plane, from where the ray beside it does."""

_PLACE_ON_TRIANGLE = r"""
        const number length = WARP_RT_SQRT(dot(across, across));
        const vector nothing = vector((number)0.0f), n_local = chosen(length > 0.0f, div(across, length), nothing);
        const vector n_world = to_world_normal(n_local);
        const number world_length = WARP_RT_SQRT(dot(n_world, n_world));
        const number plane_scale = 1.0f / WARP_RT_GREATER(world_length, (number)LEAST_DIVISOR);
        const vector n_geometric = mul(n_world, plane_scale);
        const number w = 1.0f - u - v;
        const vector weighted = add(add(mul(p0, w), mul(p1, u)), mul(p2, v));
        const vector m0 = magnitudes(p0), m1 = magnitudes(p1), m2 = magnitudes(p2);
        const vector weighted_sums = add(add(mul(m0, w), mul(m1, u)), mul(m2, v));
        const number size_p0 = largest(p0), size_p1 = largest(p1), size_p2 = largest(p2);
        const number size_p01 = WARP_RT_GREATER(size_p0, size_p1), corners = WARP_RT_GREATER(size_p01, size_p2);
        const vector left = sub(WARP_RT_VECTOR(lines + block, GROUP), offset), origin = to_place(local, left);
        const vector along_ray = add(magnitudes(origin), mul(magnitudes(direction), t));
        const number slope = dot(n_local, direction);
        const auto is_great = (largest(weighted) < GREAT_TRIANGLE * corners)
            & (largest(along_ray) < GREAT_TRIANGLE * corners) & (slope != 0.0f);
        const vector on_ray = add(origin, mul(direction, dot(n_local, sub(p0, origin)) / slope));
        const vector sums = chosen(is_great, add(along_ray, m0), weighted_sums);
        const vector position = to_place(world, chosen(is_great, on_ray, weighted));
"""
"""``place_on_triangle``: the point, on great triangles found along the ray, and the geometric normal."""

_SPAWN_CLEARANCE = r"""
        const vector back = add(magnitudes(position), magnitudes(vector(world[3], world[7], world[11])));
        vector way_back;
        for (int axis = 0; axis < 3; ++axis)
            way_back[axis] = WARP_RT_ABS(local[4 * axis]) * back[0] + WARP_RT_ABS(local[4 * axis + 1]) * back[1]
                + WARP_RT_ABS(local[4 * axis + 2]) * back[2];
        const number rounding
            = dot(magnitudes(n_local), add(sums, way_back)) * SPAWN_OFFSET + corners * SPAWN_OFFSET_MIN;
"""
"""``spawn_clearance``: how far off it rays must start."""

_EVAL_NORMALS = r"""
        const vector n0 = WARP_RT_VECTOR(read[NORMALS], LANES), n1 = WARP_RT_VECTOR(read[NORMALS + 3], LANES);
        const vector n2 = WARP_RT_VECTOR(read[NORMALS + 6], LANES);
        const vector n = to_world_normal(add(add(mul(n0, 1.0f - (u + v)), mul(n1, u)), mul(n2, v)));
        const number n_length = WARP_RT_SQRT(dot(n, n));
        const auto is_smooth = (n_length > 0.0f) & (WARP_RT_NUMBER(read[IS_SMOOTH]) > 0.0f);
"""
"""``eval_normals``: the shading normal."""

_WRITE_SURFACES = r"""
        WARP_RT_KEEP_VECTOR(rows + POSITION_ROW * GROUP + block, GROUP, position);
        WARP_RT_KEEP_VECTOR(rows + GEOMETRIC_ROW * GROUP + block, GROUP, n_geometric);
        const vector n_shading = chosen(is_smooth, div(n, n_length), n_geometric);
        WARP_RT_KEEP_VECTOR(rows + SHADING_ROW * GROUP + block, GROUP, n_shading);
        WARP_RT_KEEP(rows + CLEARANCE_ROW * GROUP + block, plane_scale * rounding);
        WARP_RT_KEEP(rows + U_ROW * GROUP + block, u);
        WARP_RT_KEEP(rows + V_ROW * GROUP + block, v);
        WARP_RT_KEEP(rows + T_ROW * GROUP + block, t);
"""
"""The rows of the block."""

_SURFACES = (
    "{\n"
    + NUMBERS
    + _HELPERS
    + r"""
    const float* lines = (const float*)group.rays.data;
    float* rows = (float*)surfaces.data;
    int* words_ = (int*)surfaces.data;
    for (int block = 0; block < count; block += LANES) {
"""
    + _READ_HITS
    + _TO_INSTANCES
    + _LOAD_TRIANGLE
    + _CORRECT_HIT
    + _PLACE_ON_TRIANGLE
    + _SPAWN_CLEARANCE
    + _EVAL_NORMALS
    + _WRITE_SURFACES
    + "    }\n}\n"
)
_SURFACES = spell_out(
    _SURFACES,
    GROUP=GROUP,
    DIRECTION_ROW=DIRECTION_ROW,
    TRIANGLES=TRIANGLES,
    NORMALS_SLOT=NORMALS_SLOT,
    GREAT_TRIANGLE=GREAT_TRIANGLE,
    LEAST_DIVISOR=LEAST_DIVISOR,
    SPAWN_OFFSET=SPAWN_OFFSET,
    SPAWN_OFFSET_MIN=SPAWN_OFFSET_MIN,
    POSITION_ROW=POSITION_ROW,
    GEOMETRIC_ROW=GEOMETRIC_ROW,
    SHADING_ROW=SHADING_ROW,
    CLEARANCE_ROW=CLEARANCE_ROW,
    U_ROW=U_ROW,
    V_ROW=V_ROW,
    T_ROW=T_ROW,
    INSTANCE_ROW=INSTANCE_ROW,
    TRIANGLE_ROW=TRIANGLE_ROW,
    MESH_ROW=MESH_ROW,
    MATERIAL_ROW=MATERIAL_ROW,
)


@wp.func_native(_SURFACES)
def find_surfaces(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    group: wp.ref[RayGroup],
    tasks: wp.array[RayTask],
    order: wp.array[int],
    start: int,
    count: int,
    surfaces: wp.array[float],
):
    """Write where the lines that rays are meant to follow meet the triangles that their search has found.

    Args:
        scene: Shading data.
        accel: Hierarchies.
        group: The rays, with their closest hits.
        tasks: Those that have been gathered to the group.
        order: Which they are, from ``start`` on.
        start: Position of the first.
        count: How many.
        surfaces: Output, SURFACE_FLOATS long; of rays that have met no triangle it means nothing.
    """
    ...


@wp.func
def surface_in_group(
    scene: wp.ref[SceneData],
    accel: wp.ref[AccelData],
    group: wp.ref[RayGroup],
    task: wp.ref[RayTask],
    surfaces: wp.array[float],
    slot: int,
    hit: wp.ref[Hit],
    s: wp.ref[Surface],
) -> float:
    """Write the hit of a ray of a group, as ``traverse`` finds it, and what ``surface_on_line`` does; return its t.

    Args:
        scene: Shading data.
        accel: Hierarchies.
        group: The rays.
        task: The ray.
        surfaces: As ``find_surfaces`` has written them; points on shapes are added.
        slot: Place of the ray in its group.
        hit: Output.
        s: Output, unless nothing is met.
    """
    hit.t = task.reach
    hit.instance = row_int(surfaces, INSTANCE_ROW, slot)
    hit.triangle = -1
    word = group.words[slot]
    if word < 0:
        return hit.t
    hit.t = group.ends[slot]
    hit.u = group.u[slot]
    hit.v = group.v[slot]
    if hit.instance < 0:
        hit.instance = accel.instances[group.records[slot]].instance
        hit.triangle = wp.cast(accel.shapes[word], wp.int32)
        distance = surface_on_line(scene, hit, task.origin, task.offset, task.direction, s)
        surfaces[INSTANCE_ROW * GROUP + slot] = wp.cast(hit.instance, float)
        surfaces[TRIANGLE_ROW * GROUP + slot] = wp.cast(hit.triangle, float)
        set_row(surfaces, POSITION_ROW, slot, s.position)
        set_row(surfaces, GEOMETRIC_ROW, slot, s.n_geometric)
        surfaces[CLEARANCE_ROW * GROUP + slot] = s.clearance
        return distance
    hit.triangle = row_int(surfaces, TRIANGLE_ROW, slot)
    s.instance = hit.instance
    s.triangle = hit.triangle
    s.mesh = row_int(surfaces, MESH_ROW, slot)
    s.material = row_int(surfaces, MATERIAL_ROW, slot)
    s.u = surfaces[U_ROW * GROUP + slot]
    s.v = surfaces[V_ROW * GROUP + slot]
    s.position = row_vector(surfaces, POSITION_ROW, slot)
    s.n_geometric = row_vector(surfaces, GEOMETRIC_ROW, slot)
    s.n_shading = row_vector(surfaces, SHADING_ROW, slot)
    s.clearance = surfaces[CLEARANCE_ROW * GROUP + slot]
    return surfaces[T_ROW * GROUP + slot]
