# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""How plots look: small SVG files that follow the reader's light or dark theme."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("svg")

from matplotlib import pyplot

INK, PAPER, GRID = "#24292f", "#ffffff", "#d0d7de"
DARK = {INK: "#e6edf3", PAPER: "#0d1117", GRID: "#30363d"}
# Okabe and Ito's palette, which colour-blind readers can tell apart, on light and on dark paper.
ORANGE, BLUE, GREEN, PURPLE, VERMILION, SKY = "#e69f00", "#0072b2", "#009e73", "#cc79a7", "#d55e00", "#56b4e9"

_PARAMETERS: dict[Any, Any] = {
    "svg.fonttype": "none",  # text stays text
    "svg.hashsalt": "warp_rt",  # the same picture is the same file
    "font.family": "sans-serif",
    "font.size": 10,
    "axes.titlesize": 11,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "figure.facecolor": PAPER,
    "axes.facecolor": PAPER,
    "savefig.facecolor": PAPER,
    "legend.frameon": False,
} | dict.fromkeys(("text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color"), INK)
matplotlib.rcParams.update(_PARAMETERS)


def panels(rows: int, columns: int, width: float = 9.0, height: float = 3.0) -> tuple[Any, Any]:
    """Return a figure and its axes, an array of shape [rows, columns]; sizes in inches, ``height`` of one row."""
    return pyplot.subplots(rows, columns, figsize=(width, height * rows), squeeze=False, layout="constrained")


def write(figure: Any, path: Path) -> None:
    """Write a figure as SVG in which ink and paper change places where the reader prefers dark."""
    for axis in figure.axes:
        axis.minorticks_off()
    figure.savefig(path, metadata={"Date": None, "Creator": None})
    pyplot.close(figure)
    text = re.sub(r"\d+\.\d{3,}", lambda number: f"{float(number[0]):.2f}", path.read_text(encoding="utf-8"))
    rules = "".join(
        f'[style*="{kind}: {light}"]{{{kind}:{dark}!important}}'
        for light, dark in DARK.items()
        for kind in ("fill", "stroke")
    )
    start = text.index("<defs>")
    style = f"<style>@media(prefers-color-scheme:dark){{{rules}}}</style>\n  "
    lines = (text[:start] + style + text[start:]).splitlines()
    path.write_text("\n".join(line.rstrip() for line in lines) + "\n", encoding="utf-8")
