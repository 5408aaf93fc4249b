# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Device code: every ``@wp.func`` and kernel of the ray tracer, importable one by one and free of host code."""

if __name__ != "warp_rt.kernels":
    raise ImportError("import warp_rt.kernels, not kernels: a second copy would define every wp.struct twice")
