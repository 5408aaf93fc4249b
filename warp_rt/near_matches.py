# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What was probably meant by a name that does not exist."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

_LEAST_RATIO = 0.75
"""Of letters that two names share in order: one slip in a word of four is near, ``height`` for ``width`` is not."""
_LEAST_LEAD = 0.1
"""Names whose ratio is less than the best one's by more are not what was meant."""
_SHORTEST = 3  # letters of an abbreviation
_MOST = 3  # names that are suggested


def near_matches(word: str, known: Iterable[str]) -> str:
    """Return ``; did you mean a, b?`` with the known names that ``word`` misspells or abbreviates, or nothing.

    Dashes in front and capitals count for nothing.
    """
    ratios = {name: _ratio(_bare(word), _bare(name)) for name in known}
    least = max(_LEAST_RATIO, max(ratios.values(), default=0.0) - _LEAST_LEAD)
    near = sorted((name for name, ratio in ratios.items() if ratio >= least), key=lambda name: -ratios[name])
    return f"; did you mean {', '.join(near[:_MOST])}?" if near else ""


def _bare(name: str) -> str:
    return name.lstrip("-").lower()


def _ratio(word: str, name: str) -> float:
    """Return how alike two names are, 0 to 1; an abbreviation is as good as a misspelling."""
    ratio = difflib.SequenceMatcher(None, word, name).ratio()
    return max(ratio, _LEAST_RATIO) if len(word) >= _SHORTEST and name.startswith(word) else ratio
