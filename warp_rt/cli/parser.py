# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Argument parsing with one-line errors and near matches, and the options that commands share."""

from __future__ import annotations

import argparse
import difflib
from collections.abc import Callable, Iterable
from typing import Any, NoReturn

from warp_rt.cli.terminal import COLOR_CHOICES
from warp_rt.errors import OptionError


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
        raise OptionError(f"{message.removeprefix('argument ')} (see {self.prog} --help)")

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
    parser.add_argument("scene", metavar="SCENE", help="a USD stage: .usda, .usdc, .usd or .usdz")
    parser.add_argument(
        "--purposes",
        type=names,
        metavar="P[,P]",
        help="purposes to draw besides default: render, proxy, guide (default: as the render settings say, else proxy)",
    )


def add_json(parser: Parser, what: str) -> None:
    """Add --json."""
    parser.add_argument("--json", action="store_true", help=f"print {what} as one JSON object on stdout")


def names(text: str) -> tuple[str, ...]:
    """Return the words of a list that is separated by commas or blanks."""
    return tuple(text.replace(",", " ").split())


def numbers(count: int, convert: Callable[[str], Any]) -> Callable[[str], tuple[Any, ...]]:
    """Return a type for argparse: so many numbers, separated by commas."""

    def parse(text: str) -> tuple[Any, ...]:
        values = tuple(convert(part) for part in text.split(","))
        if len(values) != count:
            raise ValueError(text)
        return values

    parse.__name__ = f"list of {count} numbers"  # argparse says: invalid ... value
    return parse


def rgb(text: str) -> tuple[float, float, float]:
    """Return a colour: ``R,G,B``, or one number for a grey."""
    values = tuple(float(part) for part in text.split(","))
    if len(values) not in (1, 3):
        raise ValueError(text)
    return values * 3 if len(values) == 1 else values  # type: ignore[return-value]


rgb.__name__ = "colour"
