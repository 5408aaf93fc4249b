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
    for prims that have any, of their own or from prims above, as UsdSemanticsLabelsQuery inherits them.

    Args:
        tables: By AOV (``primId``, ``instanceId``): the path of each id.
        labels: Semantic labels: prim path to taxonomy to labels.
    """
    sidecar: dict[str, object] = {"none": NOTHING}
    for aov, paths in tables.items():
        sidecar[aov] = {str(index): _entry(path, labels) for index, path in enumerate(paths)}
    return (json.dumps(sidecar, indent=1) + "\n").encode()


def _entry(path: str, labels: Mapping[str, Mapping[str, tuple[str, ...]]]) -> dict[str, object]:
    inherited: dict[str, list[str]] = {}
    ends = [*(index for index, letter in enumerate(path) if letter in "/["), len(path)] if labels else []
    for end in ends:
        for taxonomy, words in labels.get(path[:end], {}).items():
            known = inherited.setdefault(taxonomy, [])
            known.extend(word for word in words if word not in known)
    return {"path": path, "labels": inherited} if inherited else {"path": path}
