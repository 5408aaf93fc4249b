# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""``warp-rt render``, ``doctor`` and ``warmup`` from file to file, on stages of a few lines."""

import json
import os
import signal
import subprocess
import sys
import textwrap
import time
from contextlib import contextmanager

import numpy as np
import OpenEXR
import pytest
from PIL import Image as PillowImage

from warp_rt.cli.main import main
from warp_rt.cli.render_summary import whole_run

from ..processes import hear_interrupts
from ..wall_stage import STAGE

WIDTH, HEIGHT = 16, 8


@pytest.fixture
def stage(tmp_path, monkeypatch):
    """A stage in the current folder, which holds nothing else."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "wall.usda"
    path.write_text(STAGE)
    return path


def _render(*arguments):
    return main(["render", "wall.usda", "--width", str(WIDTH), "--device", "cpu", *arguments])


def _channels(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return {name: channel.pixels for name, channel in file.channels().items()}


def test_no_output_name_means_the_scenes_name_here(stage, capfd):
    assert _render() == 0
    out, err = capfd.readouterr()
    assert out == ""
    assert "wall.png: 16 x 8" in err
    assert PillowImage.open("wall.png").size == (WIDTH, HEIGHT)
    assert {path.name for path in stage.parent.iterdir()} == {"wall.usda", "wall.png"}


def test_json_has_everything_that_the_interface_promises(stage, capfd):
    assert _render("-o", "a.exr", "--json", "--depth", "5", "--threshold", "0.25", "--threads", "1") == 0
    result = json.loads(capfd.readouterr().out)
    assert result["outputs"] == ["a.exr"]
    assert (result["width"], result["height"], result["spp"]) == (WIDTH, HEIGHT, 1)
    assert (result["integrator"], result["depth"], result["threshold"]) == ("whitted", 5, 0.25)
    assert (result["device"], result["threads"]) == ("cpu", 1)
    assert (result["triangles"], result["instances"]) == (2, 1)
    assert set(result["seconds"]) == {"start", "load", "upload", "build", "compile", "render", "write", "total"}
    stages = [value for stage, value in result["seconds"].items() if stage != "total"]
    assert all(value >= 0 for value in stages)
    assert sum(stages) <= result["seconds"]["total"] + 0.05
    rays = result["rays"]
    assert rays["primary"] == WIDTH * HEIGHT
    # Half the picture shows the wall, every point of which faces the light: one shadow ray each.
    assert (rays["reflection"], rays["refraction"], rays["shadow"]) == (0, 0, WIDTH * HEIGHT // 2)
    assert (rays["total_internal_reflection"], rays["dropped_by_depth"], rays["dropped_by_threshold"]) == (0, 0, 0)
    assert rays["deepest"] == len(rays["per_depth"]) == 1
    assert set(result["bvh"]) == {"builder", "nodes", "depth", "sah_cost", "bytes"}
    assert result["bvh"]["builder"] == "sah"
    assert result["memory"]["peak_bytes"] > 1 << 20
    assert result["memory"]["device_bytes"] > 0
    assert result["warnings"] == []


def test_wall_facing_a_light_of_irradiance_pi_shows_its_diffuse_colour(stage):
    assert _render("-o", "a.exr") == 0
    channels = _channels("a.exr")
    wall = np.zeros((HEIGHT, WIDTH), bool)
    wall[:, WIDTH // 4 : 3 * WIDTH // 4] = True
    for name, albedo in (("R", 0.25), ("G", 0.5), ("B", 0.75), ("A", 1.0)):
        assert channels[name][wall] == pytest.approx(albedo, abs=1e-5)
        assert (channels[name][~wall] == 0).all()


def test_aovs_are_layers_and_ids_have_their_sidecar(stage, capfd):
    aovs = "color,depth,normal,primId,instanceId,elementId"
    assert _render("-o", "a.exr", "--aov", aovs, "--json") == 0
    assert json.loads(capfd.readouterr().out)["outputs"] == ["a.exr", "a.ids.json"]
    channels = _channels("a.exr")
    hit = channels["A"] > 0
    assert hit.any()
    assert (~hit).any()
    assert channels["depth.Z"][hit] == pytest.approx(10, abs=1e-4)
    assert np.isinf(channels["depth.Z"][~hit]).all()
    assert channels["normal.Z"][hit] == pytest.approx(1, abs=1e-6)
    ids = channels["primId.X"].view(np.int32)
    assert (ids[~hit] == -1).all()
    assert (channels["elementId.X"][hit] == 0).all()
    sidecar = json.loads((stage.parent / "a.ids.json").read_text())
    assert {sidecar["primId"][str(index)]["path"] for index in np.unique(ids[hit])} == {"/World/Wall"}


def test_frames_become_numbered_files(stage, capfd):
    """In a folder, which the lines that say how far it is name too."""
    (stage.parent / "shots").mkdir()
    assert _render("-o", "shots/a.##.exr", "--frames", "1:3x2", "--aov", "color,depth", "--json") == 0
    out, err = capfd.readouterr()
    result = json.loads(out)
    assert [line.partition(":")[0] for line in err.splitlines() if " of 2)" in line] == [
        "shots/a.01.exr (1 of 2)",
        "shots/a.03.exr (2 of 2)",
    ]
    assert result["outputs"] == ["shots/a.01.exr", "shots/a.03.exr"]
    assert [frame["frame"] for frame in result["frames"]] == [1, 3]
    assert result["rays"]["primary"] == 2 * WIDTH * HEIGHT
    for name, distance in (("shots/a.01.exr", 10), ("shots/a.03.exr", 30)):
        depth = _channels(name)["depth.Z"]
        assert depth[np.isfinite(depth)] == pytest.approx(distance, abs=1e-3)


def test_without_frames_it_is_the_start_time(stage):
    assert _render("-o", "a.png", "--aov", "color,depth") == 0
    depth = np.load("a.depth.npy")
    assert depth[np.isfinite(depth)] == pytest.approx(10, abs=1e-3)


def test_default_time_reads_the_values_without_time(stage):
    """The translation has time samples only, so at the default time the wall stands in the camera, unseen."""
    assert _render("-o", "a.exr", "--defaultTime", "--aov", "color,depth") == 0
    assert np.isinf(_channels("a.exr")["depth.Z"]).all()


def test_crop_is_that_part_of_the_picture(stage):
    assert _render("-o", "whole.exr") == 0
    assert _render("-o", "part.exr", "--crop", "2,3,7,4") == 0
    assert _render("-o", "edge.exr", "--crop", "12,6,100,100") == 0  # what lies outside is left off
    whole, part, edge = (_channels(f"{name}.exr") for name in ("whole", "part", "edge"))
    for name in "RGBA":
        assert np.array_equal(edge[name], whole[name][6:, 12:])
        assert np.array_equal(part[name], whole[name][3:7, 2:9])


def test_usdrecords_spellings(stage):
    arguments = ["--imageWidth", "20", "-cam", "Front", "-f", "2", "-c", "low", "--purposes", "proxy,render"]
    assert main(["render", "wall.usda", "-o", "a.png", *arguments]) == 0
    assert PillowImage.open("a.png").size == (20, 10)


def test_files_say_how_they_were_made(stage):
    assert _render("-o", "a.png", "--seed", "3", "--spp", "2") == 0
    text = PillowImage.open("a.png").text
    assert text["Source"].endswith("wall.usda")
    assert (text["warp_rt:camera"], text["warp_rt:spp"], text["warp_rt:seed"]) == ("/World/Front", "2", "3")


def test_same_render_twice_is_the_same_file(stage):
    assert _render("-o", "a.png") == 0
    assert _render("-o", "b.png", "--threads", "2") == 0
    assert (stage.parent / "a.png").read_bytes() == (stage.parent / "b.png").read_bytes()


def test_quiet_says_nothing(stage, capfd):
    assert _render("-q", "-o", "a.png") == 0
    assert capfd.readouterr() == ("", "")


# --- what goes wrong


def test_missing_and_broken_scenes_exit_3_and_name_the_file(stage, capfd):
    (stage.parent / "broken.usda").write_text("#usda 1.0\ndef Mesh {")
    for name in ("missing.usda", "broken.usda"):
        assert main(["render", name, "-o", "a.png"]) == 3
        out, err = capfd.readouterr()
        assert out == ""
        assert [line for line in err.splitlines() if line.startswith("warp-rt render: error: ")]
        assert name in err
        assert "Traceback" not in err
    assert not (stage.parent / "a.png").exists()


def test_prim_that_is_no_camera_is_called_that(stage, capfd):
    assert _render("-o", "a.png", "--camera", "/World/Wall") == 3
    assert "wall.usda: /World/Wall is no camera; it has /World/Front\n" in capfd.readouterr().err


def test_unknown_camera_exits_3_with_near_matches(stage, capfd):
    assert _render("-o", "a.png", "--camera", "Frond") == 3
    assert "Front" in capfd.readouterr().err
    assert not (stage.parent / "a.png").exists()


def test_strict_makes_warnings_errors_before_anything_is_written(stage, capfd):
    stage.write_text(STAGE.replace('subdivisionScheme = "none"', 'orientation = "sideways"'))
    assert _render("-o", "a.png") == 0
    assert "warning: W114 /World/Wall: orientation is 'sideways'" in capfd.readouterr().err
    (stage.parent / "a.png").unlink()
    assert _render("-o", "a.png", "--strict") == 3
    err = capfd.readouterr().err
    assert err.count("W114") == 1
    assert err.endswith("warp-rt render: error: wall.usda: --strict: 1 warning\n")
    assert _render("-o", "a.png", "--strict", "-q") == 3
    assert "--strict: 1 warning: W114 /World/Wall: orientation" in capfd.readouterr().err  # nobody else told it
    assert not (stage.parent / "a.png").exists()


def test_complexity_refines_subdivision_surfaces(stage, capfd):
    """The square's rim becomes a closed cubic B-spline."""
    smooth = 'uniform token interpolateBoundary = "edgeOnly"'
    stage.write_text(STAGE.replace('uniform token subdivisionScheme = "none"', smooth))
    assert _render("-o", "a.exr", "--complexity", "veryhigh", "--spp", "64") == 0
    t = np.linspace(0, 1, 1000, endpoint=False)[:, None]
    weights = [(1 - t) ** 3 / 6, (3 * t**3 - 6 * t**2 + 4) / 6, (-3 * t**3 + 3 * t**2 + 3 * t + 1) / 6, t**3 / 6]
    square = np.array([(-2, -2), (2, -2), (2, 2), (-2, 2)], float)
    rim = np.concatenate([sum(w * square[(k + i) % 4] for i, w in enumerate(weights)) for k in range(4)])
    x, y = rim.T
    area = 0.5 * np.abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))
    # 32 chords cut 0.6 % off it.
    assert _channels("a.exr")["A"].mean() == pytest.approx(area / 32, rel=0.015)


def test_notes_are_not_warnings(stage, capfd):
    stage.write_text(STAGE[: STAGE.index('    def Camera "Front"')] + "}\n")
    assert _render("-o", "a.png", "--strict", "--json") == 0
    out, err = capfd.readouterr()
    result = json.loads(out)
    assert result["warnings"] == []
    assert {note["code"] for note in result["notes"]} == {"N901", "N902"}
    assert err.count("note: N901") == err.count("note: N902") == 1


def test_absent_device_exits_4(stage, capfd):
    assert main(["render", "wall.usda", "--device", "cuda:99"]) == 4
    assert "'cuda:99' is not available" in capfd.readouterr().err


def test_time_limit_exits_5_and_writes_nothing(stage, capfd):
    assert _render("-o", "a.png", "--time-limit", "0.2", "--spp", "1000000") == 5
    assert "time limit" in capfd.readouterr().err
    assert not (stage.parent / "a.png").exists()


@pytest.mark.parametrize("output", ["no/a.png", "wall.usda/a.png", "folder.png"])
def test_unwritable_output_exits_6_before_the_scene_is_read(stage, capfd, output):
    (stage.parent / "folder.png").mkdir()
    assert main(["render", "missing.usda", "-o", output]) == 6
    assert output in capfd.readouterr().err


@pytest.mark.parametrize("output", [f"{300 * 'x'}.png", f"{300 * 'x'}/a.png", f"{250 * 'x'}.png"])
def test_names_that_no_file_can_have_exit_6(stage, capfd, output):
    """The last is short enough for a picture, but not for the AOV beside it."""
    assert main(["render", "missing.usda", "-o", output, "--aov", "color,depth"]) == 6
    err = capfd.readouterr().err
    assert err.startswith("warp-rt render: error: xxx")
    assert err.count("\n") == 1


def test_files_that_the_scene_reads_are_spared(stage, capfd):
    PillowImage.new("RGB", (2, 2), (255, 0, 0)).save("wall.png")
    before = (stage.parent / "wall.png").read_bytes()
    material = textwrap.dedent("""
        over "World"
        {
            over "Wall" (prepend apiSchemas = ["MaterialBindingAPI"])
            {
                rel material:binding = </World/Paint>
            }
            def Material "Paint"
            {
                token outputs:surface.connect = </World/Paint/Surface.outputs:surface>
                def Shader "Surface"
                {
                    uniform token info:id = "UsdPreviewSurface"
                    color3f inputs:diffuseColor.connect = </World/Paint/Texture.outputs:rgb>
                    token outputs:surface
                }
                def Shader "Texture"
                {
                    uniform token info:id = "UsdUVTexture"
                    asset inputs:file = @wall.png@
                    float3 outputs:rgb
                }
            }
        }
    """)
    base = stage.parent / "base.usda"
    base.write_text(STAGE)
    stage.write_text("#usda 1.0\n( subLayers = [@base.usda@] )\n" + material)
    assert _render() == 6
    assert "the scene reads this file" in capfd.readouterr().err
    assert (stage.parent / "wall.png").read_bytes() == before


# --- the process as a whole


def _process(*arguments, **options):
    return subprocess.run(
        [sys.executable, "-m", "warp_rt", *arguments], capture_output=True, text=True, timeout=120, **options
    )


def test_nothing_but_the_result_is_printed(stage):
    result = _process("render", "wall.usda", "-w", "16", "--json")
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout)["outputs"] == ["wall.png"]
    lines = result.stderr.splitlines()
    assert [line for line in lines if "compiling" not in line] == [line for line in lines if "wall.png" in line]


def test_odd_names_and_a_plain_locale(stage):
    odd = stage.parent / "bö\nse wand.usda"
    odd.write_text(STAGE)
    environment = {**os.environ, "LC_ALL": "C"}
    result = _process("render", odd.name, "-w", "16", "-o", "ä\nb.png", "--json", env=environment)
    assert result.returncode == 0, result.stderr
    assert "Traceback" not in result.stderr
    assert (stage.parent / "ä\nb.png").exists()
    assert len(json.loads(result.stdout)["outputs"]) == 1


# --- with somebody watching

if sys.platform != "win32":
    import pty

on_terminal = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo-terminals")


@contextmanager
def _watched(*arguments):
    """Give a render whose stderr is a terminal, and the terminal's other end; nothing of it outlives the block."""
    leader, follower = pty.openpty()
    command = [sys.executable, "-m", "warp_rt", "render", "wall.usda", "-o", "a.png", *arguments]
    process = subprocess.Popen(command, stderr=follower, stdout=subprocess.PIPE, preexec_fn=hear_interrupts)
    os.close(follower)
    try:
        yield process, leader
    finally:
        process.kill()


def _read_until(leader, word):
    """Return what the terminal shows until it holds ``word``, or to its end."""
    shown = b""
    while word not in shown:
        try:
            chunk = os.read(leader, 4096)
        except OSError:  # Linux's way to say that the other end is closed
            break
        if not chunk:
            break
        shown += chunk
    return shown


@on_terminal
def test_terminal_shows_progress(stage):
    with _watched("-w", "64", "--spp", "500") as (process, leader):
        shown = _read_until(leader, b"no such text")
        assert process.wait(timeout=60) == 0
        assert b"rendering a.png" in shown
        assert b"%" in shown
        assert b"a.png: 64 x 32" in shown
        assert process.stdout.read() == b""


@on_terminal
@pytest.mark.parametrize(("sent", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signals_end_a_render_at_once_and_leave_nothing(stage, sent, code):
    with _watched("-w", "512", "--spp", "1000000") as (process, leader):
        assert b"rendering" in _read_until(leader, b"rendering")
        time.sleep(0.5)
        begin = time.monotonic()
        process.send_signal(sent)
        shown = _read_until(leader, b"error: ")
        process.wait(timeout=10)
        assert time.monotonic() - begin < 5  # of hours
    assert process.returncode == code
    assert b"Traceback" not in shown
    assert {path.name for path in stage.parent.iterdir()} == {"wall.usda"}


# --- doctor, warmup


def test_doctor_tells_versions_devices_and_the_cache(capfd):
    assert main(["doctor", "--json"]) == 0
    findings = json.loads(capfd.readouterr().out)
    assert {"warp_rt", "warp", "usd", "numpy", "python"} == set(findings["versions"])
    assert findings["devices"][0]["name"] == "cpu"
    assert findings["threads"] >= 1
    assert set(findings["kernel_cache"]) == {"path", "bytes", "is_temporary"}


def test_doctor_and_its_reader_learn_that_the_cache_is_temporary(tmp_path):
    not_a_folder = tmp_path / "file"
    not_a_folder.write_text("")
    result = _process("doctor", env={**os.environ, "TMPDIR": str(tmp_path), "WARP_CACHE_PATH": str(not_a_folder)})
    assert result.returncode == 0
    assert "  (temporary, 0.0 MiB)" in result.stdout
    assert result.stderr.count("WARP_CACHE_PATH") == 1


def test_warmup_compiles_for_a_device(capfd):
    assert main(["warmup", "--device", "cpu"]) == 0
    out, err = capfd.readouterr()
    assert out == ""
    *files, end = [line for line in err.splitlines() if line.startswith("kernels ")]
    assert [line.split(":")[0] for line in files] == [f"kernels {n} of {len(files)}" for n in range(1, len(files) + 1)]
    assert end.startswith("kernels are ready for cpu")
    assert main(["warmup", "--device", "cuda:99"]) == 4


def test_sums_over_a_sequence():
    def frame(name, nodes):
        levels = [{"depth": depth, "nodes": count} for depth, count in enumerate(nodes, start=1)]
        return {
            "outputs": [name],
            "width": 4,
            "height": 2,
            "seconds": {"load": 1.0},
            "rays": {"primary": nodes[0], "deepest": len(nodes), "per_depth": levels},
            "warnings": [{"code": "W101", "prim": "/a", "message": "dropped"}],
            "notes": [],
        }

    run = whole_run([frame("a.1.png", [10, 4]), frame("a.2.png", [10, 6, 3])], [1.0, 2.0])
    assert run["outputs"] == ["a.1.png", "a.2.png"]
    assert run["seconds"] == {"load": 2.0}
    assert (run["rays"]["primary"], run["rays"]["deepest"]) == (20, 3)
    assert [level["nodes"] for level in run["rays"]["per_depth"]] == [20, 10, 3]
    assert run["warnings"] == [{"code": "W101", "prim": "/a", "message": "dropped"}]
    assert [frame["frame"] for frame in run["frames"]] == [1.0, 2.0]


def test_the_last_line_names_the_files_and_is_not_mistaken_about_their_size(stage, capfd):
    size = ["-w", str(WIDTH)]
    assert main(["render", str(stage), "-o", "a.png", "--aov", "color,depth", *size]) == 0
    assert f"a.png and a.depth.npy: {WIDTH} x {HEIGHT}, " in capfd.readouterr().err
    # The picture of a cost is larger, for its legend.
    assert main(["render", str(stage), "-o", "c.png", "--aov", "rays", *size]) == 0
    assert f"c.png and c.rays.npy: costs of {WIDTH} x {HEIGHT} pixels, " in capfd.readouterr().err
    assert main(["render", str(stage), "-o", "d.png", "--aov", "color,depth,uv,normal,position", *size]) == 0
    assert "d.png to d.position.npy, 5 files: " in capfd.readouterr().err
