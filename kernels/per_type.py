# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""One source, compiled once for each type of an argument: what the type says costs no instruction at run time."""

from typing import TypeVar

import warp as wp


def per_type(function, is_needed=lambda types: True):
    """Return the Warp function that has ``function`` as its overload for each choice of types for its type variables.

    A type variable in the annotations stands for each of its constraints, passed by reference. Warp's own generics
    (``Any``) would do, but cannot be mixed with arguments by reference.

    One that the file defines after another of the same name replaces those of its overloads that have the same types.

    Args:
        function: Annotated Python function.
        is_needed: Whether any kernel has a use for a choice of types, a list.
    """
    annotations = function.__annotations__
    choices = [{}]
    for variable in dict.fromkeys(type_ for type_ in annotations.values() if isinstance(type_, TypeVar)):
        choices = [choice | {variable: type_} for choice in choices for type_ in variable.__constraints__]
    overloads = []
    for chosen in choices:
        if not is_needed(list(chosen.values())):
            continue
        twin = type(function)(function.__code__, function.__globals__, function.__name__)
        twin.__qualname__, twin.__doc__ = function.__qualname__, function.__doc__
        twin.__annotations__ = {
            name: wp.ref[chosen[type_]] if isinstance(type_, TypeVar) else type_ for name, type_ in annotations.items()
        }
        overloads.append(wp.func(twin))
    earlier = function.__globals__.get(function.__name__)
    first = earlier if isinstance(earlier, wp.Function) else overloads.pop(0)
    for overload in overloads:
        first.add_overload(overload)
    return first
