# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""docs/whitted.md: its example renders to the values that the model gives, its tables hold, its figure can be made."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import warp_rt
from warp_rt.cli.series import parser
from warp_rt.kernels import codes, constants
from warp_rt.options import DEFAULT_DEPTH, DEFAULT_THRESHOLD, MAX_DEPTH, MAX_LIGHT_SAMPLES, SHADOWS

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs" / "whitted.md").read_text(encoding="utf-8")


def rows(heading: str) -> list[list[str]]:
    """Return the cells of the first table below a header row."""
    lines = TEXT[TEXT.index(heading) :].splitlines()[2:]
    table = []
    for line in lines:
        if not line.startswith("|"):
            break
        table.append([cell.strip() for cell in line.strip("|").split("|")])
    return table


# --- the example

IA = np.ones(3)
BACKGROUND = np.array([0.2, 0.4, 0.8])
KA = np.full(3, 0.1)  # the default
KD = np.array([0.6, 0.3, 0.1])
KS, SHININESS, KR = 0.2, 10, 0.25
KT = np.array([0.9, 0.8, 0.7])


@pytest.fixture(scope="module")
def example(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("docs") / "example.usda"
    path.write_text(re.search(r"^```usda\n(.*?)^```", TEXT, re.MULTILINE | re.DOTALL)[1])
    return path


def pixels(example: Path, **options) -> np.ndarray:
    """Return the picture with one pixel a scene unit, its centre at whole coordinates: [2 - y, x + 2]."""
    image = warp_rt.render(example, width=5, height=5, **options)
    assert image.linear.shape == (5, 5, 3)
    return image.linear


def floor(x: float, y: float) -> np.ndarray:
    """Return I_local of the floor at (x, y, 0), lit: N is +z, V is +z, the lamp stands at (2, 0, 4)."""
    to_light = np.array([2 - x, -y, 4.0])
    n_l = to_light[2] / np.linalg.norm(to_light)
    return KA * IA + KD * n_l + KS * n_l**SHININESS  # R_l.V = (R_l)_z = N.L


def test_example_is_clean(example: Path):
    assert warp_rt.load_scene(example).diagnostics == ()


@pytest.mark.parametrize(("x", "y"), [(2, 0), (0, 2), (2, 2)])
def test_floor_of_the_example(example: Path, x: int, y: int):
    seen = pixels(example)[2 - y, x + 2]
    np.testing.assert_allclose(seen, floor(x, y) + KR * BACKGROUND, rtol=1e-5)
    np.testing.assert_allclose(pixels(example, depth=1)[2 - y, x + 2], floor(x, y), rtol=1e-5)


@pytest.mark.parametrize(
    ("depth", "expected"),
    [
        (2, 0 * KT),
        (3, KT**2 * KA),
        (5, KT**2 * KA),
        (6, KT**2 * (KA + KR * KT**2 * BACKGROUND)),
        (7, KT**2 * (KA + KR * KT**2 * BACKGROUND)),
    ],
)
def test_ball_of_the_example(example: Path, depth: int, expected: np.ndarray):
    """In and out of the glass, the shadowed floor, and back through the glass to the sky: depths 1 to 3, and 4 to 6."""
    seen = pixels(example, depth=depth, threshold=0.0)[2, 2]
    np.testing.assert_allclose(seen, expected, rtol=1e-5, atol=1e-7)


def test_shadow_modes_of_the_example(example: Path):
    """In its shadow an opaque ball leaves the ambient term, a transparent one the light times Kt for each crossing."""
    assert {row[0].split()[0].strip("`") for row in rows("| mode |")} == set(SHADOWS)
    ambient = KA + KR * BACKGROUND
    lit = floor(-2, 0) - KA
    for shadows, expected in (("opaque", ambient), ("auto", ambient), ("transmit", ambient + KT**2 * lit)):
        np.testing.assert_allclose(pixels(example, shadows=shadows)[2, 0], expected, rtol=1e-5)


# --- tables and figures


def test_inputs_are_those_of_the_material():
    assert tuple(row[0].strip("`") for row in rows("| input |")) == codes.WHITTED_INPUTS


def test_defaults_are_those_of_the_material(example: Path, tmp_path: Path):
    """A shader that says nothing looks like one that says the documented defaults."""
    pictures = []
    authored = "".join(f"{kind} inputs:{name[1:-1]} = {value}\n" for name, kind, value, _ in rows("| input |"))
    for body in ("", authored):
        text = re.sub(
            r'("WhittedSurface"\n).*?( token outputs:surface\n)', rf"\1{body}\2", example.read_text(), flags=re.DOTALL
        )
        assert "inputs:reflection = (0.25" not in text
        path = tmp_path / "defaults.usda"
        path.write_text(text)
        pictures.append(warp_rt.render(warp_rt.load_scene(_open(path)), width=5, height=5).linear)
    np.testing.assert_array_equal(*pictures)


def _open(path: Path):
    from pxr import Usd

    stage = Usd.Stage.Open(str(path))
    stage.Reload()
    return stage


def test_scene_wide_terms(example: Path):
    table = {row[0].strip("`"): row for row in rows("| attribute |")}
    names = ("ambient", "background", "depth", "threshold", "lightSamples")
    assert list(table) == [f"warp_rt:{name}" for name in names]
    assert int(table["warp_rt:depth"][2]) == DEFAULT_DEPTH
    assert table["warp_rt:threshold"][2] == f"1/{round(1 / DEFAULT_THRESHOLD)}"
    assert str(MAX_DEPTH) in table["warp_rt:depth"][4]
    assert f"0 to {MAX_LIGHT_SAMPLES}" in table["warp_rt:lightSamples"][4]
    settings = warp_rt.load_scene(example).settings
    assert settings.ambient == (1, 1, 1)
    assert settings.background == pytest.approx(tuple(BACKGROUND))


def test_bounds_in_the_text():
    assert f"1 up to roughness {float(constants.MIRROR_FADE_START)}" in TEXT
    assert f"0 from {float(constants.MIRROR_FADE_END)} on" in TEXT
    limit = int(constants.PASS_LIMIT)
    assert f"at most {limit} times" in TEXT
    assert float(constants.SPAWN_OFFSET) == 2.0**-19
    assert int(constants.CYLINDER_FACETS) == 6
    assert f"below {float(constants.SOLID_ANGLE_MIN)} sr" in TEXT
    assert f"at most {int(constants.GRAZING_FADE)} F0" in TEXT
    assert float(constants.IMAGE_SHARE) == 0.5


@pytest.mark.parametrize("document", ["whitted.md", "usd.md", "conventions.md"])
def test_links_to_functions_lead_to_the_file_that_has_them(document: str):
    text = (ROOT / "docs" / document).read_text(encoding="utf-8")
    for name, link in re.findall(r"\[`(\w+)`\]\((\.\./[\w/]+\.py)\)", text):
        source = (ROOT / "docs" / link).resolve().read_text(encoding="utf-8")
        assert re.search(rf"^(def|class) {name}\b|^{name} =", source, re.MULTILINE), f"{name} is not in {link}"


def test_figure_can_be_made():
    """The command is there; at depth 1 alone the mirror has its ambient shade: ka Ia = (0.03, 0.04, 0.05)."""
    command, *arguments = re.search(r"`warp-rt (series .*?)`", TEXT)[1].split()
    assert command == "series"
    args = parser().parse(arguments)
    assert (ROOT / args.scene).is_file()
    assert args.depths == tuple(range(1, 8))
    shade = np.round(255 * (1.055 * np.array([0.03, 0.04, 0.05]) ** (1 / 2.4) - 0.055))
    for step in warp_rt.render_series(ROOT / args.scene, args.depths, width=32, spp=args.spp).steps:
        is_shade = (np.asarray(step.image)[..., :3] == shade).all(axis=2)
        assert (is_shade.mean() > 0.1) if step.depth == 1 else not is_shade.any()
