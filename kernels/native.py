# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Source text of native functions, in which constants stand by their names."""

import re


def spell_out(source: str, **constants: float) -> str:
    """Return native source with the names of constants replaced by their values, float32 literals where they are float.

    Args:
        source: C++ source.
        **constants: By the names that stand in it as whole words.
    """
    for name, value in constants.items():
        literal = str(value) if isinstance(value, int) else f"{value!r}f"
        source = re.sub(rf"\b{name}\b", literal, source)
    return source
