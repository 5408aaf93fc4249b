# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Argument parsing with one-line errors and near matches, and the options that commands share."""

from __future__ import annotations

import argparse
import contextlib
import re
from collections.abc import Callable
from itertools import takewhile
from typing import NoReturn

from warp_rt.cli.help_format import HelpFormat
from warp_rt.cli.stand_in_options import stand_in
from warp_rt.cli.terminal import COLOR_CHOICES, Terminal
from warp_rt.errors import OptionError
from warp_rt.near_matches import near_matches
from warp_rt.options import PURPOSES, check_purposes

_REQUIRED = "the following arguments are required: "
# What argparse says, in the words of the other errors: those of Python 3.11 to 3.14.
_WORDINGS = (
    (re.compile(r"ignored explicit argument"), "takes no value, got"),
    (re.compile(r"expected one argument"), "a value is missing"),
    (re.compile(r"not allowed with argument (-[\w-]+).*"), r"not together with \1"),
    (re.compile(rf"{_REQUIRED}(.*)"), r"missing: \1"),
)
_INVALID_CHOICE = re.compile(r"invalid choice: '(.*)' \(choose from (.*)\)")


class Parser(argparse.ArgumentParser):
    """An ArgumentParser that raises what it has to say."""

    def __init__(self, command: str, description: str, *, epilog: str | None = None) -> None:
        super().__init__(
            prog=f"warp-rt {command}",
            description=description,
            epilog=epilog,
            allow_abbrev=False,
            formatter_class=HelpFormat,
        )
        self.register("type", int, _whole_number)
        self.register("type", float, _number)
        # Lists of numbers are values too: --crop -2,0,4,4 and --frames -3:-1.
        self._negative_number_matcher = re.compile(r"-\.?\d[\d.,:xe+-]*$")
        talk = self.add_argument_group("messages")
        talk.add_argument("-q", "--quiet", action="store_true", help="print errors only")
        talk.add_argument("-v", "--verbose", action="store_true", help="print details, and every diagnostic")
        talk.add_argument(
            "--color", choices=COLOR_CHOICES, default="auto", help="colour on stderr (default: %(default)s)"
        )

    def print_help(self, file: object = None) -> None:
        """Print the help on stdout.

        Raises:
            OutputError: Standard output cannot be written.
        """
        Terminal(self.prog).data(self.format_help().rstrip("\n"))

    def error(self, message: str) -> NoReturn:
        """Raise a usage error.

        Raises:
            OptionError: Always.
        """
        for wording, ours in _WORDINGS:
            message = wording.sub(ours, message)
        message = _INVALID_CHOICE.sub(_none_of, message)
        about = re.match(r"argument (-[\w-]+|[A-Z]+)[^:]*: ", message)  # an option's first spelling will do
        raise OptionError(f"{about[1]}: {message[about.end() :]}" if about else f"{message} (see {self.prog} --help)")

    def as_argument(self, error: OptionError) -> OptionError:
        """Return an error about an option, such as ``time_limit: ...``, in the command line's spelling."""
        name, colon, rest = str(error).partition(": ")
        argument = f"--{name.replace('_', '-')}"
        is_known = colon and any(argument in action.option_strings for action in self._actions)
        return OptionError(f"{argument}: {rest}") if is_known else error

    def parse(self, arguments: list[str]) -> argparse.Namespace:
        """Return the parsed arguments.

        Raises:
            OptionError: They make no sense; options that are unknown come with what stands in for them, or with the
                nearest known ones.
        """
        known = [string for action in self._actions for string in action.option_strings]
        for argument in takewhile("--".__ne__, arguments):  # before argparse takes -color for -c olor
            option = argument.partition("=")[0]
            if option not in known and (hint := stand_in(option, known)):
                self.error(f"unknown option {option}{hint}")
        namespace, unknown = self.parse_known_args(arguments)
        if unknown:
            first = unknown[0].partition("=")[0]
            is_option = first.startswith("-")
            self.error(f"unknown option {first}{near_matches(first, known)}" if is_option else f"unexpected {first!r}")
        for action in self._actions:
            if getattr(namespace, action.dest, None) == []:  # Python before 3.13 drops the value of --option=--
                self.error(f"argument {action.option_strings[0]}: a value is missing")
        return namespace


def add_scene(parser: Parser) -> None:
    """Add the arguments by which a stage is found and read."""
    parser.add_argument(
        "scene", type=name, metavar="SCENE", help="a USD stage: .usda, .usdc, .usd or .usdz; or .nff, .nff.gz"
    )
    parser.add_argument(
        "--purposes",
        type=_purposes,
        metavar="P[,P]",
        help=f"purposes to draw besides default, of {', '.join(PURPOSES)} "
        "(default: as the render settings say, else proxy; render in products)",
    )


def add_json(parser: Parser, what: str) -> None:
    """Add --json."""
    parser.add_argument("--json", action="store_true", help=f"print {what} as one JSON object on stdout")


def names(text: str) -> tuple[str, ...]:
    """Return the words of a list that is separated by commas or blanks."""
    return tuple(text.replace(",", " ").split())


def some_names(text: str) -> tuple[str, ...]:
    """Return the words of such a list, of which there is at least one."""
    if not names(text):
        raise argparse.ArgumentTypeError(f"a name expected, got {repr(text) if text.strip() else 'nothing'}")
    return names(text)


def name(text: str) -> str:
    """Return a name, which has letters: an empty one is a shell's variable that was not set."""
    if not text.strip():
        raise argparse.ArgumentTypeError("a name expected, got nothing")
    return text


def whole_numbers(form: str) -> Callable[[str], tuple[int, ...]]:
    """Return a type for argparse: whole numbers in a form such as ``X,Y,W,H``."""

    def parse(text: str) -> tuple[int, ...]:
        with contextlib.suppress(ValueError):
            values = tuple(int(part) for part in text.split(","))
            if len(values) == form.count(",") + 1:
                return values
        raise argparse.ArgumentTypeError(f"{form} expected, whole numbers, got {text!r}")

    return parse


def rgb(text: str) -> tuple[float, float, float]:
    """Return a colour: ``R,G,B``, or one number for a grey."""
    with contextlib.suppress(ValueError):
        values = tuple(float(part) for part in text.split(","))
        if len(values) in (1, 3):
            return values * 3 if len(values) == 1 else values  # type: ignore[return-value]
    raise argparse.ArgumentTypeError(f"R,G,B expected, such as 0.2,0.2,0.2, or one number, got {text!r}")


def _none_of(match: re.Match[str]) -> str:
    """Return an error of argparse's about a value that is none of an option's choices, as ours say it."""
    choices = match[2].replace("'", "")  # which Python quotes up to 3.11 only
    return f"{match[1]!r} is none of {choices}{near_matches(match[1], choices.split(', '))}"


def _whole_number(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"a whole number expected, got {text!r}") from None


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"a number expected, got {text!r}") from None


def _purposes(text: str) -> tuple[str, ...]:
    values = names(text)
    try:
        check_purposes(values)
    except OptionError as error:
        raise argparse.ArgumentTypeError(str(error).partition(": ")[2]) from error
    return values
