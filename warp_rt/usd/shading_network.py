# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Following the connections of a shading network to what produces a value.

Connections lead through node graphs and the interface inputs of materials to any depth. The walk here gives what
``UsdShade.Utils.GetValueProducingAttributes`` gives (a test compares them), but it is a loop, so that no chain is
too deep for it, and a cycle or a broken connection becomes a diagnostic instead of a line on stderr.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

from pxr import Sdf, Tf, Usd, UsdShade

from warp_rt.report import Report
from warp_rt.usd.attribute_values import how_many, numbers, shown

BROKEN_CONNECTION = "W304"
WRONG_TYPE = "W306"
CONNECTED_CONSTANT = "W308"
UNKNOWN_INPUTS = "N917"


@dataclass(frozen=True)
class Node:
    """A shader's output that a value comes from."""

    shader: UsdShade.Shader
    output: str

    @property
    def path(self) -> Sdf.Path:
        """Of the output."""
        return self.shader.GetPath().AppendProperty(f"{UsdShade.Tokens.outputs}{self.output}")

    @property
    def id(self) -> str:
        """What the shader is: its identifier, or a description of source code without one; empty: nothing said."""
        return shader_id(self.shader)


def shader_id(shader: UsdShade.Shader) -> str:
    """Return ``info:id``, or ``type:asset`` for a shader implemented by a file; empty where nothing is said."""
    identifier = shader.GetShaderId()
    if identifier:
        return str(identifier)
    for attribute in shader.GetPrim().GetAuthoredAttributes():
        parts = attribute.GetName().split(":")
        if parts[0] == "info" and parts[-1] in ("sourceAsset", "sourceCode"):
            value = attribute.Get()
            return f"{':'.join(parts[1:-1]) or 'source'}:{getattr(value, 'path', 'code')}"
    return ""


def note_unknown_inputs(shader: UsdShade.Shader, kind: str, names: Collection[str], report: Report) -> None:
    """Note the inputs of a node that its kind does not have: misspellings, or what its exporter keeps there.

    Args:
        shader: The node.
        kind: What it is.
        names: The inputs that the kind has, without ``inputs:``.
        report: Takes the note.
    """
    unknown = sorted(port.GetFullName() for port in shader.GetInputs() if port.GetBaseName() not in names)
    if unknown:
        report.warn(UNKNOWN_INPUTS, shader.GetPath(), f"{kind} has no {', '.join(unknown)}; ignored")


def find_source(port: UsdShade.Input | UsdShade.Output, report: Report) -> Usd.Attribute | Node | None:
    """Return what gives an input or output its value.

    Args:
        port: Where the walk starts.
        report: Takes a diagnostic for a cycle or a connection to nothing.

    Returns:
        The attribute that holds a constant, the shader output that computes the value, or None: the default holds.
    """
    attribute = port.GetAttr()
    visited: dict[Sdf.Path, Usd.Attribute] = {}
    while attribute.GetPath() not in visited:
        visited[attribute.GetPath()] = attribute
        try:
            sources, invalid = UsdShade.ConnectableAPI.GetConnectedSources(attribute)
        except Tf.ErrorException:
            report.warn(BROKEN_CONNECTION, attribute.GetPath(), "is a relationship and not an attribute; ignored")
            return None
        if invalid:
            is_there = bool(attribute.GetStage().GetObjectAtPath(invalid[0]))
            why = "is no input or output" if is_there else "does not exist"
            report.warn(BROKEN_CONNECTION, attribute.GetPath(), f"connected to {invalid[0]}, which {why}")
        if len(sources) > 1:
            message = f"connected to {len(sources)} sources: the first counts"
            report.warn(BROKEN_CONNECTION, attribute.GetPath(), message)
        if not sources:  # then the last one on the way that has a value counts
            return next((held for held in reversed(visited.values()) if held.HasAuthoredValue()), None)
        source = sources[0]
        if source.sourceType == UsdShade.AttributeType.Output:
            if not source.source.IsContainer():
                return Node(UsdShade.Shader(source.source.GetPrim()), source.sourceName)
            attribute = source.source.GetOutput(source.sourceName).GetAttr()
        else:
            attribute = source.source.GetInput(source.sourceName).GetAttr()
    report.warn(BROKEN_CONNECTION, port.GetAttr().GetPath(), "connected in a cycle; the default is used")
    return None


def read_constant(shader: UsdShade.Shader, name: str, time: Usd.TimeCode, report: Report) -> Any:
    """Return the value of an input that cannot vary over a surface; None where it is not set.

    Interface inputs are followed; a connection to a node is reported and counts as not set.
    """
    port = shader.GetInput(name)
    if not port:
        return None
    source = find_source(port, report)
    if isinstance(source, Node):
        warn_connected(port, report)
        return None
    return source.Get(time) if source else None


def read_numbers(
    shader: UsdShade.Shader, name: str, counts: Sequence[int], time: Usd.TimeCode, report: Report
) -> tuple[float, ...] | None:
    """Return a constant of as many finite numbers as ``counts`` has among it; None, with a diagnostic, for others."""
    value = read_constant(shader, name, time, report)
    found = numbers(value)
    if value is None or (found is not None and len(found) in counts):
        return found
    warn_type(shader.GetInput(name).GetAttr(), value, f"not {how_many(counts)}", report)
    return None


def read_token(shader: UsdShade.Shader, name: str, time: Usd.TimeCode, report: Report) -> str | None:
    """Return a constant token or string; None, with a diagnostic, for other values."""
    value = read_constant(shader, name, time, report)
    if value is None or isinstance(value, str):
        return value
    warn_type(shader.GetInput(name).GetAttr(), value, "not a token", report)
    return None


def warn_connected(port: UsdShade.Input, report: Report) -> None:
    """Report a connection to a node, of an input that cannot vary over a surface."""
    report.warn(CONNECTED_CONSTANT, port.GetAttr().GetPath(), "cannot be connected to a node; the default is used")


def warn_type(attribute: Usd.Attribute, value: Any, why: str, report: Report) -> None:
    """Report a value of another kind than the inputs that it is read for."""
    report.warn(WRONG_TYPE, attribute.GetPath(), f"is {shown(value)}, {why}; the default is used")
