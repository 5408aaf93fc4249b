# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a kernel can render, as a type: one for plain scenes is not slowed down by what they do not have.

What the fuller scenes need would cost a plain one nothing but branches that are never taken, and yet a tenth of a
frame: the compiler keeps in memory what such a branch might read, instead of in registers. So the functions of the ray
tree take ``features``, are compiled once for each of these types that a kernel passes, and where a plain scene needs
less, an overload for ``PlainScene`` says so.
"""

from typing import TypeVar

import warp as wp


@wp.struct
class AnyScene:
    """Everything that a scene can have."""


@wp.struct
class PlainScene:
    """No texture and no bent normal in its materials, no dome, no light that is sampled, visible or restricted to some
    instances, nothing that lets light through to a shadow, nothing that only some rays see."""


Features = TypeVar("Features", AnyScene, PlainScene)
"""Stands for each of them in the annotations of a ``per_type`` function."""
