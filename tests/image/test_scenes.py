# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Every stage of scenes/, against a picture made earlier: a guard against change, not a proof of being right.

What is right is tested against closed forms and other programs in tests/analytic and tests/reference. After a change
that is meant: ``pytest tests/image --update-references``, then look at each picture that git says has changed.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import warp_rt

ROOT = Path(__file__).resolve().parents[2]
REFERENCES = Path(__file__).parent / "references"
SCENES = sorted((ROOT / "scenes").glob("*.usda"))

SAMPLES = {"depth_of_field": 16, "motion_blur": 16}  # a pixel, where one does not show what the scene is about

STEP = 2  # of 255: one from the rounding of 8 bits, one from float32
DIFFERENT_PIXELS = 0.005  # share beyond that: edges and shadow borders, where another CPU's last bit may decide


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.stem)
def test_scene_looks_as_before(path: Path, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    picture = np.asarray(warp_rt.render(path, width=200, spp=SAMPLES.get(path.stem, 1), device="cpu"))
    reference = REFERENCES / f"{path.stem}.png"
    if request.config.getoption("--update-references"):
        REFERENCES.mkdir(exist_ok=True)
        Image.fromarray(picture).save(reference, optimize=True)
        return
    expected = np.asarray(Image.open(reference)).astype(int)
    assert picture.shape == expected.shape
    differs = np.abs(picture - expected).max(axis=-1) > STEP
    if differs.mean() > DIFFERENT_PIXELS:
        Image.fromarray(picture).save(tmp_path / "picture.png")
        Image.fromarray(differs).save(tmp_path / "difference.png")
        pytest.fail(f"{differs.mean():.2%} of the pixels differ from {reference.name}; see {tmp_path}")
