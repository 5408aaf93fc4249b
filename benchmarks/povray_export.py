# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A scene as POV-Ray 3.7's scene language has it, term for term; and what POV-Ray has no equal for.

The mapping of WhittedSurface, lights and camera:

| here | POV-Ray |
|---|---|
| depth N, threshold | max_trace_level N, adc_bailout |
| Ia, ka | ambient_light; finish ambient ka / (pigment opacity), for it is multiplied by both |
| kd | pigment kd, diffuse 1 / opacity |
| ks, n | phong, phong_size: a grey weight |
| Kr | reflection, without Fresnel, metallic, or conserved energy |
| Kt, ior | pigment transmit, interior ior: a grey weight; opacity = 1 - Kt |
| point light without fall-off, distant light | light_source; the same, parallel, from afar |
| opaque shadows of glass | no_shadow, and an opaque twin that only shadow rays see |

Total internal reflection weighs 1 in POV-Ray, Kr + Kt here: the same where Kr + Kt = 1. POV-Ray keeps a list of the
bodies that a ray is in, here vacuum is outside of each: the same unless glass touches glass.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from warp_rt import Scene
from warp_rt.rendering.film_camera import choose_camera, conform_window
from warp_rt.scene import (
    MATERIAL_DEFAULTS,
    Light,
    LightKind,
    Material,
    MaterialModel,
    Mesh,
    ShapeKind,
    Shapes,
    local_bounds,
)

SIZE = 100.0  # that scenes are brought to: POV-Ray's tolerances are 1e-3 and 1e-4, at size 10 they decide shadows
AFAR = 1e5  # distance of parallel lights
DARKEST = 1e-6  # pigment that stands for black, by which the ambient term can still be divided
DEFAULTS = MATERIAL_DEFAULTS[MaterialModel.WHITTED]


class Export:
    """A scene in POV-Ray's words.

    Attributes:
        text: The scene file.
        unsupported: One line for each thing that POV-Ray renders otherwise, or not at all: prim and reason.
    """

    def __init__(
        self, scene: Scene, *, width: int, height: int, depth: int, threshold: float, transmit: bool = False
    ) -> None:
        """Write the scene.

        Args:
            scene: What to export, brought to size ``SIZE``.
            width: Of the picture [pixel].
            height: Likewise.
            depth: Levels of the ray tree.
            threshold: Weight below which rays are dropped.
            transmit: Whether glass casts shadows of its Kt; False: opaque ones.
        """
        self.unsupported: list[str] = []
        self._scene, self._transmit = scene, transmit
        low, high = scene.bounds()
        size = float(np.linalg.norm(high - low))
        self._scale = SIZE / size if np.isfinite(size) and size > 0 else 1.0
        settings = scene.settings
        head = f"assumed_gamma 1.0 ambient_light rgb {vector(settings.ambient or (0, 0, 0))}"
        lines = ["#version 3.7;", f"global_settings{{{head} max_trace_level {depth} adc_bailout {threshold:.9g}}}"]
        lines += ["#default{finish{ambient 0 diffuse 0}}"]
        lines += [f"background{{color rgb {vector(settings.background or (0, 0, 0))}}}"]
        lines += [self._camera(width, height), *self._lights(), *self._bodies()]
        self.text = "\n".join(lines) + "\n"

    def _camera(self, width: int, height: int) -> str:
        scene = self._scene
        camera = choose_camera(scene, None)
        if camera is None:
            raise SystemExit(f"{scene.source}: no camera to export")
        if not camera.is_perspective:
            self._tell(camera.path, "an orthographic camera; the picture is perspective")
        if camera.exposure_scale != 1.0:
            self._tell(camera.path, "exposure is left out")
        aspect = width / height * scene.settings.pixel_aspect_ratio
        left, right, bottom, top = conform_window(camera.window, aspect, scene.settings.aspect_policy)
        linear, eye = camera.world_from_camera[:3, :3], camera.world_from_camera[:3, 3] * self._scale
        middle = linear @ ((left + right) / 2, (bottom + top) / 2, -1.0)
        across, up = linear @ (right - left, 0.0, 0.0), linear @ (0.0, top - bottom, 0.0)
        frame = {"location": eye, "direction": middle, "right": across, "up": up}
        return f"camera{{perspective {' '.join(f'{name} {vector(value)}' for name, value in frame.items())}}}"

    def _lights(self) -> Iterator[str]:
        for dome in self._scene.domes:
            self._tell(dome.path, "a dome light is left out")
        for light in self._scene.lights:
            reason = odd_light(light)
            if reason:
                self._tell(light.path, f"{reason} is left out")
            elif light.kind == LightKind.DISTANT:
                toward = light.world_from_light[:3, 2] / np.linalg.norm(light.world_from_light[:3, 2])
                color = np.array(light.radiance) / np.pi
                yield f"light_source{{{vector(AFAR * toward)} color rgb {vector(color)} parallel point_at <0,0,0>}}"
            else:
                position = light.world_from_light[:3, 3] * self._scale
                yield f"light_source{{{vector(position)} color rgb {vector(light.radiance)}}}"

    def _bodies(self) -> Iterator[str]:
        scene, told = self._scene, set()
        boxes = []
        for row, mesh_row in enumerate(scene.instances.mesh):
            path = scene.prims[scene.instances.prim[row]]
            mesh = scene.meshes[mesh_row]
            if scene.instances.primvars:
                self._tell(path, "primvars of instances are left out")
            for slot, body in self._parts(mesh, scene.instances.world_from_local[row], path):
                index = scene.instances.material_table[scene.instances.material_offset[row] + slot]
                material = scene.materials[index]
                reasons = odd_material(material)
                if material.path not in told:
                    told.add(material.path)
                    for reason in reasons:
                        self._tell(material.path, reason)
                texture, is_glass = finish(material)
                if not is_glass:
                    yield f"{body}\n{texture}}}"
                    continue
                ior = term(material, "ior")[0] if mesh.is_closed else 1.0
                yield f"{body}\n{texture} interior{{ior {ior:.9g}}}{'' if self._transmit else ' no_shadow'}}}"
                if not self._transmit:
                    yield f"{body}\ntexture{{pigment{{color rgb 0}}}} no_image no_reflection}}"
                boxes.append((path, *placed_bounds(mesh, scene.instances.world_from_local[row])))
        for k, (path, low, high) in enumerate(boxes):
            for other, other_low, other_high in boxes[:k]:
                if path != other and (low <= other_high).all() and (other_low <= high).all():
                    self._tell(path, f"glass that may touch {other}: POV-Ray bends rays by the indices of both")

    def _parts(self, mesh: Mesh | Shapes, matrix: np.ndarray, path: str) -> Iterator[tuple[int, str]]:
        """Yield what is placed, by material slot, each without the closing brace."""
        if isinstance(mesh, Mesh):
            slots = np.zeros(len(mesh.triangles), int) if mesh.material_slots is None else mesh.material_slots
            for slot in np.unique(slots):
                yield slot, self._mesh(mesh, matrix, slots == slot)
        elif mesh.kind in (ShapeKind.SPHERE, ShapeKind.FRUSTUM) and mesh.caps[0] == mesh.caps[1]:
            yield 0, self._shapes(mesh, matrix)
        else:
            self._tell(path, "a shape that is no mesh, sphere or cone is left out")

    def _shapes(self, shapes: Shapes, matrix: np.ndarray) -> str:
        """Return the beginning of a union of spheres or cones, placed, without the closing brace."""
        words = []
        for points, radii in zip(shapes.points.tolist(), shapes.radii.tolist(), strict=True):
            ends = ", ".join(f"{vector(point)}, {radius:.9g}" for point, radius in zip(points, radii, strict=True))
            words.append(
                f"sphere{{{ends}}}"
                if shapes.kind == ShapeKind.SPHERE
                else f"cone{{{ends}{'' if shapes.caps[0] else ' open'}}}"
            )
        # POV-Ray's vectors are rows.
        placed = ",".join(f"{value:.9g}" for value in (matrix[:3] * self._scale).T.reshape(-1))
        inside = " inverse" if shapes.is_inside_out else ""
        return f"union{{{chr(10).join(words)} matrix <{placed}>{inside}"

    def _mesh(self, mesh: Mesh, matrix: np.ndarray, chosen: np.ndarray) -> str:
        """Return the beginning of a mesh2 of some triangles, in world space, without the closing brace."""
        triangles = mesh.triangles[chosen]
        used, faces = np.unique(triangles, return_inverse=True)
        points = (mesh.points[used].astype(float) @ matrix[:3, :3].T + matrix[:3, 3]) * self._scale
        parts = [f"vertex_vectors{{{len(points)},{rows(points)}}}"]
        text = f"face_indices{{{len(triangles)},{rows(faces.reshape(-1, 3))}}}"
        if mesh.normals is not None:
            corner_rows = np.zeros_like(mesh.triangles) if mesh.normals.indices is None else mesh.normals.indices
            kept, corners = np.unique(corner_rows[chosen], return_inverse=True)
            normals = mesh.normals.values[kept].astype(float) @ np.linalg.inv(matrix[:3, :3])
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
            parts.append(f"normal_vectors{{{len(normals)},{rows(normals)}}}")
            text += f"\nnormal_indices{{{len(triangles)},{rows(corners.reshape(-1, 3))}}}"
        return "mesh2{" + "\n".join([*parts, text])

    def _tell(self, path: str, reason: str) -> None:
        line = f"{path}: {reason}"
        if line not in self.unsupported:
            self.unsupported.append(line)


def placed_bounds(mesh: Mesh | Shapes, matrix: np.ndarray) -> np.ndarray:
    """Return the world box of a mesh, or the one about that of shapes: shape [2, 3]."""
    corners = mesh.points
    if isinstance(mesh, Shapes):
        pick = np.array([[k >> axis & 1 for axis in range(3)] for k in range(8)])
        corners = np.take_along_axis(local_bounds(mesh), pick, axis=0)
    world = corners @ matrix[:3, :3].T + matrix[:3, 3]
    return np.array([world.min(axis=0), world.max(axis=0)])


def odd_light(light: Light) -> str:
    """Return why POV-Ray has no such light; empty where it has."""
    if light.kind == LightKind.DISTANT and light.angle == 0:
        pass
    elif light.kind != LightKind.POINT:
        return f"a {light.kind.name.lower()} light with an extent"
    elif light.has_falloff:
        return "a point light that weakens with distance"
    if light.cone_angle < np.pi or light.focus > 0:
        return "a light with a cone or focus"
    if not light.casts_shadow or light.diffuse != 1 or light.specular != 1:
        return "a light with multipliers, or without shadows"
    return ""


def term(material: Material, name: str) -> np.ndarray:
    """Return an input's constant, or its default."""
    default = DEFAULTS[name]
    given = material.inputs.get(name)
    return np.array(default if given is None else given.value[: len(default)], float)


def odd_material(material: Material) -> list[str]:
    """Return what POV-Ray renders otherwise of a material."""
    if material.model != MaterialModel.WHITTED:
        return ["no WhittedSurface: the lecture's default material is exported"]
    reasons = [
        f"{name} is textured: its constant is exported"
        for name, given in material.inputs.items()
        if given.texture >= 0 or given.primvar
    ]
    kr, kt = term(material, "reflection"), term(material, "transmission")
    for name in ("specular", "transmission"):
        if np.ptp(term(material, name)) > 1e-7:
            reasons.append(f"{name} is coloured: its mean is exported")
    if kt.max() > 0 and np.abs(kr + kt - 1).max() > 1e-6:
        reasons.append("reflection + transmission is not 1: total internal reflection weighs 1 in POV-Ray")
    if kt.mean() >= 1 and max(term(material, "ambient").max(), term(material, "diffuse").max()) > 0:
        reasons.append("ambient and diffuse terms of fully transparent glass are left out")
    return reasons


def finish(material: Material) -> tuple[str, bool]:
    """Return a material as a texture, and whether it is glass."""
    names = ("ambient", "diffuse", "specular", "reflection", "transmission")
    given = material if material.model == MaterialModel.WHITTED else Material(material.path, MaterialModel.WHITTED)
    ka, kd, ks, kr, kt = (term(given, name) for name in names)
    transmit = float(kt.mean())
    opacity = 1 - transmit
    pigment, ambient, diffuse = np.ones(3), np.zeros(3), 0.0
    if opacity > 0:
        pigment = np.maximum(kd, DARKEST)
        ambient, diffuse = ka / (pigment * opacity), 1 / opacity if kd.max() > 0 else 0.0
    color = ",".join(f"{value:.9g}" for value in (*pigment, transmit))
    highlight = f"phong {ks.mean():.9g} phong_size {term(given, 'shininess')[0]:.9g}"
    shine = f"ambient rgb {vector(ambient)} diffuse {diffuse:.9g} {highlight} reflection{{rgb {vector(kr)}}}"
    return f"texture{{pigment{{color rgbt <{color}>}} finish{{{shine}}}}}", transmit > 0


def vector(values: Sequence[float] | np.ndarray) -> str:
    """Return a vector of POV-Ray's."""
    return "<" + ",".join(f"{value:.9g}" for value in values) + ">"


def rows(values: np.ndarray) -> str:
    """Return the rows of a table as vectors."""
    return ",".join(map(vector, values.tolist()))
