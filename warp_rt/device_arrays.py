# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Arrays on a device, made of what the host has."""

from __future__ import annotations

from typing import Any

import warp as wp


def array_of_one(struct: Any, dtype: Any, device: str) -> wp.array:
    """Return a struct as kernels take large ones: in an array, which no thread copies."""
    return wp.array([struct], dtype=dtype, device=device)
