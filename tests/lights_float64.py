# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdLux lights cut into patches, in float64: what they send to a point, by summing up.

Shares no code with the package but the dataclasses. Reference: UsdLux schema documentation; reference/usd.md.
"""

from __future__ import annotations

import numpy as np

from warp_rt.scene import Light, LightKind


def midpoints(low: float, high: float, count: int) -> np.ndarray:
    """Return the middles of equal parts of an interval."""
    return low + (high - low) * (np.arange(count) + 0.5) / count


def patches(light: Light, count: int = 512) -> tuple[np.ndarray, np.ndarray]:
    """Return centres of patches of a light's surface, and their areas as vectors along the side that emits.

    Args:
        light: Its transform, of any scale and shear, applies to its shape.
        count: Parts of either parameter.

    Returns:
        Two arrays of shape [count^2, 3], world space.
    """
    return patches_at(light, *_grid(midpoints(0, 1, count), midpoints(0, 1, count)), count)


def patches_at(light: Light, s: np.ndarray, t: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the patches about some values of the light's parameters, each 1 / ``count`` wide, of 0 to 1.

    Args:
        light: The light.
        s: First parameter, shape [n].
        t: Second parameter, shape [n].
        count: Parts of either parameter.

    Returns:
        As :func:`patches`, shape [n, 3].
    """
    m = light.world_from_light[:3, :3]
    if light.kind == LightKind.RECT:
        u, v = s - 0.5, t - 0.5
        p = np.stack([light.width * u, light.height * v, 0 * u], -1)
        du, dv = _along(p, 0, light.width / count), _along(p, 1, light.height / count)
        inward = -m[:, 2]
    elif light.kind == LightKind.DISK:
        r, a = light.radius * s, 2 * np.pi * t
        c, s = np.cos(a), np.sin(a)
        p = np.stack([r * c, r * s, 0 * r], -1)
        du = np.stack([c, s, 0 * r], -1) * (light.radius / count)
        dv = np.stack([-r * s, r * c, 0 * r], -1) * (2 * np.pi / count)
        inward = -m[:, 2]
    elif light.kind == LightKind.SPHERE:
        # Equal steps of the cosine are equal areas of the sphere.
        z, a = 2 * s - 1, 2 * np.pi * t
        q, c, s = np.sqrt(1 - z * z), np.cos(a), np.sin(a)
        p = light.radius * np.stack([q * c, q * s, z], -1)
        du = light.radius * np.stack([-z / q * c, -z / q * s, np.ones_like(z)], -1) * (2 / count)
        dv = light.radius * np.stack([-q * s, q * c, 0 * z], -1) * (2 * np.pi / count)
        inward = None
    else:
        x, a = light.length * (s - 0.5), 2 * np.pi * t
        c, s = np.cos(a), np.sin(a)
        p = np.stack([x, light.radius * c, light.radius * s], -1)
        du = _along(p, 0, light.length / count)
        dv = light.radius * np.stack([0 * x, -s, c], -1) * (2 * np.pi / count)
        inward = None
    areas = np.cross(du @ m.T, dv @ m.T)
    outward = np.broadcast_to(inward, p.shape) if inward is not None else p @ m.T
    if light.kind == LightKind.CYLINDER:
        outward = (p * (0, 1, 1)) @ m.T
    areas *= np.sign((areas * outward).sum(-1, keepdims=True))
    return p @ m.T + light.world_from_light[:3, 3], areas


def _grid(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    x, y = np.meshgrid(a, b, indexing="ij")
    return x.reshape(-1), y.reshape(-1)


def _along(p: np.ndarray, axis: int, length: float) -> np.ndarray:
    step = np.zeros_like(p)
    step[:, axis] = length
    return step


def shaping(light: Light, cosine: np.ndarray) -> np.ndarray:
    """Return the factor of focus and cone for light that leaves at ``cosine`` to the axis: shape [n, 3]."""
    factor = np.ones((len(cosine), 3))
    if light.focus > 0:
        f = np.abs(cosine)[:, None] ** light.focus
        factor = f + (1 - f) * np.array(light.focus_tint)
    if light.cone_angle < np.pi:
        theta = np.arccos(np.clip(cosine, -1, 1))
        rim = light.cone_angle * (1 - light.cone_softness)
        x = np.clip((theta - rim) / max(light.cone_angle - rim, 1e-12), 0, 1)
        factor = factor * np.where(theta > light.cone_angle, 0.0, 1 - x * x * (3 - 2 * x))[:, None]
    return factor


Cut = tuple[np.ndarray, np.ndarray]
"""What :func:`patches` returns."""


def arriving(
    light: Light, point: np.ndarray, count: int = 512, *, cut: Cut | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return unit directions from a point to the patches that it sees, their solid angles, and their radiance.

    Nothing is in between. Shapes [n, 3], [n], [n, 3].

    Args:
        light: The light.
        point: Whence.
        count: Parts of either parameter.
        cut: The light's patches, so that many points can share them.
    """
    axis = light.world_from_light[:3, 2] / np.linalg.norm(light.world_from_light[:3, 2])
    if light.kind == LightKind.DISTANT:
        return _cone(light, axis, count)
    centers, areas = cut or patches(light, count)
    to_light = centers - point
    d = np.linalg.norm(to_light, axis=1)
    wi = to_light / d[:, None]
    solid_angle = np.maximum(-(areas * wi).sum(1), 0) / d**2
    seen = solid_angle > 0
    radiance = np.array(light.radiance) * shaping(light, wi[seen] @ axis)
    return wi[seen], solid_angle[seen], radiance


def _cone(light: Light, axis: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    cap = 1 - np.cos(light.angle / 2)
    height, a = _grid(cap * midpoints(0, 1, count), midpoints(0, 2 * np.pi, count))
    x = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    x /= np.linalg.norm(x)
    y = np.cross(axis, x)
    sine = np.sqrt(height * (2 - height))
    wi = sine[:, None] * (np.cos(a)[:, None] * x + np.sin(a)[:, None] * y) + (1 - height)[:, None] * axis
    solid_angle = np.full(len(wi), 2 * np.pi * cap / len(wi))
    return wi, solid_angle, np.broadcast_to(np.array(light.radiance), wi.shape)


def irradiance(light: Light, point: np.ndarray, normal: np.ndarray, count: int = 512) -> np.ndarray:
    """Return the irradiance of a surface, what lies below its horizon left out: shape [3]."""
    return irradiances(light, point[None], normal, count)[0]


def irradiances(light: Light, points: np.ndarray, normal: np.ndarray, count: int = 512) -> np.ndarray:
    """Return the irradiance of each of some places of a flat surface, shape [n, 3]: shape [n, 3]."""
    cut = None if light.kind == LightKind.DISTANT else patches(light, count)
    result = []
    for point in points:
        wi, solid_angle, radiance = arriving(light, point, count, cut=cut)
        result.append((radiance * (np.maximum(wi @ normal, 0) * solid_angle)[:, None]).sum(0))
    return np.array(result)
