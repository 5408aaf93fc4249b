# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The modules of benchmarks/, which is no installed package."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from types import ModuleType

from .data import ROOT


def load(name: str) -> ModuleType:
    """Return a module of benchmarks/."""
    if "benchmarks" not in sys.modules:
        path = ROOT / "benchmarks" / "__init__.py"
        spec = importlib.util.spec_from_file_location("benchmarks", path, submodule_search_locations=[str(path.parent)])
        assert spec is not None
        assert spec.loader is not None
        sys.modules["benchmarks"] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(sys.modules["benchmarks"])
    return importlib.import_module(f"benchmarks.{name}")
