# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Build the tutorial: take the code that its pages show from the source, and make its pictures.

    python docs/tutorial/build.py               # the code
    python docs/tutorial/build.py --pictures    # and the pictures: a minute

A page says what code it shows in a comment above the block, and this script fills in the block:

    <!-- code: kernels/vector.py reflect -->
    <!-- code: kernels/tree_node.py visit_node: local = ... return local -->

The first shows a function without its docstring; the second the lines of one from the first that holds the words
before the dots to the next that holds those after them.
"""

from __future__ import annotations

import argparse
import ast
import inspect
import re
import textwrap
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
IMAGES = HERE / "images"

_BLOCK = re.compile(r"(<!-- code: (\S+) (\w+)(?:: (.+?) \.\.\. (.+?))? -->\n)```python\n.*?```", re.DOTALL)


def function_lines(path: Path, name: str) -> list[str]:
    """Return the source of a function without its decorators and docstring."""
    source = path.read_text(encoding="utf-8")
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef) and node.name == name:
            lines = source.splitlines()
            body = node.body[1:] if ast.get_docstring(node) is not None else node.body
            head = lines[node.lineno - 1 : node.body[0].lineno - 1]
            return textwrap.dedent("\n".join(head + lines[body[0].lineno - 1 : node.end_lineno])).splitlines()
    raise LookupError(f"{path.name}: no function {name}")


def part(lines: list[str], first: str, last: str) -> list[str]:
    """Return the lines from the first that holds ``first`` to the next that holds ``last``, without their indent."""
    start = next((i for i, line in enumerate(lines) if first in line), None)
    if start is None:
        raise LookupError(f"no line holds {first!r}")
    end = next((i for i, line in enumerate(lines) if i >= start and last in line), None)
    if end is None:
        raise LookupError(f"no line from {first!r} on holds {last!r}")
    return textwrap.dedent("\n".join(lines[start : end + 1])).splitlines()


def build_page(text: str) -> str:
    """Return a page with its blocks of code as the source has them now."""

    def block(match: re.Match[str]) -> str:
        marker, file, name, first, last = match.groups()
        lines = function_lines(ROOT / file, name)
        if first:
            lines = part(lines, first, last)
        return marker + "```python\n" + "\n".join(lines) + "\n```"

    return _BLOCK.sub(block, text)


def make_pictures() -> None:
    """Render every picture into the folder that the pages link to."""
    import pictures

    IMAGES.mkdir(exist_ok=True)
    for name, function in inspect.getmembers(pictures, inspect.isfunction):
        if function.__module__ == "pictures" and not name.startswith("_"):
            function().save(IMAGES / f"{name}.jpg", quality=88)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Build the tutorial.")
    parser.add_argument("--pictures", action="store_true", help="make the pictures too")
    if parser.parse_args().pictures:
        make_pictures()
    for page in sorted(HERE.glob("*.md")):
        page.write_text(build_page(page.read_text(encoding="utf-8")), encoding="utf-8")
