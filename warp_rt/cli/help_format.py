# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""How ``--help`` looks: as wide as the terminal, and each thing said once."""

from __future__ import annotations

import argparse
import re
from typing import Any


class HelpFormat(argparse.HelpFormatter):
    """Argparse's format, with paragraphs, and a usage that leaves the options to the list below it."""

    def add_usage(self, usage: str | None, actions: Any, groups: Any, prefix: str | None = None) -> None:
        """Show the command, ``[options]``, and what stands without one."""
        places = [str(action.metavar) for action in actions if not action.option_strings]
        super().add_usage(" ".join(["%(prog)s", "[options]", *places]), actions, groups, prefix)

    def _format_action_invocation(self, action: argparse.Action) -> str:
        """Return an option's spellings, and what its value is called once, after the last."""
        if not action.option_strings or action.nargs == 0:
            return super()._format_action_invocation(action)
        value = self._format_args(action, self._get_default_metavar_for_optional(action))
        return f"{', '.join(action.option_strings)} {value}"

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        """Wrap each paragraph; those that are indented, tables and examples, stay as they are."""
        paragraphs = re.split(r"\n\n+", text.strip("\n"))
        fill = super()._fill_text
        return "\n\n".join(part if part.startswith(" ") else fill(part, width, indent) for part in paragraphs)
