# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The ray counts that Haines published for his Standard Procedural Databases, to half a percent."""

from __future__ import annotations

import pytest

from warp_rt import load_scene

from ..benchmark_modules import load
from ..data import find_test_data

spd = load("spd")

TOLERANCE = 0.005  # relative; the databases' author asks for 0.1


@pytest.mark.parametrize("name", spd.PUBLISHED)
def test_counts(name: str) -> None:
    folder = find_test_data("oracles")
    if folder is None:
        pytest.skip("the databases are not at hand: set WARP_RT_TEST_DATA to the folder that holds oracles/")
    found = spd.count(load_scene(spd.find_database(folder / "spd", name)))
    for column, ours, published in zip(spd.COLUMNS, found, spd.PUBLISHED[name], strict=True):
        assert ours == pytest.approx(published, rel=TOLERANCE), column
