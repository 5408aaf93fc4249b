# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Large stages from the file to the first picture: seconds of each step, and the memory that it takes (Linux).

    python -m benchmarks scale
    python -m benchmarks scale --forms plain deep --count 100000

Each stage is read, prepared and rendered by a process of its own, which has loaded its libraries and kernels before
the clock starts. ``load`` counts from the file to the Scene, ``open`` is what OpenUSD takes of that to compose the
stage, once more when all is done: what a closed stage leaves free would hide what the scene takes. ``load_mb`` is what
the process has grown by when the scene is loaded and what is free is given back to the system, ``growth_mb`` the most
that it has grown by from the first to the last step, ``peak_mb`` the most that it ever held, libraries and all
(``VmHWM``, for ``ru_maxrss`` begins with that of the process that starts it).
"""

from __future__ import annotations

import gc
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from . import results
from .command import make_parser, save_if_asked
from .memory import resident_bytes
from .scale_stages import FORMS, write

KEYS = ("form", "count")
COUNTS = {"instancer": 1_000_000, "triangles": 10_000_000}
GPRIMS = 100_000
WIDTH = 256


def main(arguments: Sequence[str]) -> None:
    """Print the table, and save its rows where asked to."""
    parser = make_parser("scale", __doc__, rounds=3)
    parser.add_argument("--forms", nargs="+", choices=FORMS, default=list(FORMS))
    parser.add_argument("--count", type=int, help="gprims, instances or triangles instead of the table's own")
    parser.add_argument("--folder", type=Path, help="where stages are written, and kept; those that are there are used")
    parser.add_argument("--alone", type=Path, metavar="STAGE", help="one stage in this process, as JSON")
    options = parser.parse_args(arguments)
    if options.alone:
        print(json.dumps(measure_alone(options.alone)))
        return
    rows = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.folder or Path(temporary)
        for form in options.forms:
            count = options.count or COUNTS.get(form, GPRIMS)
            path = folder / f"{form}-{count}.usdc"
            if not path.exists():
                write(form, count, path)
            turns = [measure(path) for _ in range(options.rounds)]
            # The round of the median load: times and memory of one and the same process.
            best = sorted(turns, key=lambda turn: turn["load"])[len(turns) // 2]
            rows.append({"form": form, "count": count, **best, "prims_per_second": round(count / best["load"])})
            print(f"{form:<10} {count:>10,}  {'  '.join(f'{k} {v:,}' for k, v in rows[-1].items() if k not in KEYS)}")
            sys.stdout.flush()
    save_if_asked(options, "scale", rows, KEYS)


def measure(path: Path) -> dict[str, float]:
    """Return the figures of one stage, from a process of its own."""
    command = [sys.executable, "-m", "benchmarks", "scale", "--alone", str(path)]
    run = subprocess.run(command, cwd=results.ROOT, check=True, stdout=subprocess.PIPE, text=True)
    figures: dict[str, float] = json.loads(run.stdout.splitlines()[-1])
    return figures


def measure_alone(path: Path) -> dict[str, float]:
    """Return seconds and megabytes of loading, preparing and rendering a stage in this process."""
    from pxr import Usd

    from warp_rt.api import load_scene
    from warp_rt.device.host_memory import give_back_freed
    from warp_rt.options import RenderOptions
    from warp_rt.rendering.renderer import Renderer

    options = RenderOptions(width=WIDTH)
    teapot = load_scene(results.ROOT / "scenes" / "mirror_teapot.usda")
    Renderer(teapot, RenderOptions(width=8), device="cpu").render()  # loads libraries and kernels
    del teapot
    gc.collect()
    give_back_freed()
    before = resident_bytes("VmRSS")
    start = time.perf_counter()
    scene = load_scene(path)
    seconds = {"open": 0.0, "load": time.perf_counter() - start}
    give_back_freed()
    loaded = resident_bytes("VmRSS") - before
    start = time.perf_counter()
    renderer = Renderer(scene, options, device="cpu")
    seconds["prepare"] = time.perf_counter() - start
    kept = resident_bytes("VmRSS") - before
    start = time.perf_counter()
    renderer.render()
    seconds["render"] = time.perf_counter() - start
    peak = resident_bytes("VmHWM")
    del scene, renderer
    gc.collect()
    start = time.perf_counter()
    stage = Usd.Stage.Open(str(path), Usd.Stage.LoadAll)
    seconds["open"] = time.perf_counter() - start
    del stage
    sizes = {"load_mb": loaded, "kept_mb": kept, "growth_mb": peak - before, "peak_mb": peak}
    figures = {name: float(f"{value:.3g}") for name, value in seconds.items()}
    return figures | {name: round(size / 1e6) for name, size in sizes.items()}
