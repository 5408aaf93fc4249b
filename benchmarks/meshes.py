# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The meshes that are traced: even and uneven ones, in the first cache and far out of the last."""

from __future__ import annotations

import importlib.util
import os
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import ModuleType

import numpy as np
import warp as wp

import warp_rt

from .results import ROOT


class MissingMeshError(Exception):
    """A mesh that is not at hand, and why."""


@dataclass(frozen=True)
class TriangleMesh:
    """One mesh in world space."""

    points: np.ndarray
    """float32, shape [n, 3]."""
    triangles: np.ndarray
    """int32, rows of ``points``, shape [m, 3]."""


def teapot(segments: int) -> TriangleMesh:
    """Return the Utah teapot with 64 segments^2 - 8 segments triangles."""
    points, polygons, _ = load_file(ROOT / "scenes" / "make_teapot.py").tessellate(segments)
    triangles = [(p[0], p[i], p[i + 1]) for p in polygons for i in range(1, len(p) - 1)]
    return TriangleMesh(np.asarray(points, np.float32), np.array(triangles, np.int32))


def noisy_icosphere(levels: int, noise: float = 0.02) -> TriangleMesh:
    """Return an icosphere of 20 * 4^levels triangles whose vertices are moved in and out by up to ``noise``."""
    g = (1 + 5**0.5) / 2
    points: list[tuple[float, float, float]] = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g)]
    points += [(0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    faces = "0b5 051 017 07a 0ab 159 5b4 ba2 a76 718 394 342 326 368 389 495 24b 62a 867 981"
    triangles = np.array([[int(c, 16) for c in face] for face in faces.split()])
    vertices = np.array(points, float)
    for _ in range(levels):
        edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
        count = len(vertices)
        keys, inverse = np.unique(edges[:, 0] * count + edges[:, 1], return_inverse=True)
        ab, bc, ca = inverse.reshape(3, -1) + count
        a, b, c = triangles.T
        vertices = np.concatenate([vertices, (vertices[keys // count] + vertices[keys % count]) / 2])
        corners = ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))
        triangles = np.concatenate([np.stack(columns, axis=1) for columns in corners])
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    vertices *= np.random.default_rng(7).uniform(1 - noise, 1 + noise, (len(vertices), 1))
    return TriangleMesh(vertices.astype(np.float32), triangles.astype(np.int32))


def noisy_torus(count: int, noise: float = 0.2) -> TriangleMesh:
    """Return a torus of about ``count`` triangles, whatever their number of the same shape.

    Its vertices are moved in and out by up to ``noise`` times the length of the edges across.
    """
    across = max(3, round(np.sqrt(count / 4)))
    around = max(3, round(count / (2 * across)))
    i, j = np.meshgrid(np.arange(around), np.arange(across), indexing="ij")
    a, b = 2 * np.pi * i / around, 2 * np.pi * j / across
    tube = 0.4 * (1 + 2 * np.pi / across * np.random.default_rng(7).uniform(-noise, noise, a.shape))
    radius = 1 + tube * np.cos(b)
    points = np.stack([radius * np.cos(a), radius * np.sin(a), tube * np.sin(b)], axis=-1)
    rows = np.arange(around * across, dtype=np.int32).reshape(around, across)
    right, up = np.roll(rows, -1, axis=0), np.roll(rows, -1, axis=1)
    both = np.roll(right, -1, axis=1)
    triangles = np.stack([rows, right, both, rows, both, up], axis=-1).reshape(-1, 3)
    return TriangleMesh(points.reshape(-1, 3).astype(np.float32), triangles)


def bunny() -> TriangleMesh:
    """Return the bunny among the assets of Warp's examples."""
    path = Path(wp.__file__).parent / "examples" / "assets" / "bunny.usd"
    if not path.is_file():
        raise MissingMeshError(f"this Warp comes without {path.name}")
    return flatten(warp_rt.load_scene(path))


def stage(name: str) -> TriangleMesh:
    """Return all triangles of a stage of the test data as one mesh."""
    path = find_test_data(f"corpora/{name}")
    if path is None:
        raise MissingMeshError(
            f"no corpora/{name} in the test data: WARP_RT_TEST_DATA names the folder that holds corpora/"
        )
    return flatten(warp_rt.load_scene(path))


def find_test_data(name: str) -> Path | None:
    """Return a file of the test data, which lie where WARP_RT_TEST_DATA says, else in ``shared`` beside the project."""
    path = Path(os.environ.get("WARP_RT_TEST_DATA") or ROOT.parent / "shared") / name
    return path if path.is_file() else None


def flatten(scene: warp_rt.Scene) -> TriangleMesh:
    """Return the triangles of all instances in world space."""
    points, triangles, first = [], [], 0
    for row, mesh_row in enumerate(scene.instances.mesh):
        mesh, matrix = scene.meshes[mesh_row], scene.instances.world_from_local[row]
        points.append(mesh.points @ matrix[:3, :3].T + matrix[:3, 3])
        triangles.append(mesh.triangles + first)
        first += len(mesh.points)
    return TriangleMesh(np.concatenate(points).astype(np.float32), np.concatenate(triangles).astype(np.int32))


def load_file(path: Path) -> ModuleType:
    """Return a Python file that is in no package as a module; its neighbours import it by its bare name."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None or not path.is_file():
        raise FileNotFoundError(path)
    module = importlib.util.module_from_spec(spec)
    sys.modules.setdefault(path.stem, module)
    spec.loader.exec_module(module)
    return module


# The test data hold no building and no car of more than some thousand triangles. These three are its largest stages and
# its most uneven ones of any size.
MESHES: dict[str, Callable[[], TriangleMesh]] = {
    "bunny": bunny,
    "teapot": partial(teapot, 12),
    "ico-82k": partial(noisy_icosphere, 6),
    "ico-1.31M": partial(noisy_icosphere, 8),
    # Characters of skinned meshes: the longest hundredth of the edges is ten times the median.
    "characters": partial(stage, "arnold-usd/testsuite/test_1352/data/test.usd"),
    # 4,000 instances of shapes and lettering, flattened: slivers, one triangle in a hundred 80 times as long as high.
    "lettering": partial(stage, "arnold-usd/testsuite/test_0237/data/test.usda"),
    # 1,000 instances of tea sets strewn over a plane, flattened: 2.5 million triangles in few places.
    "tea-sets": partial(stage, "usd-wg-assets/intent-vfx/scenes/teapotScene.usd"),
}
