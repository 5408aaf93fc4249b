# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Hierarchies of bounding volumes: built from a scene, kept as an Accel, and queried with rays."""
