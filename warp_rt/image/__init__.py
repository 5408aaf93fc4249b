# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Film to pictures: colour, tone curve, file formats. Imports NumPy and image libraries only."""
