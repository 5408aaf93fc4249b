# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Files in the Neutral File Format, good and bad: what is read, and the one line about what cannot be."""

from __future__ import annotations

import gzip
from pathlib import Path

import pytest

from warp_rt.errors import SceneError
from warp_rt.nff.statements import Fill, LightStatement, View, is_nff, read_nff

VIEW = "v\nfrom 0 -5 1\nat 0 0 1\nup 0 0 1\nangle 45\nhither 1\nresolution 4 3\n"
FILL = "f 1 0.5 0.25 0.8 0.1 20 0 0\n"


def write(folder: Path, text: str) -> Path:
    path = folder / "scene.nff"
    path.write_text(text)
    return path


def test_every_statement(tmp_path: Path) -> None:
    text = f"""# a comment
b 0.1 0.2 0.3   # and another
{VIEW}l 1 2 3
l 4 5 6 0.7 0.8 0.9
{FILL}s 1 2 3 4
c 0 0 0 1
  0 0 2 0.5
p 3
0 0 0  1 0 0  0 1 0
f 0 0 1 0 0.5 5 0.9 1.5
pp 3 0 0 0 0 0 1
1 0 0 0 0 1
0 1 0 0 0 1
s 0 0 0 -2 {FILL}s 7 7 7 1"""
    file = read_nff(write(tmp_path, text))
    assert file.background == (0.1, 0.2, 0.3)
    assert file.view == View((0, -5, 1), (0, 0, 1), (0, 0, 1), 45, (4, 3))
    assert file.lights == [LightStatement((1, 2, 3), None), LightStatement((4, 5, 6), (0.7, 0.8, 0.9))]
    first, second = Fill((1, 0.5, 0.25), 0.8, 0.1, 20, 0, 0), Fill((0, 0, 1), 0, 0.5, 5, 0.9, 1.5)
    assert list(file.primitives) == [first, second]
    assert file.primitives[first].spheres == [(1, 2, 3, 4), (7, 7, 7, 1)]  # the fill came twice
    assert file.primitives[first].cones == [(0, 0, 0, 1, 0, 0, 2, 0.5)]
    assert file.primitives[first].polygons == [[(0, 0, 0), (1, 0, 0), (0, 1, 0)]]
    assert file.primitives[second].patches == [[(0, 0, 0, 0, 0, 1), (1, 0, 0, 0, 0, 1), (0, 1, 0, 0, 0, 1)]]
    assert file.primitives[second].spheres == [(0, 0, 0, -2)]


BAD = [
    ("s 0 0 0 1", "1: geometry before the first f, which colours it"),
    (f"{FILL}q 1 2 3", "2: 'q' is no statement; there are v, b, l, f, s, c, p, pp"),
    ("b 0 0", "1: b: the file ends where a number is expected"),
    ("b 0 0\n\nblue", "3: b: a number expected, got 'blue'"),
    ("b 0 0 nan", "1: b: a number expected, got 'nan'"),
    ("b 0 0 1e300", "1: b: 1e300 is not within 1e+12"),
    ("b 0 0 0\nb 1 1 1", "2: b: a second background"),
    (f"{VIEW}{VIEW}", "8: v: a second viewpoint"),
    ("v\nfrom 0 0 0\nangle 45", "1: v: at, up, resolution missing"),
    ("v\nangle 45\nangle 45", "3: v: a second 'angle'"),
    (VIEW.replace("45", "180"), "1: v: angle 180 is outside 0..180"),
    (VIEW.replace("4 3", "4 0"), "1: v: resolution 4 0: whole numbers from 1 to 65536 expected"),
    (VIEW.replace("up 0 0 1", "up 0 2 0"), "1: v: from, at and up do not span a picture"),
    ("f 1 1 1 1 0 1 0 -1", "1: f: a number is negative"),
    ("f 1 1 1 0 0 1 0.5 0", "1: f: what transmits light needs an index of refraction above 0"),
    (f"{FILL}c 0 0 0 1\n0 0 1 -1", "3: c: one radius is negative, the other is not"),
    (f"{FILL}p 2.5", "2: p: a number of corners expected, got 2.5"),
    (f"{FILL}p 1000000000\n0 0 0", "3: p: the file ends where a number is expected"),
]


@pytest.mark.parametrize(("text", "message"), BAD)
def test_bad_files_are_told_by_line(tmp_path: Path, text: str, message: str) -> None:
    path = write(tmp_path, text)
    with pytest.raises(SceneError) as caught:
        read_nff(path)
    assert str(caught.value) == f"{path}:{message}"


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"none\.nff: cannot be read: No such file"):
        read_nff(tmp_path / "none.nff")
    packed = tmp_path / "scene.nff.gz"
    packed.write_bytes(b"no gzip")
    with pytest.raises(SceneError, match=r"scene\.nff\.gz: cannot be read: Not a gzipped file"):
        read_nff(packed)
    packed.write_bytes(gzip.compress(FILL.encode() * 100)[:40])
    with pytest.raises(SceneError, match=r"scene\.nff\.gz: cannot be read"):
        read_nff(packed)


def test_gzip(tmp_path: Path) -> None:
    packed = tmp_path / "scene.nff.gz"
    packed.write_bytes(gzip.compress(f"{FILL}s 0 0 0 1".encode()))
    assert len(read_nff(packed).primitives) == 1


@pytest.mark.parametrize(
    ("name", "expected"), [("a.nff", True), ("A.NFF.GZ", True), ("nff.usda", False), ("nff", False)]
)
def test_names(name: str, expected: bool) -> None:
    assert is_nff(name) is expected
    assert is_nff(Path(name)) is expected
