# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Arrays on a device."""

from typing import Any

import numpy as np
import pytest
import warp as wp

from warp_rt.device.arrays import filled
from warp_rt.warp_setup import init_warp

init_warp()


@pytest.mark.parametrize("value", [0, -1])
@pytest.mark.parametrize("dtype", [wp.int32, wp.float32, wp.vec2, wp.vec3, wp.vec4])
@pytest.mark.parametrize("shape", [(3, 5), (0, 0), (2, 1, 4)])
def test_filled_is_what_warp_fills(shape: tuple[int, ...], dtype: Any, value: int) -> None:
    array = filled(shape, value, dtype, "cpu")
    expected = wp.full(shape, dtype(value), dtype=dtype, device="cpu")
    assert (array.shape, array.dtype) == (expected.shape, expected.dtype)
    np.testing.assert_array_equal(array.numpy(), expected.numpy())
