# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Floors under lights of every type, each parameter swept, beside float64 sums of what the schema says they send out.

    python -m benchmarks radiometry
    python -m benchmarks radiometry --only SphereLight --only cone --samples 0

Each frame is rendered with lights as a whole (0 samples), and sampled. Printed for each sweep: by how much the mean of
a picture is off, and by how much a pixel, in the worst frame; away from the terminator, which is to say where it gets
at least a fiftieth of what the brightest pixel gets. Sampled pixels have noise: of them the root mean square is told.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path

import numpy as np

from warp_rt import Renderer, RenderOptions
from warp_rt.api import open_scene
from warp_rt.warp_setup import init_warp

from . import light_sweeps, mesh_sweeps, solid_sweeps
from .command import make_parser, save_if_asked
from .light_files import write_files
from .light_floor import LightFrame, floor_points
from .results import Row

KEYS = ("light", "sweep", "samples")
ACROSS = 12  # pixels, and down: even, so that none lies in a plane of symmetry
SWEEPS = {"MeshLight": mesh_sweeps, "LightAPI": solid_sweeps}
"""Modules of what is no light of its own; all others are of ``light_sweeps``."""
TERMINATOR = 0.02  # of the brightest pixel


def main(arguments: Sequence[str]) -> None:
    """Print the errors of each sweep, then of each light as a table; save the former where asked to."""
    parser = make_parser("radiometry", __doc__)
    parser.add_argument("--only", action="append", default=[], help="a pattern that light and sweep match")
    parser.add_argument("--samples", action="append", type=int, default=[], help="light samples (default: 0, 256)")
    options = parser.parse_args(arguments)
    counts = options.samples or [0, 256]
    init_warp()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        files = write_files(Path(folder))
        for light, name, frames in all_sweeps(files):
            if all(re.search(word, f"{light} {name}") for word in options.only):
                rows += _sweep(light, name, frames, counts)
    for line in summary(rows, counts):
        print(line)
    save_if_asked(options, "radiometry", rows, KEYS)


def all_sweeps(files: Mapping[str, Path]) -> Iterator[tuple[str, str, list[LightFrame]]]:
    """Yield each type of light, what is swept, and the frames; see ``light_sweeps.sweeps``."""
    return chain(*(module.sweeps(files) for module in (light_sweeps, *SWEEPS.values())))


def summary(rows: Sequence[Row], counts: Sequence[int]) -> Iterator[str]:
    """Yield the worst of each light's sweeps as the lines of a Markdown table."""
    heads = [f"{count} samples: mean | {'pixel' if count == 0 else 'root mean square of pixels'}" for count in counts]
    yield " | ".join(["| light | sweeps, frames", *heads]) + " |"
    yield "|---" * (2 + 2 * len(counts)) + "|"
    for light in dict.fromkeys(row["light"] for row in rows):
        own = [row for row in rows if row["light"] == light]
        first = [row for row in own if row["samples"] == counts[0]]
        cells = [light, f"{len(first)}, {sum(row['frames'] for row in first)}"]
        for count in counts:
            these = [row for row in own if row["samples"] == count]
            spread = "pixel" if count == 0 else "rms"
            cells += [f"{max(abs(row[key]) for row in these):.2%}" for key in ("mean", spread)]
        yield "| " + " | ".join(cells) + " |"


def _sweep(light: str, name: str, frames: Sequence[LightFrame], counts: Sequence[int]) -> list[Row]:
    module = SWEEPS.get(light, light_sweeps)
    truth = [module.expected(frame, floor_points(ACROSS)) for frame in frames]
    scenes = open_scene(module.make_stage(frames), render_pass=module.PASS)
    rows = []
    for count in counts:
        options = RenderOptions(width=ACROSS, height=ACROSS, light_samples=count)
        films = [Renderer(scenes.scene(k), options, device="cpu").render() for k in range(len(frames))]
        errors = [errors_of(film.color.reshape(-1, 3), exact) for film, exact in zip(films, truth, strict=True)]
        worst = [max((error[k] for error in errors), key=abs) for k in range(3)]
        row = {"light": light, "sweep": name, "samples": count, "frames": len(frames)}
        rows.append(row | {key: round(value, 6) for key, value in zip(("mean", "pixel", "rms"), worst, strict=True)})
    text = "  ".join(f"{r['samples']:>4}: {r['mean']:8.3%} {r['pixel']:8.2%} {r['rms']:7.2%}" for r in rows)
    print(f"{light:14}{name:28}{text}", flush=True)
    return rows


def errors_of(found: np.ndarray, exact: np.ndarray) -> tuple[float, float, float]:
    """Return the relative errors of the mean and of the worst pixel, and the root mean square of the pixels'.

    Args:
        found: shape [n, 3].
        exact: Likewise. Where all of it is black, what is found is the error.
    """
    if not exact.any():
        return (float(np.abs(found).max()),) * 3
    relative = found.astype(float) / np.where(exact > 0, exact, np.inf) - 1
    relative = relative[exact >= np.maximum(TERMINATOR * exact.max(axis=0), 1e-30)]
    return (
        float(found.mean(dtype=float) / exact.mean() - 1),
        float(relative[np.abs(relative).argmax()]),
        float(np.sqrt((relative**2).mean())),
    )
