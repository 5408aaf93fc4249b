# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The program ``warp-rt``: find the command, run it, turn what happens into an exit code.

A command's module is imported when it is asked for, and it imports Warp, pxr and NumPy only when it runs, so that
``--help`` and usage errors answer at once.
"""

from __future__ import annotations

import contextlib
import signal
import sys
import threading
import traceback
from collections.abc import Iterator, Sequence
from importlib import import_module
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from warp_rt.cli.terminal import Terminal, data_only_stdout
from warp_rt.errors import LimitError, OptionError, OutputError, WarpRtError
from warp_rt.near_matches import near_matches

if TYPE_CHECKING:
    from warp_rt.cli.parser import Parser

PROGRAM = "warp-rt"

COMMANDS = {
    "render": "render an image from a USD stage",
    "record": "the same with usdrecord's arguments and defaults",
    "series": "render it at growing depth of the ray tree, with a contact sheet",
    "tree": "explain one pixel: every ray, light and shadow behind its colour",
    "info": "tell what a stage holds",
    "check": "name everything in a stage that would be ignored, repaired or refused",
    "warmup": "compile the kernels ahead of the first render",
    "doctor": "tell versions, devices and caches",
}

_WARP_IS_OUT_OF_MEMORY = "Failed to allocate"

EXIT_INTERNAL = 1
EXIT_INTERRUPTED = 128 + signal.SIGINT
EXIT_TERMINATED = 128 + signal.SIGTERM

_USAGE = """\
usage: {program} COMMAND [options]
       {program} --version

Whitted ray tracing of USD stages: reflections, refractions and shadows, on any
machine.

commands:
{commands}

{program} COMMAND --help tells the options of a command.

exit codes: 0 done, 1 internal error, 2 usage, 3 scene unreadable or invalid
(any warning, with --strict), 4 device unavailable, 5 a limit was hit, 6 cannot
write, 130 interrupted, 143 terminated
"""


class _Terminated(KeyboardInterrupt):
    """SIGTERM; whatever stops for Ctrl-C stops for it too."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Args:
        argv: The arguments after the program's name; None: those of this process.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    terminal = Terminal(PROGRAM)
    if not arguments:
        terminal.text(_usage())
        terminal.error(f"a command is missing; to render a stage: {PROGRAM} render SCENE")
        return OptionError.exit_code
    name, *rest = arguments
    try:
        if name in ("-h", "--help"):
            terminal.data(_usage())
            return 0
        if name == "--version":
            terminal.data(_version())
            return 0
        if name not in COMMANDS:
            raise OptionError(_unknown_command(name))
    except WarpRtError as error:
        terminal.error(error)
        return error.exit_code
    return _command(name, rest)


def _command(name: str, arguments: list[str]) -> int:
    """Parse a command's arguments, run it, and return the exit code that its end deserves."""
    command = import_module(f"warp_rt.cli.{name}")
    parser: Parser = command.parser()
    program = f"{PROGRAM} {name}"
    try:
        args = parser.parse(arguments)
    except WarpRtError as error:
        return _fail(Terminal(program), error.exit_code, str(error), as_json="--json" in arguments)
    except SystemExit as end:  # argparse has printed its help
        return int(end.code or 0)
    verbosity = int(args.verbose) - int(args.quiet)
    with data_only_stdout() as data, _sigterm_raises():
        terminal = Terminal(program, verbosity=verbosity, color=args.color, data=data)
        try:
            with terminal.logging():
                return int(command.run(args, terminal))
        except (Exception, KeyboardInterrupt) as error:
            code, message = _verdict(error, parser)
            if code == EXIT_INTERNAL and verbosity > 0:
                terminal.text(traceback.format_exc())
            return _fail(terminal, code, message, as_json=getattr(args, "json", False))


def _verdict(error: BaseException, parser: Parser) -> tuple[int, str]:
    """Return the exit code that an error deserves, and what to say."""
    if isinstance(error, OptionError):
        return error.exit_code, str(parser.as_argument(error))
    if isinstance(error, WarpRtError):
        return error.exit_code, str(error)
    if isinstance(error, KeyboardInterrupt):
        is_terminated = isinstance(error, _Terminated)
        return (EXIT_TERMINATED, "terminated") if is_terminated else (EXIT_INTERRUPTED, "interrupted")
    if isinstance(error, MemoryError):
        return LimitError.exit_code, "out of memory"
    if isinstance(error, FileNotFoundError) and _is_nowhere():
        return OutputError.exit_code, "the current folder has been removed"
    if isinstance(error, RuntimeError) and str(error).startswith(_WARP_IS_OUT_OF_MEMORY):
        return LimitError.exit_code, f"out of memory: {error}"
    reason = f"{type(error).__name__}: {error}"
    return EXIT_INTERNAL, f"internal error: {reason} (please report it; -v shows where it happened)"


def _is_nowhere() -> bool:
    """Return whether the folder that the process was started in is gone."""
    try:
        Path.cwd()
    except FileNotFoundError:
        return True
    return False


def _fail(terminal: Terminal, code: int, message: str, *, as_json: bool) -> int:
    """Tell why there is no result, on stdout too where an object is awaited there; return the exit code."""
    terminal.error(message)
    if as_json and not terminal.has_data:
        with contextlib.suppress(WarpRtError):
            terminal.json({"error": {"code": code, "message": message}})
    return code


@contextlib.contextmanager
def _sigterm_raises() -> Iterator[None]:
    """Let SIGTERM end the block as Ctrl-C does; only a process's main thread may say so."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def terminate(signum: int, frame: FrameType | None) -> None:
        raise _Terminated

    previous = signal.signal(signal.SIGTERM, terminate)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, previous)


def _usage() -> str:
    commands = "\n".join(f"  {name:<8} {what}" for name, what in COMMANDS.items())
    return _USAGE.format(program=PROGRAM, commands=commands).rstrip("\n")


def _unknown_command(name: str) -> str:
    if "." in name and not name.startswith("-"):
        return f"{name!r} is no command; to render a stage: {PROGRAM} render {name}"
    hint = near_matches(name, (*COMMANDS, "--help", "--version")) or f"; there are {', '.join(COMMANDS)}"
    return f"{name!r} is no command{hint}"


def _version() -> str:
    from warp_rt.cli.versions import versions

    ours, *others = versions().items()
    return f"{PROGRAM} {ours[1]} ({', '.join(f'{name} {version}' for name, version in others)})"
