# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``--product``: the pictures that the render settings ask for, in the files that they name."""

from __future__ import annotations

import argparse
import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from warp_rt.cli.frames import has_placeholder, numbered_files, parse_frames, placeholder
from warp_rt.cli.pictures import Shot, View, make_pictures
from warp_rt.cli.stage_input import open_stage
from warp_rt.cli.terminal import Terminal
from warp_rt.errors import OptionError, OutputError, SceneError
from warp_rt.image.outputs import FORMATS
from warp_rt.near_matches import near_matches
from warp_rt.options import PRODUCT_PURPOSES, RenderOptions
from warp_rt.report import Diagnostic

if TYPE_CHECKING:
    from warp_rt.scene import Product, Scene
    from warp_rt.scene.source import SceneSource

ALL = "all"
OTHER_NAME = "N904"


def make_products(
    args: argparse.Namespace,
    terminal: Terminal,
    options: RenderOptions,
    view: Callable[[Scene], View],
    announce: Callable[[Scene], None] | None = None,
    output: Path | None = None,
) -> int:
    """Make the products that ``--product`` names; return the exit code.

    Args:
        args: Of a parser that has ``render_arguments``.
        terminal: Takes what is told.
        options: How.
        view: See ``make_pictures``.
        announce: Likewise.
        output: File of the one product that is chosen; None: each has the name that the stage gives it.
    """
    source = open_stage(args, PRODUCT_PURPOSES)
    shots, notes = product_shots(source, args.product, args.frames, args.aov, output)
    make_folders(shots)
    return make_pictures(args, terminal, options, shots, view, announce, source, notes)


def product_shots(
    source: SceneSource,
    chosen: str,
    frames: str | None = None,
    aovs: tuple[str, ...] | None = None,
    output: Path | None = None,
) -> tuple[list[Shot], list[Diagnostic]]:
    """Return the pictures of products, and what is to be told about their files.

    Args:
        source: The stage, whose render settings have the products.
        chosen: Path or name of one, or ``all``.
        frames: Time codes, as ``--frames`` has them.
        aovs: What they hold; None: their render vars.
        output: File of the one product that is chosen; None: each has the name that the stage gives it.

    Raises:
        OptionError: ``frames`` cannot be read, or ``output`` is one file for several pictures.
        OutputError: Two pictures would be one file.
        SceneError: There is no such product.
    """
    from warp_rt.image.layers import layer_names

    products = source.products()
    found = [product for product in products if chosen in (ALL, product.path, product.path.rsplit("/", 1)[-1])]
    if not found:
        paths = [product.path for product in products]
        if not paths:
            raise SceneError("--product: the render settings name no raster product")
        hint = near_matches(chosen, paths) or f"; there are {', '.join(paths)}"
        raise SceneError(f"--product: the render settings name no raster product {chosen!r}{hint}")
    if output is not None and len(found) > 1:
        raise OptionError(f"--product: {output} is one file for {len(found)} products; leave it out")
    codes = None if frames is None else parse_frames(frames)
    times = [None] if codes is None else [float(code) for code in codes]
    shots: list[Shot] = []
    notes: list[Diagnostic] = []
    for product in found:
        if aovs is not None:
            product = replace(product, variables=())
        held = aovs or tuple(dict.fromkeys(variable.aov for variable in product.variables)) or ("color",)
        names = _names(product, source, codes)
        files = {name: output or product_file(product.path, name, has_color="color" in held) for name in names}
        for name, path in files.items():
            if output is None and path.as_posix() != name:
                asked = f"productName {name!r}" if name else "no productName"
                notes.append(Diagnostic(OTHER_NAME, product.path, f"{asked}: written as {path}"))
        for variable, layer in zip(product.variables, layer_names(product.variables), strict=True):
            if layer not in ("", variable.layer):
                told = f"another layer of {product.path} is called {variable.layer!r}: this one is {layer!r}"
                notes.append(Diagnostic(OTHER_NAME, variable.path, told))
        numbered = _numbered([files[name] for name in names], source, codes)
        shots += [Shot(time, file, held, product) for time, file in zip(times, numbered, strict=True)]
    for file, count in Counter(shot.output for shot in shots).items():
        if count > 1:
            raise OutputError(f"{file}: more than one picture would have this name")
    return shots, notes


def product_file(prim: str, product_name: str, *, has_color: bool) -> Path:
    """Return where a product goes, relative to the current folder.

    A stage may come from anywhere, so that it does not decide about files elsewhere: of a name that leads out of the
    folder, the last part counts. Where its extension is no format that can be written, or that holds no more than a
    colour which there is not, EXR is.

    Args:
        prim: Path of the product, whose last part stands in for a name.
        product_name: As the stage says it.
        has_color: Whether there is a colour.
    """
    name = PurePosixPath(re.sub(r"^[A-Za-z]:", "", product_name.replace("\\", "/")))
    if name.is_absolute() or ".." in name.parts:
        name = PurePosixPath(name.name)
    if not name.name or name.name == "..":
        name = PurePosixPath(prim.rsplit("/", 1)[-1])
    if name.suffix.lower() not in FORMATS or (not has_color and name.suffix.lower() != ".exr"):
        name = name.with_name(f"{name.name}.exr")
    return Path(name)


def make_folders(shots: Sequence[Shot]) -> None:
    """Make the folders that products name.

    Raises:
        OutputError: One cannot be made.
    """
    for folder in {shot.output.parent for shot in shots}:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(f"{folder}: cannot make this folder: {error.strerror}") from error


def _names(product: Product, source: SceneSource, codes: Sequence[Fraction] | None) -> list[str]:
    """Return how the stage calls the file of each frame; where none are asked for, of the one that is drawn."""
    if codes is None:
        return [product.name_at(source.scene().time if product.names else None)]
    return [product.name_at(float(code)) for code in codes]


def _numbered(paths: Sequence[Path], source: SceneSource, codes: tuple[Fraction, ...] | None) -> Sequence[Path]:
    """Return the file of each frame; where they would be one, its number goes to a placeholder or before the extension.

    Where no frames are asked for, the one that is drawn has its number; the default time, which has none, is 0.
    """
    path = paths[0]
    if codes is None:
        return numbered_files(path, (Fraction(source.scene().time or 0),)) if has_placeholder(path) else paths
    if len(set(paths)) > 1:
        return [file for path, code in zip(paths, codes, strict=True) for file in numbered_files(path, (code,))]
    if not has_placeholder(path) and len(codes) > 1:
        path = path.with_name(f"{path.stem}.{placeholder(codes)}{path.suffix}")
    return numbered_files(path, codes)
