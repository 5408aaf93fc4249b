# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The sidecar of id AOVs: which prim each number stands for."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

NOTHING = -1


def encode_ids(tables: Mapping[str, Sequence[str]], labels: Mapping[str, Mapping[str, tuple[str, ...]]]) -> bytes:
    """Return the sidecar as JSON.

    ``{"none": -1, "primId": {"0": {"path": "/World/Pot", "labels": {"class": ["teapot"]}}}}``: all ids of the
    scene, also those that are not in the picture, so that the tables of several cameras agree. Labels are there
    for prims that have any.

    Args:
        tables: By AOV (``primId``, ``instanceId``): the path of each id.
        labels: Semantic labels: prim path to taxonomy to labels.
    """
    sidecar: dict[str, object] = {"none": NOTHING}
    for aov, paths in tables.items():
        entries: dict[str, object] = {}
        for index, path in enumerate(paths):
            found = labels_of(path, labels)
            entries[str(index)] = {"path": path, "labels": found} if found else {"path": path}
        sidecar[aov] = entries
    return (json.dumps(sidecar, indent=1) + "\n").encode()


def labels_of(path: str, labels: Mapping[str, Mapping[str, tuple[str, ...]]]) -> dict[str, tuple[str, ...]]:
    """Return the semantic labels of a prim by taxonomy, its own and those of the prims above it.

    Args:
        path: Of the prim, or of an instance such as ``/Instancer[7]``.
        labels: Those that prims have themselves: prim path to taxonomy to labels.

    Reference: UsdSemanticsLabelsQuery, ComputeUniqueInheritedLabels.
    """
    inherited: dict[str, tuple[str, ...]] = {}
    ends = [*(index for index, letter in enumerate(path) if letter in "/["), len(path)] if labels else []
    for end in ends:
        for taxonomy, words in labels.get(path[:end], {}).items():
            known = inherited.get(taxonomy, ())
            inherited[taxonomy] = (*known, *(word for word in words if word not in known))
    return inherited
