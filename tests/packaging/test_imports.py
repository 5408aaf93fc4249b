# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What is loaded before there is anything to render."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

HEAVY = ("warp", "pxr", "numpy", "PIL", "OpenEXR", "rich")

MODULES = "import sys\nprint('modules:', *sys.modules)"


def _modules(code):
    """Return the names of all modules that are loaded after some code has run."""
    result = subprocess.run([sys.executable, "-c", f"{code}\n{MODULES}"], check=True, capture_output=True, text=True)
    heading, *names = result.stdout.splitlines()[-1].split()
    assert heading == "modules:"
    return set(names)


@pytest.mark.parametrize(
    ("code", "own"),
    [
        ("import warp_rt", 2),
        ("from warp_rt.cli.main import main; main(['--help'])", 10),
        ("from warp_rt.cli.main import main; main(['render', '--help'])", 30),
    ],
    ids=["import", "help", "render help"],
)
def test_answers_at_once(code, own):
    """For next to nothing is loaded: modules of Python's own, few of ours. ``benchmarks startup`` tells the time."""
    loaded = _modules(code) - _modules("")
    ours = {name for name in loaded if name.partition(".")[0] == "warp_rt"}
    assert {name.partition(".")[0] for name in loaded - ours} <= sys.stdlib_module_names
    assert len(ours) <= own


@pytest.mark.parametrize(
    "code",
    [
        "import warp_rt",
        "import warp_rt; dir(warp_rt)",
        "from warp_rt.cli.main import main; main(['--help'])",
        *(
            f"from warp_rt.cli.main import main; main(['{command}', '--help'])"
            for command in ("render", "info", "check", "warmup", "doctor")
        ),
        "from warp_rt.cli.main import main; main(['render', 'a.usda', '--depth', '0'])",
    ],
)
def test_nothing_heavy_is_loaded(code):
    report = f"{code}\nimport sys\nprint('loaded:', *(name for name in {HEAVY} if name in sys.modules))"
    result = subprocess.run([sys.executable, "-c", report], check=True, capture_output=True, text=True)
    assert result.stdout.splitlines()[-1] == "loaded:"


def test_import_prints_nothing():
    code = "import warp_rt, warp_rt.rendering.renderer, warp_rt.usd.load, warp_rt.image.image"
    result = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
    assert (result.stdout, result.stderr) == (b"", b"")


def test_kernels_need_neither_host_code_nor_pxr():
    unwanted = {"pxr", "warp_rt.scene", "warp_rt.rendering.renderer"}
    code = f"import sys, warp_rt.kernels.vector; print(sorted({unwanted} & set(sys.modules)))"
    result = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert result.stdout == "[]\n"


def test_every_public_name_arrives():
    code = "import warp_rt\nfor name in warp_rt.__all__: getattr(warp_rt, name)\nprint(len(warp_rt.__all__))"
    result = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert int(result.stdout) > 10


def test_kernels_refuse_another_name():
    result = subprocess.run([sys.executable, "-c", "import kernels"], cwd=ROOT, capture_output=True, text=True)
    assert result.returncode == 1
    assert "import warp_rt.kernels, not kernels" in result.stderr
