# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Rational B-splines in float64: their Bezier pieces, surfaces cut into triangles, trim curves."""
