# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What lies in the files, read back by the libraries that others read them with."""

import json
import os
import signal
import subprocess
import sys
import textwrap
import time
from types import SimpleNamespace

import numpy as np
import OpenEXR
import pytest
from PIL import Image as PillowImage

from warp_rt.errors import OptionError, OutputError
from warp_rt.image.atomic import replacing, write_bytes
from warp_rt.image.image import Image
from warp_rt.image.outputs import check_writable, planned_files

WIDTH, HEIGHT = 5, 3


@pytest.fixture
def film():
    """A film whose every pixel differs; the left column is empty, the rest is half covered."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float32)
    alpha = np.where(x > 0, np.float32(0.5), np.float32(0.0))
    color = np.stack([x / 10, y / 10, np.full_like(x, 0.125)], axis=-1) * alpha[..., None]
    depth = np.where(x > 0, x + 10 * y, np.float32(np.inf))
    ids = np.where(x > 0, (y % 2), -1).astype(np.int32)
    return SimpleNamespace(
        facts={},
        data_window=None,
        pixel_aspect_ratio=1.0,
        aovs={
            "color": color,
            "alpha": alpha,
            "depth": depth,
            "normal": np.stack([x, y, -x], axis=-1),
            "uv": np.stack([x / WIDTH, y / HEIGHT], axis=-1),
            "primId": ids,
        },
        prims=("/World/Teapot", "/World/Ünï"),
        instance_paths=(),
        labels={"/World/Teapot": {"class": ("pot", "tea")}},
    )


FACTS = {"source": "scene.usda", "camera": "/World/Camera", "spp": 4, "seed": 7}


def test_png_has_straight_alpha_and_says_how_it_was_made(film, tmp_path):
    film.facts = FACTS
    Image(film).save(tmp_path / "a.png")
    with PillowImage.open(tmp_path / "a.png") as picture:
        assert (picture.mode, picture.size) == ("RGBA", (WIDTH, HEIGHT))
        text = picture.text
        pixels = np.asarray(picture)
    assert np.array_equal(pixels[..., 3], np.where(film.aovs["alpha"] > 0, 128, 0))
    # Blue is 0.125 before it is covered by half; 1.055 * 0.125^(1/2.4) - 0.055 = 0.38857 is code 99.
    assert (pixels[:, 1:, 2] == 99).all()
    assert text["Software"].startswith("warp_rt ")
    assert text["Source"] == "scene.usda"
    assert text["warp_rt:camera"] == "/World/Camera"
    assert (text["warp_rt:spp"], text["warp_rt:seed"], text["warp_rt:colorspace"]) == ("4", "7", "sRGB")


def test_first_row_is_the_top(film, tmp_path):
    Image(film, tonemap="raw").save(tmp_path / "a.png")
    pixels = np.asarray(PillowImage.open(tmp_path / "a.png"))
    assert list(pixels[:, 1, 1]) == [0, 26, 51]  # 0, 0.1, 0.2


@pytest.mark.parametrize(("tonemap", "present", "absent"), [("srgb", b"sRGB", b"gAMA"), ("raw", b"gAMA", b"sRGB")])
def test_png_declares_its_colour_space(film, tmp_path, tonemap, present, absent):
    Image(film, tonemap=tonemap).save(tmp_path / "a.png")
    data = (tmp_path / "a.png").read_bytes()
    header = data[: data.index(b"IDAT")]
    assert present in header
    assert b"\0\0\0" + absent not in header


def test_metadata_may_hold_any_file_name(film, tmp_path):
    names = {"source": "szene-ä-雪.usda", "camera": os.fsdecode(b"/bad\xff")}
    for extension in ("png", "jpg", "exr"):
        film.facts = names
        Image(film).save(tmp_path / f"a.{extension}")
    assert PillowImage.open(tmp_path / "a.png").text["Source"] == "szene-ä-雪.usda"


def test_jpeg_stands_over_black(film, tmp_path):
    # One colour all over, so that the coding's loss is no more than rounding.
    half = np.full((8, 8), 0.5, np.float32)
    film.aovs = {"color": half[..., None] * np.float32([0.8, 0.4, 0.2]), "alpha": half}
    film.facts = FACTS
    Image(film, tonemap="raw").save(tmp_path / "a.jpg")
    with PillowImage.open(tmp_path / "a.jpg") as picture:
        pixels = np.asarray(picture).astype(int)
        assert b"camera: /World/Camera" in picture.info["comment"]
        assert picture.getexif()[0x0131].startswith("warp_rt ")
    assert abs(pixels - [102, 51, 25.5]).max() <= 2


def test_exr_holds_exactly_what_was_computed(film, tmp_path):
    film.facts = FACTS
    Image(film, exposure=3.0).save(tmp_path / "a.exr")
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
        header = dict(file.header())  # the file empties its own when it closes
    assert set(channels) == {
        *("R", "G", "B", "A", "depth.Z", "normal.X", "normal.Y", "normal.Z", "uv.U", "uv.V", "primId.X"),
    }
    for component, name in enumerate("RGB"):
        assert channels[name].dtype == np.float32
        assert np.array_equal(channels[name], film.aovs["color"][..., component])  # exposure is for displays
    assert np.array_equal(channels["A"], film.aovs["alpha"])
    assert np.array_equal(channels["depth.Z"], film.aovs["depth"])
    assert np.array_equal(channels["normal.Y"], film.aovs["normal"][..., 1])
    assert channels["primId.X"].dtype == np.uint32
    assert np.array_equal(channels["primId.X"].view(np.int32), film.aovs["primId"])
    assert header["warp_rt:spp"] == 4
    assert header["warp_rt:camera"] == "/World/Camera"
    assert header["warp_rt:colorspace"] == "linear Rec.709"
    assert header["chromaticities"][:2] == pytest.approx((0.64, 0.33))


def test_ids_have_a_sidecar(film, tmp_path):
    files = Image(film).save(tmp_path / "a.exr")
    assert [file.name for file in files] == ["a.exr", "a.ids.json"]
    sidecar = json.loads((tmp_path / "a.ids.json").read_text())
    assert sidecar == {
        "none": -1,
        "primId": {
            "0": {"path": "/World/Teapot", "labels": {"class": ["pot", "tea"]}},
            "1": {"path": "/World/Ünï"},
        },
    }


def test_further_aovs_lie_beside_a_png_unchanged(film, tmp_path):
    files = Image(film).save(tmp_path / "a.png")
    assert {file.name for file in files} == {
        *("a.png", "a.depth.npy", "a.normal.npy", "a.uv.npy", "a.primId.npy", "a.ids.json"),
    }
    assert set(tmp_path.iterdir()) == set(files)
    for aov in ("depth", "normal", "primId"):
        stored = np.load(tmp_path / f"a.{aov}.npy")
        assert stored.dtype == film.aovs[aov].dtype
        assert np.array_equal(stored, film.aovs[aov])


def test_png_without_colour_is_refused(tmp_path):
    with pytest.raises(OptionError, match=r"holds color"):
        planned_files(tmp_path / "depth.png", ("depth",))


@pytest.mark.parametrize("name", ["a.tga", "a", "a.png.gz", ".png"])
def test_unknown_extension_is_a_usage_error(tmp_path, name):
    with pytest.raises(OptionError, match=r"extension"):
        planned_files(tmp_path / name, ("color",))


def test_extension_may_be_upper_case(film, tmp_path):
    Image(film).save(tmp_path / "A.PNG")
    assert PillowImage.open(tmp_path / "A.PNG").format == "PNG"


def test_arrays_and_notebooks(film):
    image = Image(film)
    assert image.linear is film.aovs["color"]
    assert np.array_equal(image["depth"], film.aovs["depth"])
    assert np.array_equal(np.asarray(image), image.to_srgb8())
    assert image._repr_png_().startswith(b"\x89PNG")
    assert (image.width, image.height) == (WIDTH, HEIGHT)
    with pytest.raises(OptionError, match="'distance' was not rendered"):
        image["distance"]


def test_missing_folder_is_an_output_error(film, tmp_path):
    with pytest.raises(OutputError, match="does not exist"):
        Image(film).save(tmp_path / "no" / "a.png")
    with pytest.raises(OutputError, match="is a folder"):
        check_writable(tmp_path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes have no names here")
def test_what_is_no_regular_file_is_not_replaced(film, tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    (tmp_path / "a.png").symlink_to(pipe)
    with pytest.raises(OutputError, match="is no regular file"):
        check_writable(tmp_path / "a.png")
    with pytest.raises(OutputError, match="is no regular file"):
        Image(film).save(tmp_path / "a.png")
    assert pipe.is_fifo()


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere file names are Unicode")
@pytest.mark.parametrize("name", [b"\xff.png", b"\xff.jpg", b"\xff.exr", 50 * "雪".encode() + b"long.exr", b"a\nb.exr"])
def test_files_may_be_called_anything(film, tmp_path, name):
    path = tmp_path / os.fsdecode(name)
    Image(film).save(path)
    assert path.stat().st_size > 100
    assert not list(tmp_path.glob(".*"))


# --- atomic writes


def test_failed_write_leaves_the_old_file_and_nothing_else(tmp_path):
    target = tmp_path / "a.png"
    target.write_bytes(b"old")

    def fail():
        with replacing(target) as temporary:
            temporary.write_bytes(b"half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    assert target.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.skipif(os.name == "nt", reason="Windows has no umask")
def test_new_files_have_the_usual_permissions(tmp_path):
    umask = os.umask(0o027)
    try:
        write_bytes(tmp_path / "a.bin", b"x")
    finally:
        os.umask(umask)
    assert (tmp_path / "a.bin").stat().st_mode & 0o777 == 0o640


def test_link_stays_a_link(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "link.bin").symlink_to(tmp_path / "real" / "a.bin")
    write_bytes(tmp_path / "link.bin", b"x")
    assert (tmp_path / "link.bin").is_symlink()
    assert (tmp_path / "real" / "a.bin").read_bytes() == b"x"


@pytest.mark.parametrize("extension", ["png", "jpg", "exr"])
def test_full_disk_leaves_the_old_file(film, tmp_path, extension):
    resource = pytest.importorskip("resource")  # Windows has no such limit
    rng = np.random.default_rng(1)
    film.aovs = {
        "color": rng.random((200, 200, 3), np.float32),
        "alpha": np.ones((200, 200), np.float32),
    }
    target = tmp_path / f"a.{extension}"
    target.write_bytes(b"old")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, hard))
    try:
        with pytest.raises(OutputError, match=r"cannot write: .*File too large"):
            Image(film).save(target)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert target.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.skipif(os.name == "nt", reason="Windows cannot kill so")
def test_killed_writer_leaves_the_old_file_and_the_next_one_cleans_up(tmp_path):
    target = tmp_path / "a.bin"
    target.write_bytes(b"old")
    writer = subprocess.Popen(
        [
            sys.executable,
            "-c",
            textwrap.dedent(f"""
                import time
                from pathlib import Path
                from warp_rt.image.atomic import replacing
                with replacing(Path({str(target)!r})) as temporary:
                    temporary.write_bytes(b"half")
                    print("ready", flush=True)
                    time.sleep(60)
            """),
        ],
        stdout=subprocess.PIPE,
    )
    assert writer.stdout.readline() == b"ready\n"
    write_bytes(target, b"newer")  # a living writer's file is left alone
    assert len(list(tmp_path.glob(".a.bin.*.part"))) == 1
    writer.send_signal(signal.SIGKILL)
    writer.wait()
    assert target.read_bytes() == b"newer"
    deadline = time.monotonic() + 5
    while list(tmp_path.glob(".a.bin.*.part")) and time.monotonic() < deadline:
        write_bytes(target, b"newest")
    assert list(tmp_path.iterdir()) == [target]
