# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What few lights have, in tables that lights refer to by row: links, shadows, profiles, textures, triangles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import Any

import numpy as np

from warp_rt.kernels import light_structs
from warp_rt.scene import Light, Profile, Shadow
from warp_rt.upload.light_bodies import BOTH_SIDES, connected_parts, convex_bodies, free_sides_of
from warp_rt.upload.light_clusters import leaf_count, light_clusters
from warp_rt.upload.meridian_tables import meridian_record
from warp_rt.upload.profile_scales import profile_scales


class LinkTable:
    """Sets of instances as bits, the lowest first: the words of ``kernels.scene_structs.SceneData.links``."""

    def __init__(self) -> None:
        self._words: list[np.ndarray] = []
        self._count = 0

    def add(self, held: np.ndarray | None) -> int:
        """Return the first word of a set: bool, shape [instances], True for those held; -1 for None, all of them."""
        if held is None:
            return -1
        offset = self._count
        bits = np.zeros(-(-len(held) // 32) * 4, np.uint8)
        packed = np.packbits(held, bitorder="little")
        bits[: len(packed)] = packed
        self._words.append(bits.view("<u4"))
        self._count += len(self._words[-1])
        return offset

    def words(self) -> np.ndarray:
        """Return all of them: uint32, shape [n]."""
        return np.concatenate([np.zeros(0, np.uint32), *self._words])


class LightTables:
    """Collects the rows that the lights of a scene refer to.

    Args:
        image_of: Returns the device's row of a light's image, and its mean colour, shape [3].
    """

    def __init__(self, image_of: Callable[[Light], tuple[int, np.ndarray]]) -> None:
        self.links = LinkTable()
        self.shadows: list[dict[str, Any]] = []
        """Rows of ``kernels.scene_structs.SceneData.shadows``."""
        self.profiles: list[dict[str, Any]] = []
        """Rows of ``kernels.scene_structs.SceneData.profiles``."""
        self.meridians: list[dict[str, Any]] = []
        """Rows of ``kernels.scene_structs.SceneData.meridians``."""
        self.textures: list[dict[str, Any]] = []
        """Rows of ``kernels.scene_structs.SceneData.light_textures``."""
        self.meshes: list[dict[str, Any]] = []
        """Rows of ``kernels.scene_structs.SceneData.light_meshes``."""
        self.triangles: list[np.ndarray] = []
        """Of each of them, of ``kernels.light_structs.LightTriangle``."""
        self.clusters: list[np.ndarray] = []
        """Of each of them, of ``kernels.light_structs.LightCluster``."""
        self._image_of = image_of
        self._numbers: list[np.ndarray] = []
        self._number_count = 0
        self._offsets: dict[int, int] = {}
        self._sums: list[np.ndarray] = []
        self._meridian_rows: dict[tuple[Any, ...], int] = {}

    def add_shadow(self, shadow: Shadow) -> int:
        """Return the row of a light's shadow; -1 for a plain one."""
        if shadow.is_plain:
            return -1
        record = {field.name: getattr(shadow, field.name) for field in fields(shadow)}
        self.shadows.append(record | {"casters": self.links.add(shadow.casters)})
        return len(self.shadows) - 1

    def add_profile(self, light: Light) -> int:
        """Return the row of a light's profile; -1 where it has none."""
        if light.profile is None:
            return -1
        light_from_world = np.linalg.inv(light.world_from_light[:3, :3])
        # Of any length, for only directions are taken there; of about 1, for float32.
        light_from_world /= np.linalg.norm(light_from_world, axis=1).max()
        self.profiles.append(
            {
                "offset": self._add_numbers(light.profile),
                "vertical_count": len(light.profile.vertical),
                "horizontal_count": len(light.profile.horizontal),
                "angle_scale": light.profile_angle_scale,
                **profile_scales(light.profile, light.profile_angle_scale),
                **dict(zip(("row_x", "row_y", "row_z"), light_from_world, strict=True)),
            }
        )
        return len(self.profiles) - 1

    def add_meridians(self, light: Light, *, is_even: bool) -> int:
        """Return the row of a light's meridians; -1 where it has none. Lights that are shaped alike share one.

        Args:
            light: The light.
            is_even: Whether its transform scales all directions alike.
        """
        shape = (light.focus, any(light.focus_tint), light.cone_angle, light.cone_softness)
        key = (*shape, id(light.profile), light.profile_angle_scale, light.image >= 0, is_even)
        if key not in self._meridian_rows:
            found = meridian_record(light, is_even=is_even)
            self._meridian_rows[key] = len(self.meridians) if found else -1
            if found:
                fields, numbers = found
                self.meridians.append({"offset": sum(map(len, self._sums)), **fields})
                self._sums.append(numbers)
        return self._meridian_rows[key]

    def meridian_sums(self) -> np.ndarray:
        """Return ``kernels.scene_structs.SceneData.meridian_sums``: float32, shape [n, 4]."""
        return np.concatenate([np.zeros((0, 4), np.float32), *self._sums])

    def add_texture(self, light: Light) -> tuple[int, np.ndarray]:
        """Return the row of a light's texture and its mean colour, shape [3]; -1 and white where it has none."""
        if light.image < 0:
            return -1, np.ones(3)
        image, mean = self._image_of(light)
        self.textures.append({"image": image, "radiance": light.radiance})
        return len(self.textures) - 1, mean

    def add_mesh(self, light: Light, origin: np.ndarray) -> int:
        """Return the row of a mesh light's triangles; -1 where it is none.

        Args:
            light: The light.
            origin: World point that device coordinates are relative to, shape [3].
        """
        if light.triangles is None:
            return -1
        linear = light.world_from_light[:3, :3]
        triangles, parts, ball_leaves = light.triangles, np.zeros(len(light.triangles), np.int64), 0
        if light.ball_triangles and _is_even(linear):
            triangles, ball_leaves = _padded_balls(triangles, light.ball_triangles)
            parts = np.repeat(np.arange(len(triangles) // ball_leaves), ball_leaves)
        elif light.drawn_by is not None:
            parts = connected_parts(triangles)
        order = _along_a_curve(triangles.mean(axis=1), parts)
        corners = triangles[order] @ linear.T + (light.world_from_light[:3, 3] - origin)
        sides = corners[:, 1:] - corners[:, :1]
        if np.linalg.det(linear) < 0:  # a mirroring turns the winding round
            sides = sides[:, ::-1]
        areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1) / 2
        table = np.zeros(len(corners), light_structs.LightTriangle.numpy_dtype())
        table["origin"], table["side_x"], table["side_y"] = corners[:, 0], sides[:, 0], sides[:, 1]
        wound = corners[:, :1] + np.concatenate([np.zeros_like(sides[:, :1]), sides], axis=1)
        table["free_sides"], table["body"] = BOTH_SIDES, -1
        if light.drawn_by is not None:
            table["free_sides"] = free_sides_of(wound)
            table["body"] = parts[order] if ball_leaves else convex_bodies(wound, parts[order])
        self.meshes.append(
            {
                "offset": sum(map(len, self.triangles)),
                "count": len(table),
                "area": areas.sum(),
                "is_double_sided": light.is_double_sided,
                "is_closed": light.is_closed,
                "leaves": leaf_count(len(table)),
                "clusters": sum(map(len, self.clusters)),
                "ball_bits": max(ball_leaves.bit_length() - 1, 0),
            }
        )
        self.triangles.append(table)
        self.clusters.append(light_clusters(wound, table["free_sides"], table["body"], ball_leaves))
        return len(self.meshes) - 1

    def profile_numbers(self) -> np.ndarray:
        """Return ``kernels.scene_structs.SceneData.profile_numbers``: float32, shape [n]."""
        return np.concatenate([np.zeros(0, np.float32), *self._numbers])

    def _add_numbers(self, profile: Profile) -> int:
        """Return where a profile's numbers begin; lights that share one share its numbers."""
        offset = self._offsets.setdefault(id(profile), self._number_count)
        if offset == self._number_count:
            self._numbers += [profile.vertical, profile.horizontal, profile.values.reshape(-1)]
            self._number_count += len(profile.vertical) + len(profile.horizontal) + profile.values.size
        return offset


def _is_even(linear: np.ndarray) -> bool:
    """Return whether a linear map, shape [3, 3], leaves balls what they are."""
    sizes = np.linalg.svd(linear, compute_uv=False)
    return bool(sizes[0] <= (1 + 1e-4) * sizes[2])


def _padded_balls(triangles: np.ndarray, each: int) -> tuple[np.ndarray, int]:
    """Return balls' triangles with ones without area, so that each ball has a power of two of them, and that.

    Args:
        triangles: Shape [n * ``each``, 3, 3], ball after ball.
        each: Of a ball.
    """
    leaves = leaf_count(each)
    balls = triangles.reshape(-1, each, 3, 3)
    points = np.repeat(np.repeat(balls[:, :1, :1], leaves - each, axis=1), 3, axis=2)
    return np.concatenate([balls, points], axis=1).reshape(-1, 3, 3), leaves


def _along_a_curve(points: np.ndarray, parts: np.ndarray) -> np.ndarray:
    """Return the order of points along a Morton curve, part by part, as its first is met: int64, shape [n].

    Args:
        points: shape [n, 3].
        parts: Number of each's part, shape [n].

    Reference: Morton (1966), A Computer Oriented Geodetic Data Base, IBM.
    """
    low = points.min(axis=0)
    cells = ((points - low) / max(float((points.max(axis=0) - low).max()), 1e-30) * 1023).astype(np.int64)
    code = np.zeros(len(points), np.int64)
    for bit in range(10):
        for axis in range(3):
            code |= ((cells[:, axis] >> bit) & 1) << (3 * bit + axis)
    _, part = np.unique(parts, return_inverse=True)
    first = np.full(part.max() + 1, code.max())
    np.minimum.at(first, part, code)
    return np.lexsort((code, part, first[part]))
