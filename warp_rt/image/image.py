# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A rendered picture in the hand: linear values, display values, files."""

from __future__ import annotations

import io
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from warp_rt.errors import OptionError, OutputError
from warp_rt.image.atomic import write_bytes
from warp_rt.image.color import display, unpremultiply
from warp_rt.image.exr import write_exr
from warp_rt.image.ids import encode_ids, labels_of
from warp_rt.image.jpeg import MAX_SIDE, encode_jpeg
from warp_rt.image.layers import channels_of, default_layer, layer_names
from warp_rt.image.outputs import ID_TABLES, check_writable, format_of, picture_of, planned_files
from warp_rt.image.png import encode_png, opaque
from warp_rt.image.tone import check_display
from warp_rt.options import COSTS
from warp_rt.scene import RenderVar


class FilmLike(Protocol):
    """What a picture is made of; ``warp_rt.Film`` is one."""

    @property
    def aovs(self) -> Mapping[str, np.ndarray]:
        """Arrays by name, [height, width] or [height, width, components], row 0 on top; ``color`` and ``alpha`` too."""

    @property
    def prims(self) -> tuple[str, ...]:
        """Path of each primId."""

    @property
    def instance_paths(self) -> Sequence[str]:
        """Path of each instanceId."""

    @property
    def labels(self) -> Mapping[str, Mapping[str, tuple[str, ...]]]:
        """Semantic labels by prim path and taxonomy."""

    @property
    def facts(self) -> Mapping[str, object]:
        """What the files' headers say about how it was made, such as source, camera, spp and seed."""

    @property
    def data_window(self) -> tuple[int, int, int, int] | None:
        """x and y of its top left pixel in a picture, and that one's width and height [pixel]; None: it is all."""

    @property
    def pixel_aspect_ratio(self) -> float:
        """Width by height of a pixel as it is to be shown."""


class Image:
    """A film, developed: how it is exposed and toned, and what is known about its making.

    ``np.asarray(image)`` is what a screen shows, uint8 RGBA; :attr:`linear` and ``image["depth"]`` are what was
    computed. A notebook shows the picture by itself.
    """

    def __init__(
        self,
        film: FilmLike,
        *,
        exposure: float = 0.0,
        tonemap: str = "srgb",
    ) -> None:
        """Wrap a film.

        Args:
            film: The rendered AOVs.
            exposure: Stops, for display values only; files of linear values keep what was computed.
            tonemap: ``srgb``, or ``raw`` for display values without a curve.

        Raises:
            OptionError: The exposure or the tone map cannot be used.
        """
        check_display(exposure, tonemap)
        self.film = film
        self.exposure = exposure
        self.tonemap = tonemap

    @property
    def linear(self) -> np.ndarray:
        """Linear Rec. 709 radiance, premultiplied by alpha: float32, shape [height, width, 3], row 0 on top."""
        return self["color"]

    @property
    def alpha(self) -> np.ndarray:
        """Coverage: float32, shape [height, width]."""
        return self["alpha"]

    @property
    def width(self) -> int:
        """Width [pixel]."""
        return self.alpha.shape[1]

    @property
    def height(self) -> int:
        """Height [pixel]."""
        return self.alpha.shape[0]

    def __getitem__(self, aov: str) -> np.ndarray:
        """Return an AOV as it was computed.

        Raises:
            OptionError: The film has no such AOV.
        """
        try:
            return self.film.aovs[aov]
        except KeyError:
            raise OptionError(f"aov: {aov!r} was not rendered; there are {', '.join(self.film.aovs)}") from None

    def labels(self, aov: str) -> list[dict[str, tuple[str, ...]]]:
        """Return the semantic labels of each id of ``primId`` or ``instanceId``, its own and inherited, by taxonomy.

        Raises:
            OptionError: The AOV has no ids of prims.
        """
        if aov not in ID_TABLES:
            raise OptionError(f"aov: {aov!r} is none of {', '.join(ID_TABLES)}")
        return [labels_of(path, self.film.labels) for path in self._id_tables()[aov]]

    def to_srgb8(self) -> np.ndarray:
        """Return what a screen shows: straight alpha, uint8, shape [height, width, 4], row 0 on top."""
        straight = unpremultiply(self.linear, self.alpha)
        alpha = display(self.alpha, tonemap="raw")
        return np.dstack([display(straight, exposure=self.exposure, tonemap=self.tonemap), alpha])

    def cost_map(self, aov: str) -> np.ndarray:
        """Return a cost as a picture with a colour bar: display values, uint8, shape [height, width, 3].

        It is larger than the film by its legend.

        Raises:
            OptionError: The AOV counts no cost, or the film has no such AOV.
        """
        from warp_rt.image.cost_map import cost_map

        if aov not in COSTS:
            raise OptionError(f"aov: {aov!r} is none of {', '.join(COSTS)}")
        samples = self.film.facts.get("spp", 1)
        return cost_map(aov, self[aov], samples=samples if isinstance(samples, int) else 1)

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        aovs: Iterable[str] | None = None,
        layers: Sequence[RenderVar] = (),
    ) -> tuple[Path, ...]:
        """Write the picture, each file whole or not at all, and return the files, the picture first.

        The extension decides: ``.exr`` holds every AOV, linear; ``.png`` (straight alpha) and ``.jpg`` (over black)
        hold colour for display, and each further AOV is written beside it as ``NAME.AOV.npy``; costs also as pictures
        with a colour bar, ``NAME.AOV.png``. With ids, ``NAME.ids.json`` says which prims they are.

        Args:
            path: The picture's file.
            aovs: Which AOVs; None: all. EXR holds colour in any case; a PNG or JPEG of a single cost shows that.
            layers: What an EXR holds instead, and how it is called; none: ``aovs``.

        Raises:
            OptionError: The extension is unknown, or there is nothing that the picture could show.
            OutputError: A file could not be written.
        """
        target = Path(path)
        wanted = tuple(self.film.aovs if aovs is None else aovs)
        files = planned_files(target, wanted)
        for file in files.values():
            check_writable(file)
        for kind, file in files.items():
            if kind == "ids":
                write_bytes(file, self._encode_ids())
            elif kind.endswith(".png"):
                write_bytes(file, self._encode_cost(kind.removesuffix(".png"), "png"))
            elif kind != "image":
                write_bytes(file, _encode_npy(self[kind]))
        self._save_picture(target, wanted, layers)  # last: where it is, the rest is too
        return tuple(files.values())

    def _save_picture(self, path: Path, wanted: tuple[str, ...], layers: Sequence[RenderVar]) -> None:
        kind = format_of(path)
        if kind != "exr" and (shown := picture_of(path, wanted)) != "color":
            write_bytes(path, self._encode_cost(shown, kind))
        elif kind == "exr":
            write_exr(
                path,
                self._channels(layers),
                software=software(),
                metadata={**self.film.facts, "colorspace": "linear Rec.709"},
                data_window=self.film.data_window,
                pixel_aspect_ratio=self.film.pixel_aspect_ratio,
            )
        elif kind == "jpeg":
            write_bytes(path, self._encode_jpeg(path))
        else:
            write_bytes(path, self._repr_png_())

    def _channels(self, layers: Sequence[RenderVar]) -> dict[str, np.ndarray]:
        """Return the planes of an EXR; of layers the first colour, with alpha, is the one that viewers show."""
        channels: dict[str, np.ndarray] = {}
        if not layers:
            for aov, values in self.film.aovs.items():
                channels |= channels_of(aov, values, default_layer(aov))
            return channels
        for layer, name in zip(layers, layer_names(layers), strict=True):
            values = self[layer.aov]
            if layer.is_half and values.dtype == np.float32:
                with np.errstate(over="ignore"):  # infinite where too great
                    values = values.astype(np.float16)
            channels |= channels_of(layer.aov, values, name)
            if layer.aov == "color" and not name:
                channels |= channels_of("alpha", self.alpha.astype(values.dtype), "")
        return channels

    def _display_facts(self) -> dict[str, object]:
        colorspace = "sRGB" if self.tonemap == "srgb" else "linear Rec.709"
        return {**self.film.facts, "exposure": self.exposure, "colorspace": colorspace}

    def _encode_jpeg(self, path: Path) -> bytes:
        if max(self.width, self.height) > MAX_SIDE:
            raise OutputError(f"{path}: JPEG holds at most {MAX_SIDE} pixels a side")
        over_black = display(self.linear, exposure=self.exposure, tonemap=self.tonemap)
        return encode_jpeg(over_black, software=software(), metadata=self._display_facts())

    def _encode_cost(self, aov: str, kind: str) -> bytes:
        picture, facts = self.cost_map(aov), {**self.film.facts, "aov": aov}
        if kind == "jpeg":
            return encode_jpeg(picture, software=software(), metadata=facts)
        return encode_png(opaque(picture), software=software(), metadata=facts, is_srgb=True)

    def _id_tables(self) -> dict[str, Sequence[str]]:
        return {"primId": self.film.prims, "instanceId": self.film.instance_paths}

    def _encode_ids(self) -> bytes:
        present = {aov: paths for aov, paths in self._id_tables().items() if aov in self.film.aovs}
        return encode_ids(present, self.film.labels)

    def _repr_png_(self) -> bytes:
        """Return a PNG file: notebooks call this to show the picture."""
        is_srgb = self.tonemap == "srgb"
        return encode_png(self.to_srgb8(), software=software(), metadata=self._display_facts(), is_srgb=is_srgb)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        if copy is False:
            raise ValueError("display values are computed, so they are always a new array")
        return self.to_srgb8().astype(dtype or np.uint8, copy=False)

    def __repr__(self) -> str:
        return f"<warp_rt.Image {self.width} x {self.height}: {', '.join(self.film.aovs)}>"


def _encode_npy(values: np.ndarray) -> bytes:
    file = io.BytesIO()
    np.save(file, values, allow_pickle=False)
    return file.getvalue()


def software() -> str:
    """Return who makes the files, for their headers."""
    from warp_rt import __version__

    return f"warp_rt {__version__}"
