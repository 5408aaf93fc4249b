# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``--strict``: what a picture would not show as the stage says it is an error."""

from __future__ import annotations

from collections.abc import Iterable

from warp_rt.cli.parser import Parser
from warp_rt.errors import SceneError
from warp_rt.report import Diagnostic, counted


def add_strict(parser: Parser) -> None:
    """Add --strict."""
    parser.add_argument("--strict", action="store_true", help="any warning is an error (exit code 3)")


def refuse_warnings(scene: str, records: Iterable[Diagnostic], *, are_told: bool) -> None:
    """Return if there are notes at most.

    Args:
        scene: Its file.
        records: What was found in it.
        are_told: Whether the warnings have been shown already; else the error names the first.

    Raises:
        SceneError: There are warnings.
    """
    warnings = [record for record in records if record.is_warning]
    if warnings:
        count = counted(len(warnings), "warning")
        first = "" if are_told else f"{', the first' if len(warnings) > 1 else ''}: {warnings[0]}"
        raise SceneError(f"{scene}: --strict: {count}{first}")
