# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a render tells when it is done: the object of ``--json``, and one line for people."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

from warp_rt.report import Diagnostic, counted

if TYPE_CHECKING:
    from warp_rt.rendering.film import Film
    from warp_rt.rendering.renderer import Renderer

_NAMED = 4  # files of a summary; of more it names two
_TRACED = ("primary", "reflection", "refraction", "shadow")


def frame_summary(
    renderer: Renderer,
    film: Film,
    outputs: Sequence[Path],
    seconds: dict[str, float],
    diagnostics: Iterable[Diagnostic],
) -> dict[str, Any]:
    """Return the JSON object of one picture."""
    options, scene, hierarchy = renderer.options, renderer.scene, renderer.accel.statistics
    records = tuple(diagnostics)
    return {
        "outputs": [str(path) for path in outputs],
        "width": film.width,
        "height": film.height,
        "camera": film.facts.get("camera", ""),
        "spp": options.spp,
        "light_samples": options.light_samples,
        "integrator": options.integrator,
        "depth": options.depth,
        "threshold": options.threshold,
        "device": renderer.device,
        "threads": renderer.threads,
        "triangles": scene.triangle_count,
        "shapes": scene.shape_count,
        "instances": len(scene.instances),
        "seconds": seconds,
        "rays": film.rays.to_json(),
        "bvh": {
            "builder": hierarchy.builder,
            "nodes": hierarchy.nodes,
            "depth": hierarchy.depth,
            "sah_cost": hierarchy.sah_cost,
            "bytes": hierarchy.bytes,
        },
        "memory": {"peak_bytes": None, "device_bytes": renderer.device_bytes},
        "warnings": [vars(record) for record in records if record.is_warning],
        "notes": [vars(record) for record in records if not record.is_warning],
    }


def whole_run(frames: Sequence[dict[str, Any]], times: Sequence[float | None]) -> dict[str, Any]:
    """Return the JSON object of a run: that of its one picture, or the sums over a sequence and the list of frames.

    Of a sequence, outputs, seconds, rays and diagnostics are those of all frames; the rest is the last frame's.
    """
    run = dict(frames[-1])
    if len(frames) == 1:
        return run
    run["outputs"] = [path for frame in frames for path in frame["outputs"]]
    run["seconds"] = {stage: sum(frame["seconds"][stage] for frame in frames) for stage in run["seconds"]}
    run["rays"] = sum_rays([frame["rays"] for frame in frames])
    for kind in ("warnings", "notes"):
        run[kind] = list({tuple(record.values()): record for frame in frames for record in frame[kind]}.values())
    run["frames"] = [
        {"frame": time, **{key: frame[key] for key in ("outputs", "width", "height", "seconds", "rays")}}
        for time, frame in zip(times, frames, strict=True)
    ]
    return run


def summary_line(run: dict[str, Any], *, has_legend: bool = False) -> str:
    """Return what people want to know at the end.

    Args:
        run: As ``whole_run`` returns it.
        has_legend: Whether the picture is of a cost, enlarged perhaps and with a bar beside it.
    """
    seconds = run["seconds"]
    rays = sum(run["rays"][kind] for kind in _TRACED)
    where = run["device"] if run["device"] != "cpu" else f"cpu, {counted(run['threads'], 'thread')}"
    sizes = {(frame["width"], frame["height"]) for frame in run.get("frames", [run])}
    size = f"{run['width']} x {run['height']}" if len(sizes) == 1 else f"{len(sizes)} sizes"
    if has_legend:
        size = f"costs of {size} pixels"
    return (
        f"{_named(run['outputs'])}: {size}, {run['spp']} spp, "
        f"{_geometry(run)}, {counted(rays, 'ray')} in {seconds['render']:.2f} s on {where}; "
        f"{seconds['total']:.2f} s in all"
    )


def _named(files: Sequence[str]) -> str:
    """Return the names of files, of many those of the first and the last."""
    if len(files) > _NAMED:
        return f"{files[0]} to {files[-1]}, {len(files)} files"
    *others, last = files
    return f"{', '.join(others)} and {last}" if others else last


def _geometry(run: dict[str, Any]) -> str:
    """Return how many primitives there are; kinds of which there are none are left out, but not both."""
    counts = [(run["triangles"], "triangle"), (run["shapes"], "shape")]
    return ", ".join(counted(count, noun) for count, noun in counts if count) or counted(0, "triangle")


def sum_rays(counts: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return the counts of several pictures as one: sums, but the deepest level of any; levels add up one by one."""
    total = {key: sum(count[key] for count in counts) for key in counts[0] if key not in ("deepest", "per_depth")}
    levels = [
        {key: at[0][key] if key == "depth" else sum(level[key] for level in at) for key in at[0]}
        for rows in zip_longest(*(count["per_depth"] for count in counts))
        if (at := [level for level in rows if level is not None])
    ]
    return {**total, "deepest": max(count["deepest"] for count in counts), "per_depth": levels}
