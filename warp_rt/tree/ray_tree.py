# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The ray tree of a pixel, and every way to look at it."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from warp_rt.tree.pixel_tree import PixelTree


@dataclass(frozen=True, repr=False)
class RayTree(PixelTree):
    """The ray tree of a pixel: its value, and for each sample the eye ray's node, with all that it led to.

    Iterating yields every node in the order of tracing. ``print`` shows the tree as text, a notebook as a drawing.
    """

    def to_text(self, *, width: int = 100, levels: int | None = None) -> str:
        """Return the tree as text, for people.

        Args:
            width: Columns that there are.
            levels: Draw all nodes down to this level; None: those that lead to most of the pixel's light.
        """
        from warp_rt.tree.text import plain, tree_rows

        return plain(tree_rows(self, width=width, levels=levels))

    def to_json(self) -> dict[str, Any]:
        """Return all of the tree as the object that ``warp-rt tree --json`` prints."""
        from warp_rt.tree.tree_json import tree_object

        return tree_object(self)

    def to_dot(self, *, levels: int | None = None) -> str:
        """Return the tree as a graph in Graphviz's language; ``levels`` as for :meth:`to_text`."""
        from warp_rt.tree.dot import dot_graph

        return dot_graph(self, levels=levels)

    def to_svg(self, *, levels: int | None = None) -> str:
        """Return the tree as a drawing; ``levels`` as for :meth:`to_text`."""
        from warp_rt.tree.svg import svg_drawing

        return svg_drawing(self, levels=levels)

    def save_usd(self, path: str | PathLike[str]) -> None:
        """Write a USD layer that has the scene's stage as its sublayer and the rays as curves over it.

        Raises:
            OptionError: The extension is none of USD's, or the scene was not read from a file.
            OutputError: The file could not be written.
        """
        from warp_rt.tree.layer import save_layer

        save_layer(self, Path(path))

    def _repr_svg_(self) -> str:
        return self.to_svg()

    def _repr_html_(self) -> str:
        from warp_rt.tree.notebook import notebook_html

        return notebook_html(self)

    def __str__(self) -> str:
        return self.to_text()

    def __repr__(self) -> str:
        return f"<warp_rt.RayTree of pixel ({self.x}, {self.y}): {len(self):,} nodes, {self.counts['deepest']} levels>"
