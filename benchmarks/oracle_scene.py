# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A scene in the plain terms that other programs are fed with: those of the oracles of the test data."""

from __future__ import annotations

from typing import Any

import numpy as np

from warp_rt.scene import Light, LightKind, Material, Mesh, Scene


def describe(scene: Scene, width: int, height: int) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return a scene's camera, lights and materials in plain values, and its triangles in world space.

    Args:
        scene: With a perspective camera, WhittedSurface constants, and lights that are the lecture's points or distant
            ones of angle 0; whatever else it has, exact spheres too,
            is left out.
        width: Of the picture [pixel].
        height: Of the picture [pixel].

    Returns:
        The description, and arrays: vertices ``v`` [n, 3], rows of them ``f`` [m, 3], normals a corner ``n``
        [m, 3, 3], and the material ``mat`` and body ``obj`` of each triangle [m].
    """
    vertices, faces, normals, materials, bodies = [], [], [], [], []
    first = 0
    for row, mesh_row in enumerate(scene.instances.mesh):
        mesh, matrix = scene.meshes[mesh_row], scene.instances.world_from_local[row]
        if not isinstance(mesh, Mesh):
            continue
        points = mesh.points @ matrix[:3, :3].T + matrix[:3, 3]
        corner = points[mesh.triangles]
        if mesh.normals is None:
            normal = np.repeat(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])[:, None], 3, axis=1)
        else:
            normal = mesh.normals.values[mesh.normals.indices] @ np.linalg.inv(matrix[:3, :3])
        slots = np.zeros(len(corner), int) if mesh.material_slots is None else mesh.material_slots
        vertices.append(points)
        faces.append(mesh.triangles + first)
        normals.append(normal / np.linalg.norm(normal, axis=-1, keepdims=True))
        materials.append(scene.instances.material_table[scene.instances.material_offset[row] + slots])
        bodies.append(np.full(len(corner), row))
        first += len(points)
    arrays = {"v": vertices, "f": faces, "n": normals, "mat": materials, "obj": bodies}
    settings = scene.settings
    description = {
        "camera": describe_camera(scene) | {"width": width, "height": height},
        "ambient": list(settings.ambient or (0.0, 0.0, 0.0)),
        "background": list(settings.background or (0.0, 0.0, 0.0)),
        "lights": [describe_light(light) for light in scene.lights],
        "materials": [describe_material(material) for material in scene.materials],
    }
    return description, {key: np.concatenate(value) for key, value in arrays.items()}


def describe_camera(scene: Scene) -> dict[str, object]:
    """Return the first camera; its window is symmetric and has the picture's aspect ratio."""
    camera = scene.cameras[0]
    right, up, back, eye = camera.world_from_camera[:3, :].T
    left_edge, right_edge, bottom, top = camera.window
    frame = {"eye": eye, "dir": -back, "right": right * (right_edge - left_edge), "up": up * (top - bottom)}
    return {key: value.tolist() for key, value in frame.items()}


def describe_light(light: Light) -> dict[str, object]:
    """Return a lecture's point light or a distant light of angle 0; the scene has no other."""
    if light.kind == LightKind.DISTANT:
        color = [channel / np.pi for channel in light.radiance]
        return {"type": "directional", "direction": (-light.world_from_light[:3, 2]).tolist(), "color": color}
    return {"type": "point", "position": light.world_from_light[:3, 3].tolist(), "color": list(light.radiance)}


def describe_material(material: Material) -> dict[str, object]:
    """Return the constants of a WhittedSurface; whatever else the scene leaves out is black by default."""

    def constant(name: str, default: float) -> list[float]:
        return list(material.inputs[name].value) if name in material.inputs else [default] * 4

    names = {"ambient": "ka", "diffuse": "kd", "specular": "ks", "reflection": "kr", "transmission": "kt"}
    colors = {short: constant(name, 0.0)[:3] for name, short in names.items()}
    return colors | {"n": constant("shininess", 32.0)[0], "ior": constant("ior", 1.5)[0]}
