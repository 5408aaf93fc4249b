# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What is told, how loudly, in which colour."""

import io
import json
import sys

import pytest

from warp_rt.cli.terminal import Terminal, one_line, wants_color
from warp_rt.errors import OutputError
from warp_rt.report import GROUP_LIMIT, Diagnostic


def _many(code, count):
    return [Diagnostic(code, f"/World/Mesh{index}", "ignored") for index in range(count)]


def test_each_diagnostic_is_one_line(capsys):
    records = [Diagnostic("W101", "/World/A\nB", "two\nlines"), Diagnostic("N901", "a.usda", "framed")]
    Terminal("warp-rt").diagnostics(records)
    out, err = capsys.readouterr()
    assert out == ""
    assert err.splitlines() == [
        r"warning: W101 /World/A\nB: two\nlines",
        "note: N901 a.usda: framed",
    ]


def test_long_groups_are_cut_short_and_say_so(capsys):
    Terminal("warp-rt").diagnostics([*_many("W101", GROUP_LIMIT + 5), *_many("W102", GROUP_LIMIT)])
    lines = capsys.readouterr().err.splitlines()
    group = [line for line in lines if "W101" in line]
    assert len(group) == 4
    assert group[-1] == "warning: W101: and 22 more of this kind (-v names them all)"
    assert sum("W102" in line for line in lines) == GROUP_LIMIT


def test_notes_of_the_same_words_are_one_line(capsys):
    records = [*_many("N917", 3), Diagnostic("N917", "/World/A", "other words"), *_many("W101", 2)]
    Terminal("warp-rt").diagnostics(records)
    assert capsys.readouterr().err.splitlines() == [
        "note: N917 /World/Mesh0: ignored (and 2 more of these words)",
        "note: N917 /World/A: other words",
        "warning: W101 /World/Mesh0: ignored",
        "warning: W101 /World/Mesh1: ignored",
    ]
    Terminal("warp-rt", verbosity=1).diagnostics(records)
    assert len(capsys.readouterr().err.splitlines()) == len(records)


def test_verbose_names_them_all_and_quiet_none(capsys):
    Terminal("warp-rt", verbosity=1).diagnostics(_many("W101", 100))
    assert len(capsys.readouterr().err.splitlines()) == 100
    Terminal("warp-rt", verbosity=-1).diagnostics(_many("W101", 100))
    assert capsys.readouterr().err == ""


def test_errors_are_told_even_quietly_and_begin_with_the_program(capsys):
    Terminal("warp-rt render", verbosity=-1).error("no camera 'x'")
    assert capsys.readouterr().err == "warp-rt render: error: no camera 'x'\n"


def test_color_is_escape_codes_around_the_label(capsys):
    Terminal("warp-rt", color="always").diagnostics(_many("W101", 1))
    assert capsys.readouterr().err.startswith("\x1b[33mwarning:\x1b[0m W101 ")


@pytest.mark.parametrize(
    ("choice", "environment", "is_terminal", "expected"),
    [
        ("auto", {}, False, False),
        ("auto", {}, True, True),
        ("auto", {"NO_COLOR": "1"}, True, False),
        ("auto", {"NO_COLOR": ""}, True, True),
        ("auto", {"FORCE_COLOR": "1"}, False, True),
        ("auto", {"NO_COLOR": "1", "FORCE_COLOR": "1"}, False, False),
        ("auto", {"TERM": "dumb"}, True, False),
        ("always", {"NO_COLOR": "1"}, False, True),
        ("never", {"FORCE_COLOR": "1"}, True, False),
    ],
)
def test_when_stderr_is_coloured(monkeypatch, choice, environment, is_terminal, expected):
    for name in ("NO_COLOR", "FORCE_COLOR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    stream = io.StringIO()
    stream.isatty = lambda: is_terminal
    monkeypatch.setattr(sys, "stderr", stream)
    assert wants_color(choice) is expected


def test_control_characters_cannot_reach_the_terminal():
    assert one_line("a\x1b[2Jb\rc\u202ed") == r"a\x1b[2Jb\rc\u202ed"
    assert one_line("Größe 雪") == "Größe 雪"


def test_json_is_ascii_and_has_null_for_what_json_lacks():
    stream = io.StringIO()
    Terminal("warp-rt", data=stream).json({"a": float("nan"), "b": [float("inf"), 1.5], "c": "雪"})
    assert stream.getvalue().isascii()
    assert json.loads(stream.getvalue()) == {"a": None, "b": [None, 1.5], "c": "雪"}


def test_closed_stderr_is_no_reason_to_write_to_stdout(monkeypatch, capsys):
    monkeypatch.setattr(sys, "stderr", None)
    Terminal("warp-rt").error("unheard")
    assert capsys.readouterr().out == ""


class _Full(io.StringIO):
    def write(self, text):
        raise OSError(28, "No space left on device")


def test_full_stdout_is_an_output_error():
    with pytest.raises(OutputError, match="standard output: cannot write: No space left"):
        Terminal("warp-rt", data=_Full()).data("text")
