# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a ray looks for, as a type: traversal is compiled for each goal, whatever the compiler makes of a flag."""

from typing import TypeVar

import warp as wp


@wp.struct
class ClosestHit:
    """The hit of smallest t."""


@wp.struct
class AnyHit:
    """Whether there is a hit."""


Goal = TypeVar("Goal", ClosestHit, AnyHit)
"""Stands for each goal in the annotations of a ``per_type`` function."""
