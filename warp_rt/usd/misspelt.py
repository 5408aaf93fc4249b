# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Properties that are written as their schema does not write them, and so count for nothing."""

from __future__ import annotations

import re

from pxr import Usd

from warp_rt.report import Report
from warp_rt.usd.questions import get_type_name

MISSPELT = "N942"


def report_misspelt(prim: Usd.Prim, report: Report) -> None:
    """Note properties whose letters are those of one that the prim's schema has, such as ``fstop`` for ``fStop``."""
    known = prim.GetPrimDefinition().GetPropertyNames()
    meant = {_letters(name): name for name in known}
    for name in sorted(set(prim.GetAuthoredPropertyNames()) - set(known)):
        if _letters(name) in meant:
            message = f"a {get_type_name(prim)} has no {name}, but {meant[_letters(name)]}; ignored"
            report.warn(MISSPELT, prim.GetPath(), message)


def _letters(name: str) -> str:
    return re.sub("[:_]", "", name).casefold()
