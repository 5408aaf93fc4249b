# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Paths that are made when they are asked for are the strings that they stand for."""

from __future__ import annotations

import numpy as np
import pytest

from warp_rt.scene.instance_paths import JoinedPaths, NestedPaths, NumberedPaths


def test_paths_are_what_they_stand_for() -> None:
    numbered = NumberedPaths("/I", np.array([0, 7, 2]))
    nested = NestedPaths(numbered, ["/a", "/b"])
    joined = JoinedPaths([(), ["/x"], nested])
    assert numbered == ("/I[0]", "/I[7]", "/I[2]")
    assert nested == ["/I[0]/a", "/I[0]/b", "/I[7]/a", "/I[7]/b", "/I[2]/a", "/I[2]/b"]
    assert list(joined) == ["/x", *nested]
    assert [joined[k] for k in range(7)] == list(joined)
    assert (joined[-1], joined[1:3]) == ("/I[2]/b", ("/I[0]/a", "/I[0]/b"))
    assert joined != ["/x"]
    assert len(JoinedPaths([])) == 0
    with pytest.raises(IndexError):
        joined[7]
