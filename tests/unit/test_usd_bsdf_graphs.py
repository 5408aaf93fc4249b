# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""ND_surface over graphs of BSDFs, as UsdPreviewSurface: against the definitions of MaterialX's nodes."""

import numpy as np
import pytest
from PIL import Image as PilImage

from warp_rt.scene import OpacityMode
from warp_rt.scene.texture_values import texture_values

from ..material_stages import read_material


def node(name, kind, *lines, output="token outputs:out"):
    body = "\n".join((f'uniform token info:id = "ND_{kind}"', *lines, output))
    return f'def Shader "{name}" {{\n{body}\n}}\n'


def wire(name, source, kind="token"):
    return f"{kind} inputs:{name}.connect = </M/{source}.outputs:out>"


def color(name, *values):
    return f"color3f inputs:{name} = {values}"


def scalar(name, value):
    return f"float inputs:{name} = {value}"


def rough(value):
    return f"float2 inputs:roughness = ({value}, {value})"


def surface(*lines):
    return node("S", "surface", *lines)


def value(material, name):
    return np.array(material.inputs[name].value[: 1 if name in ("roughness", "ior", "opacity", "clearcoat") else 3])


DIFFUSE = node("D", "oren_nayar_diffuse_bsdf", color("color", 0.2, 0.4, 0.6), scalar("weight", 0.5))
GLASS_F0 = (0.5 / 2.5) ** 2  # ior 1.5


def test_a_diffuse_surface_reflects_nothing_else():
    material, told, _ = read_material(surface(wire("bsdf", "D")) + DIFFUSE)
    np.testing.assert_allclose(value(material, "diffuseColor"), (0.1, 0.2, 0.3))
    assert (value(material, "specularColor").tolist(), value(material, "ior").tolist()) == ([0, 0, 0], [1])
    assert material.use_specular_workflow
    assert told == [("W302", "the surface 'ND_surface' of BSDFs is approximated by a UsdPreviewSurface")]


def test_a_dielectric_over_a_diffuse_base():
    top = node("T", "dielectric_bsdf", rough(0.09), color("tint", 1.0, 0.5, 0.25), scalar("weight", 0.5))
    layer = node("L", "layer_bsdf", wire("top", "T"), wire("base", "D"))
    material, told, _ = read_material(surface(wire("bsdf", "L")) + layer + top + DIFFUSE)
    np.testing.assert_allclose(value(material, "diffuseColor"), (0.1, 0.2, 0.3))
    np.testing.assert_allclose(value(material, "specularColor"), 0.5 * GLASS_F0 * np.array((1, 0.5, 0.25)), rtol=1e-6)
    np.testing.assert_allclose(value(material, "roughness"), 0.3)  # alpha is its square
    assert "clearcoat" not in material.inputs
    assert [code for code, _ in told] == ["W302"]


def test_a_coat_over_what_reflects_is_the_clearcoat():
    nodes = surface(wire("bsdf", "C"))
    nodes += node("C", "layer_bsdf", wire("top", "K"), wire("base", "G"))
    nodes += node("K", "dielectric_bsdf", rough(0.04), scalar("weight", 0.75))
    nodes += node("G", "conductor_bsdf", rough(0.25))
    material, _, _ = read_material(nodes)
    np.testing.assert_allclose(value(material, "clearcoat"), 0.75)
    np.testing.assert_allclose(material.inputs["clearcoatRoughness"].value[0], 0.2)
    # Fresnel's equations head on, of gold, which the node defaults to.
    n, k = np.array((0.183, 0.421, 1.373)), np.array((3.424, 2.346, 1.770))
    expected = np.abs((1 - (n - 1j * k)) / (1 + (n - 1j * k))) ** 2
    np.testing.assert_allclose(value(material, "specularColor"), expected, rtol=1e-6)
    np.testing.assert_allclose(value(material, "roughness"), 0.5)
    np.testing.assert_allclose(value(material, "ior"), 1.5)  # the coat's, of which a metal says nothing


@pytest.mark.parametrize(
    ("coat", "base", "ior", "lost"),
    [
        ((scalar("ior", 1.8),), (), 1.8, ""),
        ((scalar("ior", 1.8),), ('string inputs:scatter_mode = "RT"',), 1.33, "the index of refraction of its coat"),
        ((color("tint", 1.0, 0.5, 0.5),), (), 1.5, "the tint of its coat"),
    ],
)
def test_a_coat_has_its_own_index_where_nothing_is_refracted(coat, base, ior, lost):
    nodes = surface(wire("bsdf", "C")) + node("C", "layer_bsdf", wire("top", "K"), wire("base", "G"))
    nodes += node("K", "dielectric_bsdf", *coat) + node("G", "dielectric_bsdf", scalar("ior", 1.33), *base)
    material, told, _ = read_material(nodes)
    np.testing.assert_allclose(value(material, "ior"), ior, rtol=1e-6)
    np.testing.assert_allclose(value(material, "specularColor"), (0.33 / 2.33) ** 2, rtol=1e-5)
    assert [message for _, message in told][-1].endswith(f", without {lost}" if lost else "UsdPreviewSurface")


def test_an_artistic_conductor_reflects_its_colour():
    nodes = surface(wire("bsdf", "G")) + node("G", "conductor_bsdf", wire("ior", "A", "color3f"))
    nodes += node("A", "artistic_ior", color("reflectivity", 0.9, 0.6, 0.3), output="color3f outputs:out")
    material, _, _ = read_material(nodes)
    np.testing.assert_allclose(value(material, "specularColor"), (0.9, 0.6, 0.3), rtol=1e-6)


def test_glass_lets_light_through_and_bends_it():
    body = ('string inputs:scatter_mode = "RT"', scalar("ior", 1.33), rough(0.0))
    material, _, _ = read_material(surface(wire("bsdf", "G")) + node("G", "dielectric_bsdf", *body))
    assert material.opacity_mode == OpacityMode.TRANSPARENT
    np.testing.assert_allclose([value(material, "opacity")[0], value(material, "ior")[0]], (0.0, 1.33), rtol=1e-6)
    np.testing.assert_allclose(value(material, "specularColor"), [(0.33 / 2.33) ** 2] * 3, rtol=1e-5)


def test_mixtures_sums_and_products_add_up():
    nodes = surface(wire("bsdf", "P"))
    nodes += node("P", "multiply_bsdfC", wire("in1", "A"), color("in2", 0.5, 1.0, 2.0))
    nodes += node("A", "add_bsdf", wire("in1", "X"), wire("in2", "D"))
    nodes += node("X", "mix_bsdf", wire("fg", "D"), wire("bg", "E"), scalar("mix", 0.25))
    nodes += node("E", "burley_diffuse_bsdf", color("color", 0.4, 0.4, 0.4))
    material, _, _ = read_material(nodes + DIFFUSE)
    base = np.array((0.1, 0.2, 0.3))
    expected = np.array((0.5, 1.0, 2.0)) * (0.25 * base + 0.75 * 0.4 + base)
    np.testing.assert_allclose(value(material, "diffuseColor"), expected, rtol=1e-6)


def test_a_mixture_by_a_texture_is_one_texture(tmp_path):
    pixels = np.full((2, 2), 64, np.uint8)
    PilImage.fromarray(pixels).save(tmp_path / "mask.png")
    nodes = surface(wire("bsdf", "X"))
    nodes += node("X", "mix_bsdf", wire("fg", "D"), wire("bg", "E"), wire("mix", "I", "float"))
    nodes += node("E", "burley_diffuse_bsdf", color("color", 0.4, 0.4, 0.4))
    file = f"asset inputs:file = @{tmp_path / 'mask.png'}@"
    material, told, reader = read_material(nodes + DIFFUSE + node("I", "image_float", file, output="float outputs:out"))
    source = material.inputs["diffuseColor"]
    found = texture_values(reader.textures[source.texture], reader.images, np.array([(0.5, 0.5)]))[0, :3]
    share = 64 / 255
    np.testing.assert_allclose(found, share * np.array((0.1, 0.2, 0.3)) + (1 - share) * 0.4, atol=1e-6)
    assert [code for code, _ in told] == ["W302"]


def test_emission_and_presence():
    nodes = surface(wire("bsdf", "D"), wire("edf", "E"), scalar("opacity", 0.25))
    nodes += node("E", "multiply_edfF", wire("in1", "U"), scalar("in2", 3.0))
    nodes += node("U", "uniform_edf", color("color", 1.0, 0.5, 0.0))
    material, _, _ = read_material(nodes + DIFFUSE)
    np.testing.assert_allclose(value(material, "emissiveColor"), (3.0, 1.5, 0.0))
    assert (value(material, "opacity").tolist(), material.opacity_mode) == ([0.25], OpacityMode.PRESENCE)


def test_roughness_of_the_node_that_squares_it():
    nodes = surface(wire("bsdf", "G")) + node("G", "dielectric_bsdf", wire("roughness", "R", "float2"))
    nodes += node("R", "roughness_anisotropy", scalar("roughness", 0.4), output="float2 outputs:out")
    material, _, _ = read_material(nodes)
    np.testing.assert_allclose(value(material, "roughness"), 0.4)


def test_what_is_lost_is_named():
    nodes = surface(wire("bsdf", "L")) + node("L", "layer_bsdf", wire("top", "H"), wire("base", "D"))
    nodes += node("H", "sheen_bsdf", scalar("weight", 0.5))
    _, told, _ = read_material(nodes + DIFFUSE.replace("inputs:weight = 0.5", "inputs:roughness = 0.5"))
    lost = "without sheen, the roughness of its diffuse reflection"
    assert told == [("W302", f"the surface 'ND_surface' of BSDFs is approximated by a UsdPreviewSurface, {lost}")]


@pytest.mark.parametrize(
    ("nodes", "codes"),
    [
        (surface(wire("bsdf", "X")) + node("X", "hair_bsdf"), ["W303", "W301"]),
        (surface(wire("bsdf", "X")) + node("X", "add_bsdf", wire("in1", "X"), wire("in2", "Y")), ["W303", "W301"]),
    ],
    ids=["unknown", "circle"],
)
def test_where_no_node_is_known_display_color_is_shown(nodes, codes):
    material, told, _ = read_material(nodes)
    assert [code for code, _ in told if code != "W304"] == codes
    assert material.path == "/__displayColor"


def test_graphs_that_double_with_each_node_end():
    chain = "".join(node(f"X{k}", "add_bsdf", *(wire(f"in{i}", f"X{k + 1}") for i in (1, 2))) for k in range(60))
    material, told, _ = read_material(surface(wire("bsdf", "X0")) + chain)
    assert {code for code, _ in told} == {"W304", "W303", "W301"}
    assert material.path == "/__displayColor"
