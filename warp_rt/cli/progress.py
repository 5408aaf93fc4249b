# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A progress bar with the time left, on terminals only."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator

from warp_rt.cli.terminal import Terminal


@contextlib.contextmanager
def progress_bar(terminal: Terminal, label: str) -> Iterator[Callable[[float], None] | None]:
    """Yield what is to be called with the finished fraction; None where nobody watches."""
    if not terminal.is_interactive:
        yield None
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
