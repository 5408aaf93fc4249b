# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""From a scene to a film: camera, launches, exposure, and the ray tree of one pixel."""
