# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What the comparisons with the float64 oracle share: its modules, its counts by our names, and the pass figures."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from warp_rt.rendering.film import Film

from ..data import find_test_data

# Pass figures: float32 moves silhouettes, and the glass ball magnifies that, on a few pixels in ten thousand.
ERROR_LIMIT = 1e-4  # largest channel difference of a pixel, radiance near 1
PIXEL_FRACTION = 0.999
COUNT_TOLERANCE = 1e-3  # relative
COUNT_SLACK = 5  # rays, for counts too small for the relative figure


def oracle_folder() -> Path:
    """Return the folder of the oracles; skip the test where it is not at hand."""
    folder = find_test_data("oracles")
    if folder is None:
        pytest.skip("the oracles are not at hand: set WARP_RT_TEST_DATA to the folder that holds oracles/")
    return folder


def oracle_module(name: str) -> ModuleType:
    """Return one of the oracles' modules; they import each other by their bare names."""
    if name not in sys.modules:
        path = oracle_folder() / f"{name}.py"
        spec = importlib.util.spec_from_file_location(name, path)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
    return sys.modules[name]


def assert_same_image(color: np.ndarray, expected: np.ndarray) -> None:
    """Check that nearly all pixels have the oracle's colour."""
    error = np.abs(color - expected).max(axis=-1)
    fraction = float((error <= ERROR_LIMIT).mean())
    assert fraction >= PIXEL_FRACTION, f"{fraction:.5f} of the pixels within {ERROR_LIMIT}, worst {error.max():.3g}"


def assert_same_counts(film: Film, expected: dict[str, float]) -> None:
    """Check every ray count that the oracle has, ``expected`` being by its names."""
    rays = film.rays
    found = {
        "primary": rays.primary,
        "reflection": rays.reflection,
        "refraction": rays.refraction,
        "tir": rays.total_internal_reflection,
        "shadow": rays.shadow,
        "pruned_depth": rays.dropped_by_depth,
        "pruned_threshold": rays.dropped_by_threshold,
        "nodes": sum(level.nodes for level in rays.per_depth),
    }
    for name, count in found.items():
        assert_near(count, expected[name], name)


def assert_near(count: int, wanted: float, name: str) -> None:
    """Check one count."""
    slack = max(COUNT_SLACK, COUNT_TOLERANCE * wanted)
    assert abs(count - wanted) <= slack, f"{name}: {count}, the oracle has {wanted:.0f}"
