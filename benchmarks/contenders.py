# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Who traces: each contender takes a mesh and answers closest hit and any hit for rays in NumPy arrays.

Times include what each interface does besides tracing, such as making its output arrays: that is what its users get.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import warp as wp

import warp_rt

from .meshes import TriangleMesh
from .processes import SideBySide
from .ray_sets import Rays

wp.set_module_options({"enable_backward": False})

SIDE_BY_SIDE = "warp_rt, processes"
PROCESSES = os.cpu_count() or 1

Query = Callable[[Rays], np.ndarray]


@dataclass(frozen=True)
class Contender:
    """A built hierarchy that answers queries."""

    closest: Query
    """Returns the triangle of each ray's closest hit; negative (or not below the triangle count) for none."""
    any: Query
    """Returns whether each ray hits anything."""


def warp_rt_contender(mesh: TriangleMesh, threads: int) -> Contender:
    """warp_rt with its default builder."""
    accel = warp_rt.build_accel(warp_rt.Scene.from_arrays(mesh.points, mesh.triangles))
    return Contender(
        lambda rays: warp_rt.closest_hit(accel, rays.origins, rays.directions, threads=threads).triangle,
        lambda rays: warp_rt.any_hit(accel, rays.origins, rays.directions, threads=threads),
    )


def side_by_side_contender(mesh: TriangleMesh) -> Contender:
    """warp_rt in a process for each core, by one thread and all of the rays each; where processes can be forked."""
    if not hasattr(os, "fork"):
        raise ImportError("this system does not fork processes")
    alone = warp_rt_contender(mesh, threads=1)
    return Contender(SideBySide(alone.closest, PROCESSES), SideBySide(alone.any, PROCESSES))


def embree_contender(mesh: TriangleMesh) -> Contender:
    """Embree 4 through embreex: robust mode, ray by ray, one thread."""
    from embreex import rtcore_scene
    from embreex.mesh_construction import TriangleMesh as EmbreeMesh

    scene = rtcore_scene.EmbreeScene(robust=True)
    EmbreeMesh(scene, mesh.points, mesh.triangles)
    return Contender(
        lambda rays: scene.run(rays.origins, rays.directions),
        lambda rays: scene.run(rays.origins, rays.directions, query="OCCLUDED") >= 0,
    )


def open3d_contender(mesh: TriangleMesh) -> Contender:
    """Embree through Open3D's RaycastingScene: robust mode, ray by ray, one thread."""
    import open3d

    scene = open3d.t.geometry.RaycastingScene(nthreads=1)
    scene.add_triangles(mesh.points, mesh.triangles.astype(np.uint32))

    def tensor(rays: Rays) -> open3d.core.Tensor:
        return open3d.core.Tensor(np.concatenate([rays.origins, rays.directions], axis=1))

    def closest(rays: Rays) -> np.ndarray:
        ids = scene.cast_rays(tensor(rays), nthreads=1)["primitive_ids"].numpy()
        return ids.view(np.int32)  # its word for none is all ones

    return Contender(closest, lambda rays: scene.test_occlusions(tensor(rays), nthreads=1).numpy())


def wp_mesh_contender(mesh: TriangleMesh, constructor: str | None) -> Contender:
    """wp.Mesh with one of its constructors (None: the default of the device), one thread."""
    built = wp.Mesh(
        wp.array(mesh.points, dtype=wp.vec3, device="cpu"),
        wp.array(mesh.triangles.reshape(-1), dtype=int, device="cpu"),
        bvh_constructor=constructor,
    )

    def vectors(rays: Rays) -> list[wp.array]:
        return [wp.array(v, dtype=wp.vec3, device="cpu", copy=False) for v in (rays.origins, rays.directions)]

    def closest(rays: Rays) -> np.ndarray:
        outputs = [wp.empty(len(rays), dtype=dtype, device="cpu") for dtype in (int, float, wp.vec2)]
        wp.launch(mesh_closest, len(rays), inputs=[built.id, *vectors(rays)], outputs=outputs, device="cpu")
        return outputs[0].numpy()

    def blocked(rays: Rays) -> np.ndarray:
        output = wp.empty(len(rays), dtype=wp.bool, device="cpu")
        wp.launch(mesh_any, len(rays), inputs=[built.id, *vectors(rays)], outputs=[output], device="cpu")
        return output.numpy()

    return Contender(closest, blocked)


@wp.kernel
def mesh_closest(
    mesh: wp.uint64,
    origins: wp.array[wp.vec3],
    directions: wp.array[wp.vec3],
    face_out: wp.array[int],
    t_out: wp.array[float],
    uv_out: wp.array[wp.vec2],
):
    i = wp.tid()
    query = wp.mesh_query_ray(mesh, origins[i], directions[i], 1.0e30)
    face_out[i] = wp.where(query.result, query.face, -1)
    t_out[i] = query.t
    uv_out[i] = wp.vec2(query.u, query.v)


@wp.kernel
def mesh_any(
    mesh: wp.uint64, origins: wp.array[wp.vec3], directions: wp.array[wp.vec3], blocked_out: wp.array[wp.bool]
):
    i = wp.tid()
    blocked_out[i] = wp.mesh_query_ray_anyhit(mesh, origins[i], directions[i], 1.0e30)


CONTENDERS: dict[str, Callable[[TriangleMesh], Contender]] = {
    "warp_rt": partial(warp_rt_contender, threads=1),
    "warp_rt, all cores": partial(warp_rt_contender, threads=os.cpu_count() or 1),
    SIDE_BY_SIDE: side_by_side_contender,
    "embree": embree_contender,
    "wp.Mesh": partial(wp_mesh_contender, constructor=None),
    "open3d": open3d_contender,
    "wp.Mesh, median": partial(wp_mesh_contender, constructor="median"),
    "wp.Mesh, cubql": partial(wp_mesh_contender, constructor="cubql"),
}
DEFAULT = ("warp_rt", "warp_rt, all cores", SIDE_BY_SIDE, "embree", "wp.Mesh")
