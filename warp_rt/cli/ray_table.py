# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The counts of a ray tree as a table for people: rays by kind and depth, and what depth and threshold saved."""

from __future__ import annotations

from typing import Any

from warp_rt.cli.columns import in_columns
from warp_rt.cli.terminal import Terminal
from warp_rt.report import counted

_COLUMNS = {
    "primary": ("", "primary"),
    "reflection": ("", "reflection"),
    "refraction": ("", "refraction"),
    "shadow": ("", "shadow"),
    "dropped_by_threshold": ("saved by", "threshold"),
    "dropped_by_depth": ("saved by", "depth"),
}
"""The two lines of each column's title."""
_EVENTS = {"total_internal_reflection": "total internal reflection", "passed": "straight pass-through"}


def tell_rays(terminal: Terminal, rays: dict[str, Any]) -> None:
    """Show the counts of a render: on a terminal where there is a tree to tell of, elsewhere when all is asked for.

    Args:
        terminal: Where to.
        rays: The object ``rays`` of ``render --json``.
    """
    is_tree = any(rays[kind] for kind in ("reflection", "refraction", "dropped_by_threshold", "dropped_by_depth"))
    if terminal.verbosity > 0 or (terminal.is_interactive and is_tree):
        terminal.text(ray_table(rays))


def ray_table(rays: dict[str, Any]) -> str:
    """Return the counts as lines: one a depth, their sums, and what else happened on the way."""
    levels = [{"primary": rays["primary"] if level["depth"] == 1 else 0} | level for level in rays["per_depth"]]
    rows = list(zip(("", "depth"), *_COLUMNS.values(), strict=True))
    rows += [(str(level["depth"]), *(_number(level[key]) for key in _COLUMNS)) for level in levels]
    rows.append(("all", *(_number(rays[key]) for key in _COLUMNS)))
    told = [counted(rays[key], noun) for key, noun in _EVENTS.items() if rays[key]]
    return "\n".join([in_columns(rows), *([", ".join(told)] if told else [])])


def _number(count: int) -> str:
    return f"{count:,}" if count else "-"
