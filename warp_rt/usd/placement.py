# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Groups of placed gprims, and copies of groups: what instancing of every kind comes down to."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NoReturn

import numpy as np
from pxr import Usd

from warp_rt.errors import LimitError
from warp_rt.scene.instance_paths import JoinedPaths, NestedPaths
from warp_rt.scene.instance_transforms import Transforms, join, nest
from warp_rt.usd.gprims import Gprims
from warp_rt.usd.primvars import Values, merge_width

MAX_INSTANCES = 10_000_000


@dataclass(frozen=True)
class PlacedPrim:
    """A light or a camera in a group."""

    prim: Usd.Prim
    matrix: np.ndarray
    """float64, shape [4, 4], group from local."""
    path: str
    """As the group's names: relative to the path of what holds the group."""


@dataclass(frozen=True)
class Group:
    """Rows of placed gprims, one for each copy; a group within it has been copied into it already."""

    gprim: np.ndarray
    """int32, shape [k], row of the ``Gprims``."""
    matrix: Transforms
    """float64, shape [k, 4, 4], group from local."""
    name: np.ndarray
    """int32, shape [k], row of ``names``, or -1 for what belongs to the group's own instance."""
    names: Sequence[str]
    """Paths of the instances within the group, relative to the path of what holds the group."""
    values: dict[str, np.ndarray]
    """Values that precede the mesh's primvar: float32, shape [k, c]; a row of NaN: none, one of BLOCKED: none, and none
    from outside the group."""
    from_instancer: dict[str, np.ndarray]
    """Which rows of ``values`` an instancer within the group gave: bool, shape [k]. Nothing outside precedes them."""
    is_sealed: np.ndarray
    """Which rows inherit nothing from outside: bool, shape [k]. They are of prototypes that stand elsewhere."""
    lights: tuple[PlacedPrim, ...]
    cameras: tuple[PlacedPrim, ...]

    def __len__(self) -> int:
        return len(self.gprim)

    def unblocked(self) -> Group:
        """Return the group of all that is drawn, in which nothing is inherited any more: BLOCKED rows have no value."""
        held = {}
        for name, values in self.values.items():
            is_blocked = np.isinf(values[:, 0])
            if is_blocked.any():
                values = np.where(is_blocked[:, None], np.float32(np.nan), values)
            if not is_blocked.all():
                held[name] = values
        return replace(self, values=held) if len(self) else self

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing to copy."""
        return not (len(self.gprim) or self.lights or self.cameras)


class GroupBuilder:
    """Collects a group: gprims, lights, cameras, and copies of other groups.

    Copies are only counted as they are added, and made by ``build``: so a group that multiplies beyond the limit is
    refused before any group within it has taken memory.

    Args:
        instance_limit: Number of rows at which LimitError is raised, before memory is taken.
    """

    def __init__(self, instance_limit: int = MAX_INSTANCES) -> None:
        self._limit = instance_limit
        self.is_absolute = False
        """Whether something in it stands still, wherever the group is placed."""
        self.weight = 0
        """Number of gprims, lights and cameras, copies included."""
        self._group: Group | None = None
        self._singles: list[tuple[int, np.ndarray, Values]] = []
        self._copies: dict[tuple[int, frozenset[str]], tuple[GroupBuilder, list[tuple[np.ndarray, str, Values]]]] = {}
        self._batches: list[tuple[GroupBuilder, Transforms, Sequence[str], Values, Values, bool]] = []
        self._lights: list[PlacedPrim] = []
        self._cameras: list[PlacedPrim] = []

    def add_gprim(self, gprim: int, matrix: np.ndarray, values: Values) -> None:
        """Place a gprim.

        Args:
            gprim: Its row.
            matrix: Group from local, shape [4, 4].
            values: Those that it inherits or that its shared mesh has no room for; what its mesh has itself precedes.
        """
        self.weight += 1
        if self.weight > self._limit:
            self._refuse()
        self._singles.append((gprim, matrix, values))

    def add_light(self, light: PlacedPrim) -> None:
        """Place a light."""
        self._take(1)
        self._lights.append(light)

    def add_camera(self, camera: PlacedPrim) -> None:
        """Place a camera."""
        self._take(1)
        self._cameras.append(camera)

    def add_copy(self, group: GroupBuilder, matrix: np.ndarray, name: str, inherited: Values) -> None:
        """Place one copy, of a native instance.

        Args:
            group: What is copied, complete.
            matrix: This group from that group, shape [4, 4].
            name: Path of the instance, relative to what holds this group.
            inherited: Values that count where the group's rows have none of that name.
        """
        self._take(group.weight)
        key = (id(group), frozenset(inherited))
        self._copies.setdefault(key, (group, []))[1].append((matrix, name, inherited))

    def add_copies(
        self,
        group: GroupBuilder,
        matrices: Transforms,
        names: Sequence[str],
        inherited: Values,
        given: Values,
        *,
        is_sealed: bool,
    ) -> None:
        """Place copies of a PointInstancer.

        Args:
            group: What is copied, complete.
            matrices: This group from that group, shape [n, 4, 4].
            names: Path of each copy, relative to what holds this group.
            inherited: Values that count where the group's rows have none, shape [n, c].
            given: Values that precede the group's own, shape [n, c].
            is_sealed: Whether they inherit nothing else, as the group stands elsewhere.
        """
        self._take(group.weight * len(matrices))
        self._batches.append((group, matrices, names, inherited, given, is_sealed))

    def build(self, gprims: Gprims) -> Group:
        """Return the group, without the gprims that are not drawn; later calls return the same one."""
        if self._group is None:
            self._group = self._joined([self._single_rows(gprims), *self._copied_groups(gprims)])
        return self._group

    def _copied_groups(self, gprims: Gprims) -> Iterator[Group]:
        for builder, copies in self._copies.values():
            group = builder.build(gprims)
            if not group.is_empty:
                matrices = np.stack([matrix for matrix, _, _ in copies])
                names = [name for _, name, _ in copies]
                values = {key: _stack_padded([inherited[key] for _, _, inherited in copies]) for key in copies[0][2]}
                yield _copied(group, matrices, names, values, {}, False, gprims)
        while self._batches:  # whose memory is free once they are copied
            batch = self._batches.pop(0)
            group = batch[0].build(gprims)
            if not group.is_empty:
                yield _copied(group, *batch[1:], gprims)

    def _joined(self, chunks: list[Group]) -> Group:
        held = [chunk for chunk in chunks if not chunk.is_empty]
        if len(held) == 1 and not (self._lights or self._cameras):
            return held[0]
        counts = [len(chunk) for chunk in chunks]
        offsets = np.cumsum([0] + [len(chunk.names) for chunk in chunks])[:-1]
        return Group(
            gprim=np.concatenate([chunk.gprim for chunk in chunks]),
            matrix=join([chunk.matrix for chunk in chunks]),
            name=np.concatenate(
                [
                    np.where(chunk.name < 0, -1, chunk.name + offset).astype(np.int32)
                    for chunk, offset in zip(chunks, offsets, strict=True)
                ]
            ),
            names=JoinedPaths(chunk.names for chunk in chunks),
            values=_concatenated([chunk.values for chunk in chunks], counts),
            from_instancer={
                key: np.concatenate([chunk.from_instancer.get(key, np.zeros(len(chunk), bool)) for chunk in chunks])
                for key in sorted({key for chunk in chunks for key in chunk.from_instancer})
            },
            is_sealed=np.concatenate([chunk.is_sealed for chunk in chunks]),
            lights=tuple(self._lights) + tuple(light for chunk in chunks for light in chunk.lights),
            cameras=tuple(self._cameras) + tuple(camera for chunk in chunks for camera in chunk.cameras),
        )

    def _take(self, count: int) -> None:
        self.weight += count
        if self.weight > self._limit:
            self._refuse()

    def _refuse(self) -> NoReturn:
        raise LimitError(f"the stage holds more than {self._limit} instances")

    def _single_rows(self, gprims: Gprims) -> Group:
        gprim = np.array([row for row, _, _ in self._singles], np.int32)
        drawn = np.flatnonzero(gprims.mesh[gprim] >= 0)
        gprim = gprim[drawn]
        matrices = np.empty((len(drawn), 4, 4))
        if len(drawn):
            np.concatenate([self._singles[row][1] for row in drawn.tolist()], out=matrices.reshape(-1, 4))
        holders: dict[str, list[int]] = {}
        for place, row in enumerate(drawn.tolist()):
            for key in self._singles[row][2]:
                holders.setdefault(key, []).append(place)
        values = {}
        for key in sorted(holders):
            places = np.array(holders[key])
            places = places[~gprims.has_own(key, gprim[places])]
            if len(places):
                given = _stack_padded([self._singles[drawn[place]][2][key] for place in places])
                values[key] = np.full((len(drawn), given.shape[1]), np.nan, np.float32)
                values[key][places] = given
        return Group(
            gprim=gprim,
            matrix=matrices,
            name=np.full(len(drawn), -1, np.int32),
            names=(),
            values=values,
            from_instancer={},
            is_sealed=np.zeros(len(drawn), bool),
            lights=(),
            cameras=(),
        )


def _copied(
    group: Group,
    matrices: Transforms,
    names: Sequence[str],
    inherited: Values,
    given: Values,
    is_sealed: bool,
    gprims: Gprims,
) -> Group:
    """Return n copies of a group, one after the other; arguments as ``GroupBuilder.add_copies``."""
    n, k = len(matrices), len(group)
    used, local = np.unique(group.name, return_inverse=True)
    suffixes = [group.names[row] if row >= 0 else "" for row in used]
    values: dict[str, np.ndarray] = {}
    from_instancer = {key: np.tile(is_given, n) for key, is_given in group.from_instancer.items()}
    for key in {**group.values, **inherited, **given}:
        sources = [source[key] for source in (group.values, inherited, given) if key in source]
        width = max(source.shape[-1] for source in sources)
        rows = np.full((n, k, width), np.nan, np.float32)
        if key in group.values:
            rows[:] = merge_width(group.values[key], width)
        if key in inherited:
            is_free = np.isnan(rows[0, :, 0]) & ~gprims.has_own(key, group.gprim) & ~group.is_sealed
            rows[:, is_free] = merge_width(inherited[key], width)[:, None]
        if key in given:
            is_open = ~group.from_instancer.get(key, np.zeros(k, bool))
            rows[:, is_open] = merge_width(given[key], width)[:, None]
            from_instancer[key] = np.ones(n * k, bool)
        values[key] = rows.reshape(n * k, width)
    return Group(
        gprim=np.tile(group.gprim, n),
        matrix=nest(matrices, group.matrix),
        name=(np.arange(n)[:, None] * len(used) + local.reshape(-1)[None]).reshape(-1).astype(np.int32),
        names=names if suffixes == [""] else NestedPaths(names, suffixes),
        values=values,
        from_instancer=from_instancer,
        is_sealed=np.ones(n * k, bool) if is_sealed else np.tile(group.is_sealed, n),
        lights=_copied_prims(group.lights, matrices, names),
        cameras=_copied_prims(group.cameras, matrices, names),
    )


def _copied_prims(prims: Sequence[PlacedPrim], matrices: Transforms, names: Sequence[str]) -> tuple[PlacedPrim, ...]:
    return tuple(
        PlacedPrim(placed.prim, matrix @ placed.matrix, name + placed.path)
        for matrix, name in zip(matrices if prims else (), names if prims else (), strict=True)
        for placed in prims
    )


def _concatenated(parts: Sequence[Mapping[str, np.ndarray]], counts: Sequence[int]) -> dict[str, np.ndarray]:
    """Return values of consecutive rows; NaN where a part lacks a name."""
    found = {}
    for key in sorted({key for part in parts for key in part}):
        width = max(part[key].shape[1] for part in parts if key in part)
        found[key] = np.concatenate(
            [
                merge_width(part[key], width) if key in part else np.full((count, width), np.nan, np.float32)
                for part, count in zip(parts, counts, strict=True)
            ]
        )
    return found


def _stack_padded(values: Sequence[np.ndarray]) -> np.ndarray:
    width = max(len(value) for value in values)
    return np.stack([merge_width(value, width) for value in values])
