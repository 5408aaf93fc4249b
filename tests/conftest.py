# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Fixtures that all tests share."""

from __future__ import annotations

import os

import pytest

from warp_rt.errors import DeviceError
from warp_rt.warp_setup import resolve_device

# What the user's shell says of terminals, and a test's own process would hear. A test that means one sets it.
for _name in ("FORCE_COLOR", "NO_COLOR", "COLUMNS", "LINES", "TERM"):
    os.environ.pop(_name, None)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add what tests/image knows."""
    parser.addoption("--update-references", action="store_true", help="write the pictures of tests/image anew")


@pytest.fixture(params=["cpu", pytest.param("cuda:0", marks=pytest.mark.cuda)])
def device(request: pytest.FixtureRequest) -> str:
    """Each device in turn; a GPU that is not there is skipped."""
    try:
        return resolve_device(request.param)
    except DeviceError as error:
        pytest.skip(str(error))
