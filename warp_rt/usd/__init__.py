# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The only code that imports pxr: ``load.load_stage`` makes a Scene of a USD stage."""
