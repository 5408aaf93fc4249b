# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A scene's triangles in world space and float64, and what rays meet among them: first hits, and all hits on a way.

Written from docs/whitted.md, with NumPy alone: it shares no code with the kernels that it judges.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from warp_rt import Scene

NEAREST = 1e-9  # of a hit along a ray: where it starts is on its surface to 1e-14
BLOCK = 2048  # rays at a time
LEAF = 12  # triangles to a box


class Triangles:
    """All triangles of a scene, boxed in small groups.

    Attributes:
        normal: Unit, outward, of each triangle: float64, shape [n, 3].
        shading: Unit at each corner, or ``normal`` thrice: float64, shape [n, 3, 3].
        body: Row of the instance of each triangle, shape [n].
        triangle: Index of each within its mesh, shape [n].
        material: Row of ``Scene.materials``, shape [n].
        is_closed: Whether each body bounds a volume, shape [bodies].
    """

    def __init__(self, scene: Scene) -> None:
        corners, normals, shadings, bodies, ids, materials = [], [], [], [], [], []
        placed = scene.instances
        for body, (row, matrix) in enumerate(zip(placed.mesh, placed.world_from_local, strict=True)):
            mesh = scene.meshes[row]
            corner = (mesh.points.astype(float) @ matrix[:3, :3].T + matrix[:3, 3])[mesh.triangles]
            normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
            normal = unit(normal * np.sign(np.linalg.det(matrix[:3, :3])))
            shading = np.repeat(normal[:, None], 3, axis=1)
            if mesh.normals is not None:
                rows = np.zeros_like(mesh.triangles) if mesh.normals.indices is None else mesh.normals.indices
                shading = mesh.normals.values.astype(float)[rows] @ np.linalg.inv(matrix[:3, :3])
            slots = np.zeros(len(corner), int) if mesh.material_slots is None else mesh.material_slots
            corners.append(corner)
            normals.append(normal)
            shadings.append(shading)
            bodies.append(np.full(len(corner), body))
            ids.append(np.arange(len(corner)))
            materials.append(placed.material_table[placed.material_offset[body] + slots])
        self.corners = np.concatenate(corners)
        self.normal, self.shading = np.concatenate(normals), np.concatenate(shadings)
        self.body, self.triangle, self.material = (np.concatenate(rows) for rows in (bodies, ids, materials))
        self.is_closed = np.array([scene.meshes[row].is_closed for row in placed.mesh])
        self._edges = self.corners[:, 1:] - self.corners[:, :1]
        self._groups = _split(self.corners.mean(axis=1))
        members = np.where(self._groups < 0, self._groups[:, :1], self._groups)
        self._low = self.corners[members].min(axis=(1, 2))
        self._high = self.corners[members].max(axis=(1, 2))

    def first_hits(self, origin: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return t (inf: a miss), the triangle (-1: a miss), alpha and beta of each ray's closest hit."""
        t, alpha, beta = np.full(len(origin), np.inf), np.zeros(len(origin)), np.zeros(len(origin))
        triangle = np.full(len(origin), -1)
        for ray, found, *place in self.hits(origin, direction, np.full(len(origin), np.inf)):
            order = np.lexsort((place[0], ray))
            first, index = np.unique(ray[order], return_index=True)
            best = order[index]
            triangle[first] = found[best]
            t[first], alpha[first], beta[first] = (values[best] for values in place)
        return t, triangle, alpha, beta

    def hits(self, origin: np.ndarray, direction: np.ndarray, far: np.ndarray) -> Iterator[tuple[np.ndarray, ...]]:
        """Yield every hit nearer than ``far``, block by block of rays: ray, triangle, t, alpha, beta.

        A ray's hits all come in one block. The test is the textbook's: solve o + t d = p0 + alpha e1 + beta e2.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            for start in range(0, len(origin), BLOCK):
                o, d = origin[start : start + BLOCK], direction[start : start + BLOCK]
                ray, group = np.nonzero(self._meets_box(o, d, far[start : start + BLOCK]))
                triangle = self._groups[group].reshape(-1)
                ray = np.repeat(ray, LEAF)[triangle >= 0]
                triangle = triangle[triangle >= 0]
                p0, e1, e2 = self.corners[triangle, 0], self._edges[triangle, 0], self._edges[triangle, 1]
                s = o[ray] - p0
                h, q = np.cross(d[ray], e2), np.cross(s, e1)
                inverse = 1 / dot(e1, h)
                alpha, beta, t = dot(s, h) * inverse, dot(d[ray], q) * inverse, dot(e2, q) * inverse
                is_hit = (alpha >= 0) & (beta >= 0) & (alpha + beta <= 1) & (t > NEAREST) & (t < far[start + ray])
                yield start + ray[is_hit], *(values[is_hit] for values in (triangle, t, alpha, beta))

    def _meets_box(self, origin: np.ndarray, direction: np.ndarray, far: np.ndarray) -> np.ndarray:
        """Return whether each ray passes each group's box: shape [n, groups]."""
        enter, leave = (np.full((len(origin), len(self._low)), limit) for limit in (-np.inf, np.inf))
        for o, d, low, high in zip(origin.T, direction.T, self._low.T, self._high.T, strict=True):
            a, b = (low - o[:, None]) / d[:, None], (high - o[:, None]) / d[:, None]
            enter = np.fmax(enter, np.fmin(a, b))
            leave = np.fmin(leave, np.fmax(a, b))
        leave += 1e-9 * (1 + np.abs(leave))
        return (enter <= leave) & (leave >= 0) & (enter <= far[:, None])

    def bodies_around(self, point: np.ndarray) -> np.ndarray:
        """Return whether each closed body's winding number about a point is not 0: shape [bodies].

        Reference: van Oosterom and Strackee (1983), The Solid Angle of a Plane Triangle.
        """
        a, b, c = (self.corners[:, k] - point for k in range(3))
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        volume = dot(a, np.cross(b, c))
        angle = 2 * np.arctan2(volume, la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb)
        turns = np.bincount(self.body, weights=angle, minlength=len(self.is_closed)) / (4 * np.pi)
        return self.is_closed & (np.abs(turns) > 0.5)


def unit(v: np.ndarray) -> np.ndarray:
    """Return vectors made unit length: shape [..., 3]."""
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the scalar products of matching vectors: shape [n, 3] to [n]."""
    return np.einsum("ij,ij->i", a, b)


def _split(centers: np.ndarray) -> np.ndarray:
    """Return the points' indices in groups of up to ``LEAF`` that lie together: shape [groups, LEAF], -1 for none."""
    groups, waiting = [], [np.arange(len(centers))]
    while waiting:
        group = waiting.pop()
        if len(group) <= LEAF:
            groups.append(np.pad(group, (0, LEAF - len(group)), constant_values=-1))
            continue
        axis = np.ptp(centers[group], axis=0).argmax()
        order = group[np.argsort(centers[group, axis], kind="stable")]
        waiting += [order[: len(order) // 2], order[len(order) // 2 :]]
    return np.array(groups)
