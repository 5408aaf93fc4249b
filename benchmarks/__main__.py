# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``python -m benchmarks NAME [options]``; without a name, what there is."""

from __future__ import annotations

import importlib
import sys

NAMES = {
    "rays": "rays per second by mesh and kind of ray, beside Embree and wp.Mesh",
}


def main() -> None:
    """Run the benchmark that the command line names."""
    name = sys.argv[1] if len(sys.argv) > 1 else ""
    if name not in NAMES:
        print(__doc__, *(f"{key:<10}{text}" for key, text in NAMES.items()), sep="\n")
        raise SystemExit(0 if name in ("", "-h", "--help") else 2)
    importlib.import_module(f"benchmarks.{name}").main(sys.argv[2:])


if __name__ == "__main__":
    main()
