# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""How far a render is: a bar on terminals, now and then a line elsewhere."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator

from warp_rt.cli.terminal import Terminal

SECONDS_A_LINE = 10.0


@contextlib.contextmanager
def progress_bar(terminal: Terminal, label: str) -> Iterator[Callable[[float], None] | None]:
    """Yield what is to be called with the finished fraction; None where silence is asked for."""
    if terminal.verbosity < 0:
        yield None
        return
    if not terminal.is_interactive:
        yield _Lines(terminal, label)
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    bar = Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        console=Console(stderr=True, no_color=not terminal.has_color),
        transient=True,
        redirect_stdout=False,  # nothing but data goes there
    )
    with bar:
        task = bar.add_task(label, total=1.0)
        yield lambda fraction: bar.update(task, completed=fraction)


class _Lines:
    """Tells a log how far it is."""

    def __init__(self, terminal: Terminal, label: str) -> None:
        self._terminal = terminal
        self._label = label
        self._start = self._told = time.monotonic()

    def __call__(self, fraction: float) -> None:
        """Write a line if the last one is a while ago."""
        now = time.monotonic()
        if now - self._told < SECONDS_A_LINE:
            return
        self._told = now
        left = f", {duration((now - self._start) * (1 - fraction) / fraction)} left" if fraction > 0 else ""
        self._terminal.info(f"{self._label}: {100 * fraction:.0f} %{left}")


def duration(seconds: float) -> str:
    """Return a time for people: ``20 s``, ``1 min 20 s``, ``2 h 5 min``."""
    minutes, rest = divmod(round(seconds), 60)
    hours = minutes // 60
    if hours:
        return f"{hours} h {minutes % 60} min"
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"
