# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Binaries of render kernels are known by what they were compiled from, and launched without it."""

import errno
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import warp as wp

from warp_rt import device, errors, kernels
from warp_rt.device import compile_notice, kernel_binaries
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
    return kernel_binaries._text_digest(folder / "main.py")


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


@pytest.mark.parametrize(
    ("name", "value", "counts"),
    [
        ("mode", "debug", True),
        ("verify_cuda", ["a", "list"], True),
        ("log_level", 12345, False),
    ],
)
def test_a_binary_depends_on_the_settings_that_it_was_compiled_with(
    name: str, value: object, counts: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = kernel_binaries._folder(render_plain, b"")
    monkeypatch.setattr(wp.config, name, value)
    assert (kernel_binaries._folder(render_plain, b"") != before) == counts


def test_a_binary_depends_on_the_options_of_its_module() -> None:
    """Warp copies some settings into them when a file is imported, and others may be set for a file alone."""
    before = kernel_binaries._folder(render_plain, b"")
    options = wp.get_module_options(render_plain)
    try:
        wp.set_module_options({"max_unroll": options["max_unroll"] + 1}, module=render_plain)
        assert kernel_binaries._folder(render_plain, b"") != before
    finally:
        wp.set_module_options({"max_unroll": options["max_unroll"] - 1}, module=render_plain)
    assert kernel_binaries._folder(render_plain, b"") == before


@pytest.mark.parametrize(
    ("first", "second", "is_same"),
    [
        ({"b": [1], "a": 2}, {"a": 2, "b": [1]}, True),
        ({"b": [1], "a": 2}, {"b": [2], "a": 2}, False),
        ({"of", "no", "order"}, {"order", "no", "of"}, True),
        ({"x"}, set(), False),
        (["x", "y"], ["y", "x"], False),
    ],
)
def test_a_setting_is_told_from_others_by_what_is_in_it(first: object, second: object, is_same: bool) -> None:
    assert (kernel_binaries._text(first) == kernel_binaries._text(second)) == is_same


MAIN = """
import warp as wp
wp.set_module_options({"enable_backward": False})
def import_body():
    global number
    from .near import number
@wp.kernel
def store(out: wp.array[float]):
    out[0] = number()
"""
NEAR = """
import warp as wp
@wp.func
def number():
    return 1.0
"""
LOAD = """
import sys
from importlib import import_module
from pathlib import Path
import warp as wp
wp.config.log_level = wp.LOG_WARNING
wp.config.use_precompiled_headers = False  # to make one takes longer than to do without
wp.init()
from warp_rt.device import kernel_binaries
from warp_rt.kernels import main
def edit():
    near = Path(main.__file__).with_name("near.py")
    near.write_text(near.read_text().replace("1.0", "2.0"))
moment = sys.argv[1]
is_loaded, import_body = kernel_binaries._is_loaded, main.import_body
if moment == "before the digest":
    import_module("warp_rt.kernels.near")
    edit()
elif moment == "after the digest":
    kernel_binaries._is_loaded = lambda *arguments: (is_loaded(*arguments), edit())[0]
elif moment == "after the import":
    main.import_body = lambda: (import_body(), edit())
for _ in range(2):
    kernel_binaries.load_module(main, "cpu")
out = wp.zeros(1, device="cpu")
wp.launch(main.store, 1, [out], device="cpu")
print(out.numpy()[0])
"""


@pytest.fixture
def house(tmp_path: Path) -> Path:
    """A folder with a package of two small kernel files, which are loaded as ours are."""
    (tmp_path / "warp_rt" / "kernels").mkdir(parents=True)
    (tmp_path / "warp_rt" / "__init__.py").touch()
    (tmp_path / "warp_rt" / "device").mkdir()
    shutil.copy(str(errors.__file__), tmp_path / "warp_rt")
    for module in (device, compile_notice, kernel_binaries):
        shutil.copy(str(module.__file__), tmp_path / "warp_rt" / "device")
    shutil.copyfile(str(kernels.__file__), tmp_path / "warp_rt" / "kernels" / "__init__.py")
    (tmp_path / "warp_rt" / "kernels" / "main.py").write_text(MAIN)
    (tmp_path / "warp_rt" / "kernels" / "near.py").write_text(NEAR)
    return tmp_path


def load(house: Path, moment: str = "never", path: str = "") -> float:
    """Return what the kernel stores in a process that edits its file at some moment."""
    environment = os.environ | {"PYTHONPATH": str(house / path), "WARP_CACHE_PATH": str(house / "cache")}
    command = [sys.executable, "-P", "-c", LOAD, moment]
    return float(subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True).stdout)


@pytest.mark.parametrize(
    ("moment", "imported"), [("before the digest", 1.0), ("after the digest", 2.0), ("after the import", 1.0)]
)
def test_what_was_imported_before_an_edit_is_not_kept_for_what_is_there_after_it(
    moment: str, imported: float, house: Path
) -> None:
    assert load(house, moment) == imported
    assert load(house) == 2.0
    near = house / "warp_rt" / "kernels" / "near.py"
    near.write_text(NEAR)
    assert load(house) == 1.0


def test_a_damaged_binary_is_compiled_again(house: Path) -> None:
    assert load(house) == 1.0
    (binary,) = house.glob("cache/**/wp_warp_rt.kernels.main_*/*.o")
    whole = binary.stat().st_size
    binary.write_bytes(binary.read_bytes()[:100])
    assert load(house) == 1.0
    assert binary.stat().st_size == whole


def test_a_cache_that_cannot_be_written_is_named_and_left_clean(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(wp.config, "kernel_cache_dir", str(tmp_path))

    def full(*arguments: object, **options: object) -> None:
        (tmp_path / f"wp_any_p{os.getpid()}_t1").mkdir()
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(wp, "compile_aot_module", full)
    with pytest.raises(errors.OutputError, match=r"cannot write kernels: No space left on device; WARP_CACHE_PATH"):
        kernel_binaries.load_module(render_plain, "cpu")
    assert not list(tmp_path.iterdir())


def test_kernels_in_an_archive_are_loaded_as_warp_does(house: Path) -> None:
    shutil.make_archive(str(house / "house"), "zip", house, "warp_rt")
    assert load(house, path="house.zip") == 1.0
    (binary,) = house.glob("cache/**/wp_warp_rt.kernels.main_*/*.o")
    binary.write_bytes(b"")
    assert load(house, path="house.zip") == 1.0
    assert binary.stat().st_size > 0


def test_it_is_cleared_with_those_of_warp() -> None:
    """``wp.clear_kernel_cache`` removes the folders whose names begin so."""
    folder = kernel_binaries._folder(render_plain, b"")
    assert folder.name.startswith("wp_")
    assert folder.parent == Path(wp.config.kernel_cache_dir)
