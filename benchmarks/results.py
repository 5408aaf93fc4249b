# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Result files: rows of numbers with the machine, the commit and the versions that they come from.

A file holds one table of one machine. Rows know their commit, because a long table is measured in pieces: a piece
replaces the rows that it has anew and keeps the others.
"""

from __future__ import annotations

import datetime
import importlib.metadata
import json
import os
import platform
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "benchmarks" / "results"

Row = dict[str, Any]

_PACKAGES = ("warp-lang", "numpy", "usd-core", "embreex", "open3d", "mitsuba")


def read(name: str) -> dict[str, Any]:
    """Return the result file of a benchmark; without rows where there is none."""
    path = FOLDER / f"{name}.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {"rows": []}


def save(name: str, rows: Sequence[Row], keys: Sequence[str]) -> Path:
    """Write rows to the result file of a benchmark, in place of those that have the same ``keys``."""
    machine = describe_machine()
    old = read(name)
    if old.get("machine", machine) != machine:
        print(f"{name}.json was another machine's: its rows are dropped")
        old = {"rows": []}
    mark = {"commit": describe_commit(), "date": datetime.datetime.now(datetime.UTC).date().isoformat()}
    merged = {tuple(row.get(key) for key in keys): row for row in old["rows"]}
    merged |= {tuple(row.get(key) for key in keys): row | mark for row in rows}
    document = {"benchmark": name, "machine": machine, "versions": describe_versions(), "rows": list(merged.values())}
    FOLDER.mkdir(exist_ok=True)
    path = FOLDER / f"{name}.json"
    lines = json.dumps(document | {"rows": []}, indent=1)[: -len("[]\n}")]
    body = ",\n".join("  " + json.dumps(row) for row in document["rows"])  # a row a line: readable differences
    path.write_text(f"{lines}[\n{body}\n ]\n}}\n", encoding="utf-8")
    return path


def describe_machine() -> Mapping[str, Any]:
    """Return what a time depends on."""
    facts = _linux_processor()
    pages = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") if hasattr(os, "sysconf") else 0
    return {
        "processor": facts.get("model name") or platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "cache": facts.get("cache size", ""),
        "widest_vectors": _widest_vectors(facts.get("flags", "").split()),
        "memory_gib": round(pages / 2**30),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
    }


def describe_versions() -> Mapping[str, str]:
    """Return the versions of the libraries that are there."""
    found = {}
    for package in _PACKAGES:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found


def describe_commit() -> str:
    """Return the commit that is checked out, with a plus where the code differs from it."""
    try:
        commit = _git("rev-parse", "--short=10", "HEAD")
        changed = _git("status", "--porcelain", "--untracked-files=no", "--", "warp_rt", "kernels", "benchmarks/*.py")
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return commit + ("+" if changed else "")


def _git(*words: str) -> str:
    return subprocess.run(["git", *words], cwd=ROOT, check=True, capture_output=True, text=True).stdout.strip()


def _linux_processor() -> dict[str, str]:
    """Return what Linux says about the first processor; nothing elsewhere."""
    path = Path("/proc/cpuinfo")
    if not path.is_file():
        return {}
    first = path.read_text(encoding="utf-8").split("\n\n")[0]
    parts = (line.partition(":") for line in first.splitlines() if ":" in line)
    return {name.strip(): value.strip() for name, _, value in parts}


def _widest_vectors(flags: Sequence[str]) -> str:
    """Return the widest vector unit among the processor's flags."""
    return next((name for name in ("avx512f", "avx2", "sse4_2", "asimd") if name in flags), "")
