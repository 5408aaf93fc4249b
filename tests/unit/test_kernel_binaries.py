# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Binaries of render kernels are known by what they were compiled from, and launched without it."""

import subprocess
import sys
from pathlib import Path

import pytest
import warp as wp

from warp_rt.device import kernel_binaries
from warp_rt.kernels import render_plain
from warp_rt.warp_setup import init_warp

init_warp()

RENDER = """
import sys
import numpy as np
from warp_rt import Renderer, RenderOptions, Scene
triangle = Scene.from_arrays(np.eye(3, dtype=np.float32), [[0, 1, 2]])
print(Renderer(triangle, RenderOptions(width=8, height=8), device="cpu").render().color.tobytes().hex())
print("warp_rt.kernels.shading" in sys.modules)
"""


def test_a_second_process_renders_the_same_without_the_functions_of_its_kernel() -> None:
    first, second = (
        subprocess.run([sys.executable, "-c", RENDER], capture_output=True, text=True, check=True).stdout.split()
        for _ in range(2)
    )
    assert second == [first[0], "False"]


def digest_of(folder: Path, **texts: str) -> bytes:
    """Return the digest of ``main.py`` beside other files."""
    folder.mkdir()
    for name, text in texts.items():
        (folder / f"{name}.py").write_text(text)
    return kernel_binaries._source_digest(str(folder / "main.py"))


def test_a_binary_depends_on_the_text_of_all_that_its_file_imports(tmp_path: Path) -> None:
    texts = {
        "main": "from .near import a\ndef import_body():\n    from .inside import b\n",
        "near": "from .far import c\n",
        "inside": "from .far import d\n",
        "far": "from .near import a\n",  # a circle ends, too
        "other": "",
    }
    first = digest_of(tmp_path / "first", **texts)
    assert digest_of(tmp_path / "copy", **texts) == first
    assert digest_of(tmp_path / "other", **texts | {"other": "x = 1\n"}) == first
    changed = {digest_of(tmp_path / name, **texts | {name: texts[name] + "#\n"}) for name in list(texts)[:-1]}
    assert len(changed | {first}) == 5


@pytest.mark.parametrize(("name", "value", "counts"), [("mode", "debug", True), ("log_level", 12345, False)])
def test_a_binary_depends_on_the_settings_that_it_was_compiled_with(
    name: str, value: object, counts: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = kernel_binaries._folder(render_plain)
    monkeypatch.setattr(wp.config, name, value)
    assert (kernel_binaries._folder(render_plain) != before) == counts


def test_it_is_cleared_with_those_of_warp() -> None:
    """``wp.clear_kernel_cache`` removes the folders whose names begin so."""
    folder = kernel_binaries._folder(render_plain)
    assert folder.name.startswith("wp_")
    assert folder.parent == Path(wp.config.kernel_cache_dir)
