# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Every kernel compiles for NVIDIA GPUs, on a machine without one: Warp brings the compiler along."""

from __future__ import annotations

import importlib
import pkgutil
from pathlib import Path
from types import ModuleType

import pytest
import warp as wp

import warp_rt.kernels
from warp_rt.warp_setup import init_warp

init_warp()


def kernels_of(file: ModuleType) -> list[wp.Kernel]:
    """Return the kernels that a file defines itself."""
    members = [member for member in vars(file).values() if isinstance(member, wp.Kernel)]
    return [kernel for kernel in members if kernel.func.__module__ == file.__name__]


FILES = [
    importlib.import_module(f"warp_rt.kernels.{info.name}") for info in pkgutil.iter_modules(warp_rt.kernels.__path__)
]
KERNEL_FILES = [file for file in FILES if kernels_of(file)]

# Nobody launches these on a GPU, where each pixel's tree is walked by the same functions; up to 90 seconds each.
FOR_CPUS = {"render_together", "render_together_plain"}


def test_kernels_were_found() -> None:
    names = {file.__name__.rsplit(".", 1)[1] for file in KERNEL_FILES}
    assert {"bvh_build", "bvh_clusters", "bvh_collapse", "bvh_instances", "query", "render"} <= names


@pytest.mark.parametrize("arch", [80, 90])
@pytest.mark.parametrize(
    "file",
    [
        pytest.param(file, marks=[pytest.mark.heavy] if file.__name__.rsplit(".", 1)[1] in FOR_CPUS else [])
        for file in KERNEL_FILES
    ],
    ids=lambda file: file.__name__,
)
def test_file_compiles_to_ptx(file: ModuleType, arch: int, tmp_path: Path) -> None:
    if hasattr(file, "import_body"):
        file.import_body()
    wp.compile_aot_module(file, arch=arch, module_dir=tmp_path, use_ptx=True)
    text = "".join(path.read_text() for path in tmp_path.glob("*.ptx"))
    assert f".target sm_{arch}" in text
    for kernel in kernels_of(file):
        assert f".entry {kernel.key}" in text


@pytest.mark.parametrize("file", KERNEL_FILES, ids=lambda file: file.__name__)
def test_options_of_rendering_kernels(file: ModuleType) -> None:
    """No adjoint code: nine times the compile time. No contraction: the triangle test would leak on a GPU."""
    options = wp.get_module_options(file)
    assert options["enable_backward"] is False
    assert options["fuse_fp"] is False
