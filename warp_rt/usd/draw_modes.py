# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Draw modes of models: the box, the axes or the textured cards that stand in for all that is below a prim.

Hydra draws boxes and axes as lines of one pixel. Rays need lines of some width: tubes of ``LINE_WIDTH``.

Reference: UsdGeomModelAPI schema documentation, "Draw Modes" and "Cards Geometry".
"""

from __future__ import annotations

import io
import itertools
import math
from dataclasses import dataclass

import numpy as np
from PIL.TiffImagePlugin import TiffImageFile
from pxr import Usd, UsdGeom

from warp_rt.report import Report
from warp_rt.scene import Input, Material, MaterialModel, Mesh, Primvar, ShapeKind, Shapes, Texture, Wrap
from warp_rt.usd.assets import read_asset
from warp_rt.usd.attribute_values import AttributeReader, shown
from warp_rt.usd.materials import MaterialReader
from warp_rt.usd.mesh import EMPTY, INVALID_VALUE

NO_MATRIX = "W132"

MODES = ("default", "inherited", "origin", "bounds", "cards")
DRAWN_HOW = frozenset(("model:drawMode", "model:cardVisibility"))
"""Attributes without which a model is drawn as the one above is."""
LINE_WIDTH = 1 / 100
"""Width of lines by the diagonal of the box; axes span a cube."""

_GEOMETRIES = ("cross", "box", "fromTexture")
_PURPOSES = [UsdGeom.Tokens.default_, UsdGeom.Tokens.proxy, UsdGeom.Tokens.render]
_COORDINATES = "cardsUv"
_OPACITY_THRESHOLD = 0.1  # Hydra's, for the cards' cut-outs
# Cards of a cross or of a flat box that face opposite ways lie apart by this share of the box's largest side, so that
# rays tell them from another.
_GAP = 1e-4
_MATRIX_NAMES = ("worldtoscreen", "worldToNDC")  # the second is what OpenImageIO before 2.2 wrote for the first
_TIFF_WORLD_TO_SCREEN = 33305  # TIFFTAG_PIXAR_MATRIX_WORLDTOSCREEN


@dataclass(frozen=True)
class _Face:
    """A card, seen from the side that it faces."""

    name: str
    """Of the attribute ``model:cardTexture``, what follows."""
    s: np.ndarray
    """Unit, where s grows; so too ``t``. Their cross product is the way that the card faces."""
    t: np.ndarray


def _face(name: str, s: tuple[int, int, int], t: tuple[int, int, int]) -> _Face:
    return _Face(name, np.array(s, float), np.array(t, float))


# Opposite ones one after the other.
_FACES = (
    _face("XPos", (0, 1, 0), (0, 0, 1)),
    _face("XNeg", (0, -1, 0), (0, 0, 1)),
    _face("YPos", (-1, 0, 0), (0, 0, 1)),
    _face("YNeg", (1, 0, 0), (0, 0, 1)),
    _face("ZPos", (1, 0, 0), (0, 1, 0)),
    _face("ZNeg", (1, 0, 0), (0, -1, 0)),
)
_CORNERS = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)], float)


@dataclass(frozen=True, eq=False)
class StandIn:
    """What is drawn in a model's place."""

    key: tuple[object, ...]
    """Equal for stand-ins that share their geometry."""
    geometry: Mesh | Shapes
    materials: tuple[int, ...]
    """By the geometry's slots."""
    color: np.ndarray
    """float32, shape [3]: the ``displayColor`` of what has no texture."""


def draw_mode(prim: Usd.Prim, above: str, report: Report) -> str:
    """Return the draw mode of a model, one of ``MODES``, given that of its parent; empty: found from those above."""
    computed = str(UsdGeom.ModelAPI(prim).ComputeModelDrawMode(above))
    mode = computed if computed in MODES else "default"
    own = prim.GetAttribute("model:drawMode").Get()
    if own is not None and not (isinstance(own, str) and own in MODES):
        report.warn(INVALID_VALUE, prim.GetPath(), f"model:drawMode is {shown(own)}, no draw mode: {mode} is taken")
    return mode


def card_visibility(prim: Usd.Prim, above: str, report: Report) -> str:
    """Return which cards of a model are drawn, ``full`` or ``simple``, given that of its parent."""
    found = AttributeReader(prim, Usd.TimeCode.EarliestTime(), INVALID_VALUE, report)
    value = found.token("model:cardVisibility", "inherited", ("full", "simple", "inherited"))
    return above if value == "inherited" else value


def inherited_card_visibility(prim: Usd.Prim, report: Report) -> str:
    """Return which cards are drawn of models below a prim, by what it and those above it say."""
    while prim and not prim.IsPseudoRoot():
        value = card_visibility(prim, "", report)
        if value:
            return value
        prim = prim.GetParent()
    return "full"


def is_replaced(prim: Usd.Prim, mode: str, report: Report) -> bool:
    """Return whether a model of this draw mode is replaced: components are, if nothing says otherwise."""
    if mode in ("default", "inherited"):
        return False
    if prim.GetAttribute("model:applyDrawMode").HasAuthoredValue():
        found = AttributeReader(prim, Usd.TimeCode.EarliestTime(), INVALID_VALUE, report)
        return found.truth("model:applyDrawMode", False)
    return bool(Usd.ModelAPI(prim).IsKind("component"))


class StandInReader:
    """Makes the stand-ins of models.

    Args:
        stage: Along whose up axis no cards face where ``model:cardVisibility`` is simple.
        time: When their textures are read, and the extent of what is no card.
        materials: Takes those of cards.
        report: Takes the diagnostics.
    """

    def __init__(self, stage: Usd.Stage, time: Usd.TimeCode, materials: MaterialReader, report: Report) -> None:
        self._time = time
        self._up_axis = str(UsdGeom.GetStageUpAxis(stage))
        self._materials = materials
        self._report = report
        self._extents = {
            "bounds": UsdGeom.BBoxCache(time, _PURPOSES, useExtentsHint=True),
            # "For cross and box mode, the extents are calculated [...] at their earliest authored time."
            "cards": UsdGeom.BBoxCache(Usd.TimeCode.EarliestTime(), _PURPOSES, useExtentsHint=True),
        }
        self._card_materials: dict[tuple[object, ...], int] = {}

    def read(self, prim: Usd.Prim, mode: str, card_visibility: str) -> StandIn | None:
        """Return what replaces a model; None, with a diagnostic, where there is nothing to draw.

        Args:
            prim: The model.
            mode: ``origin``, ``bounds`` or ``cards``.
            card_visibility: ``full`` or ``simple``.
        """
        found = AttributeReader(prim, self._time, INVALID_VALUE, self._report)
        color = found.vector("model:drawModeColor", (0.18, 0.18, 0.18))
        if mode == "origin":
            lines = np.stack([np.zeros((3, 3)), np.eye(3)], axis=1)
            return self._lines(lines, LINE_WIDTH * math.sqrt(3), color)
        geometry = found.token("model:cardGeometry", _GEOMETRIES[0], _GEOMETRIES)
        if mode == "cards" and geometry == "fromTexture":
            return self._cards_from_textures(prim, color, card_visibility)
        box = self._box(prim, mode)
        if box is None:
            self._report.warn(EMPTY, prim.GetPath(), f"a model of no extent, of which draw mode {mode} shows nothing")
            return None
        if mode == "bounds":
            edges = _edges(box)
            return self._lines(edges, LINE_WIDTH * float(np.linalg.norm(box[1] - box[0])), color)
        return self._cards(prim, box, geometry, color, card_visibility)

    def _box(self, prim: Usd.Prim, mode: str) -> np.ndarray | None:
        """Return the box of all that the model shows, in its own space: float64, shape [2, 3]; None: it is empty."""
        extent = self._extents[mode].ComputeUntransformedBound(prim).ComputeAlignedRange()
        box = np.array([extent.GetMin(), extent.GetMax()])
        is_box = not extent.IsEmpty() and np.isfinite(box).all() and (box[1] > box[0]).any()
        return box if is_box else None

    def _lines(self, ends: np.ndarray, width: float, color: tuple[float, ...]) -> StandIn:
        lines = ends[(ends[:, 0] != ends[:, 1]).any(axis=1)]
        shapes = Shapes(
            ShapeKind.LINEAR_TUBE,
            points=lines.astype(np.float32),
            radii=np.full(lines.shape[:2], width / 2, np.float32),
            is_closed=False,
        )
        return StandIn(
            ("lines", lines.tobytes()), shapes, (self._materials.display_color(),), np.array(color, np.float32)
        )

    # --- cards

    def _cards(
        self, prim: Usd.Prim, box: np.ndarray, geometry: str, color: tuple[float, ...], visibility: str
    ) -> StandIn | None:
        textures = [self._texture(prim, face) for face in _FACES]
        drawn = [bool(textures[i] or textures[i ^ 1]) for i in range(6)]
        is_textured = any(drawn)
        drawn = [
            (is_drawn or not is_textured) and not self._is_hidden(face, visibility)
            for is_drawn, face in zip(drawn, _FACES, strict=True)
        ]
        quads, coordinates, materials = [], [], []
        half = (box[1] - box[0]) / 2
        gap = _GAP * half.max()
        reach = np.maximum(half, gap) if geometry == "box" else gap
        for i in np.flatnonzero(drawn):
            face = _FACES[i]
            corners = _CORNERS @ np.array([face.s, face.t])
            quads.append(box.mean(axis=0) + corners * half + np.cross(face.s, face.t) * reach)
            # Without one of its own a card shows its opposite's texture as if it was seen through it.
            source = i if textures[i] or not textures[i ^ 1] else i ^ 1
            frame = np.array([_FACES[source].s, _FACES[source].t])
            coordinates.append((corners @ frame.T + 1) / 2)
            texture = textures[source]
            materials.append(self._card_material(prim, texture, color) if texture else self._materials.display_color())
        return _quads(quads, coordinates, materials, color)

    def _cards_from_textures(self, prim: Usd.Prim, color: tuple[float, ...], visibility: str) -> StandIn | None:
        quads, coordinates, materials = [], [], []
        # Clockwise, for a card faces the side from where clip space lies behind it. The image's top is at y = -1, as
        # Hydra's own test pictures have it; the schema's text says +1.
        corners = _CORNERS[::-1]
        for face in _FACES:
            texture = self._texture(prim, face)
            if texture is None or self._is_hidden(face, visibility):
                continue
            asset = texture.Get(self._time)
            matrix = _world_to_screen(asset.resolvedPath)
            if matrix is None or abs(np.linalg.det(matrix)) < 1e-12:
                what = "has no metadata worldtoscreen, a matrix of 16 numbers that can be inverted"
                self._report.warn(NO_MATRIX, prim.GetPath(), f"card left out: @{asset.path}@ {what}")
                continue
            clip = np.column_stack([corners, np.zeros(4), np.ones(4)]) @ np.linalg.inv(matrix)
            quads.append(clip[:, :3] / clip[:, 3:])
            coordinates.append((corners * (1, -1) + 1) / 2)
            materials.append(self._card_material(prim, texture, color))
        return _quads(quads, coordinates, materials, color)

    def _is_hidden(self, face: _Face, visibility: str) -> bool:
        return visibility == "simple" and face.name[0] == self._up_axis

    def _texture(self, prim: Usd.Prim, face: _Face) -> Usd.Attribute | None:
        """Return the attribute that names a card's texture; None where it names none."""
        name = f"model:cardTexture{face.name}"
        value = AttributeReader(prim, self._time, INVALID_VALUE, self._report).asset(name)
        return prim.GetAttribute(name) if value is not None else None

    def _card_material(self, prim: Usd.Prim, texture: Usd.Attribute, color: tuple[float, ...]) -> int:
        image = self._materials.image(texture.Get(self._time), prim)
        image, is_srgb = self._materials.decoded(image, texture, prim.GetPath())
        key = (image, is_srgb, color)
        if key not in self._card_materials:
            row = self._materials.add_texture(
                Texture(
                    image,
                    primvar=_COORDINATES,
                    wrap_s=Wrap.CLAMP,
                    wrap_t=Wrap.CLAMP,
                    fallback=(color[0], color[1], color[2], 1.0),
                    is_srgb=is_srgb,
                )
            )
            self._card_materials[key] = self._materials.add(
                Material(
                    str(texture.GetPath()),
                    MaterialModel.PREVIEW,
                    {"diffuseColor": Input(texture=row), "opacity": Input(texture=row, channel=3)},
                    opacity_threshold=_OPACITY_THRESHOLD,
                    is_single_sided=True,
                )
            )
        return self._card_materials[key]


def _edges(box: np.ndarray) -> np.ndarray:
    """Return the twelve edges of a box: float64, shape [12, 2, 3]."""
    corners = np.array(list(itertools.product((0, 1), repeat=3)))
    pairs = [(a, b) for a, b in itertools.combinations(range(8), 2) if np.abs(corners[a] - corners[b]).sum() == 1]
    return (box[0] + corners * (box[1] - box[0]))[np.array(pairs)]


def _quads(
    quads: list[np.ndarray], coordinates: list[np.ndarray], materials: list[int], color: tuple[float, ...]
) -> StandIn | None:
    """Return cards of four corners each, a slot each."""
    if not quads:
        return None
    points = np.concatenate(quads).astype(np.float32)
    card = np.repeat(np.arange(len(quads), dtype=np.int32), 2)
    triangles = (4 * card[:, None] + np.tile([(0, 1, 2), (0, 2, 3)], (len(quads), 1))).astype(np.int32)
    st = np.concatenate(coordinates).astype(np.float32)
    mesh = Mesh(points, triangles, primvars={_COORDINATES: Primvar(st, triangles)}, material_slots=card, face_ids=card)
    return StandIn(("cards", points.tobytes(), st.tobytes()), mesh, tuple(materials), np.array(color, np.float32))


def _world_to_screen(path: str) -> np.ndarray | None:
    """Return the matrix in an image's metadata, for row vectors: float64, shape [4, 4]; None: there is none."""
    try:
        data = read_asset(path)
        found = _exr_matrix(data) if data.startswith(b"\x76\x2f\x31\x01") else _tiff_matrix(data)
        matrix = np.array(found, float).reshape(4, 4)
    except Exception:  # no such file, or whatever a decoder meets in a damaged one: told when its texels are read
        return None
    return matrix if np.isfinite(matrix).all() else None


def _exr_matrix(data: bytes) -> object:
    import OpenEXR  # here, as for texels

    header = OpenEXR.File(io.BytesIO(data), header_only=True).header()
    return next((header[name] for name in _MATRIX_NAMES if name in header), None)


def _tiff_matrix(data: bytes) -> object:
    with TiffImageFile(io.BytesIO(data)) as image:
        return image.tag_v2[_TIFF_WORLD_TO_SCREEN]
