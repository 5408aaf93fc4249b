# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``python -m warp_rt``: the command line."""

from warp_rt.cli.program import run

run()
