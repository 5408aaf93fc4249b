# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdUVTexture, UsdPrimvarReader and UsdTransform2d, written as stages of ten lines."""

import numpy as np
import OpenEXR
import pytest
from PIL import Image as PilImage
from pxr import Sdf, Usd, UsdShade

from warp_rt.report import Report
from warp_rt.scene import Input, Tiles, Wrap
from warp_rt.scene.texture_values import texture_values
from warp_rt.srgb import linear_from_srgb
from warp_rt.usd.image_cache import ImageCache
from warp_rt.usd.load import load_stage
from warp_rt.usd.surface_inputs import InputReader

TIME = Usd.TimeCode.Default()
READER = """def Shader "R" {
    uniform token info:id = "UsdPrimvarReader_float2"
    string inputs:varname = "st"
    float2 outputs:result
}"""
ST = "float2 inputs:st.connect = </M/R.outputs:result>"


@pytest.fixture
def image(tmp_path):
    """Return the path of an image of 4 x 2 texels of 8 bits, red growing to the right, green upwards."""
    texels = np.zeros((2, 4, 3), np.uint8)
    texels[..., 0] = [0, 50, 100, 150]
    texels[0, :, 1] = 255
    path = tmp_path / "image.png"
    PilImage.fromarray(texels).save(path)
    return path.as_posix()


def _read(nodes, output, kind="color3f", count=3, primvars="", layer=None):
    """Return input "x" of a surface that is connected to an output, the reader, its images, and the codes."""
    stage = Usd.Stage.CreateNew(layer) if layer else Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(
        f'#usda 1.0\ndef Material "M" {{\n{primvars}\ndef Shader "S" {{\n{kind} inputs:x.connect = </M/{output}>\n}}\n'
        f"{nodes}\n}}"
    )
    report = Report()
    images = ImageCache(report)
    reader = InputReader(images, TIME, report)
    port = UsdShade.Shader(stage.GetPrimAtPath("/M/S")).GetInput("x")
    found = reader.read(port, count, stage.GetPrimAtPath("/M"))
    return found, reader.textures, images.images, [d.code for d in report]


def _texture(body, output="rgb", kind="color3f", count=3, nodes=READER, identifier="UsdUVTexture", layer=None):
    node = f'def Shader "T" {{\nuniform token info:id = "{identifier}"\n{body}\nfloat3 outputs:{output}\n}}\n{nodes}'
    found, textures, images, codes = _read(node, f"T.outputs:{output}", kind, count, layer=layer)
    return found, textures[found.texture], images, codes


# --- UsdUVTexture


def test_image_has_its_bottom_row_first(image):
    found, texture, images, codes = _texture(f"asset inputs:file = @{image}@\n{ST}")
    assert (found, texture.image, codes) == (Input(texture=0), 0, [])
    np.testing.assert_array_equal(images[0].pixels[0, :, 1], 0)
    np.testing.assert_array_equal(images[0].pixels[1, :, 1], 255)
    np.testing.assert_array_equal(images[0].pixels[0, :, 0], [0, 50, 100, 150])


def test_defaults_of_the_specification(image):
    _, texture, _, _ = _texture(f"asset inputs:file = @{image}@\n{ST}")
    assert (texture.wrap_s, texture.wrap_t) == (Wrap.BLACK, Wrap.BLACK)
    assert (texture.scale, texture.bias) == ((1, 1, 1, 1), (0, 0, 0, 0))
    assert texture.fallback == (0, 0, 0, 1)
    assert texture.primvar == "st"
    np.testing.assert_array_equal(texture.uv_transform, [[1, 0, 0], [0, 1, 0]])


@pytest.mark.parametrize(
    ("token", "wrap"),
    [
        ("black", Wrap.BLACK),
        ("clamp", Wrap.CLAMP),
        ("repeat", Wrap.REPEAT),
        ("mirror", Wrap.MIRROR),
        ("useMetadata", Wrap.BLACK),
    ],
)
def test_wrap_modes(image, token, wrap):
    _, texture, _, codes = _texture(f'asset inputs:file = @{image}@\ntoken inputs:wrapS = "{token}"\n{ST}')
    assert (texture.wrap_s, texture.wrap_t, codes) == (wrap, Wrap.BLACK, [])
    _, texture, _, _ = _texture(f'asset inputs:file = @{image}@\ntoken inputs:wrapT = "{token}"\n{ST}')
    assert (texture.wrap_s, texture.wrap_t) == (Wrap.BLACK, wrap)


@pytest.mark.parametrize(
    ("said", "wraps"),
    [
        ("periodic", (Wrap.REPEAT, Wrap.REPEAT)),
        ("clamp, mirror", (Wrap.CLAMP, Wrap.MIRROR)),
        ("black,periodic", (Wrap.BLACK, Wrap.REPEAT)),
        ("spiral", (Wrap.BLACK, Wrap.BLACK)),
        ("", (Wrap.BLACK, Wrap.BLACK)),
    ],
)
@pytest.mark.parametrize("name", ["image.exr", "image.tif", "deep.tif"])
def test_files_say_what_lies_beyond_them(tmp_path, said, wraps, name):
    """OpenEXR's standard attribute, and Pixar's tag of TIFFs; a node's own token counts before."""
    path = tmp_path / name
    if name == "image.exr":
        header = {"compression": OpenEXR.NO_COMPRESSION, "type": OpenEXR.scanlineimage, "wrapmodes": said}
        OpenEXR.File(header, {"RGB": np.zeros((2, 2, 3), np.float32)}).write(str(path))
    else:
        texels = np.zeros((2, 2), np.float32) if name == "deep.tif" else np.zeros((2, 2, 3), np.uint8)
        PilImage.fromarray(texels).save(path, tiffinfo={33303: said})
    _, texture, _, codes = _texture(f"asset inputs:file = @{path.as_posix()}@\n{ST}")
    assert (texture.wrap_s, texture.wrap_t, codes) == (*wraps, [])
    _, texture, _, _ = _texture(f'asset inputs:file = @{path.as_posix()}@\ntoken inputs:wrapS = "clamp"\n{ST}')
    assert (texture.wrap_s, texture.wrap_t) == (Wrap.CLAMP, wraps[1])


def test_scale_bias_and_fallback(image):
    body = (
        f"asset inputs:file = @{image}@\nfloat4 inputs:scale = (2, 3, 4, 5)\nfloat4 inputs:bias = (-1, -2, -3, -4)\n"
        f"float4 inputs:fallback = (1, 0, 0.5, 0.25)\n{ST}"
    )
    _, texture, _, _ = _texture(body)
    assert (texture.scale, texture.bias) == ((2, 3, 4, 5), (-1, -2, -3, -4))
    assert texture.fallback == (1, 0, 0.5, 0.25)


@pytest.mark.parametrize(
    ("channels", "token", "is_srgb"),
    [(3, "auto", True), (4, "auto", True), (1, "auto", False), (1, "sRGB", True), (3, "raw", False), (3, "sRGB", True)],
)
def test_color_space(tmp_path, channels, token, is_srgb):
    path = tmp_path / "c.png"
    PilImage.fromarray(np.zeros((2, 2, channels) if channels > 1 else (2, 2), np.uint8)).save(path)
    body = f'asset inputs:file = @{path.as_posix()}@\ntoken inputs:sourceColorSpace = "{token}"\n{ST}'
    assert _texture(body)[1].is_srgb is is_srgb


@pytest.mark.parametrize(
    ("name", "is_srgb", "codes"),
    [("raw", False, []), ("lin_rec709", False, []), ("srgb_texture", True, []), ("ADX10", True, ["W205"])],
)
def test_color_space_of_the_asset(image, name, is_srgb, codes):
    _, texture, _, found = _texture(f'asset inputs:file = @{image}@ (colorSpace = "{name}")\n{ST}')
    assert (texture.is_srgb, found) == (is_srgb, codes)


@pytest.mark.parametrize(
    "named", ['(colorSpace = "srgb_displayp3")', '\ntoken inputs:sourceColorSpace = "srgb_p3d65_scene"']
)
def test_images_of_other_primaries_become_linear_rec709(image, named):
    _, texture, images, codes = _texture(f"asset inputs:file = @{image}@ {named}\n{ST}")
    assert (texture.image, texture.is_srgb, codes) == (1, False, [])
    linear = ((np.array([50, 255, 0]) / 255 + 0.055) / 1.055) ** 2.4
    linear[2] = 0.0
    matrix = [(1.22494, -0.22494, 0.0), (-0.04206, 1.04206, 0.0), (-0.01964, -0.07864, 1.09828)]
    np.testing.assert_allclose(images[1].pixels[1, 1], [*(np.array(matrix) @ linear), 1.0], atol=2e-4)


@pytest.mark.parametrize(
    ("output", "count", "channel"),
    [("rgb", 3, -1), ("rgba", 3, -1), ("r", 1, 0), ("g", 1, 1), ("b", 1, 2), ("a", 1, 3), ("a", 3, 3), ("rgb", 1, 0)],
)
def test_channels(image, output, count, channel):
    found, *_ = _texture(f"asset inputs:file = @{image}@\n{ST}", output, count=count)
    assert found == Input(texture=0, channel=channel)


def test_one_node_is_one_texture_for_all_its_outputs(image):
    nodes = f"""def Shader "T" {{
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @{image}@
        {ST}
        float outputs:r
        float outputs:g
    }}
    {READER}
    def Shader "U" {{
        float inputs:y.connect = </M/T.outputs:g>
    }}"""
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(
        f'#usda 1.0\ndef Material "M" {{\ndef Shader "S" {{\nfloat inputs:x.connect = </M/T.outputs:r>\n}}\n{nodes}\n}}'
    )
    reader = InputReader(ImageCache(Report()), TIME, Report())
    for path, name, channel in (("/M/S", "x", 0), ("/M/U", "y", 1)):
        port = UsdShade.Shader(stage.GetPrimAtPath(path)).GetInput(name)
        assert reader.read(port, 1, stage.GetPrimAtPath("/M")) == Input(texture=0, channel=channel)
    assert len(reader.textures) == 1


def test_missing_files_leave_the_fallback():
    _, texture, images, codes = _texture(
        f"asset inputs:file = @/nowhere/x.png@\nfloat4 inputs:fallback = (0, 1, 0, 1)\n{ST}"
    )
    assert (texture.image, texture.fallback, images, codes) == (-1, (0, 1, 0, 1), [], ["W201"])
    assert _texture(ST)[3] == ["W201"]


@pytest.mark.parametrize(
    ("file", "code"),
    [('string inputs:file = "x.png"', "W306"), ("asset inputs:file.connect = </M/R.outputs:result>", "W308")],
)
def test_what_names_no_file_is_told_as_what_it_is(file, code):
    _, texture, _, codes = _texture(f"{file}\n{ST}")
    assert (texture.image, codes) == (-1, [code])


SAMPLED = """
    def Shader "T" {{
        uniform token info:id = "UsdUVTexture"
        asset inputs:file{file}
        float2 inputs:st.connect = <../R.outputs:result>
        float3 outputs:rgb
    }}
    def Shader "R" {{
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "st"
        float2 outputs:result
    }}
"""
ASSET = """#usda 1.0
(
    defaultPrim = "A"
)
def Sphere "A" (apiSchemas = ["MaterialBindingAPI"]) {{
    rel material:binding = </A/M>
    def Material "M" {{
        asset inputs:file = @here.png@
        token outputs:surface.connect = <S.outputs:surface>
        def Shader "S" {{
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor.connect = <../T.outputs:rgb>
            token outputs:surface
        }}
        {texture}
    }}
}}
"""


@pytest.mark.parametrize(
    ("file", "shot", "red"),
    [
        (" = @here.png@", "", 1),
        (" = @./here.png@", "", 1),
        (" = @here.png@", 'over "T" { asset inputs:file = @here.png@\n}', 2),
        ('= @`"${NAME}.png"`@', "", 1),
        (".connect = <../../M.inputs:file>", "", 1),
        (".connect = <../../M.inputs:file>", "asset inputs:file = @here.png@", 2),
        (".timeSamples = { 1: @gone.png@, 2: @here.png@ }", "", 1),
        (" = @t.<UDIM>.png@", "", 3),
        ('= @`"${TILES}.<UDIM>.png"`@', "", 3),
        (" = @./t.<UDIM>.png@", "", 3),
    ],
)
@pytest.mark.parametrize("packages", [0, 1, 2])
def test_relative_paths_start_from_the_layer_that_authors_them(file, shot, red, packages, tmp_path):
    """A shot refers to an asset in a folder, or in a package, or in a package in a package."""
    folder = tmp_path / "assets"
    folder.mkdir()
    (folder / "asset.usda").write_text(ASSET.format(texture=SAMPLED.format(file=file)))
    for name, value in (("assets/here.png", 1), ("assets/t.1001.png", 3), ("here.png", 2)):
        PilImage.new("RGB", (1, 1), (value, 0, 0)).save(tmp_path / name)
    asset = "assets/asset.usda"
    for level in range(packages):
        held = (
            [folder / "asset.usda", folder / "here.png", folder / "t.1001.png"] if level == 0 else [folder / "0.usdz"]
        )
        if level:
            (folder / "outer.usda").write_text('#usda 1.0\n(defaultPrim = "A")\ndef "A" (references = @0.usdz@) {\n}\n')
            held.insert(0, folder / "outer.usda")
        package = Sdf.ZipFileWriter.CreateNew(str(folder / f"{level}.usdz"))
        for source in held:
            package.AddFile(str(source), source.name)
        assert package.Save()
        asset = f"assets/{level}.usdz"
    (tmp_path / "shot.usda").write_text(
        '#usda 1.0\n(\nexpressionVariables = {\nstring NAME = "here"\nstring TILES = "t"\n}\n)\n'
        f'def "A" (references = @{asset}@) {{\nover "M" {{\n{shot}\n}}\n}}\n'
    )
    scene = load_stage(tmp_path / "shot.usda", time=2.0)
    assert [image.pixels[0, 0, 0] for image in scene.images] == [red]
    assert {record.code for record in scene.diagnostics} <= {"N901"}


def test_unreadable_files_are_named(tmp_path):
    path = tmp_path / "x.png"
    path.write_bytes(b"nonsense")
    _, texture, _, codes = _texture(f"asset inputs:file = @{path.as_posix()}@\n{ST}")
    assert (texture.image, codes) == (-1, ["W202"])


def test_file_through_an_interface_input(image):
    node = f"""def Shader "T" {{
        uniform token info:id = "UsdUVTexture"
        asset inputs:file.connect = </M.inputs:map>
        {ST}
        float3 outputs:rgb
    }}
    {READER}"""
    _, textures, _, codes = _read(node, "T.outputs:rgb", primvars=f"asset inputs:map = @{image}@")
    assert (textures[0].image, codes) == (0, [])


# --- coordinates


def _coordinates(nodes, image):
    body = f"asset inputs:file = @{image}@\nfloat2 inputs:st.connect = </M/A.outputs:result>"
    _, texture, _, codes = _texture(body, nodes=nodes)
    return texture, codes


@pytest.mark.parametrize("kind", ["string", "token"])
def test_name_of_the_primvar(image, kind):
    nodes = f"""def Shader "A" {{
        uniform token info:id = "UsdPrimvarReader_float2"
        {kind} inputs:varname = "map2"
        float2 inputs:fallback = (0.25, 0.75)
        float2 outputs:result
    }}"""
    texture, codes = _coordinates(nodes, image)
    assert (texture.primvar, texture.uv_fallback, codes) == ("map2", (0.25, 0.75), [])


def test_varname_through_an_interface_input(image):
    node = f"""def Shader "T" {{
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @{image}@
        float2 inputs:st.connect = </M/A.outputs:result>
        float3 outputs:rgb
    }}
    def Shader "A" {{
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname.connect = </M.inputs:frame:stPrimvarName>
        float2 outputs:result
    }}"""
    _, textures, _, _ = _read(node, "T.outputs:rgb", primvars='token inputs:frame:stPrimvarName = "uvSet"')
    assert textures[0].primvar == "uvSet"


def _transform_node(name, source, body):
    return (
        f'def Shader "{name}" {{\nuniform token info:id = "UsdTransform2d"\n'
        f"float2 inputs:in.connect = </M/{source}.outputs:result>\n{body}\nfloat2 outputs:result\n}}\n"
    )


def test_transform_scales_then_turns_counter_clockwise_then_moves(image):
    body = "float2 inputs:scale = (2, 3)\nfloat inputs:rotation = 90\nfloat2 inputs:translation = (10, 20)"
    texture, codes = _coordinates(_transform_node("A", "R", body) + READER, image)
    # (1, 0) -> (2, 0) -> (0, 2) -> (10, 22); (0, 1) -> (0, 3) -> (-3, 0) -> (7, 20)
    np.testing.assert_allclose(texture.uv_transform @ [1, 0, 1], [10, 22], rtol=1e-6)
    np.testing.assert_allclose(texture.uv_transform @ [0, 1, 1], [7, 20], rtol=1e-6)
    assert (texture.primvar, codes) == ("st", [])
    assert texture.uv_transform.dtype == np.float32


def test_the_transform_nearest_to_the_primvar_comes_first(image):
    nodes = _transform_node("A", "B", "float2 inputs:scale = (2, 2)")
    nodes += _transform_node("B", "R", "float2 inputs:translation = (1, 0)") + READER
    texture, _ = _coordinates(nodes, image)
    np.testing.assert_allclose(texture.uv_transform @ [3, 5, 1], [8, 10])


def test_coordinates_that_are_constant_are_the_same_for_every_primvar(image):
    texture, codes = _coordinates(
        'def Shader "A" {\nuniform token info:id = "UsdTransform2d"\nfloat2 inputs:in = (0.5, 0.25)\n'
        "float2 inputs:translation = (1, 2)\nfloat2 outputs:result\n}",
        image,
    )
    for uv in ([0, 0, 1], [7, -3, 1]):
        np.testing.assert_allclose(texture.uv_transform @ uv, [1.5, 2.25])
    assert codes == []  # somebody means them


def test_coordinates_that_nothing_gives_are_told(image):
    for given in ("", "float2 inputs:translation = (1, 2)"):
        texture, codes = _coordinates(
            f'def Shader "A" {{\nuniform token info:id = "UsdTransform2d"\n{given}\nfloat2 outputs:result\n}}', image
        )
        np.testing.assert_allclose(texture.uv_transform @ [7, -3, 1], [1, 2] if given else [0, 0])
        assert codes == ["W206"]


def test_unknown_coordinates_are_named(image):
    texture, codes = _coordinates(
        'def Shader "A" {\nuniform token info:id = "PxrManifold2D"\nfloat2 outputs:result\n}', image
    )
    assert (texture.primvar, codes) == ("st", ["W303"])


def test_a_cycle_of_transforms_ends(image):
    texture, codes = _coordinates(_transform_node("A", "A", ""), image)
    assert (texture.primvar, codes) == ("st", ["W303"])


# --- UsdPrimvarReader as a value


@pytest.mark.parametrize(
    ("kind", "fallback", "count", "expected"),
    [
        ("float3", "float3 inputs:fallback = (1, 2, 3)", 3, Input((1, 2, 3, 0), primvar="p")),
        ("vector", "vector3f inputs:fallback = (1, 2, 3)", 3, Input((1, 2, 3, 0), primvar="p")),
        ("float4", "float4 inputs:fallback = (1, 2, 3, 4)", 3, Input((1, 2, 3, 4), primvar="p")),
        ("float", "float inputs:fallback = 0.5", 1, Input((0.5, 0, 0, 0), primvar="p", channel=0)),
        ("float", "float inputs:fallback = 0.5", 3, Input((0.5, 0.5, 0.5, 0), primvar="p", channel=0)),
        ("float3", "float3 inputs:fallback = (1, 2, 3)", 1, Input((1, 0, 0, 0), primvar="p", channel=0)),
        ("int", "int inputs:fallback = 2", 1, Input((2, 0, 0, 0), primvar="p", channel=0)),
        ("float3", "", 3, Input(primvar="p")),
    ],
)
def test_primvar_reader(kind, fallback, count, expected):
    node = f"""def Shader "P" {{
        uniform token info:id = "UsdPrimvarReader_{kind}"
        string inputs:varname = "p"
        {fallback}
        float outputs:result
    }}"""
    found, _, _, codes = _read(node, "P.outputs:result", count=count)
    assert (found, codes) == (expected, [])


def test_primvars_of_the_material_come_before_the_readers_fallback():
    node = (
        'def Shader "P" {\nuniform token info:id = "UsdPrimvarReader_float3"\nstring inputs:varname = "p"\n'
        "float3 inputs:fallback = (1, 2, 3)\nfloat3 outputs:result\n}"
    )
    found, *_ = _read(node, "P.outputs:result", primvars="color3f primvars:p = (4, 5, 6)")
    assert found == Input((4, 5, 6, 0), primvar="p")


def test_reader_without_a_name_gives_its_fallback():
    node = """def Shader "P" {
        uniform token info:id = "UsdPrimvarReader_float3"
        float3 inputs:fallback = (1, 2, 3)
        float3 outputs:result
    }"""
    found, _, _, codes = _read(node, "P.outputs:result")
    assert (found, codes) == (Input((1, 2, 3, 0)), ["W206"])


@pytest.mark.parametrize("identifier", ["UsdPrimvarReader_string", "UsdPrimvarReader_matrix", "PxrFractal"])
def test_nodes_that_give_no_value_are_named(identifier):
    node = f'def Shader "P" {{\nuniform token info:id = "{identifier}"\nfloat outputs:result\n}}'
    found, _, _, codes = _read(node, "P.outputs:result")
    assert (found, codes) == (None, ["W303"])


# --- MaterialX's nodes


def test_materialx_image(image):
    body = f'asset inputs:file = @{image}@\nstring inputs:vaddressmode = "clamp"\ncolor3f inputs:default = (1, 0.5, 0)'
    found, texture, _, codes = _texture(body, "out", identifier="ND_image_color3")
    assert (found.channel, texture.primvar, texture.is_srgb, codes) == (-1, "st", True, [])
    assert (texture.wrap_s, texture.wrap_t) == (Wrap.REPEAT, Wrap.CLAMP)
    assert texture.fallback == (1, 0.5, 0, 1)
    found, texture, _, _ = _texture(body, "out", count=1, identifier="ND_image_float")
    assert (found.channel, texture.is_srgb) == (0, False)


def test_conversions_pass_on_what_comes_in():
    nodes = (
        'def Shader "C" {\nuniform token info:id = "ND_convert_color4_color3"\n'
        "color4f inputs:in.connect = </M/K.outputs:out>\ncolor3f outputs:out\n}\n"
        'def Shader "K" {\nuniform token info:id = "ND_constant_color4"\ncolor4f inputs:value = (1, 2, 3, 4)\n'
        "color4f outputs:out\n}"
    )
    assert _read(nodes, "C.outputs:out")[0] == Input((1, 2, 3, 0))


# --- UDIM


def udim(tmp_path, **tiles):
    """Return what a texture of tiles becomes, written from arrays by number."""
    for number, pixels in tiles.items():
        PilImage.fromarray(pixels).save(tmp_path / f"t.{number[1:]}.png")
    layer = str(tmp_path / "scene.usda")
    return _texture(f"asset inputs:file = @t.<UDIM>.png@\n{ST}", layer=layer)


def test_udim_tiles_lie_side_by_side(tmp_path):
    first, second = (np.full((2, 2, 3), value, np.uint8) for value in (10, 20))
    found, texture, images, codes = udim(tmp_path, t1001=first, t1012=second)
    assert (found.texture, texture.image, codes) == (0, 0, [])
    # Tile 1001 covers [0, 1] x [0, 1], tile 1012 = 1001 + 1 + 10 covers [1, 2] x [1, 2]; the others are clear.
    assert texture.tiles == Tiles(0, 0, ((0, -1), (-1, 1)))
    uv = np.array([(0.5, 0.5), (1.5, 1.5), (1.5, 0.5), (0.5, 1.5)])
    linear = linear_from_srgb(np.array([10, 20]) / 255)
    expected = [(linear[0], 1), (linear[1], 1), (0, 0), (0, 0)]
    np.testing.assert_allclose(texture_values(texture, images, uv)[:, [0, 3]], expected, atol=1e-7)


def test_beyond_the_outermost_udim_tiles_is_nothing(tmp_path):
    """An absent tile is the same within the rectangle of those there are and outside; seams on its edge are not cut."""
    _, texture, images, _ = udim(tmp_path, t1001=np.full((2, 2, 3), 255, np.uint8))
    uv = np.array([(0.5, 0.5), (1.0, 1.0), (1.000001, 0.5), (1.01, 0.5), (0.5, -0.01), (7.5, 0.5)])
    expected = [1, 1, 1, 0, 0, 0]
    np.testing.assert_array_equal(texture_values(texture, images, uv), np.repeat(expected, 4).reshape(-1, 4))


def test_udim_tiles_need_not_begin_at_the_first_nor_have_one_size(tmp_path):
    tiles = {"t1023": np.full((1, 1, 3), 10, np.uint8), "t1024": np.full((4, 2, 3), 20, np.uint8)}
    _, texture, images, codes = udim(tmp_path, **tiles)
    assert (texture.tiles, codes) == (Tiles(2, 2, ((0, 1),)), [])
    assert [image.pixels.shape for image in images] == [(1, 1, 4), (4, 2, 4)]


def test_udim_tiles_may_differ_in_depth_each_decoded_as_it_is_by_itself(tmp_path):
    """Under auto, 8 bits are sRGB and 16 are linear."""
    wide = np.full((2, 2), 32768, np.uint16)
    _, texture, images, codes = udim(tmp_path, t1001=np.full((2, 2, 3), 188, np.uint8), t1002=wide)
    assert codes == []
    values = texture_values(texture, images, np.array([(0.5, 0.5), (1.5, 0.5)]))[:, 0]
    np.testing.assert_allclose(values, [linear_from_srgb(np.array(188 / 255)), 32768 / 65535], rtol=1e-6)


def test_a_udim_tile_that_is_damaged_is_named_and_is_none(tmp_path):
    (tmp_path / "t.1002.png").write_bytes(b"damaged")
    _, texture, _, codes = udim(tmp_path, t1001=np.full((2, 2, 3), 9, np.uint8))
    assert (texture.tiles, codes) == (Tiles(0, 0, ((0,),)), ["W202"])


def test_udim_without_tiles_is_named(tmp_path):
    _, texture, _, codes = _texture(f"asset inputs:file = @t.<UDIM>.png@\n{ST}", layer=str(tmp_path / "scene.usda"))
    assert (texture.image, codes) == (-1, ["W201"])


@pytest.mark.parametrize(
    "value",
    [
        'string inputs:scale = "2"',
        "float2 inputs:bias = (1, 2)",
        'string inputs:fallback = "red"',
        "int inputs:wrapS = 1",
        "int inputs:sourceColorSpace = 1",
    ],
)
def test_constants_of_a_wrong_type_are_named_and_the_defaults_hold(value, image):
    _, texture, _, codes = _texture(f"asset inputs:file = @{image}@\n{ST}\n{value}")
    _, expected, _, _ = _texture(f"asset inputs:file = @{image}@\n{ST}")
    assert codes == ["W306"]
    for name in ("scale", "bias", "fallback", "wrap_s", "is_srgb"):
        assert getattr(texture, name) == getattr(expected, name)


@pytest.mark.parametrize(
    "value", ['string inputs:rotation = "90"', "float3 inputs:scale = (1, 2, 3)", 'string inputs:translation = "x"']
)
def test_turns_of_a_wrong_type_are_named_and_nothing_is_turned(value, image):
    turn = (
        f'def Shader "X" {{\nuniform token info:id = "UsdTransform2d"\n{value}\n'
        "float2 inputs:in.connect = </M/R.outputs:result>\nfloat2 outputs:result\n}\n"
    )
    body = f"asset inputs:file = @{image}@\nfloat2 inputs:st.connect = </M/X.outputs:result>"
    _, texture, _, codes = _texture(body, nodes=turn + READER)
    assert codes == ["W306"]
    np.testing.assert_array_equal(texture.uv_transform, np.eye(2, 3))
