# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Draw the saved results as the pictures of docs/performance.md.

    python -m benchmarks plots                all of them
    python -m benchmarks plots --only rays

Bars and dots are medians; whiskers go from the slowest turn to the fastest.
"""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from . import results
from .plot_style import BLUE, GREEN, INK, ORANGE, PURPLE, SKY, VERMILION, panels, write

FOLDER = results.ROOT / "docs" / "performance"
COLORS = {
    "warp_rt": VERMILION,
    "embree": BLUE,
    "wp.Mesh": GREEN,
    "povray": PURPLE,
    "mitsuba": SKY,
    "warp_rt, sah": VERMILION,
    "warp_rt, median": ORANGE,
    "warp_rt, midpoint": PURPLE,
    "warp_rt, lbvh": SKY,
    "warp_rt, ploc": INK,
}
TREE_COLORS = {
    "brute force": BLUE,
    "lbvh": SKY,
    "median": ORANGE,
    "midpoint": PURPLE,
    "ploc": GREEN,
    "sah": VERMILION,
}


def main(arguments: Sequence[str]) -> None:
    """Draw what the command line asks for."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks plots", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--only", nargs="+", choices=PLOTS, default=list(PLOTS))
    parser.add_argument("--output", type=Path, default=FOLDER, help="folder")
    options = parser.parse_args(arguments)
    options.output.mkdir(parents=True, exist_ok=True)
    for name in options.only:
        draw, source = PLOTS[name]
        rows = results.read(source)["rows"]
        if not rows:
            print(f"{name}: benchmarks/results has no {source}.json yet")
            continue
        path = options.output / f"{name}.svg"
        write(draw(rows), path)
        print(path)


def draw_rays(rows: Sequence[results.Row]) -> Any:
    """Return rays per second: a panel a kind of rays, a group of bars a mesh."""
    names = ["warp_rt", "embree", "wp.Mesh"]
    shown = {"primary": "closest", "mirror": "closest", "shadow": "any", "ao": "any", "diffuse": "closest"}
    shown |= {"random": "closest"}
    figure, axes = panels(3, 2, height=2.4)
    for axis, (kind, query) in zip(axes.flat, shown.items(), strict=True):
        chosen = [row for row in rows if (row["rays"], row["query"]) == (kind, query)]
        for shift, name in enumerate(names):
            rates = [[row["ray_count"] / s / 1e6 for s in row["seconds"].get(name, [])] for row in chosen]
            bars(axis, np.arange(len(chosen)) + 0.27 * (shift - 1), rates, 0.25, name)
        axis.set_title(f"{kind}, {query} hit")
        axis.set_xticks(range(len(chosen)), [row["mesh"] for row in chosen], rotation=20)
        axis.grid(axis="x", visible=False)
    for axis in axes[:, 0]:
        axis.set_ylabel("million rays a second")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    return figure


def draw_ratios(rows: Sequence[results.Row]) -> Any:
    """Return how many times as fast as Embree and as wp.Mesh: a dot a row of the table."""
    meshes = list(dict.fromkeys(row["mesh"] for row in rows))
    kinds = list(dict.fromkeys(row["rays"] for row in rows))
    figure, axes = panels(1, 2, height=3.6)
    for axis, (name, goal) in zip(axes.flat, {"embree": 1.5, "wp.Mesh": 4.0}.items(), strict=True):
        for query, marker in {"closest": "o", "any": "^"}.items():
            for color, kind in zip((VERMILION, ORANGE, GREEN, BLUE, PURPLE, SKY), kinds, strict=False):
                chosen = [r for r in rows if (r["rays"], r["query"]) == (kind, query) and name in r["seconds"]]
                x = [min(row["seconds"][name]) / min(row["seconds"]["warp_rt"]) for row in chosen]
                y = [meshes.index(row["mesh"]) + 0.12 * kinds.index(kind) - 0.3 for row in chosen]
                label = kind if query == "closest" else None
                axis.scatter(x, y, 22, color=color, marker=marker, label=label)
        axis.axvline(1, color=INK, linewidth=0.8)
        axis.axvline(goal, color=INK, linewidth=0.8, linestyle=":")
        axis.set_title(f"times as fast as {name} (dotted: the goal)")
        axis.set_yticks(range(len(meshes)), meshes)
        axis.invert_yaxis()
        axis.set_xlim(left=0)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=6)
    axes[0, 0].set_xlabel("circles: closest hit, triangles: any hit")
    return figure


def draw_build(rows: Sequence[results.Row]) -> Any:
    """Return seconds of building on the CPU by triangles, a panel a number of threads."""
    rows = [row for row in rows if "device" not in row]
    counts = sorted({row["threads"] for row in rows})
    figure, axes = panels(1, len(counts), height=3.6)
    for axis, threads in zip(axes.flat, counts, strict=True):
        chosen = sorted((r for r in rows if r["threads"] == threads), key=lambda row: row["triangles"])
        for name in dict.fromkeys(name for row in chosen for name in row["seconds"]):
            having = [row for row in chosen if name in row["seconds"]]
            lines(axis, [r["triangles"] for r in having], [r["seconds"][name] for r in having], name)
        axis.set_title(f"{threads} thread{'s' if threads > 1 else ''}")
        axis.set_xlabel("triangles")
        log_log(axis)
    axes[0, 0].set_ylabel("seconds to build")
    axes[0, 0].legend(fontsize=8)
    return figure


def draw_frame(rows: Sequence[results.Row]) -> Any:
    """Return CPU seconds of a frame: a group of bars a size."""
    figure, axes = panels(1, 1, width=6, height=2.8)
    axis = axes[0, 0]
    for shift, name in enumerate(("warp_rt", "povray", "mitsuba")):
        seconds = [row["seconds"].get(name, []) for row in rows]
        bars(axis, np.arange(len(rows)) + 0.27 * (shift - 1), seconds, 0.25, name)
    axis.set_xticks(range(len(rows)), [f"{row['triangles']:,} triangles" for row in rows])
    axis.set_ylabel("CPU seconds of a frame")
    axis.grid(axis="x", visible=False)
    axis.legend(fontsize=8)
    return figure


def draw_scaling(rows: Sequence[results.Row]) -> Any:
    """Return seconds of a frame by what grows, a panel each; and nanoseconds a ray by instances."""
    titles = {
        "threads": "threads",
        "triangles": "triangles of the teapot",
        "resolution": "width of the picture [pixel]",
        "depth": "depth of the ray tree",
        "instances": "instances of 1,280 triangles",
    }
    figure, axes = panels(2, 3, height=2.6)
    for axis, (name, title) in zip(axes.flat, titles.items(), strict=False):
        chosen = sorted((row for row in rows if row["of"] == name), key=lambda row: row["value"])
        x = [row["value"] for row in chosen]
        axis.set_visible(bool(chosen))
        if not chosen:
            continue
        axis.set_xlabel(title)
        if name == "instances":
            for part, color in {"instances": VERMILION, "flattened": BLUE}.items():
                having = [row for row in chosen if part in row["seconds"]]
                each = [[s / row["ray_count"] * 1e9 for s in row["seconds"][part]] for row in having]
                lines(axis, [row["value"] for row in having], each, part, color)
            axis.set_ylabel("ns a primary ray")
            axis.set_xscale("log")
            axis.set_ylim(bottom=0)
            axis.legend(fontsize=8)
            continue
        lines(axis, x, [row["seconds"]["frame"] for row in chosen], "frame", VERMILION)
        axis.set_ylabel("seconds a frame")
        if name == "resolution":
            log_log(axis)
            axis.set_xticks(x, [f"{value}" for value in x])
        elif name == "triangles":
            axis.set_xscale("log")
            axis.set_ylim(bottom=0)
        else:
            axis.set_ylim(bottom=0)
            axis.set_xticks(x)
    axes[1, 2].set_visible(False)
    return figure


def draw_hierarchies(rows: Sequence[results.Row]) -> Any:
    """Return tests a ray and nanoseconds a ray by triangles: brute force, and the trees in the lecture's order."""
    figure, axes = panels(1, 3, width=10.5, height=3.8)
    for structure, color in TREE_COLORS.items():
        for volume, style in {"none": "-", "box": "-", "sphere": ":"}.items():
            chosen = [row for row in rows if (row["structure"], row["volume"]) == (structure, volume)]
            chosen = sorted((r for r in chosen if r["order"] != "nearer first"), key=lambda row: row["triangles"])
            x = [row["triangles"] for row in chosen]
            tests = [row["volume_tests"] + row["triangle_tests"] for row in chosen]
            each = [statistics.median(row["ns_a_ray"]) for row in chosen]
            label = structure if volume != "sphere" else None
            for axis, y in zip(axes.flat, (tests, tests, each), strict=True):
                if chosen and not (axis is axes[0, 1] and volume == "none"):
                    axis.plot(x, y, style, marker="o", markersize=3, color=color, label=label)
    ours = sorted((row for row in rows if row["structure"] == "warp_rt"), key=lambda row: row["triangles"])
    each = [statistics.median(row["ns_a_ray"]) for row in ours]
    axes[0, 2].plot([row["triangles"] for row in ours], each, "s-", markersize=3, color=INK, label="warp_rt itself")
    axes[0, 0].set_title("tests a ray")
    axes[0, 1].set_title("the same, hierarchies alone")
    axes[0, 2].set_title("nanoseconds a ray, one thread")
    for axis in axes.flat:
        log_log(axis)
    axes[0, 1].set_yscale("linear")
    axes[0, 1].set_ylim(bottom=0)
    axes[0, 0].legend(fontsize=8)
    axes[0, 2].legend(fontsize=8)
    axes[0, 1].set_xlabel("triangles (solid: boxes, dotted: spheres)")
    return figure


def draw_complexity(rows: Sequence[results.Row]) -> Any:
    """Return operations of a picture by triangles: the rasteriser's model beside the ray tracer's counted tests."""
    pixels = 1024 * 768
    figure, axes = panels(1, 1, width=6.5, height=3.8)
    axis = axes[0, 0]
    brute = sorted((row for row in rows if row["structure"] == "brute force"), key=lambda row: row["triangles"])
    x = [row["triangles"] for row in brute]
    axis.plot(x, [pixels * row["triangle_tests"] for row in brute], "o-", color=INK, label="rays, brute force")
    for order, color in {"as they come": ORANGE, "nearer first": VERMILION}.items():
        chosen = [row for row in rows if (row["structure"], row["volume"], row["order"]) == ("sah", "box", order)]
        chosen.sort(key=lambda row: row["triangles"])
        tests = [pixels * (row["volume_tests"] + row["triangle_tests"]) for row in chosen]
        label = f"rays, SAH tree, children {order}"
        axis.plot([row["triangles"] for row in chosen], tests, "o-", color=color, label=label)
    cost = [row["vertices"] + row["exact_triangles"] + pixels * row["surfaces_a_ray"] for row in brute]
    axis.plot(x, cost, "o-", color=BLUE, label="rasteriser: vertices + triangles + fragments")
    axis.set_xlabel("triangles")
    axis.set_ylabel("operations of a 1024 x 768 picture")
    axis.legend(fontsize=8)
    log_log(axis)
    return figure


def bars(axis: Any, x: np.ndarray, values: Sequence[Sequence[float]], width: float, name: str) -> None:
    """Draw medians as bars, with whiskers; an empty sequence leaves a gap."""
    there = [i for i, turns in enumerate(values) if turns]
    middle = np.array([statistics.median(values[i]) for i in there])
    low, high = (np.array([f(values[i]) for i in there]) for f in (min, max))
    axis.bar(x[there], middle, width, color=COLORS[name], label=name)
    axis.errorbar(x[there], middle, [middle - low, high - middle], fmt="none", ecolor=INK, elinewidth=0.7)


def lines(
    axis: Any, x: Sequence[float], values: Sequence[Sequence[float]], name: str, color: str | None = None
) -> None:
    """Draw medians as a line with dots."""
    middle = [statistics.median(turns) for turns in values]
    axis.plot(x, middle, "o-", markersize=3.5, linewidth=1.3, color=color or COLORS[name], label=name)


def log_log(axis: Any) -> None:
    """Make both axes logarithmic."""
    axis.set_xscale("log")
    axis.set_yscale("log")


PLOTS: dict[str, tuple[Callable[[Sequence[results.Row]], Any], str]] = {
    "rays": (draw_rays, "rays"),
    "ratios": (draw_ratios, "rays"),
    "build": (draw_build, "build"),
    "frame": (draw_frame, "frame"),
    "scaling": (draw_scaling, "scaling"),
    "hierarchies": (draw_hierarchies, "hierarchies"),
    "complexity": (draw_complexity, "hierarchies"),
}
