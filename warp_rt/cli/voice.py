# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a command that makes several pictures tells about them: each thing once."""

from __future__ import annotations

from collections.abc import Iterable

from warp_rt.cli.terminal import Terminal
from warp_rt.report import Diagnostic


class Voice:
    """Tells each thing once, however many frames it holds for."""

    def __init__(self, terminal: Terminal) -> None:
        self.terminal = terminal
        self._told: set[Diagnostic] = set()

    def diagnostics(self, records: Iterable[Diagnostic]) -> None:
        """Tell the diagnostics that are new."""
        new = [record for record in records if record not in self._told]
        self.terminal.diagnostics(new)
        self._told.update(new)
