# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Haines' Neutral File Format: ``load.load_nff`` makes a Scene of a file."""
