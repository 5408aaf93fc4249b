# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Argument parsing with one-line errors and near matches, and the options that commands share."""

from __future__ import annotations

import argparse
import contextlib
import difflib
import re
from collections.abc import Callable, Iterable
from typing import NoReturn

from warp_rt.cli.terminal import COLOR_CHOICES
from warp_rt.errors import OptionError
from warp_rt.options import PURPOSES, check_purposes


class Parser(argparse.ArgumentParser):
    """An ArgumentParser that raises what it has to say."""

    def __init__(self, command: str, description: str, *, epilog: str | None = None) -> None:
        super().__init__(
            prog=f"warp-rt {command}",
            description=description,
            epilog=epilog,
            allow_abbrev=False,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        # Lists of numbers are values too: --crop -2,0,4,4 and --frames -3:-1.
        self._negative_number_matcher = re.compile(r"-\.?\d[\d.,:xe+-]*$")
        talk = self.add_argument_group("messages")
        talk.add_argument("-q", "--quiet", action="store_true", help="print errors only")
        talk.add_argument("-v", "--verbose", action="store_true", help="print details, and every diagnostic")
        talk.add_argument(
            "--color", choices=COLOR_CHOICES, default="auto", help="colour on stderr (default: %(default)s)"
        )

    def error(self, message: str) -> NoReturn:
        """Raise a usage error.

        Raises:
            OptionError: Always.
        """
        message = re.sub(r"ignored explicit argument", "takes no value, got", message)
        about = re.match(r"argument (--?[\w-]+)[^:]*: ", message)  # its first spelling will do
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
            OptionError: They make no sense; options that are unknown come with the nearest known ones.
        """
        namespace, unknown = self.parse_known_args(arguments)
        if unknown:
            known = [string for action in self._actions for string in action.option_strings]
            self.error(f"unknown argument {unknown[0]}{near_matches(unknown[0].partition('=')[0], known)}")
        return namespace


def near_matches(word: str, known: Iterable[str]) -> str:
    """Return ``; did you mean a, b?`` with the known words that resemble ``word``, or nothing."""
    close = difflib.get_close_matches(word, list(known), n=3, cutoff=0.6)
    return f"; did you mean {', '.join(close)}?" if close else ""


def add_scene(parser: Parser) -> None:
    """Add the arguments by which a stage is found and read."""
    parser.add_argument("scene", metavar="SCENE", help="a USD stage: .usda, .usdc, .usd or .usdz; or .nff, .nff.gz")
    parser.add_argument(
        "--purposes",
        type=_purposes,
        metavar="P[,P]",
        help=f"purposes to draw besides default, of {', '.join(PURPOSES)} "
        "(default: as the render settings say, else proxy)",
    )


def add_json(parser: Parser, what: str) -> None:
    """Add --json."""
    parser.add_argument("--json", action="store_true", help=f"print {what} as one JSON object on stdout")


def names(text: str) -> tuple[str, ...]:
    """Return the words of a list that is separated by commas or blanks."""
    return tuple(text.replace(",", " ").split())


def some_names(text: str) -> tuple[str, ...]:
    """Return the words of such a list, of which there is at least one."""
    return names(name(text))


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


def _purposes(text: str) -> tuple[str, ...]:
    values = names(text)
    try:
        check_purposes(values)
    except OptionError as error:
        raise argparse.ArgumentTypeError(str(error).partition(": ")[2]) from error
    return values
