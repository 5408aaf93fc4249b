# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``python -m benchmarks NAME [options]``; without a name, what there is."""

from __future__ import annotations

import importlib
import sys

NAMES = {
    "rays": "rays per second by mesh and kind of ray, beside Embree and wp.Mesh",
    "build": "seconds to build a hierarchy, beside Embree and wp.Mesh",
    "memory": "bytes a triangle of geometry and hierarchy, beside Embree and wp.Mesh",
    "frame": "CPU seconds of a whole frame, beside POV-Ray and Mitsuba",
    "povray": "pictures and ray counts beside POV-Ray",
    "spd": "ray counts of the Standard Procedural Databases, beside the published ones",
    "references": "silhouettes beside reference pictures by other renderers",
    "radiometry": "floors under lights of every type, each parameter swept, beside float64 sums",
    "scaling": "a frame by threads, triangles, resolution and depth; rays per second by instances",
    "scale": "large stages from the file to the first picture: seconds and memory",
    "startup": "whole processes, warm and cold",
    "leaks": "a hundred million rays aimed at edges and vertices",
    "counters": "instructions, cycles and misses a ray, where the machine tells them",
    "hierarchies": "tests and time a ray: brute force, four builders, boxes and spheres",
    "plots": "pictures of the saved results, in docs/performance/",
}


def main() -> None:
    """Run the benchmark that the command line names."""
    name = sys.argv[1] if len(sys.argv) > 1 else ""
    if name not in NAMES:
        print(__doc__, *(f"{key:<13}{text}" for key, text in NAMES.items()), sep="\n")
        raise SystemExit(0 if name in ("", "-h", "--help") else 2)
    importlib.import_module(f"benchmarks.{name}").main(sys.argv[2:])


if __name__ == "__main__":
    main()
