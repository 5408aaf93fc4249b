# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Measurements beside other programs: ``python -m benchmarks NAME``, from the project's root.

Contenders do the same work in one process and take turns, so that whatever else the machine does falls on all of them.
Each table is one command; with ``--save`` its rows go into ``benchmarks/results/NAME.json``, from which
``python -m benchmarks plots`` draws the pictures of docs/performance.md.
"""
