# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Subdivision surfaces: Catmull-Clark and Loop, uniformly refined, with points and normals of the limit."""
