# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What is loaded, and how long it takes, before there is anything to render."""

import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

HEAVY = ("warp", "pxr", "numpy", "PIL", "OpenEXR", "rich")

LIMIT_SECONDS = 0.2
ATTEMPTS = 7  # the fastest counts: whatever else the machine does only ever slows a run down


def _fastest(command):
    times = []
    for _ in range(ATTEMPTS):
        begin = time.perf_counter()
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        times.append(time.perf_counter() - begin)
    return min(times)


@pytest.mark.parametrize(
    "command",
    [
        ["-c", "import warp_rt"],
        ["-m", "warp_rt", "--help"],
        ["-m", "warp_rt", "render", "--help"],
    ],
    ids=["import", "help", "render help"],
)
def test_answers_at_once(command):
    assert _fastest([sys.executable, *command]) < LIMIT_SECONDS


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
