# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Which rows of an array are the same."""

from __future__ import annotations

import numpy as np


def number_rows(rows: np.ndarray) -> np.ndarray:
    """Return a number for each row, the same for equal rows: int64, shape [n], from 0 without gaps.

    Args:
        rows: float32, shape [n, k], without NaN.
    """
    columns = rows.T + np.float32(0)  # -0 becomes 0
    order = np.lexsort(columns)
    is_new = np.zeros(len(order), bool)
    is_new[1:] = (columns[:, order[1:]] != columns[:, order[:-1]]).any(axis=0)
    number = np.empty(len(order), np.int64)
    number[order] = np.cumsum(is_new)
    return number


def first_equal_rows(rows: np.ndarray) -> np.ndarray:
    """Return the first row that equals each row: int64, shape [n].

    Args:
        rows: float32, shape [n, k], without NaN.
    """
    number = number_rows(rows)
    return np.unique(number, return_index=True)[1][number]
