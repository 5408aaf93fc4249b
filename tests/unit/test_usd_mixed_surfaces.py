# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Mixtures of surfaces: what they reflect and send out is held against the formulas of UsdPreviewSurface."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image as PilImage

from warp_rt.scene import OpacityMode
from warp_rt.scene.texture_values import texture_values

from ..material_stages import read_material


def shader(name: str, identifier: str, *lines: str) -> str:
    body = "\n".join((f'uniform token info:id = "{identifier}"', *lines, "token outputs:out", "token outputs:surface"))
    return f'def Shader "{name}" {{\n{body}\n}}\n'


def preview(name: str, *lines: str) -> str:
    return shader(name, "UsdPreviewSurface", *lines)


def mixture(*lines: str, name: str = "S", fg: str = "A", bg: str = "B") -> str:
    wires = [f"token inputs:{port}.connect = </M/{source}.outputs:out>" for port, source in (("fg", fg), ("bg", bg))]
    return shader(name, "ND_mix_surfaceshader", *wires, *lines)


def value(material, name: str, count: int = 3) -> np.ndarray:
    return np.array(material.inputs[name].value[:count])


RED = preview("A", "color3f inputs:diffuseColor = (0.8, 0.1, 0)", "float inputs:roughness = 0.2")
BLUE = preview("B", "color3f inputs:diffuseColor = (0, 0.1, 0.6)", "color3f inputs:emissiveColor = (1, 2, 3)")


def test_two_surfaces_of_one_kind_are_mixed_input_by_input():
    material, told, _ = read_material(mixture("float inputs:mix = 0.25") + RED + BLUE)
    np.testing.assert_allclose(value(material, "diffuseColor"), (0.2, 0.1, 0.45), rtol=1e-6)
    np.testing.assert_allclose(value(material, "emissiveColor"), (0.75, 1.5, 2.25), rtol=1e-6)
    np.testing.assert_allclose(value(material, "roughness", 1), 0.25 * 0.2 + 0.75 * 0.5, rtol=1e-6)
    assert not material.use_specular_workflow
    message = "the surface 'ND_mix_surfaceshader' is approximated by a UsdPreviewSurface of mixed inputs"
    assert told == [("W302", message)]


def test_a_metal_and_a_dielectric_are_mixed_as_what_they_reflect():
    """Diffuse (1 - metallic) diffuseColor and F0 = lerp(R^2 c, c, metallic), c = lerp(1, diffuseColor, metallic)."""
    gold, m, n = (0.9, 0.6, 0.2), 0.75, 1.4
    metal = preview(
        "A", f"color3f inputs:diffuseColor = {gold}", f"float inputs:metallic = {m}", f"float inputs:ior = {n}"
    )
    material, _, _ = read_material(mixture("float inputs:mix = 0.5") + metal + BLUE)
    gold = np.array(gold)
    tint = (1 - m) + m * gold
    of_metal = ((n - 1) / (n + 1)) ** 2 * tint * (1 - m) + tint * m
    np.testing.assert_allclose(value(material, "specularColor"), 0.5 * of_metal + 0.5 * 0.04, rtol=1e-6)
    # What is reflected diffusely, seen head on, is each one's diffuse colour times what its own lobe leaves.
    diffuse, head_on = value(material, "diffuseColor"), value(material, "specularColor")
    expected = 0.5 * (1 - m) * gold * (1 - of_metal) + 0.5 * np.array((0, 0.1, 0.6)) * (1 - 0.04)
    np.testing.assert_allclose(diffuse * (1 - head_on), expected, rtol=1e-6)
    assert material.use_specular_workflow
    assert "metallic" not in material.inputs


def test_a_weight_of_a_texture_makes_textures(tmp_path):
    PilImage.fromarray(np.array([[0, 51], [102, 255]], np.uint8)).save(tmp_path / "mask.png")
    mask = shader("I", "ND_image_float", f"asset inputs:file = @{tmp_path / 'mask.png'}@")
    nodes = mixture("float inputs:mix.connect = </M/I.outputs:out>") + RED + BLUE + mask
    material, told, reader = read_material(nodes)
    spots = np.array([(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)])
    share = np.array([102, 255, 0, 51])[:, None] / 255
    source = material.inputs["diffuseColor"]
    found = texture_values(reader.textures[source.texture], reader.images, spots)[:, :3]
    np.testing.assert_allclose(found, share * (0.8, 0.1, 0) + (1 - share) * np.array((0, 0.1, 0.6)), atol=1e-6)
    assert [code for code, _ in told] == ["W302"]


def test_opacity_has_the_mode_of_the_surface_that_lets_light_through():
    leaf = preview("A", "float inputs:opacity = 0.4", 'token inputs:opacityMode = "presence"')
    material, _, _ = read_material(mixture("float inputs:mix = 0.5") + leaf + BLUE)
    assert material.opacity_mode == OpacityMode.PRESENCE
    np.testing.assert_allclose(value(material, "opacity", 1), 0.7, rtol=1e-6)
    glass = BLUE.replace("token outputs:out", "float inputs:opacity = 0\ntoken outputs:out")
    _, told, _ = read_material(mixture("float inputs:mix = 0.5") + leaf + glass)
    assert "of opacityMode and opacityThreshold the background's" in told[-1][1]


def test_surfaces_of_other_renderers_are_mixed_and_mixtures_too():
    wood = shader("A", "ND_standard_surface_surfaceshader", "color3f inputs:base_color = (0.5, 0.25, 0.125)")
    inner = mixture("float inputs:mix = 0.5", name="C") + wood + BLUE
    material, told, _ = read_material(mixture("float inputs:mix = 0.5", fg="C") + inner)
    expected = 0.25 * np.array((0.5, 0.25, 0.125)) + 0.75 * np.array((0, 0.1, 0.6))
    np.testing.assert_allclose(value(material, "diffuseColor"), expected, rtol=1e-6)
    assert [code for code, _ in told] == ["W302"] * 3


def test_where_one_surface_is_unknown_the_other_counts():
    material, told, _ = read_material(mixture("float inputs:mix = 0.5") + shader("A", "ND_gooch_shade") + BLUE)
    np.testing.assert_allclose(value(material, "diffuseColor"), (0, 0.1, 0.6), rtol=1e-6)
    assert told == [("W301", "the surface 'ND_gooch_shade' is not supported: the other of the mixture counts")]


@pytest.mark.parametrize(
    "nodes", [mixture(fg="S", bg="S"), mixture(fg="C", bg="C") + mixture(name="C", fg="S", bg="S")]
)
def test_circles_end(nodes):
    material, told, _ = read_material(nodes)
    assert material.path == "/__displayColor"
    assert {code for code, _ in told} == {"W301"}


def test_a_surfacematerial_passes_its_surface_on():
    holder = shader("S", "ND_surfacematerial", "token inputs:surfaceshader.connect = </M/B.outputs:out>")
    material, told, _ = read_material(holder + BLUE)
    np.testing.assert_allclose(value(material, "emissiveColor"), (1, 2, 3))
    assert told == []


def test_a_colour_made_a_surface_shines():
    convert = shader("S", "ND_convert_color3_surfaceshader", "color3f inputs:in = (0.1, 0.2, 0.3)")
    material, told, _ = read_material(convert)
    np.testing.assert_allclose(value(material, "emissiveColor"), (0.1, 0.2, 0.3), rtol=1e-6)
    assert not value(material, "diffuseColor").any()
    assert [code for code, _ in told] == ["W302"]


def test_a_colour_with_alpha_made_a_surface_is_there_as_far_as_its_alpha_says():
    """As the library's graph has it, an unlit surface of that opacity."""
    material, _, _ = read_material(
        shader("S", "ND_convert_color4_surfaceshader", "color4f inputs:in = (1, 2, 3, 0.25)")
    )
    np.testing.assert_allclose(value(material, "emissiveColor"), (1, 2, 3), rtol=1e-6)
    assert (material.inputs["opacity"].value[0], material.opacity_mode) == (0.25, OpacityMode.PRESENCE)


def test_a_matt_surface_is_not_dimmed_by_the_metal_that_it_is_mixed_with():
    """Half of what each reflects from a white surrounding, seen head on, both as smooth as mirrors."""
    smooth = "float inputs:roughness = 0"
    metal = preview("A", "color3f inputs:diffuseColor = (1, 1, 1)", "float inputs:metallic = 1", smooth)
    plastic = preview("B", "color3f inputs:diffuseColor = (0.3, 0.3, 0.3)", smooth)
    material, _, _ = read_material(mixture("float inputs:mix = 0.5") + metal + plastic)
    diffuse, head_on = value(material, "diffuseColor"), value(material, "specularColor")
    np.testing.assert_allclose(head_on + (1 - head_on) * diffuse, 0.5 * 1 + 0.5 * (0.04 + 0.96 * 0.3), rtol=1e-6)
    all_metal, _, _ = read_material(mixture("float inputs:mix = 1") + metal + plastic)
    assert not value(all_metal, "diffuseColor").any()
