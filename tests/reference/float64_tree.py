# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The illumination model of docs/whitted.md in float64 and NumPy: the judge of the renderer's pictures and counts.

All rays of one depth are traced together, level by level. Written from the documents, it shares no code with the
kernels: no hierarchy, no stack, no offset of spawned rays. Whether glass is entered or left is kept as what it means,
the set of bodies that a ray is inside of: a refraction crosses the surface, a reflection does not. On the way the set
changes by that alone, so it cannot depend on where an interpolated normal happens to bend a ray.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from warp_rt import Scene
from warp_rt.scene import Camera, Light, LightKind

from .float64_materials import Hits
from .float64_triangles import Triangles, dot, unit


@dataclass
class Level:
    """What one level of the tree adds to the picture and to the counts."""

    color: np.ndarray
    """float64, shape [pixels, 3]."""
    nodes: int
    reflection: int
    """Rays of this level."""
    refraction: int
    shadow: int = 0
    """Cast from this level's nodes; so too the rest."""
    total_internal_reflection: int = 0
    dropped_by_threshold: int = 0
    children: int = 0
    """Kept by the threshold."""


@dataclass
class Tree:
    """The levels of a traced picture; the first k of them are the picture of depth k."""

    height: int
    width: int
    levels: list[Level]

    def image(self, depth: int) -> np.ndarray:
        """Return the picture of a depth: float64, shape [height, width, 3]."""
        return sum(level.color for level in self.levels[:depth]).reshape(self.height, self.width, 3)

    def counts(self, depth: int) -> dict[str, int]:
        """Return the ray counts of a depth by the names of ``assert_same_counts``."""
        levels = self.levels[:depth]
        names = ("reflection", "refraction", "shadow", "nodes")
        total = {name: sum(getattr(level, name) for level in levels) for name in names}
        return total | {
            "primary": self.width * self.height,
            "tir": sum(level.total_internal_reflection for level in levels),
            "pruned_threshold": sum(level.dropped_by_threshold for level in levels),
            "pruned_depth": levels[-1].children if len(levels) == depth else 0,
        }


@dataclass
class Rays:
    """The rays of one level."""

    pixel: np.ndarray
    origin: np.ndarray
    direction: np.ndarray
    coefficient: np.ndarray
    """Product of the coefficients on the way, shape [n, 3]."""
    weight: np.ndarray
    """Product of their largest channels."""
    inside: np.ndarray
    """Whether the ray is inside of each body, shape [n, bodies]."""
    is_refraction: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))

    def __getitem__(self, rows: np.ndarray) -> Rays:
        return Rays(*(values[rows] for values in vars(self).values()))

    @staticmethod
    def join(parts: list[Rays]) -> Rays:
        """Return the rays of all parts."""
        columns = zip(*(vars(part).values() for part in parts), strict=True)
        return Rays(*(np.concatenate(column) for column in columns))


def trace(
    scene: Scene, camera: Camera, width: int, height: int, *, depth: int, threshold: float = 0.0, transmit: bool = False
) -> Tree:
    """Return the ray trees of a picture, one ray through each pixel's centre.

    Args:
        scene: Triangles with WhittedSurfaces, point and distant lights.
        camera: A pinhole whose window has the picture's aspect ratio.
        width: Of the picture [pixel].
        height: Likewise.
        depth: Levels.
        threshold: Children of a weight strictly below are dropped.
        transmit: Whether shadow rays are weakened by the glass that they cross; False: any hit blocks them.
    """
    triangles = Triangles(scene)
    rays = _eye_rays(triangles, camera, width, height)
    levels = []
    while len(rays.pixel) and len(levels) < depth:
        is_first = not levels
        bent = int(rays.is_refraction.sum())
        color = np.zeros((width * height, 3))
        level = Level(color, len(rays.pixel), 0 if is_first else len(rays.pixel) - bent, bent)
        levels.append(level)
        rays = _trace_level(scene, triangles, rays, level, threshold, transmit)
    return Tree(height, width, levels)


def _eye_rays(triangles: Triangles, camera: Camera, width: int, height: int) -> Rays:
    left, right, bottom, top = camera.window
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    window = np.stack([left + (right - left) * x, top + (bottom - top) * y, np.full_like(x, -1.0)], axis=-1)
    direction = unit(window.reshape(-1, 3) @ camera.world_from_camera[:3, :3].T)
    eye = camera.world_from_camera[:3, 3]
    count = len(direction)
    inside = np.tile(triangles.bodies_around(eye), (count, 1))
    ones = np.ones(count)
    return Rays(
        np.arange(count), np.tile(eye, (count, 1)), direction, np.ones((count, 3)), ones, inside, np.zeros(count, bool)
    )


def _trace_level(
    scene: Scene, triangles: Triangles, rays: Rays, level: Level, threshold: float, transmit: bool
) -> Rays:
    """Add a level's radiance to it; return the rays of the next."""
    t, row, alpha, beta = triangles.first_hits(rays.origin, rays.direction)
    background = np.array(scene.settings.background or (0.0, 0.0, 0.0))
    np.add.at(level.color, rays.pixel[row < 0], rays.coefficient[row < 0] * background)

    is_hit = row >= 0
    rays, t, row, alpha, beta = rays[is_hit], t[is_hit], row[is_hit], alpha[is_hit], beta[is_hit]
    body = triangles.body[row]
    hits = Hits(scene, body, triangles.triangle[row], triangles.material[row], alpha, beta)
    position = rays.origin + t[:, None] * rays.direction
    normal = unit(np.einsum("nk,nkc->nc", hits.weights, triangles.shading[row]))
    normal *= np.where(dot(normal, rays.direction) > 0, -1.0, 1.0)[:, None]

    local = _local_illumination(scene, triangles, hits, position, normal, rays.direction, level, transmit)
    np.add.at(level.color, rays.pixel, rays.coefficient * local)
    return _children(triangles, hits, rays, position, normal, level, threshold)


def _local_illumination(
    scene: Scene,
    triangles: Triangles,
    hits: Hits,
    position: np.ndarray,
    normal: np.ndarray,
    direction: np.ndarray,
    level: Level,
    transmit: bool,
) -> np.ndarray:
    """Return ka Ia + sum over lights with N.L > 0 of S I_l (kd (N.L) + ks max(R_l.V, 0)^n): shape [n, 3]."""
    result = hits.term("ambient") * (scene.settings.ambient or (0.0, 0.0, 0.0))
    diffuse, specular, exponent = (hits.term(name) for name in ("diffuse", "specular", "shininess"))
    has_local = (diffuse + specular).max(axis=1) > 0
    for light in scene.lights:
        toward, distance, color = _light_at(light, position)
        cosine = dot(normal, toward)
        lit = np.flatnonzero((cosine > 0) & has_local)
        level.shadow += len(lit)
        share = _shadow(scene, triangles, position[lit], toward[lit], distance[lit], transmit)
        mirrored = 2 * cosine[lit, None] * normal[lit] - toward[lit]
        highlight = np.maximum(-dot(mirrored, direction[lit]), 0.0)
        highlight = np.where(highlight > 0, highlight ** exponent[lit], 0.0)
        phong = diffuse[lit] * cosine[lit, None] + specular[lit] * highlight[:, None]
        result[lit] += share * color[lit] * phong
    return result


def _light_at(light: Light, position: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the unit direction to a light, its distance, and its colour I_l = E / pi at each position."""
    radiance = np.tile(np.array(light.radiance, float), (len(position), 1))
    if light.kind == LightKind.DISTANT and light.angle == 0:
        toward = np.tile(unit(light.world_from_light[:3, 2]), (len(position), 1))
        return toward, np.full(len(position), np.inf), radiance / np.pi
    if light.kind != LightKind.POINT or light.cone_angle < np.pi or light.focus > 0 or not light.casts_shadow:
        raise NotImplementedError(f"{light.path}: the reference knows plain point and distant lights alone")
    toward = light.world_from_light[:3, 3] - position
    distance = np.linalg.norm(toward, axis=1)
    if light.has_falloff:
        radiance *= (light.radius / distance[:, None]) ** 2
    return toward / distance[:, None], distance, radiance


def _shadow(
    scene: Scene,
    triangles: Triangles,
    origin: np.ndarray,
    direction: np.ndarray,
    distance: np.ndarray,
    transmit: bool,
) -> np.ndarray:
    """Return S: the share of a light that arrives, shape [n, 3]."""
    share = np.ones((len(origin), 3))
    for ray, row, _, alpha, beta in triangles.hits(origin, direction, distance):
        if transmit:
            crossed = Hits(scene, triangles.body[row], triangles.triangle[row], triangles.material[row], alpha, beta)
            np.multiply.at(share, ray, crossed.term("transmission"))
        else:
            share[ray] = 0.0
    return share


def _children(
    triangles: Triangles,
    hits: Hits,
    rays: Rays,
    position: np.ndarray,
    normal: np.ndarray,
    level: Level,
    threshold: float,
) -> Rays:
    """Return the reflection and refraction rays that the threshold keeps."""
    kr, kt, index = (hits.term(name) for name in ("reflection", "transmission", "ior"))
    d = rays.direction
    cosine = -dot(d, normal)
    rows = np.arange(len(d))
    is_inside = rays.inside[rows, hits.body]
    is_closed = triangles.is_closed[hits.body]
    eta = np.where(is_closed, np.where(is_inside, index, 1 / index), 1.0)
    cosine2_out = 1 - eta**2 * (1 - cosine**2)
    is_glass = kt.max(axis=1) > 0
    is_total = is_glass & (cosine2_out < 0)
    level.total_internal_reflection += int(is_total.sum())
    kr = np.where(is_total[:, None], kr + kt, kr)
    kt = np.where((is_glass & ~is_total)[:, None], kt, 0.0)

    mirrored = d + 2 * cosine[:, None] * normal
    bent = eta[:, None] * d + (eta * cosine - np.sqrt(np.maximum(cosine2_out, 0)))[:, None] * normal
    crossed = rays.inside.copy()
    crossed[rows, hits.body] ^= is_closed
    parts = []
    for name, coefficient, direction, inside in (("R", kr, mirrored, rays.inside), ("T", kt, bent, crossed)):
        largest = coefficient.max(axis=1)
        weight = rays.weight * largest
        is_dropped = (largest > 0) & (weight < threshold)
        level.dropped_by_threshold += int(is_dropped.sum())
        child = Rays(
            rays.pixel,
            position,
            unit(direction),
            rays.coefficient * coefficient,
            weight,
            inside,
            np.full(len(d), name == "T"),
        )
        parts.append(child[(largest > 0) & ~is_dropped])
    level.children = sum(len(part.pixel) for part in parts)
    return Rays.join(parts)
