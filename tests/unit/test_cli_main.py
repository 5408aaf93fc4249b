# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Which exit code each end has, and that it is told in one line. Nothing here renders."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import warp_rt.cli.doctor
import warp_rt.cli.info
import warp_rt.cli.render
from warp_rt import errors
from warp_rt.cli.main import COMMANDS, main
from warp_rt.cli.stand_in_options import stand_in
from warp_rt.cli.terminal import one_line

from ..processes import hear_interrupts


def _raising(error):
    def run(args, terminal):
        raise error

    return run


@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (errors.OptionError("depth: too deep"), 2, "warp-rt info: error: depth: too deep"),
        (errors.SceneError("a.usda: no prim"), 3, "warp-rt info: error: a.usda: no prim"),
        (errors.DeviceError("no such device"), 4, "warp-rt info: error: no such device"),
        (errors.LimitError("time limit"), 5, "warp-rt info: error: time limit"),
        (MemoryError(), 5, "warp-rt info: error: out of memory"),
        (
            RuntimeError("Failed to allocate 64 bytes on device 'cpu'"),
            5,
            "warp-rt info: error: out of memory: Failed to allocate 64 bytes on device 'cpu'",
        ),
        (errors.OutputError("a.png: disk full"), 6, "warp-rt info: error: a.png: disk full"),
        (KeyboardInterrupt(), 130, "warp-rt info: error: interrupted"),
    ],
)
def test_exit_codes(monkeypatch, capfd, error, code, line):
    monkeypatch.setattr(warp_rt.cli.info, "run", _raising(error))
    assert main(["info", "a.usda"]) == code
    assert capfd.readouterr() == ("", line + "\n")


def test_bug_is_one_line_and_a_traceback_only_when_asked_for(monkeypatch, capfd):
    monkeypatch.setattr(warp_rt.cli.info, "run", _raising(TypeError("a\nb")))
    assert main(["info", "a.usda"]) == 1
    err = capfd.readouterr().err
    assert err.startswith(r"warp-rt info: error: internal error: TypeError: a\nb")
    assert err.count("\n") == 1
    assert main(["info", "a.usda", "-v"]) == 1
    assert "Traceback (most recent call last)" in capfd.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["rendr"], "did you mean render?"),
        (["scene.usda"], "warp-rt render scene.usda"),
        (["xyz"], "there are render, record, series, tree, info"),
        (["--verzion"], "is no command"),
        (["render"], "render: error: missing: SCENE (see warp-rt render --help)\n"),
        (["help"], "'help' is no command; did you mean --help?\n"),
        (["render", "a.usda", "--cam", "x"], "unknown option --cam; did you mean -cam? (see"),
        (["render", "a.usda", "--heigth=3"], "unknown option --heigth; did you mean --height? (see"),
        (["render", "a.usda", "--resolution", "3"], "unknown option --resolution (see"),
        (["render", "a.usda", "--spp"], "render: error: --spp: a value is missing\n"),
        (["render", "a.usda", "--threshold", "low"], "render: error: --threshold: a number expected, got 'low'\n"),
        (["render", "a.usda", "--shadows", "Opaque"], "none of auto, opaque, transmit; did you mean opaque?\n"),
        (["render", "a.usda", "b.usda"], "render: error: unexpected 'b.usda' (see warp-rt render --help)\n"),
        (["render", "a.usda", "--dept", "3"], "unknown option --dept; did you mean --depth? (see"),
        (["render", "a.usda", "--width", "wide"], "render: error: --width: a whole number expected, got 'wide'\n"),
        (["render", "a.usda", "--width", "0"], "render: error: --width: 0 is outside 1..65536\n"),
        (["render", "a.usda", "--time-limit", "-1"], "render: error: --time-limit: -1.0 is outside"),
        (["render", "a.usda", "--camera", ""], "render: error: --camera: a name expected, got nothing\n"),
        (["render", "a.usda", "--purposes", "foo"], "--purposes: 'foo' is none of default, render, proxy, guide\n"),
        (["check", "a.usda", "--purposes", ""], "--purposes: at least one of default, render, proxy, guide expected"),
        (["render", "a.usda", "--ambient", "red"], "--ambient: R,G,B expected, such as 0.2,0.2,0.2, or one number"),
        (["render", "a.usda", "--height", "-1"], "height: -1 is outside"),
        (["render", "a.usda", "--width", "1000000000"], "width: 1000000000 is outside"),
        (["render", "a.usda", "--depth", "0"], "depth: 0 is outside"),
        (["render", "a.usda", "--spp", "0"], "spp: 0 is outside"),
        (["render", "a.usda", "--threshold", "-0.1"], "threshold: -0.1 is outside"),
        (["render", "a.usda", "--threshold", "nan"], "threshold: nan is outside"),
        (["render", "a.usda", "--bvh", "kd"], "--bvh: 'kd' is none of sah, median, midpoint, lbvh, ploc\n"),
        (["render", "a.usda", "--aov", "depth,beauty"], "'beauty' is none of color, depth"),
        (["render", "a.usda", "--aov", "dpeth"], "rays; did you mean depth?\n"),
        (["render", "a.usda", "--purposes", "rendr"], "guide; did you mean render?\n"),
        (["render", "a.usda", "--aov", ""], "--aov: a name expected, got nothing"),
        (["record", "a.usda", "a.png", "--aov", " "], "--aov: a name expected, got nothing"),
        (["render", "a.usda", "--lights-visible=3"], "--lights-visible: takes no value, got '3'"),
        (["render", "a.usda", "--crop", "-2,0,4,4"], "--crop: whole numbers x, y >= 0 and width, height >= 1 expected"),
        (["render", "a.usda", "--frames", "-3:-1x0"], "--frames"),
        (["render", "a.usda", "--crop", "1,2,3"], "--crop: X,Y,W,H expected, whole numbers, got '1,2,3'"),
        (["render", "a.usda", "--crop", "0,0,0,5"], "--crop: whole numbers x, y >= 0"),
        (["render", "a.usda", "--background", "1,2"], "--background: R,G,B expected"),
        (["render", "a.usda", "--ambient", "nan"], "ambient"),
        (["render", "a.usda", "--exposure", "1000"], "exposure: 1000.0 is outside"),
        (["render", "a.usda", "--frames", "1:2:3"], "--frames: '1:2:3' is written like none of"),
        (["render", "a.usda", "--frames", "1:2", "--default-time"], "--default-time: not together with --frames\n"),
        (["render", "a.usda", "--frames", "1:2", "-o", "a.png"], "exactly one placeholder"),
        (["render", "a.usda", "-o", "a.##.png"], "needs --frames"),
        (["render", "a.usda", "-o", "a.tiff"], "the extension must be one of .png, .jpg, .jpeg, .exr"),
        (["render", "a.usda", "-o", "a.png", "--aov", "depth"], "holds color"),
        (["doctor", "a.usda"], "unexpected 'a.usda'"),
        (["render", ""], "SCENE: a name expected, got nothing"),
        (["render", "a.usda", "-o", ""], "-o: a name expected, got nothing"),
        (["record", "a.usda", ""], "OUT: a name expected, got nothing"),
        (["series", "a.usda", "-o", ""], "-o: a name expected, got nothing"),
        (["render", "a.usda", "--mask", ""], "--mask: a name expected, got nothing"),
        (["render", "a.usda", "--mask", ","], "--mask: a name expected, got ','"),
        (["render", "a.usda", "--aov", ","], "--aov: a name expected, got ','"),
        (["render", "a.usda", "--exposure=--"], "--exposure: "),
        (["render", "a.usda", "--frames", "9" * 5000], "--frames: "),
        (["render", "a.usda", "--frames", "9007199254740994"], "is outside -9007199254740992..9007199254740992"),
        (["render", "a.usda", "--renderer", "GL"], "; warp-rt record takes it, here --integrator stands in for it"),
        (["render", "a.usda", "-color", "sRGB"], "option -color; warp-rt record takes it, here --tonemap stands in"),
        (["info", "a.usda", "--renderer=GL"], "unknown option --renderer; warp-rt record takes it (see"),
        (["check", "a.usda", "--disableCameraLight"], "--disableCameraLight; warp-rt record takes it (see"),
        (["render", "a.usda", "--ocioDisplay", "x"], "--ocioDisplay; there is no OpenColorIO, only --tonemap (see"),
        (["record", "a.usda", "a.png", "--ocioView=x"], "there is no OpenColorIO, only --colorCorrectionMode (see"),
        (["render", "a.usda", "--aov", "color,primvars:a:b,primvars:a_b"], "more than one AOV would have this name"),
    ],
)
def test_usage_errors_are_one_line_and_exit_2(capfd, monkeypatch, tmp_path, arguments, said):
    monkeypatch.chdir(tmp_path)
    assert main(arguments) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert said in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "error", "code"),
    [
        (["info", "a.usda", "--json"], errors.SceneError("a.usda: no\nprim"), 3),
        (["info", "a.usda", "--json"], KeyboardInterrupt(), 130),
        (["info", "--json"], None, 2),
        (["render", "a.usda", "--json", "--width", "0"], None, 2),
    ],
)
def test_failures_are_json_objects_where_one_is_awaited(monkeypatch, capfd, arguments, error, code):
    monkeypatch.setattr(warp_rt.cli.info, "run", _raising(error))
    assert main(arguments) == code
    out, err = capfd.readouterr()
    (kind, told), *more = json.loads(out).items()
    assert (kind, more, told["code"]) == ("error", [], code)
    assert err == f"warp-rt {arguments[0]}: error: {one_line(told['message'])}\n"


def test_a_result_is_the_only_object_even_if_the_end_is_bad(monkeypatch, capfd):
    def run(args, terminal):
        terminal.json({"is": "data"})
        raise errors.SceneError("--strict")

    monkeypatch.setattr(warp_rt.cli.info, "run", run)
    assert main(["info", "a.usda", "--json"]) == 3
    assert json.loads(capfd.readouterr().out) == {"is": "data"}


def test_no_command_shows_the_help_on_stderr(capfd):
    assert main([]) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert "usage: warp-rt COMMAND" in err
    assert err.splitlines()[-1] == "warp-rt: error: a command is missing; to render a stage: warp-rt render SCENE"


def test_help_goes_to_stdout(capfd):
    assert main(["--help"]) == 0
    out, err = capfd.readouterr()
    assert err == ""
    for command in COMMANDS:
        assert f"\n  {command} " in out
        assert main([command, "--help"]) == 0
        assert f"usage: warp-rt {command}" in capfd.readouterr().out


def test_options_that_others_stand_in_for_are_those_of_the_documentation():
    rows = (Path(__file__).parents[2] / "docs" / "usdrecord.md").read_text(encoding="utf-8").splitlines()
    documented = {
        option for row in rows if row.startswith("| `-") for option in re.findall("`(-[^`]+)`", row.split("|")[1])
    }
    ours = {option for action in warp_rt.cli.render.parser()._actions for option in action.option_strings}
    assert {option for option in documented if stand_in(option, ours)} == documented - ours


@pytest.mark.parametrize("command", COMMANDS)
def test_help_is_as_wide_as_the_terminal(monkeypatch, capfd, command):
    monkeypatch.setenv("COLUMNS", "80")
    assert main([command, "--help"]) == 0
    assert max(map(len, capfd.readouterr().out.splitlines())) <= 80
    assert main(["--help"]) == 0
    assert max(map(len, capfd.readouterr().out.splitlines())) <= 80


@pytest.mark.skipif(sys.platform == "win32", reason="a folder that is in use cannot be removed there")
@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["info", "a.usda"], 3, "a.usda: no such file"),
        (["render", "a.usda"], 6, "the current folder has been removed"),
        (["series", str(Path(__file__).parents[2] / "scenes" / "shapes.usda"), "-w", "8"], 6, "has been removed"),
    ],
)
def test_a_current_folder_that_is_gone_is_no_bug(monkeypatch, capfd, tmp_path, arguments, code, said):
    folder = tmp_path / "gone"
    folder.mkdir()
    monkeypatch.chdir(folder)
    folder.rmdir()
    assert main(arguments) == code
    err = capfd.readouterr().err
    assert err.count("\n") == 1
    assert said in err


def test_version_names_what_takes_part(capfd):
    assert main(["--version"]) == 0
    out = capfd.readouterr().out
    assert out.startswith(f"warp-rt {warp_rt.__version__} (warp 1.")
    for name in ("usd", "numpy", "python"):
        assert f", {name} " in out


def test_what_libraries_print_is_not_data(monkeypatch, capfd):
    def run(args, terminal):
        subprocess.run([sys.executable, "-c", "print('from native code')"], check=True)
        print("from Python")
        terminal.json({"is": "data"})
        return 0

    monkeypatch.setattr(warp_rt.cli.doctor, "run", run)
    assert main(["doctor", "--json"]) == 0
    out, err = capfd.readouterr()
    assert out == '{\n  "is": "data"\n}\n'
    assert "from native code" in err
    assert "from Python" in err


_WAITING = """
import sys, time
import warp_rt.cli.doctor
from warp_rt.cli.main import main
def run(args, terminal):
    print("ready", file=sys.stderr, flush=True)
    time.sleep(30)
warp_rt.cli.doctor.run = run
sys.exit(main(["doctor"]))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
@pytest.mark.parametrize(("sent", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signals_end_it_at_once(sent, code):
    process = subprocess.Popen(
        [sys.executable, "-c", _WAITING], stderr=subprocess.PIPE, text=True, preexec_fn=hear_interrupts
    )
    assert process.stderr.readline() == "ready\n"
    begin = time.monotonic()
    process.send_signal(sent)
    err = process.communicate(timeout=10)[1]
    assert time.monotonic() - begin < 5  # of 30
    assert process.returncode == code
    assert err.count("\n") == 1
    assert "error: " in err


@pytest.mark.skipif(sys.platform == "win32", reason="a POSIX shell is needed")
@pytest.mark.parametrize("redirection", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-", "| true", "2>&1 | true"])
def test_closed_standard_streams_are_no_trouble(redirection):
    command = f"{sys.executable} -m warp_rt doctor {redirection}"
    result = subprocess.run(["bash", "-c", f"set -o pipefail; {command}"], capture_output=True, text=True, timeout=60)
    assert result.returncode == 0
    assert "Traceback" not in result.stderr
    assert "Exception" not in result.stderr


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="/dev/full is Linux's")
@pytest.mark.parametrize("is_unbuffered", ["", "1"])
@pytest.mark.parametrize("arguments", ["--version", "doctor", "doctor --help"])
def test_full_stdout_exits_6(arguments, is_unbuffered):
    result = subprocess.run(
        ["bash", "-c", f"{sys.executable} -m warp_rt {arguments} > /dev/full; echo $?"],
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONUNBUFFERED": is_unbuffered},
    )
    assert result.stdout == "6\n"
    assert result.stderr.endswith(": error: standard output: cannot write: No space left on device\n")
    assert result.stderr.count("\n") == 1


@pytest.mark.skipif(sys.platform == "win32", reason="a POSIX shell is needed")
@pytest.mark.parametrize("is_unbuffered", ["", "1"])
def test_a_reader_that_has_left_is_no_error(is_unbuffered):
    command = f"set -o pipefail; (sleep 0.2; {sys.executable} -m warp_rt --help) | true"
    environment = os.environ | {"PYTHONUNBUFFERED": is_unbuffered}
    result = subprocess.run(["bash", "-c", command], capture_output=True, text=True, env=environment)
    assert (result.returncode, result.stderr) == (0, "")
