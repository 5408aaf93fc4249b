# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""One refinement of random faces, most of them no manifold, against the rules applied vertex by vertex.

Reference: OpenSubdiv's documentation, "Subdivision Surfaces", and where that is silent, what its
Far::TopologyRefinerFactory sharpens: rims, edges of other than two faces that agree on a side, and vertices whose faces
are neither ring nor fan.
"""

from __future__ import annotations

import random
from itertools import pairwise

import numpy as np
import pytest

from warp_rt.scene.equal_rows import first_equal_rows
from warp_rt.subdivision.surface import Rules, Surface
from warp_rt.subdivision.topology import INFINITE, Topology

Edge = tuple[int, int]


class Cage:
    """Faces, creases and corners, looked at one vertex and one edge at a time."""

    def __init__(self, seed: int) -> None:
        pick = random.Random(seed)
        self.is_loop = pick.random() < 0.4
        self.boundary = pick.choice(["edgeAndCorner", "edgeOnly"])
        self.count, self.faces = self._grid(pick) if pick.random() < 0.5 else self._soup(pick)
        self.points = np.random.default_rng(seed).normal(size=(self.count, 3))
        self.sides: dict[Edge, list[tuple[int, bool]]] = {}
        for number, face in enumerate(self.faces):
            for a, b in pairwise([*face, face[0]]):
                self.sides.setdefault((min(a, b), max(a, b)), []).append((number, a < b))
        chosen = pick.sample(sorted(self.sides), pick.randint(0, min(5, len(self.sides))))
        self.creases = {edge: pick.choice([0.3, 0.5, 1, 1.7, 2.5, INFINITE]) for edge in chosen}
        vertices = pick.sample(range(self.count), pick.randint(0, 2))
        self.corners = {vertex: pick.choice([0.4, 1, 2.2, INFINITE]) for vertex in vertices}
        self.centers = [np.mean(self.points[face], axis=0) for face in self.faces]

    def _grid(self, pick: random.Random) -> tuple[int, list[list[int]]]:
        """Return a grid of squares, some turned over, perhaps with a triangle across it."""
        size = pick.randint(2, 4)
        steps = [(0, 0), (1, 0), (1, 1), (0, 1)]
        rows = range(size - 1)
        faces = [[(i + a) * size + j + b for a, b in steps] for i in rows for j in rows]
        if self.is_loop:
            faces = [half for a, b, c, d in faces for half in ([a, b, c], [a, c, d])]
        for _ in range(pick.randint(0, 2)):
            pick.choice(faces).reverse()
        if pick.random() < 0.4:
            faces.append([0, size * size - 1, pick.randrange(1, size * size - 1)])
        return size * size, faces

    def _soup(self, pick: random.Random) -> tuple[int, list[list[int]]]:
        count = pick.randint(4, 9)
        sizes = [3 if self.is_loop else pick.randint(3, min(5, count)) for _ in range(pick.randint(1, 8))]
        return count, [pick.sample(range(count), size) for size in sizes]

    def topology(self) -> Topology:
        sharpness = np.zeros(self.count)
        for vertex, value in self.corners.items():
            sharpness[vertex] = value
        return Topology(
            vertex_count=self.count,
            counts=np.array([len(face) for face in self.faces]),
            corners=np.concatenate([np.array(face, np.int64) for face in self.faces]),
            creases=np.array(list(self.creases), np.int64).reshape(-1, 2),
            crease_sharpness=np.array(list(self.creases.values()), float),
            vertex_sharpness=sharpness,
        )

    def joins(self, edge: Edge) -> bool:
        """Return whether an edge joins two faces that agree on a side."""
        return len(self.sides[edge]) == 2 and self.sides[edge][0][1] != self.sides[edge][1][1]

    def sharpness(self, edge: Edge) -> float:
        return self.creases.get(edge, 0.0) if self.joins(edge) else INFINITE

    def edge_point(self, edge: Edge) -> np.ndarray:
        ends = self.points[list(edge)]
        middle, faces = ends.mean(axis=0), [face for face, _ in self.sides[edge]]
        if self.is_loop:
            opposite = [self.points[self.faces[face]].sum(axis=0) - ends.sum(axis=0) for face in faces]
            smooth = 0.75 * middle + 0.25 * np.mean(opposite, axis=0)
        else:
            smooth = 0.5 * middle + 0.5 * np.mean([self.centers[face] for face in faces], axis=0)
        share = min(self.sharpness(edge), 1.0)
        return share * middle + (1 - share) * smooth

    def vertex_point(self, vertex: int) -> np.ndarray:
        edges = [edge for edge in self.sides if vertex in edge]
        before = [self.sharpness(edge) for edge in edges], self.vertex_sharpness(vertex, edges)
        after = [worn(value) for value in before[0]], worn(before[1])
        rules = [rule(*moment) for moment in (before, after)]
        if rules[0] == rules[1]:
            return self._masked(vertex, edges, rules[0], before[0])
        wearing = [(*before[0], before[1])[k] for k, left in enumerate((*after[0], after[1])) if left <= 0]
        wearing = [value for value in wearing if value > 0]
        share = min(float(np.mean(wearing)), 1.0) if wearing else 0.0
        masked = [self._masked(vertex, edges, *how) for how in zip(rules, (before[0], after[0]), strict=True)]
        return share * masked[0] + (1 - share) * masked[1]

    def vertex_sharpness(self, vertex: int, edges: list[Edge]) -> float:
        own = {number for number, face in enumerate(self.faces) if vertex in face}
        reached, pending = set(), [min(own)]
        while pending:
            face = pending.pop()
            reached.add(face)
            for edge in edges:
                around = {number for number, _ in self.sides[edge]}
                if self.joins(edge) and face in around:
                    pending += around - reached
        rims = sum(len(self.sides[edge]) == 1 for edge in edges)
        odd = sum(len(self.sides[edge]) > 1 and not self.joins(edge) for edge in edges)
        is_between_fins = odd == 2 and rims == 0 and len(own) > len(edges)
        is_torn = (odd > 0 or reached != own) and not is_between_fins
        is_corner = self.boundary == "edgeAndCorner" and len(own) == 1 and len(edges) == 2
        return INFINITE if is_torn or is_corner else self.corners.get(vertex, 0.0)

    def _masked(self, vertex: int, edges: list[Edge], kind: str, sharpness: list[float]) -> np.ndarray:
        here = self.points[vertex]
        around = np.array([self.points[a if b == vertex else b] for a, b in edges])
        if kind == "corner":
            return here
        if kind == "crease":
            return 0.75 * here + 0.125 * around[np.array(sharpness) > 0].sum(axis=0)
        n = len(edges)
        if self.is_loop:
            beta = (5 / 8 - (3 / 8 + np.cos(2 * np.pi / n) / 4) ** 2) / n
            return (1 - n * beta) * here + beta * around.sum(axis=0)
        centers = [self.centers[number] for number, face in enumerate(self.faces) if vertex in face]
        return ((n - 2) * here + around.mean(axis=0) + np.mean(centers, axis=0)) / n


def worn(sharpness: float) -> float:
    return sharpness if sharpness >= INFINITE else max(sharpness - 1, 0.0)


def rule(sharpness: list[float], of_vertex: float) -> str:
    count = sum(value > 0 for value in sharpness)
    return "corner" if of_vertex > 0 or count > 2 else "crease" if count == 2 else "smooth"


@pytest.mark.parametrize("seeds", [range(start, start + 40) for start in range(0, 160, 40)], ids=lambda r: f"{r[0]}")
def test_random_faces_are_refined_by_the_rules_of_each_vertex(seeds: range) -> None:
    for seed in seeds:
        cage = Cage(seed)
        surface = Surface(cage.topology(), Rules(is_loop=cage.is_loop, boundary=cage.boundary), 1)
        found = surface.smooth(cage.points)
        for vertex in {vertex for face in cage.faces for vertex in face}:
            np.testing.assert_allclose(found[vertex], cage.vertex_point(vertex), atol=1e-12, err_msg=f"seed {seed}")
        for row, (a, b) in enumerate(surface.cage.edges.tolist()):
            expected = cage.edge_point((min(a, b), max(a, b)))
            np.testing.assert_allclose(found[cage.count + row], expected, atol=1e-12, err_msg=f"seed {seed}")


@pytest.mark.parametrize("seeds", [range(0, 60)], ids=["all"])
def test_limits_and_values_of_random_faces_are_finite(seeds: range) -> None:
    for seed in seeds:
        cage = Cage(seed)
        surface = Surface(cage.topology(), Rules(is_loop=cage.is_loop, boundary=cage.boundary), 2)
        assert all(np.isfinite(part).all() for part in surface.limit(cage.points))
        values = np.random.default_rng(seed).integers(0, 3, size=(len(surface.cage.corners), 2)).astype(float)
        refined, rows = surface.face_varying(values, first_equal_rows(values))
        assert np.isfinite(refined).all()
        assert rows.max() < len(refined)
