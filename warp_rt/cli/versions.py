# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Versions of what takes part in a render, read without loading any of it."""

from __future__ import annotations

import platform
from importlib import metadata

from warp_rt import __version__

_DISTRIBUTIONS = {"warp": "warp-lang", "usd": "usd-core", "numpy": "numpy"}


def versions() -> dict[str, str]:
    """Return versions by name, warp_rt's first; ``missing`` for what is not installed."""
    return {
        "warp_rt": __version__,
        **{name: _version(distribution) for name, distribution in _DISTRIBUTIONS.items()},
        "python": platform.python_version(),
    }


def _version(distribution: str) -> str:
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return "missing"
