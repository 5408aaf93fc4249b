# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The tutorial shows the code that there is, and every picture that it makes."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]
TUTORIAL = ROOT / "docs" / "tutorial"
PAGES = sorted(TUTORIAL.glob("*.md"))


def _load(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(f"tutorial_{name}", TUTORIAL / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_code_is_the_sources(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert _load("build").build_page(text) == text, "python docs/tutorial/build.py brings it up to date"


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.name)
def test_every_marker_has_its_block(page: Path) -> None:
    """A marker that the build passes over would keep its old code for ever."""
    text = page.read_text(encoding="utf-8")
    assert text.count("<!-- code:") == len(re.findall(r"<!-- code: [^\n]+ -->\n```python\n(?!```)", text))


def test_a_drifted_page_is_mended() -> None:
    build = _load("build")
    page = "<!-- code: kernels/vector.py reflect -->\n```python\nold\n```\n"
    assert "2.0 * wp.dot(direction, normal)" in build.build_page(page)
    with pytest.raises(LookupError, match="no function"):
        build.build_page(page.replace("reflect", "deflect"))


def test_pictures_are_shown() -> None:
    makers = re.findall(r"^def ([a-z]\w+)", (TUTORIAL / "pictures.py").read_text(encoding="utf-8"), re.MULTILINE)
    pages = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    for name in makers:
        assert (TUTORIAL / "images" / f"{name}.jpg").exists(), f"{name}: python docs/tutorial/build.py --pictures"
        assert f"images/{name}.jpg" in pages


def test_the_python_of_the_pages_runs() -> None:
    """What stands there to be typed; the blocks above which a comment names their source are not."""
    for page in PAGES:
        for block in re.findall(r"(?<!-->\n)```python\n(import.*?)```", page.read_text(encoding="utf-8"), re.DOTALL):
            names: dict[str, object] = {}
            exec(block, names)
            if "hit" in names:
                hit = names["hit"]
                assert (hit.t, round(hit.u, 6), round(hit.v, 6)) == (1.0, 0.2, 0.3)
