# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Silhouettes beside reference pictures that other renderers made of the same stages.

    python -m benchmarks references OUT                    all stages whose camera is authored
    python -m benchmarks references OUT --only test_0202 --only Nurbs
    python -m benchmarks references OUT --gallery          and the pictures of docs/gallery.md

The pairs are those of corpora/references.tsv in the test data (WARP_RT_TEST_DATA): Arnold's of arnold-usd's tests,
Storm's of OpenUSD's, where a camera of the stage is used. Others were framed by the bounding boxes of
programs in versions that nobody wrote down. Each stage is rendered at its picture's size and frame, by the
camera, complexity and purposes that its test asked for, with dome lights hidden, and the overlap of both silhouettes is

    IoU = (pixels that both cover) / (pixels that either covers).

A pixel is covered where alpha is above one half. Of an opaque reference those are covered that are not of the
background's colour (the one that the test cleared with, else the corners'), which holds for a small share of a pixel,
so that a small share counts in ours, too; there is nothing to compare where the corners differ from one another, as
they do before a dome with a texture. Arnold filters by a Gaussian two pixels wide, and so do we beside it; where its
pixels have one sample, ours have one, in the middle. Storm does not know depth of field, and beside it there is none.
benchmarks/reference_settings.py lists with what else some pictures were made, and why. OUT gets references.tsv, the
pictures, and sheets that show reference, ours and the difference of coverage (red: theirs alone, blue: ours alone), the
worst first.
"""

from __future__ import annotations

import csv
import math
import re
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image as PillowImage
from PIL import ImageDraw
from pxr import Usd, UsdRender

from warp_rt import Renderer, RenderOptions, Scene
from warp_rt.api import open_scene
from warp_rt.errors import WarpRtError
from warp_rt.image.image import Image
from warp_rt.options import COMPLEXITIES
from warp_rt.rendering.film import Film
from warp_rt.rendering.shutter import render_frame

from .command import make_parser, save_if_asked
from .meshes import find_test_data
from .reference_settings import setting_of
from .results import ROOT, Row

GOAL = 0.98
SAMPLES = 16  # a pixel, and beside Arnold one of its parts
PARTS = 3  # of a pixel's side, which Arnold's filter is summed over
FILTER_RADIUS = 1.0  # of Arnold's Gaussian, exp(-2 r^2) [pixel]
BACKGROUND_STEPS = 3  # 8-bit steps within which a pixel has the background's colour
BACKGROUND_SHARE = BACKGROUND_STEPS / 255 / 0.3  # of a pixel, that takes it so far at a contrast of 0.3
CELL, COLUMNS, ROWS, LABEL = (160, 120), 3, 8, 24  # of a sheet: pairs side by side, and one below the other [pixel]
# Pictures of docs/gallery.md, by a part of the reference's path.
GALLERY = {
    "test_1352/": "crowd",
    "test_2231/": "velocities",
    "test_2544/": "shutter",
    "TetMesh_000": "tetrahedra",
    "NurbsPatch_001": "nurbs",
    "Sphere_010": "sphere",
}
GALLERY_FOLDER = ROOT / "docs" / "images" / "gallery"
GALLERY_WIDTH = 320  # of the reference and of ours [pixel]


@dataclass(frozen=True)
class Pair:
    """A stage, a picture of it by others, and how that was made."""

    stage: str
    image: str
    renderer: str
    """``arnold`` or ``storm``."""
    camera: str = ""
    """Path; empty: the one that the stage would be seen by."""
    frame: float | None = None
    """Time code; None: default values."""
    complexity: str = "low"
    purposes: tuple[str, ...] = ("proxy",)
    policy: str = ""
    """What gives way where camera and picture differ in aspect; empty: what the render settings say."""
    background: tuple[float, ...] | None = None
    """Colour and alpha that the picture was cleared with, where the test says so."""


@dataclass(frozen=True)
class Result:
    """How well two silhouettes overlap."""

    pair: Pair
    overlap: float
    """NaN where there is no picture to compare."""
    theirs: float
    """Share of the picture that is covered."""
    ours: float
    seconds: float
    note: str = ""
    noise: float = math.nan
    """Overlap of our silhouette with itself, drawn with as few samples as the reference has; NaN: not known."""


def main(arguments: Sequence[str]) -> None:
    """Render the stages, write the table and the sheets, and print those below the goal."""
    parser = make_parser("references", __doc__, rounds=1)
    parser.add_argument("out", type=Path, help="folder for the table, pictures and sheets")
    parser.add_argument("--only", action="append", default=[], metavar="TEXT", help="pictures whose path has TEXT")
    parser.add_argument("--gallery", action="store_true", help="also the pictures of docs/gallery.md")
    chosen = parser.parse_args(arguments)
    table = find_test_data("corpora/references.tsv")
    if table is None:
        sys.exit("references: no corpora in the test data: WARP_RT_TEST_DATA names the folder that holds corpora/")
    corpora = table.parent
    pairs = [pair for pair in read_pairs(corpora) if not chosen.only or any(text in pair.image for text in chosen.only)]
    (chosen.out / "pictures").mkdir(parents=True, exist_ok=True)
    results = [compare(corpora, pair, chosen.out / "pictures") for pair in pairs]
    results.sort(key=lambda result: (not math.isnan(result.overlap), result.overlap))
    write_table(chosen.out / "references.tsv", results)
    write_sheets(corpora, chosen.out, results)
    if chosen.gallery:
        write_gallery(corpora, chosen.out, results)
    print(summary(results))
    save_if_asked(chosen, "references", rows_of(results), ("image",))


# --- what there is


def read_pairs(corpora: Path) -> Iterator[Pair]:
    """Yield the pairs whose camera is known."""
    with (corpora / "references.tsv").open(newline="", encoding="utf-8") as table:
        rows = list(csv.DictReader(table, delimiter="\t"))
    with (corpora / "stages.tsv").open(newline="", encoding="utf-8") as table:
        has_camera = {row["path"]: row["cams"] not in ("", "0") for row in csv.DictReader(table, delimiter="\t")}
    for row in rows:
        pair = None
        if row["renderer"].startswith("Arnold") and row["class"] != "C" and has_camera.get(row["stage"]):
            pair = _arnold(row)
        elif "testUsdImagingGLBasicDrawing" in row["options"] and "-displayWindow" not in row["options"]:
            pair = _storm(row)
        if pair is not None:
            yield pair


def _arnold(row: dict[str, str]) -> Pair:
    """Arnold keeps a camera's horizontal field of view, and without a frame it reads frame 0."""
    options = row["options"]
    camera = re.search(r"-c (\S+?)'", options)
    return Pair(
        row["stage"],
        row["image"],
        "arnold",
        camera=camera[1] if camera else "",
        frame=float(row["frame"] or 0),
        purposes=("render",),
        policy="adjustApertureHeight",
    )


def _storm(row: dict[str, str]) -> Pair | None:
    """The view is known where the test names a camera."""
    words = row["options"].split()
    known: dict[str, list[str]] = {}
    for word in words:
        if re.fullmatch(r"-[a-zA-Z]+", word):
            known[word] = []
        elif known:
            known[list(known)[-1]].append(word)
    if "-camera" not in known:
        return None
    complexity = row["variant"].removeprefix("complexity ") or (known.get("-complexity") or ["1"])[0]
    purposes = [
        purpose
        for purpose, flag, is_shown in (
            ("render", "-renderPurpose", "hide"),
            ("proxy", "-proxyPurpose", "show"),
            ("guide", "-guidesPurpose", "hide"),
        )
        if (known.get(flag) or [is_shown])[0] == "show"
    ]
    clear = known.get("-clear")
    return Pair(
        row["stage"],
        row["image"],
        "storm",
        camera=known["-camera"][0],
        frame=float(row["frame"]) if row["frame"] else None,
        complexity=COMPLEXITIES[min(round(10 * (float(complexity) - 1)), len(COMPLEXITIES) - 1)],
        purposes=("default", *purposes),
        policy="expandAperture" if known.get("-windowPolicy") == ["fit"] else "adjustApertureWidth",
        background=tuple(map(float, clear[:4])) if clear else None,
    )


# --- one of them


def compare(corpora: Path, pair: Pair, pictures: Path) -> Result:
    """Render a stage as its reference was, and compare the silhouettes."""
    start = time.perf_counter()
    try:
        with PillowImage.open(corpora / pair.image) as image:
            width, height = image.size
        picture = render_pair(corpora, pair, (height, width))
        picture.save(pictures / _name(pair))
        theirs, is_opaque = read_coverage(corpora, pair)
    except (WarpRtError, OSError, ValueError) as error:
        return Result(pair, math.nan, math.nan, math.nan, time.perf_counter() - start, " ".join(str(error).split()))
    ours = our_coverage(pair, picture.alpha, is_opaque)
    noise = math.nan
    setting = setting_of(pair.image)
    if setting is not None and setting.samples:
        drawn = np.random.default_rng(0).binomial(setting.samples, picture.alpha.clip(0, 1)) / setting.samples
        noise = _overlap(silhouette(pair, drawn), ours)
    seconds = time.perf_counter() - start
    return Result(pair, _overlap(theirs, ours), float(theirs.mean()), float(ours.mean()), seconds, noise=noise)


def _overlap(first: np.ndarray, second: np.ndarray) -> float:
    either = (first | second).sum()
    return float((first & second).sum() / either) if either else 1.0


def read_coverage(corpora: Path, pair: Pair) -> tuple[np.ndarray, bool]:
    """Return which pixels a reference covers, bool, shape [height, width], and whether it is opaque.

    Raises:
        ValueError: It is opaque, and its corners differ or it has no outline.
    """
    with PillowImage.open(corpora / pair.image) as image:
        pixels = np.asarray(image.convert("RGBA"), np.float64)
    alpha, color = pixels[..., 3] / 255, pixels[..., :3]
    if alpha.min() < 1 and alpha.max() > 0:
        return silhouette(pair, alpha), False
    setting = setting_of(pair.image)
    if setting is not None and setting.has_no_outline:
        raise ValueError(f"{setting.reason}: nothing to compare")
    corners = color[[0, 0, -1, -1], [0, -1, 0, -1]]
    if pair.background is not None:
        background = 255 * np.array(pair.background[:3])
    elif np.ptp(corners, axis=0).max() <= BACKGROUND_STEPS:
        background = corners[0]
    else:
        raise ValueError("opaque, with no one colour behind: nothing to compare")
    return (np.abs(color - background) > BACKGROUND_STEPS).any(axis=2), True


def our_coverage(pair: Pair, alpha: np.ndarray, is_opaque: bool) -> np.ndarray:
    """Return which pixels of ours are covered, as those of a reference are told, bool, shape [height, width]."""
    if not is_opaque:
        return silhouette(pair, alpha)
    return alpha > (BACKGROUND_SHARE if pair.renderer == "arnold" else 0)


def silhouette(pair: Pair, alpha: np.ndarray) -> np.ndarray:
    """Return what alpha covers, bool, shape [height, width].

    That is where it is above one half; where noise asks for smoothing, above half of its largest smoothed value.
    """
    setting = setting_of(pair.image)
    if setting is None or not setting.smoothing:
        return alpha > 0.5
    reach = math.ceil(3 * setting.smoothing)
    weights = np.exp(-(np.arange(-reach, reach + 1) ** 2) / (2 * setting.smoothing**2))
    weights /= weights.sum()
    for axis in (0, 1):
        alpha = np.apply_along_axis(
            lambda line: np.convolve(np.pad(line, reach, mode="edge"), weights, "valid"), axis, alpha
        )
    return alpha > 0.5 * alpha.max()


def render_pair(corpora: Path, pair: Pair, shape: tuple[int, int]) -> Image:
    """Return our picture of a stage, filtered as the reference is."""
    if pair.renderer != "arnold":
        return Image(_render(corpora, pair, shape, SAMPLES))
    setting = setting_of(pair.image)
    is_blurred = setting is not None and setting.smoothing > 0
    count, samples = (1, 1) if is_sampled_once(corpora / pair.stage) and not is_blurred else (PARTS, SAMPLES)
    film = _render(corpora, pair, (count * shape[0], count * shape[1]), samples)
    filtered = {name: filter_parts(film.aovs[name], count) for name in ("color", "alpha")}
    return Image(replace(film, width=shape[1], height=shape[0], aovs=filtered))


def is_sampled_once(path: Path) -> bool:
    """Return whether Arnold gave each pixel of a stage one sample, which lies in its middle.

    That is what ``AA_samples`` of 1 asks for, and what its tests have where no RenderSettings are: of such pictures all
    alphas between 0 and 1 are k w or 1 - k w, with w the weight of one neighbour in the filter.
    """
    stage = Usd.Stage.Open(str(path))
    settings = [prim for prim in stage.TraverseAll() if prim.IsA(UsdRender.Settings)]
    counts = [prim.GetAttribute("arnold:global:AA_samples").Get() for prim in settings]
    return not settings or counts == [1]


def filter_parts(parts: np.ndarray, count: int) -> np.ndarray:
    """Return pixels, shape [height, width, ...], of an array that has ``count`` x ``count`` times as many."""
    height, width = parts.shape[0] // count, parts.shape[1] // count
    around = ((count, count), (count, count)) + ((0, 0),) * (parts.ndim - 2)
    padded = np.pad(parts.astype(np.float64), around, mode="edge")
    total, weights = np.zeros((height, width, *parts.shape[2:])), 0.0
    offsets = (np.arange(3 * count) + 0.5) / count - 1.5
    for row, y in enumerate(offsets):
        for column, x in enumerate(offsets):
            if x * x + y * y <= FILTER_RADIUS**2:
                weight = math.exp(-2 * (x * x + y * y))
                total += weight * padded[row:, column:][: height * count : count, : width * count : count]
                weights += weight
    return (total / weights).astype(np.float32)


def _render(corpora: Path, pair: Pair, shape: tuple[int, int], samples: int) -> Film:
    setting = setting_of(pair.image)
    stage = Usd.Stage.Open(str(corpora / pair.stage))
    if setting is not None and setting.edit is not None:
        stage = Usd.Stage.Open(stage.Flatten())
        setting.edit(stage, Usd.TimeCode.Default() if pair.frame is None else Usd.TimeCode(pair.frame))
    at_default = pair.renderer.startswith("storm") and pair.frame is None
    complexity = (setting.complexity if setting is not None else "") or pair.complexity
    source = open_scene(stage, default_time=at_default, purposes=pair.purposes, complexity=complexity)
    frame = _prepared(source.scene(pair.frame), pair)
    options = RenderOptions(width=shape[1], height=shape[0], spp=samples, depth=3)
    eye = pair.camera or None
    film, _ = render_frame(
        Renderer(frame, options, device="cpu"),
        lambda time: (_prepared(source.scene(time, base_time=frame.time), pair), eye),
        camera=eye,
    )
    for before in () if setting is None else setting.frames_before:
        film = _over(film, _render(corpora, replace(pair, image="", frame=before), shape, samples))
    return film


def _over(front: Film, back: Film) -> Film:
    behind = 1 - front.aovs["alpha"]
    aovs = {
        "color": front.aovs["color"] + behind[..., None] * back.aovs["color"],
        "alpha": front.aovs["alpha"] + behind * back.aovs["alpha"],
    }
    return replace(front, aovs=aovs)


def _prepared(scene: Scene, pair: Pair) -> Scene:
    settings = replace(scene.settings, aspect_policy=pair.policy) if pair.policy else scene.settings
    if pair.renderer.startswith("storm"):
        settings = replace(settings, disables_depth_of_field=True)
    return replace(scene, settings=settings, domes=tuple(replace(dome, is_visible=False) for dome in scene.domes))


# --- what is told


def summary(results: Sequence[Result]) -> str:
    """Return the table that people read."""
    lines = []
    for renderer in dict.fromkeys(result.pair.renderer for result in results):
        found = [r for r in results if r.pair.renderer == renderer]
        good = [r for r in found if r.overlap >= GOAL]
        median = float(np.nanmedian([r.overlap for r in found]))
        lines.append(f"{renderer}: {len(good)} of {len(found)} at {GOAL} or more, median {median:.4f}")
    lines += [
        f"{r.overlap:.4f}  theirs {r.theirs:.3f} ours {r.ours:.3f}  {r.pair.image} {r.note}"
        + ("" if math.isnan(r.noise) else f" noise alone: {r.noise:.4f}")
        for r in results
        if not r.overlap >= GOAL
    ]
    return "\n".join(lines)


def rows_of(results: Sequence[Result]) -> list[Row]:
    """Return a row a picture that can be compared."""
    return [
        {
            "image": r.pair.image,
            "renderer": r.pair.renderer,
            **{
                name: round(value, 4)
                for name, value in (("overlap", r.overlap), ("theirs", r.theirs), ("ours", r.ours))
            },
        }
        for r in sorted(results, key=lambda result: result.pair.image)
        if not math.isnan(r.overlap)
    ]


def write_table(path: Path, results: Sequence[Result]) -> None:
    """Write a row a pair."""
    with path.open("w", newline="", encoding="utf-8") as table:
        rows = csv.writer(table, delimiter="\t", lineterminator="\n")
        rows.writerow(["image", "stage", "renderer", "frame", "overlap", "theirs", "ours", "seconds", "note"])
        for r in sorted(results, key=lambda result: result.pair.image):
            numbers = [f"{number:.4f}" for number in (r.overlap, r.theirs, r.ours)]
            rows.writerow(
                [r.pair.image, r.pair.stage, r.pair.renderer, r.pair.frame, *numbers, f"{r.seconds:.2f}", r.note]
            )


def write_sheets(corpora: Path, out: Path, results: Sequence[Result]) -> None:
    """Write contact sheets of reference, ours and difference, in the order of the results."""
    per_sheet = COLUMNS * ROWS
    width, height = 3 * CELL[0] + 8, CELL[1] + LABEL
    for number in range(0, len(results), per_sheet):
        sheet = PillowImage.new("RGB", (COLUMNS * width, ROWS * height), (64, 64, 64))
        draw = ImageDraw.Draw(sheet)
        for place, result in enumerate(results[number : number + per_sheet]):
            x, y = place % COLUMNS * width, place // COLUMNS * height
            for column, part in enumerate(_parts(corpora, out, result)):
                part.thumbnail((CELL[0] - 2, CELL[1]))
                sheet.paste(part, (x + column * CELL[0], y + LABEL), part)
            name = "/".join(Path(result.pair.image).with_suffix("").parts[-4:])
            draw.text((x, y), f"{result.overlap:.4f} {result.pair.renderer} {result.note[:50]}", fill="yellow")
            draw.text((x, y + LABEL // 2), name[-78:], fill="white")
        sheet.save(out / f"sheet_{number // per_sheet:02}.png")


def write_gallery(corpora: Path, out: Path, results: Sequence[Result]) -> None:
    """Write reference and ours side by side, for the documents."""
    GALLERY_FOLDER.mkdir(parents=True, exist_ok=True)
    for result in results:
        for part, name in GALLERY.items():
            if part in result.pair.image:
                pair = _parts(corpora, out, result)[:2]
                height = round(GALLERY_WIDTH * pair[0].height / pair[0].width)
                both = PillowImage.new("RGB", (2 * GALLERY_WIDTH + 4, height), (64, 64, 64))
                for column, picture in enumerate(pair):
                    scaled = picture.resize((GALLERY_WIDTH, height), PillowImage.Resampling.LANCZOS)
                    both.paste(scaled, (column * (GALLERY_WIDTH + 4), 0), scaled)
                both.save(GALLERY_FOLDER / f"{name}.png", optimize=True)


def _parts(corpora: Path, out: Path, result: Result) -> list[PillowImage.Image]:
    with PillowImage.open(corpora / result.pair.image) as image:
        parts = [image.convert("RGBA")]
    ours = out / "pictures" / _name(result.pair)
    if not ours.is_file():
        return parts
    with PillowImage.open(ours) as image:
        parts.append(image.convert("RGBA"))
    if math.isnan(result.overlap):
        return parts
    theirs, is_opaque = read_coverage(corpora, result.pair)
    covered = our_coverage(result.pair, np.asarray(parts[1])[..., 3] / 255, is_opaque)
    both = 0.6 * (theirs & covered)
    difference = np.stack([np.maximum(theirs & ~covered, both), both, np.maximum(covered & ~theirs, both)], axis=2)
    parts.append(PillowImage.fromarray((255 * difference).astype(np.uint8)).convert("RGBA"))
    return parts


def _name(pair: Pair) -> str:
    return str(Path(pair.image).with_suffix(".png")).replace("/", "__")
