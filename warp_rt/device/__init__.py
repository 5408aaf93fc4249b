# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What runs kernels: devices, threads that launch, jobs, arrays, binaries and their compilation."""
