# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``warp-rt doctor``: versions, devices and caches, for bug reports."""

from __future__ import annotations

import argparse
import contextlib
import os
import platform
from pathlib import Path
from typing import Any

from warp_rt.cli.parser import Parser, add_json
from warp_rt.cli.terminal import Terminal
from warp_rt.cli.versions import versions


def parser() -> Parser:
    """Return the parser of ``warp-rt doctor``."""
    result = Parser("doctor", "Tell versions, devices and caches: what a bug report should say.")
    add_json(result, "all of it")
    return result


def run(args: argparse.Namespace, terminal: Terminal) -> int:
    """Tell what is found; return the exit code."""
    findings = _findings()
    if args.json:
        terminal.json(findings)
    else:
        terminal.data(_table(findings))
    return 0


def _findings() -> dict[str, Any]:
    from warp_rt.device.devices import kernel_cache, list_devices
    from warp_rt.device.workers import default_thread_count

    cache = kernel_cache()
    return {
        "versions": versions(),
        "platform": f"{platform.system()} {platform.release()} {platform.machine()}",
        "threads": default_thread_count(),
        "devices": [vars(device) for device in list_devices()],
        "kernel_cache": {
            "path": str(cache.path),
            "bytes": _size_of(cache.path),
            "is_temporary": cache.is_temporary,
        },
    }


def _size_of(folder: Path) -> int:
    """Return what the files below a folder take [byte]."""
    size = 0
    for parent, _, names in os.walk(folder):
        for name in names:
            with contextlib.suppress(FileNotFoundError):  # another process has just finished with it
                size += Path(parent, name).lstat().st_size
    return size


def _table(findings: dict[str, Any]) -> str:
    rows = [(name, version) for name, version in findings["versions"].items()]
    rows.append(("platform", findings["platform"]))
    rows.append(("threads", findings["threads"]))
    for device in findings["devices"]:
        memory = "" if device["total_bytes"] is None else f", {device['total_bytes'] / 2**30:.1f} GiB"
        rows.append(("device", f"{device['name']}  {device['description']}{memory}"))
    cache = findings["kernel_cache"]
    kind = "temporary, " if cache["is_temporary"] else ""
    rows.append(("kernel cache", f"{cache['path']}  ({kind}{cache['bytes'] / 2**20:.1f} MiB)"))
    return "\n".join(f"{name:<14}{value}" for name, value in rows)
