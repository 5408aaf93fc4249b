# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""docs/materialx.md says of surfaces and nodes what the tables in the code say."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from pxr import Usd, UsdShade

from warp_rt.report import Report
from warp_rt.usd.bsdf_graphs import LOBES
from warp_rt.usd.foreign_shaders import foreign_surface, is_preview_surface
from warp_rt.usd.image_cache import ImageCache
from warp_rt.usd.materialx_nodes import is_known_node
from warp_rt.usd.surface_inputs import InputReader

TEXT = (Path(__file__).resolve().parents[2] / "docs" / "materialx.md").read_text(encoding="utf-8")

LIBRARY = """
surfacematerial volumematerial surface_unlit image tiledimage latlongimage hextiledimage triplanarprojection
constant ramp ramp_gradient ramplr ramptb ramp4 splitlr splittb noise2d noise3d fractal2d fractal3d cellnoise2d
cellnoise3d worleynoise2d worleynoise3d unifiednoise2d unifiednoise3d flake2d flake3d randomfloat randomcolor
checkerboard line circle cloverleaf hexagon grid crosshatch tiledcircles tiledcloverleafs tiledhexagons position
normal tangent bitangent texcoord geomcolor geompropvalue geompropvalueuniform bump frame time add subtract multiply
divide modulo fract invert absval floor ceil round power safepower sin cos tan asin acos atan2 sqrt ln exp sign
clamp min max normalize magnitude distance dotproduct crossproduct transformpoint transformvector transformnormal
transformmatrix normalmap hextilednormalmap transpose determinant invertmatrix rotate2d rotate3d place2d
trianglewave reflect refract remap smoothstep luminance rgbtohsv hsvtorgb contrast range hsvadjust saturate
colorcorrect premult unpremult plus minus difference burn dodge screen overlay disjointover in mask matte out over
inside outside mix ifgreater ifgreatereq ifequal switch convert combine2 combine3 combine4 creatematrix extract
separate2 separate3 separate4 blur heighttonormal and or xor not dot osl_set_ci viewdirection facingratio
gooch_shade g18_rec709_to_lin_rec709 g22_rec709_to_lin_rec709 rec709_display_to_lin_rec709 acescg_to_lin_rec709
g22_ap1_to_lin_rec709 srgb_texture_to_lin_rec709 lin_adobergb_to_lin_rec709 adobergb_to_lin_rec709
srgb_displayp3_to_lin_rec709 lin_displayp3_to_lin_rec709 standard_surface open_pbr_surface open_pbr_anisotropy
UsdPreviewSurface UsdUVTexture UsdPrimvarReader UsdTransform2d gltf_pbr gltf_colorimage gltf_image gltf_normalmap
gltf_iridescence_thickness gltf_anisotropy_image disney_principled standard_surface_to_gltf_pbr
standard_surface_to_UsdPreviewSurface standard_surface_to_open_pbr_surface open_pbr_surface_to_standard_surface
LamaSheen LamaTranslucent LamaDielectric LamaSSS LamaDiffuse LamaLayer LamaGeneralizedSchlick LamaConductor LamaAdd
LamaEmission LamaSurface LamaIridescence LamaMix point_light directional_light spot_light oren_nayar_diffuse_bsdf
burley_diffuse_bsdf translucent_bsdf dielectric_bsdf conductor_bsdf generalized_schlick_bsdf subsurface_bsdf
sheen_bsdf chiang_hair_bsdf uniform_edf conical_edf measured_edf generalized_schlick_edf absorption_vdf
anisotropic_vdf surface volume light displacement layer roughness_anisotropy roughness_dual glossiness_anisotropy
blackbody artistic_ior deon_hair_absorption_from_melanin chiang_hair_absorption_from_color chiang_hair_roughness
"""
"""The nodes that MaterialX 1.39.5's libraries define, whatever their types."""

GRAPH = ("layer", "mix", "add", "multiply")  # nodes that put lobes together


def table(heading: str) -> list[list[str]]:
    """Return the rows of a section's table, the heading among them, without the line below it."""
    lines = [
        line
        for line in TEXT[TEXT.index(heading) :]
        .split("\n## ")[0]
        .split("\n### Surfaces of" if heading == "## Surfaces" else "\n## ")[0]
        .splitlines()
        if line.startswith("|")
    ]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if not line.startswith("|---")]


def names(cell: str) -> list[str]:
    return re.findall(r"`(\w+)`", cell)


SURFACES = table("## Surfaces")


@pytest.mark.parametrize("column", range(1, len(SURFACES[0])))
def test_inputs_of_surfaces_become_what_the_table_says(column: int) -> None:
    surface = foreign_surface(SURFACES[0][column])
    assert surface is not None
    said = {row[0]: names(re.sub(r" other than `\w+`", "", row[column])) for row in SURFACES[1:]}
    assert sorted(said.pop("lost")) == sorted(surface.lacks)
    assert said.pop("`normal`") == [surface.normal]
    coverage = said.pop("`opacity`, presence, where nothing is transmitted")
    assert coverage == [name for name in (surface.coverage, surface.coverage_mode) if name]
    assert said.pop("reflectance head on, by an `ior` that gives it") == [surface.reflectance]
    coat = said.pop(next(name for name in said if name.startswith("reflectance of the coat")))
    assert coat == [name for name in (surface.coat_ior,) if name]
    said["`opacity`"] = said.pop("`opacity`, transparent")
    expected = {
        f"`{name}`": [part for part in (term.weight, term.name) if part] for name, term in surface.terms.items()
    }
    assert {name: parts for name, parts in said.items() if parts} == expected


def test_lobes_are_those_that_are_named() -> None:
    rows = [row[0] for row in table("### Surfaces of BSDFs")[1:]]
    named = {name for cell in rows for name in re.findall(r"\w+_bsdf", cell) if name.partition("_")[0] not in GRAPH}
    assert named == set(LOBES)


NOT_FOLDED = ("image", "gltf", "geom", "texcoord", "transformmatrix", "triplanarprojection", "any")
"""How rows begin whose nodes are read beside those that ``fold`` knows."""


def test_nodes_that_fold_are_those_that_are_named() -> None:
    rows = [row for row in table("## Nodes")[1:] if not row[0].startswith(NOT_FOLDED)]
    for cell in (row[0] for row in rows):
        for name in re.findall(r"[a-z]+2 to 4|[a-z]+\w*", cell):
            kinds = [f"{name[:-6]}{k}" for k in (2, 3, 4)] if name.endswith(" to 4") else [name]
            assert all(_folds(kind) for kind in kinds), name


def _folds(name: str) -> bool:
    return any(is_known_node(f"ND_{kind}") for kind in (name, f"{name}_color3", f"logical_{name}"))


def test_every_node_of_the_library_is_in_one_row() -> None:
    rows = {row[0]: row[1].split(", ") for row in table("## Every node of the library")[1:]}
    named = [name for names_ in rows.values() for name in names_]
    assert sorted(named) == sorted(LIBRARY.split())
    computed = [*rows["folded, or computed (N938)"], *rows["computed where a ray hits"]]
    assert {name for name in LIBRARY.split() if _folds(name)} <= {*computed}
    surfaces = rows["a surface, drawn or approximated (W302)"]
    for name in surfaces:
        is_model = foreign_surface(f"ND_{name}_surfaceshader") or foreign_surface(f"ND_{name}")
        assert is_model or is_preview_surface(f"ND_{name}_surfaceshader") or name in ("surface", "surfacematerial"), (
            name
        )
    assert {name for name in rows["a part of a surface of BSDFs (W302)"] if name.endswith("_bsdf")} == set(LOBES)


@pytest.mark.parametrize(
    ("row", "is_told"),
    [
        ("folded, or computed (N938)", False),
        ("computed where a ray hits", False),
        ("approximated, and told (W303)", True),
        ("told, and the input's default is used (W303)", True),
    ],
)
def test_nodes_are_told_where_the_table_says_so(row: str, is_told: bool) -> None:
    """Each with one of its types, and nothing given but a name where it cannot do without."""
    (names_,) = (cells[1].split(", ") for cells in table("## Every node of the library")[1:] if cells[0] == row)
    for name in names_:
        if name == "displacement":  # no part of an input's network
            continue
        told = [_codes(identifier) for identifier in _identifiers(name)]
        assert all(("W303" in codes) == is_told for codes in told), (name, told)


def _identifiers(name: str) -> list[str]:
    """Return what nodes of a name are called that have no more than one type, or some of their types."""
    special = {
        **{kind: [f"ND_logical_{kind}"] for kind in ("and", "or", "xor", "not")},
        **{"UsdPrimvarReader": ["ND_UsdPrimvarReader_float"], "UsdUVTexture": ["ND_UsdUVTexture_23"]},
        **{"normalmap": ["ND_normalmap_float"], "UsdTransform2d": ["ND_UsdTransform2d"], "ramp": ["ND_ramp"]},
        "blackbody": ["ND_blackbody"],
        "convert": ["ND_convert_float_color3", "ND_convert_vector2_vector3"],
        **{"gltf_normalmap": ["ND_gltf_normalmap_vector3_1_0"], "gltf_image": ["ND_gltf_image_color3_color3_1_0"]},
        "gltf_colorimage": ["ND_gltf_colorimage"],
        "determinant": ["ND_determinant_matrix33"],
        "transformmatrix": ["ND_transformmatrix_vector3"],
    }
    kind = "color3" if name.endswith("_to_lin_rec709") else "float"
    by_type = {"color4": _OF_ALPHA, "vector2": _OF_COORDINATES, "vector3": _OF_VECTORS, "color3": _OF_COLORS}
    kind = next((one for one, of_type in by_type.items() if name in of_type), kind)
    return special.get(name, [f"ND_{name}_{kind}"])


_OF_ALPHA = ("premult", "unpremult", "over", "in", "out", "mask", "matte", "disjointover", "separate4", "combine4")
_OF_COORDINATES = ("texcoord", "place2d", "rotate2d", "separate2", "combine2", "magnitude", "distance", "dotproduct")
_OF_VECTORS = ("normalize", "crossproduct", "rotate3d", "normal", "tangent", "bitangent", "position", "heighttonormal")
_OF_COLORS = (
    *("checkerboard", "luminance", "saturate", "colorcorrect", "rgbtohsv", "hsvtorgb", "hsvadjust", "separate3"),
    *("combine3", "extract", "hextiledimage"),
)


def _codes(identifier: str) -> set[str]:
    """Return the codes of what is told of a material whose colour a node gives."""
    output = ("outx" if "vector" in identifier else "outr") if "separate" in identifier else "out"
    given = "float2 inputs:in = (0.2, 0.4)" if "vector2" in identifier else "color3f inputs:in = (0.2, 0.4, 0.6)"
    if "matrix33" in identifier:
        given = "matrix3d inputs:in = ((2, 0, 0), (0, 1, 0), (0, 0, 1))"
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(
        f"""#usda 1.0
        def Material "M" {{
            def Shader "S" {{ color3f inputs:x.connect = </M/N.outputs:{output}> }}
            def Shader "N" {{
                uniform token info:id = "{identifier}"
                string inputs:geomprop = "a"
                string inputs:varname = "a"
                {given}
                float3 inputs:in1 = (0.2, 0.4, 0.6)
                float outputs:{output}
            }}
        }}""".replace("> }", ">\n}")
    )
    report = Report()
    reader = InputReader(ImageCache(report), Usd.TimeCode.Default(), report)
    port = UsdShade.Shader(stage.GetPrimAtPath("/M/S")).GetInput("x")
    reader.signal(port, stage.GetPrimAtPath("/M"), (1, 2, 3, 4))
    return {record.code for record in report}
