# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Opening files of every kind, composition errors, time and stage metadata."""

import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf, Tf, Usd, UsdGeom, UsdShade, UsdUtils

from warp_rt.errors import OptionError, SceneError
from warp_rt.report import Report
from warp_rt.usd.assets import read_asset
from warp_rt.usd.load import load_stage
from warp_rt.usd.stage import open_stage, stage_meters_per_unit, stage_time, stage_up_axis

SPHERE = '#usda 1.0\ndef Sphere "s" {\n}\n'


def write(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def in_memory(metadata: str = "") -> Usd.Stage:
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(f"#usda 1.0\n(\n{metadata}\n)\n")
    return stage


@pytest.mark.parametrize("suffix", ["usda", "usdc", "usd", "usdz"])
def test_every_format_opens(suffix: str, tmp_path: Path) -> None:
    source = write(tmp_path / "source.usda", SPHERE)
    path = tmp_path / f"a scene é.{suffix}"
    if suffix == "usdz":
        assert UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(source)), str(path))
    else:
        layer = Sdf.Layer.FindOrOpen(str(source))
        assert layer.Export(str(path))
    scene = load_stage(path)
    assert scene.prims == ("/s",)
    assert scene.source == str(path)


def test_an_open_stage_is_read_as_it_is() -> None:
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.Sphere.Define(stage, "/s")
    before = stage.GetRootLayer().ExportToString()
    assert load_stage(stage).prims == ("/s",)
    assert stage.GetRootLayer().ExportToString() == before


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("missing.usda", None),
        ("empty.usda", b""),
        ("empty.usdc", b""),
        ("empty.usdz", b""),
        ("syntax.usda", b'#usda 1.0\ndef Sphere "s" {\n    double radius =\n}\n'),
        ("picture.usd", b"\x89PNG\r\n\x1a\n" + bytes(100)),
        ("garbage.usda", b"hello"),
        ("broken.usda", b'#usda 1.0\ndef Sphere "s" {\n'),
        ("latin.usda", b'#usda 1.0\ndef "a" {\n string s = "\xff\xfe"\n bad \xff }'),
        ("garbage.usdc", b"PXR-USDC" + bytes(100)),
        ("garbage.usdz", b"PK\x03\x04" + bytes(50)),
        ("picture.png", b"\x89PNG"),
        ("mesh.obj", b"v 0 0 0"),
        ("framesPerSecond.usda", b"#usda 1.0\n(\n framesPerSecond = 0\n)\n"),
    ],
)
def test_a_file_that_cannot_be_read_is_one_line(name: str, content: bytes | None, tmp_path: Path, capfd) -> None:
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(SceneError) as error:
        load_stage(path)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 1000
    captured = capfd.readouterr()
    assert captured.out + captured.err == ""


def test_a_crate_that_ends_early_is_one_line(tmp_path: Path, capfd) -> None:
    whole = tmp_path / "whole.usdc"
    layer = Sdf.Layer.CreateAnonymous(".usdc")
    layer.ImportFromString("#usda 1.0\n" + "".join(f'def Sphere "s{k}" {{\n}}\n' for k in range(50)))
    assert layer.Export(str(whole))
    content = whole.read_bytes()
    for kept in (8, len(content) // 2, len(content) - 20):
        path = tmp_path / f"cut{kept}.usdc"
        path.write_bytes(content[:kept])
        with pytest.raises(SceneError, match=f"cut{kept}.usdc: cannot be read as USD") as error:
            load_stage(path)
        assert "\n" not in str(error.value)
    captured = capfd.readouterr()
    assert captured.out + captured.err == ""


def test_what_is_wrong_with_a_file_is_said(tmp_path: Path) -> None:
    (tmp_path / "folder.usda").mkdir()
    (tmp_path / "empty.usd").touch()
    for path in (tmp_path, tmp_path / "folder.usda"):
        with pytest.raises(SceneError, match="is a folder, not a USD file"):
            open_stage(path)
    with pytest.raises(SceneError, match="the file is empty"):
        open_stage(tmp_path / "empty.usd")
    with pytest.raises(SceneError, match="no such file"):
        open_stage("")


@pytest.mark.skipif(os.name == "nt", reason="file names are UTF-16 there")
def test_a_name_that_is_not_utf8_is_one_line(tmp_path: Path) -> None:
    folder = os.fsencode(tmp_path)
    names = [os.fsdecode(folder + b"/latin\xe9.usda"), os.fsdecode(folder + b"/gone\xe9.usda")]
    Path(names[0]).write_text(SPHERE)
    for name in names:
        with pytest.raises(SceneError, match="not UTF-8"):
            load_stage(name)


def test_session_layers_are_refused_as_stages_are(tmp_path: Path) -> None:
    scene = str(write(tmp_path / "a.usda", SPHERE))
    empty = write(tmp_path / "empty.usda", "")
    for name, said in ((tmp_path / "no.usda", "no such file"), (tmp_path, "is a folder"), (empty, "the file is empty")):
        with pytest.raises(SceneError, match=said):
            open_stage(scene, session_layer=name)


def test_a_package_that_is_missing_is_no_such_file(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="no such file"):
        open_stage(f"{tmp_path}/no.usdz[a.usda]")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes")
def test_pipes_are_not_waited_for(tmp_path: Path) -> None:
    scene = write(tmp_path / "a.usda", SPHERE)
    pipe = tmp_path / "pipe.usda"
    os.mkfifo(pipe)
    with pytest.raises(SceneError, match="is no regular file"):
        open_stage(pipe)
    with pytest.raises(SceneError, match="is no regular file"):
        open_stage(scene, session_layer=pipe)
    with pytest.raises(SceneError, match="no regular file"):
        read_asset(str(pipe))


@pytest.mark.skipif(sys.platform != "linux", reason="other systems read file names as UTF-8 whatever the locale")
def test_a_name_that_this_process_misreads_is_called_that(tmp_path: Path) -> None:
    scene = write(tmp_path / "é.usda", SPHERE)
    code = "import sys; from warp_rt.usd.stage import open_stage; open_stage(sys.argv[1])"
    environment = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    result = subprocess.run([sys.executable, "-c", code, scene], capture_output=True, text=True, env=environment)
    assert "file names are ascii to this process and UTF-8 to USD" in result.stderr.splitlines()[-1]


def test_payloads_that_are_not_loaded_are_noted(tmp_path: Path) -> None:
    write(tmp_path / "payload.usda", '#usda 1.0\ndef Xform "p" {\ndef Sphere "s" {\n}\n}\n')
    root = write(tmp_path / "root.usda", '#usda 1.0\ndef "a" (payload = @./payload.usda@</p>) {\n}\n')
    assert load_stage(root).prims == ("/a/s",)
    scene = load_stage(Usd.Stage.Open(str(root), Usd.Stage.LoadNone))
    found = [(record.code, record.prim) for record in scene.diagnostics]
    assert found == [("N906", "/a"), ("N905", str(root))]


def test_muted_layers_are_noted(tmp_path: Path, capfd) -> None:
    layer = str(write(tmp_path / "layer.usda", SPHERE))
    write(tmp_path / "sub.usda", "#usda 1.0\n(subLayers = [@./layer.usda@])\n")
    for text in (
        "(subLayers = [@./layer.usda@])\n",
        "(subLayers = [@./sub.usda@])\n",
        'def "a" (references = @./layer.usda@</s>) {\n}\n',
    ):
        stage = Usd.Stage.Open(str(write(tmp_path / f"{len(text)}.usda", f"#usda 1.0\n{text}")))
        stage.MuteAndUnmuteLayers([layer, str(tmp_path / "of_another_stage.usda")], [])
        assert [record.code for record in load_stage(stage).diagnostics] == ["N906", "N905"]


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        ('def "a" { string s = "abc', 2, "the text ends too early in </a.s>"),
        ('def "a" (references = @', 2, "the text ends too early in </a>"),
        ('def "a" { int n = [1,\n}', 3, "cannot be parsed at"),
        ('def "a" { int n = x }', 2, "at 'x }' in </a.n>"),
    ],
)
def test_what_a_parser_says_is_for_people(tmp_path: Path, text: str, line: int, said: str) -> None:
    with pytest.raises(SceneError) as raised:
        open_stage(write(tmp_path / "bad.usda", f"#usda 1.0\n{text}"))
    message = str(raised.value)
    assert f"bad.usda:{line}:" in message
    assert said in message
    for noise in ("pegtl", "TextFileFormat", "Failed to open layer"):
        assert noise not in message


def test_what_a_mask_leaves_out_is_no_fault_of_the_stage(tmp_path: Path) -> None:
    path = write(
        tmp_path / "a.usda",
        """#usda 1.0
(
    renderSettingsPrimPath = "/Settings"
)
def Scope "World" {
    def Sphere "s" (apiSchemas = ["MaterialBindingAPI"]) { rel material:binding = </M>
    }
    def PointInstancer "i" {
        rel prototypes = </P>
        int[] protoIndices = [0]
        point3f[] positions = [(0, 0, 0)]
    }
    def RenderSettings "Inside" { rel camera = </Camera>
    }
}
def Material "M" {
}
def Sphere "P" {
}
def Camera "Camera" {
}
def RenderSettings "Settings" {
}
""",
    )
    scene = load_stage(path, mask=["/World"])
    assert scene.prims == ("/World/s",)
    found = {(record.code, record.prim) for record in scene.diagnostics if record.code != "N903"}
    assert found == {("N908", "/World/s"), ("N908", "/World/i"), ("N908", "/Settings")}
    with_camera = load_stage(path, mask=["/World"], settings_path="/World/Inside")
    assert ("N908", "/World/Inside") in {(record.code, record.prim) for record in with_camera.diagnostics}


def test_composition_errors_are_named_and_nothing_is_printed(tmp_path: Path, capfd) -> None:
    write(tmp_path / "broken.usda", "#usda 1.0\ndef garbage")
    root = write(
        tmp_path / "root.usda",
        """#usda 1.0
(
    subLayers = [@./gone_layer.usda@]
)
def Xform "A" (references = @./gone.usda@) {
}
def Xform "A2" (references = @./gone.usda@) {
}
def Xform "B" (payload = @./gone_too.usda@) {
}
def Xform "C" (references = </Nowhere>) {
}
def Xform "D" (references = </D/E>) {
    def "E" {
    }
}
def Xform "F" (references = @./broken.usda@) {
}
def Sphere "s" {
}
""",
    )
    scene = load_stage(root)
    assert scene.prims == ("/s",)
    found = [(record.code, record.prim) for record in scene.diagnostics]
    assert ("W501", "/A") in found
    assert ("W501", "/A2") not in found  # the same file, counted in the message about /A
    assert any("1 more" in record.message for record in scene.diagnostics if record.prim == "/A")
    assert {("W501", "/B"), ("W502", "/C"), ("W503", "/D"), ("W501", "/F")} <= set(found)
    assert any("gone_layer.usda" in record.message for record in scene.diagnostics)
    assert all("\n" not in record.message and "0x" not in record.message for record in scene.diagnostics)
    assert not any(record.code == "N920" for record in scene.diagnostics)
    captured = capfd.readouterr()
    assert captured.out + captured.err == ""


# --- time


@pytest.mark.parametrize(
    ("metadata", "options", "expected"),
    [
        ("", {}, 0.0),
        ("startTimeCode = 5", {}, 5.0),
        ("startTimeCode = 9\nendTimeCode = 1", {}, 9.0),
        ("startTimeCode = 5", {"time": -3.5}, -3.5),
        ("startTimeCode = 5\ntimeCodesPerSecond = 0", {"default_time": True}, None),
    ],
)
def test_time_is_the_one_given_or_the_stages_first(metadata: str, options: dict, expected: float | None) -> None:
    assert load_stage(in_memory(metadata), **options).time == expected


@pytest.mark.parametrize("time", [np.float32(2.5), np.int64(2), 2])
def test_times_may_be_numbers_of_any_type(time: object) -> None:
    assert load_stage(in_memory("startTimeCode = 5"), time=time).time == float(time)


def test_times_that_mean_nothing_are_refused() -> None:
    stage = in_memory()
    for time, default_time in ((math.nan, False), (math.inf, False), (1.0, True), ("1", False), ([1], False)):
        with pytest.raises(OptionError):
            stage_time(stage, time, default_time, Report())


@pytest.mark.parametrize(
    ("metadata", "options", "is_noted"),
    [
        ("startTimeCode = 1\nendTimeCode = 3", {}, False),
        ("startTimeCode = 1\nendTimeCode = 3", {"time": 3}, False),
        ("startTimeCode = 1\nendTimeCode = 3", {"time": 3.5}, True),
        ("startTimeCode = 1\nendTimeCode = 3", {"time": 0}, True),
        ("startTimeCode = 1\nendTimeCode = 3", {"time": 3.5, "base_time": 3}, False),  # while its shutter is open
        ("startTimeCode = 1\nendTimeCode = 3", {"default_time": True}, False),
        ("startTimeCode = 1", {"time": 0}, False),
        ("startTimeCode = 3\nendTimeCode = 1", {"time": 2}, False),  # nothing lies inside
        ("", {"time": 200}, False),
    ],
)
def test_frames_outside_of_the_stages_are_noted(metadata: str, options: dict, is_noted: bool) -> None:
    told = [
        record.message for record in load_stage(in_memory(metadata), **options).diagnostics if record.code == "N939"
    ]
    assert len(told) == is_noted
    if told:
        assert told[0].startswith("a frame outside of startTimeCode 1 to endTimeCode 3")


# --- metadata


@pytest.mark.parametrize(
    ("metadata", "axis", "is_warned"),
    [("", "Y", False), ('upAxis = "Z"', "Z", False), ('upAxis = "X"', "Z", True), ('upAxis = "up"', "Z", True)],
)
def test_up_axis(metadata: str, axis: str, is_warned: bool) -> None:
    report = Report()
    assert stage_up_axis(in_memory(metadata), report) == axis
    assert [record.code for record in report] == ["W510"] * is_warned


def test_meters_per_unit() -> None:
    report = Report()
    assert stage_meters_per_unit(in_memory(), report) == 0.01
    assert stage_meters_per_unit(in_memory("metersPerUnit = 1"), report) == 1.0
    assert len(report) == 0
    assert stage_meters_per_unit(in_memory("metersPerUnit = -1"), report) == 0.01
    assert [record.code for record in report] == ["W511"]


def test_meters_per_unit_as_old_files_have_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """USD writes no float there any more, and raises where it reads one."""

    def refuse(_: Usd.Stage) -> float:
        Tf.RaiseCodingError("Type mismatch: expected double, got float")

    monkeypatch.setattr(UsdGeom, "GetStageMetersPerUnit", refuse)
    report = Report()
    assert stage_meters_per_unit(in_memory("metersPerUnit = 0.5"), report) == 0.5
    assert [record.code for record in report] == ["N916"]


def test_a_stage_in_memory_has_no_source() -> None:
    """An anonymous layer's identifier holds an address: files made from equal stages would differ."""
    assert load_stage(in_memory()).source == ""


def test_tokens_that_are_no_text_are_told(tmp_path):
    """Bytes of a crate file's token changed to what is no UTF-8: USD hands them on, Python cannot take them."""
    stage = Usd.Stage.CreateNew(str(tmp_path / "a.usdc"))
    UsdShade.Material.Define(stage, "/Look")
    shader = UsdShade.Shader.Define(stage, "/Look/Surface")
    shader.CreateIdAttr("Qzxjkvwy")
    material = UsdShade.Material.Get(stage, "/Look")
    material.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", Sdf.ValueTypeNames.Token))
    mesh = UsdGeom.Sphere.Define(stage, "/Ball")
    UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
    stage.Save()
    data = (tmp_path / "a.usdc").read_bytes()
    assert data.count(b"Qzxjkvwy") == 1  # tokens are compressed, but nothing like this one came before it
    (tmp_path / "b.usdc").write_bytes(data.replace(b"Qzxjkvwy", b"\xb0zxjkvwy"))
    with pytest.raises(SceneError, match=r"b\.usdc: the file is damaged: it holds text that is not UTF-8"):
        load_stage(tmp_path / "b.usdc")
