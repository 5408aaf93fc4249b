# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A scene brought to a device: what its lights, images, materials and meshes are to kernels."""
