# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The ray tree of a pixel, as values and as what people look at: text, equation, graph, curves."""
