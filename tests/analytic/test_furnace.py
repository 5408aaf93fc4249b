# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The white furnace: under a dome of radiance 1 no surface sends out more than 1, and what loses nothing exactly 1."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pytest

import warp_rt
from warp_rt.kernels.constants import ALBEDO_COLUMNS, ALBEDO_ROWS, MIRROR_FADE_START
from warp_rt.upload.specular_albedo import integrate, specular_albedo

SLACK = 1e-3
BALL = 12  # pixels across a ball
COLUMNS = 16
# Every input that reflects, from end to end; what is not named has the specification's default.
SWEEP = [
    *(
        {"diffuseColor": d, "roughness": r, "ior": i}
        for d, r, i in product((0.5, 1), (0, 0.15, 0.25, 0.5, 1), (1, 1.1, 1.5, 3))
    ),
    *(
        {"diffuseColor": d, "roughness": r, "metallic": m}
        for d, r, m in product((0.5, 1), (0, 0.2, 0.4, 0.8), (0.5, 1))
    ),
    *(
        {"diffuseColor": 1, "roughness": r, "useSpecularWorkflow": 1, "specularColor": s}
        for r, s in product((0, 0.2, 0.5, 1), (0, 0.01, 0.3, 1))
    ),
    *(
        {"diffuseColor": 1, "metallic": m, "roughness": r, "clearcoat": c, "clearcoatRoughness": q}
        for m, r, c, q in product((0, 1), (0, 0.3, 0.7), (0.5, 1), (0.01, 0.25, 0.6))
    ),
    *({"diffuseColor": 1, "opacity": o, "roughness": r} for o, r in product((0, 0.5), (0, 0.3, 0.8))),
    {"diffuseColor": 1, "opacity": 0.5, "opacityMode": '"presence"'},
    {"diffuseColor": 1, "opacity": 0, "roughness": 0, "clearcoat": 1},
    # Bent away from the viewer over half of the ball.
    *(
        {"diffuseColor": d, "metallic": m, "opacity": o, "roughness": 0.4, "normal": "(0, -1, 0.01)"}
        for d, m, o in ((0, 1, 1), (1, 1, 1), (1, 0, 1), (0, 0, 0))
    ),
    # Thinner than what is around it: all of the lobes is reflected totally, but for what a rough one takes.
    *(
        {
            "diffuseColor": 0,
            "opacity": 0,
            "roughness": r,
            "clearcoat": 1,
            "clearcoatRoughness": 0.27,
            "ior": i,
            "useSpecularWorkflow": 1,
            "specularColor": 0.3,
        }
        for r, i in product((0.3, 0.5), (0.001, 0.75))
    ),
]
LOSSLESS = {
    "diffuse": {"diffuseColor": 1, "useSpecularWorkflow": 1, "specularColor": 0, "ior": 1},
    "diffuse of index 1": {"diffuseColor": 1, "ior": 1, "roughness": 0.3},
    "mirror": {"diffuseColor": 1, "metallic": 1, "roughness": 0},
    "glass": {"diffuseColor": 0, "opacity": 0, "roughness": 0},
    "bumpy mirror": {"diffuseColor": 1, "metallic": 1, "roughness": 0, "normal": "(0.8, 0, 0.6)"},
    "coated mirror": {"diffuseColor": 1, "metallic": 1, "roughness": 0, "clearcoat": 1},
}
_TYPES = {"useSpecularWorkflow": "int", "opacityMode": "token", "normal": "normal3f"}


def stage(materials: list[dict[str, object]], folder: Path) -> Path:
    """Return a stage of balls, one a material, row by row from the top, under a white dome.

    The view is parallel, so each can lie far behind the one before it and none stands in another's light.
    """
    rows = -(-len(materials) // COLUMNS)
    parts = []
    for k, inputs in enumerate(materials):
        lines = []
        for name, value in inputs.items():
            kind = "color3f" if name.endswith("Color") else _TYPES.get(name, "float")
            shown = f"({value}, {value}, {value})" if kind == "color3f" else value
            lines.append(f"{kind} inputs:{name} = {shown}")
        place = (2.5 * (k % COLUMNS - (COLUMNS - 1) / 2), 2.5 * ((rows - 1) / 2 - k // COLUMNS), -50 * k)
        parts.append(f"""
def Sphere "ball{k}" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
    double radius = 1
    rel material:binding = </material{k}>
    double3 xformOp:translate = {place}
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}
def Material "material{k}" {{
    token outputs:surface.connect = </material{k}/shader.outputs:surface>
    def Shader "shader" {{
        uniform token info:id = "UsdPreviewSurface"
        {chr(10).join(lines)}
        token outputs:surface
    }}
}}""")
    camera = f"""#usda 1.0
(upAxis = "Y")
def DomeLight "dome" {{}}
def Camera "camera" {{
    token projection = "orthographic"
    float horizontalAperture = {25 * COLUMNS}
    float verticalAperture = {25 * rows}
    double3 xformOp:translate = (0, 0, 50)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}}"""
    path = folder / "furnace.usda"
    path.write_text(camera + "".join(parts))
    return path


def balls(materials: list[dict[str, object]], folder: Path, **options: object) -> np.ndarray:
    """Return the pictures of the balls: shape [n, height, width, 3]."""
    rows = -(-len(materials) // COLUMNS)
    image = warp_rt.render(
        stage(materials, folder), width=COLUMNS * BALL, height=rows * BALL, threshold=0, device="cpu", **options
    )
    tiles = image.linear.reshape(rows, BALL, COLUMNS, BALL, 3).swapaxes(1, 2).reshape(-1, BALL, BALL, 3)
    return tiles[: len(materials)]


def test_nothing_sends_out_more_than_it_gets(tmp_path: Path) -> None:
    """To within the table's interpolation; balls see only the dome, and glass itself."""
    for inputs, tile in zip(SWEEP, balls(SWEEP, tmp_path, depth=12), strict=True):
        assert tile.max() <= 1 + SLACK, inputs


def test_samples_add_up_to_no_more(tmp_path: Path) -> None:
    """The mean over a ball, of 144 pixels and 64 samples each, is known to a standard error of 0.002."""
    for inputs, tile in zip(SWEEP, balls(SWEEP, tmp_path, depth=12, light_samples=64), strict=True):
        assert tile.mean() <= 1 + SLACK + 0.006, inputs


@pytest.mark.parametrize("samples", [0, 4])
def test_what_loses_nothing_vanishes(samples: int, tmp_path: Path) -> None:
    """Diffuse, mirror and glass balls look like the dome behind them; glass needs its many inner reflections."""
    tiles = balls(list(LOSSLESS.values()), tmp_path, depth=20, light_samples=samples)
    for name, tile in zip(LOSSLESS, tiles, strict=True):
        np.testing.assert_allclose(tile, 1, atol=SLACK, err_msg=name)


@pytest.mark.parametrize("samples", [0, 256])
def test_bright_surfaces_lose_little(samples: int, tmp_path: Path) -> None:
    """White plastic: what its gloss takes at grazing angles it gives, so that no edge is dark."""
    plastics = [{"diffuseColor": 1, "roughness": r} for r in (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)]
    for inputs, tile in zip(plastics, balls(plastics, tmp_path, light_samples=samples), strict=True):
        assert tile.mean() > 0.975, inputs


def test_the_table_is_what_it_says() -> None:
    """Between its entries too, against a finer quadrature, weighted as mirror rays leave it over."""
    rng = np.random.default_rng(3)
    roughness, cosine = rng.uniform(0.12, 1, 60), rng.uniform(0.1, 1, 60) ** 2
    x = (roughness - float(MIRROR_FADE_START)) / (1 - float(MIRROR_FADE_START)) * (int(ALBEDO_ROWS) - 1)
    y = np.cbrt(cosine) * (int(ALBEDO_COLUMNS) - 1)
    row, column = x.astype(int), np.minimum(y.astype(int), int(ALBEDO_COLUMNS) - 2)
    s, t = (x - row)[:, None], (y - column)[:, None]
    table = specular_albedo().astype(float)
    across = [table[row + k, column] * (1 - t) + table[row + k, column + 1] * t for k in (0, 1)]
    fade = np.clip((roughness - 0.1) / 0.3, 0, 1)
    left_over = (fade * fade * (3 - 2 * fade))[:, None]
    expected = integrate(roughness, cosine, 200)
    np.testing.assert_allclose((across[0] * (1 - s) + across[1] * s) * left_over, expected * left_over, atol=2e-3)
