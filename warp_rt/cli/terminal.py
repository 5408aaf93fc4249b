# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What people and scripts get to see: messages on stderr, data and nothing else on stdout."""

from __future__ import annotations

import contextlib
import io
import json
import logging
import math
import os
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, TextIO

from warp_rt.errors import OutputError
from warp_rt.report import Diagnostic, abridged, one_line

COLOR_CHOICES = ("auto", "always", "never")

_PAGE = 120
"""Columns of results for people at most: longer lines are hard to read."""
_PLAIN_LINES = str.maketrans({"│": "|", "├": "+", "└": "`", "─": "-", "°": " deg"})

_RESET, _BOLD_RED, _YELLOW, _CYAN = "\x1b[0m", "\x1b[1;31m", "\x1b[33m", "\x1b[36m"


class Terminal:
    """Writes to stderr for people, as loud as asked for, and to stdout for scripts."""

    def __init__(self, program: str, *, verbosity: int = 0, color: str = "auto", data: TextIO | None = None) -> None:
        """Make a terminal.

        Args:
            program: What error lines begin with.
            verbosity: Below 0 only errors are told, above 0 everything.
            color: One of ``COLOR_CHOICES``.
            data: Where data goes; None: to stdout.
        """
        self.program = program
        self.verbosity = verbosity
        self.has_color = wants_color(color)
        self._color = color
        self._data = data
        self.has_data = False
        """Whether a result went to stdout."""

    @property
    def is_interactive(self) -> bool:
        """Whether a person watches stderr and did not ask for silence."""
        return self.verbosity >= 0 and sys.stderr is not None and sys.stderr.isatty()

    def error(self, message: object) -> None:
        """Tell why there is no result."""
        self._tell("error:", _BOLD_RED, message, prefix=f"{self.program}: ")

    def diagnostics(self, records: Iterable[Diagnostic]) -> None:
        """Tell what the picture does not show as the stage says it, one line each; long groups are cut short."""
        if self.verbosity < 0:
            return
        for record, more in ((record, 0) for record in records) if self.verbosity > 0 else abridged(records):
            label = ("warning:", _YELLOW) if record.is_warning else ("note:", _CYAN)
            text = f"{record.code}: and {more} more of this kind (-v names them all)" if more else record
            self._tell(*label, text)

    def info(self, message: object) -> None:
        """Tell what was done."""
        if self.verbosity >= 0:
            self._write(one_line(message))

    def detail(self, message: object) -> None:
        """Tell what only the curious want to know."""
        if self.verbosity > 0:
            self._write(one_line(message))

    def text(self, block: str) -> None:
        """Write several lines to stderr as they are."""
        self._write(block.rstrip("\n"))

    def data(self, text: str) -> None:
        """Write a result to stdout. A reader that has left, as ``head`` does, is no error.

        Raises:
            OutputError: Standard output cannot be written.
        """
        stream = self._data or sys.stdout
        if stream is None:
            return
        self.has_data = True
        try:
            print(text, file=stream, flush=True)
        except OSError as error:
            _drain(stream)
            if not isinstance(error, BrokenPipeError):
                raise OutputError(f"standard output: cannot write: {error.strerror}") from error

    def rows(self, rows: Iterable[Sequence[tuple[str, str]]], colors: Mapping[str, str]) -> None:
        """Write a result for people to stdout, in colour where stdout is a terminal or colour is asked for.

        Args:
            rows: Lines of texts, each with the name of its style.
            colors: Colour of each style, ``#rrggbb``; empty: bold.
        """
        from rich.console import Console
        from rich.style import Style
        from rich.text import Text

        styles = {name: Style(color=color) if color else Style(bold=True) for name, color in colors.items()}
        stream = self._data or sys.stdout
        is_plain = not wants_color(self._color, stream)
        text = Text("\n").join(Text.assemble(*((part, styles.get(name, "")) for part, name in row)) for row in rows)
        file = io.StringIO()
        console = Console(file=file, width=10_000, force_terminal=not is_plain, no_color=is_plain, highlight=False)
        console.print(text, soft_wrap=True, end="")
        self.data(_encodable(file.getvalue(), stream))

    @property
    def data_width(self) -> int:
        """Columns that results for people may take: the terminal's, but a page's where there is none."""
        return min(self._columns() or _PAGE, _PAGE)

    @property
    def has_columns(self) -> bool:
        """Whether stdout ends at some column, and is no file or pipe."""
        return self._columns() is not None

    def _columns(self) -> int | None:
        with contextlib.suppress(ValueError):
            if os.environ.get("COLUMNS"):
                return int(os.environ["COLUMNS"])
        stream = self._data or sys.stdout
        try:
            return os.get_terminal_size(stream.fileno()).columns
        except (OSError, ValueError, AttributeError):  # a file, a pipe, or nothing at all
            return None

    def json(self, value: object) -> None:
        """Write one JSON object to stdout, in ASCII, so that no locale can spoil it; numbers it lacks become null."""
        self.data(json.dumps(_finite(value), indent=2, allow_nan=False))

    @contextlib.contextmanager
    def logging(self) -> Iterator[None]:
        """Show what the package logs while the block runs."""
        logger = logging.getLogger("warp_rt")
        handler = _TerminalHandler(self)
        level = logger.level
        logger.addHandler(handler)
        logger.setLevel(logging.DEBUG if self.verbosity > 0 else logging.INFO)
        try:
            yield
        finally:
            logger.removeHandler(handler)
            logger.setLevel(level)

    def _tell(self, kind: str, style: str, message: object, *, prefix: str = "") -> None:
        label = f"{style}{kind}{_RESET}" if self.has_color else kind
        self._write(f"{prefix}{label} {one_line(message)}")

    def _write(self, text: str) -> None:
        # sys.stderr is None where it was closed before we came; print would then turn to stdout.
        if sys.stderr is not None:
            with contextlib.suppress(OSError, ValueError):
                print(text, file=sys.stderr, flush=True)


class _TerminalHandler(logging.Handler):
    """Hands log records to the terminal."""

    def __init__(self, terminal: Terminal) -> None:
        super().__init__()
        self._terminal = terminal

    def emit(self, record: logging.LogRecord) -> None:
        """Show a record: details from DEBUG on, the rest unless silence is asked for."""
        show = self._terminal.detail if record.levelno < logging.INFO else self._terminal.info
        show(record.getMessage())


def _finite(value: Any) -> Any:
    """Return a value without infinities and not-a-numbers, which JSON has no words for."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _drain(stream: TextIO) -> None:
    """Lead a stream that cannot be written nowhere: what it has buffered would fail again when the process ends."""
    with contextlib.suppress(OSError, ValueError):  # a stream of Python's own, without a descriptor
        descriptor = stream.fileno()
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, descriptor)
        os.close(nowhere)


def _encodable(text: str, stream: TextIO | None) -> str:
    """Return a text with plain letters for drawn lines where a stream's encoding has none."""
    try:
        text.encode(getattr(stream, "encoding", None) or "utf-8")
    except UnicodeEncodeError:
        return text.translate(_PLAIN_LINES)
    return text


def wants_color(choice: str, stream: TextIO | None = None) -> bool:
    """Return whether stderr, or ``stream``, is coloured: as asked, else by NO_COLOR, FORCE_COLOR and what it is.

    Reference: no-color.org and force-color.org: both count when set and not empty.
    """
    if choice != "auto":
        return choice == "always"
    if os.environ.get("NO_COLOR"):
        return False
    if os.environ.get("FORCE_COLOR"):
        return True
    stream = stream or sys.stderr
    return stream is not None and stream.isatty() and os.environ.get("TERM") != "dumb"


@contextlib.contextmanager
def data_only_stdout() -> Iterator[TextIO]:
    """Yield the only stream that leads to stdout; whatever libraries print there goes to stderr meanwhile.

    Native libraries write to the file descriptor behind Python's back, so it is the descriptor that is diverted.
    """
    _open_standard_descriptors()
    if sys.stdout is not None:
        sys.stdout.flush()
    saved = os.dup(1)
    os.dup2(2, 1)
    stream = os.fdopen(saved, "w", encoding=getattr(sys.stdout, "encoding", None), errors="backslashreplace")
    try:
        with contextlib.redirect_stdout(sys.stderr):
            yield stream
    finally:
        with contextlib.suppress(OSError):  # data() has told it already
            stream.flush()
        os.dup2(saved, 1)
        with contextlib.suppress(OSError):
            stream.close()


def _open_standard_descriptors() -> None:
    """Fill closed standard descriptors, lest the next file that is opened become stdout."""
    for descriptor in (0, 1, 2):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
