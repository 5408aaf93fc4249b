# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The parts of the benchmarks on cases small enough to know the answer."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from warp_rt.bvh.accel import build_accel
from warp_rt.options import BUILDERS
from warp_rt.scene import Scene, is_closed

from ..benchmark_modules import load
from ..data import ROOT


@pytest.fixture
def sphere() -> Any:
    return load("meshes").noisy_icosphere(2, noise=0.0)


def test_contenders_take_turns() -> None:
    orders: list[list[str]] = [[], []]
    for order in orders:
        functions = {name: lambda n=name, order=order: order.append(n) or n for name in "abc"}
        seconds, results = load("timing").time_in_turns(functions, 6)
        assert {name: len(turns) for name, turns in seconds.items()} == {"a": 6, "b": 6, "c": 6}
        assert results == {"a": "a", "b": "b", "c": "c"}
    rounds = ["".join(orders[0][i : i + 3]) for i in range(0, 21, 3)]
    assert {*map("".join, map(sorted, rounds))} == {"abc"}  # each once a round
    assert len({*rounds}) > 2  # in no order of its own
    assert orders[0] == orders[1]  # but in the same in every run


@pytest.mark.parametrize("levels", range(3))
def test_an_icosphere_is_closed_and_has_eulers_number_of_vertices(levels: int) -> None:
    mesh = load("meshes").noisy_icosphere(levels, noise=0.0)
    assert mesh.triangles.shape == (20 * 4**levels, 3)
    assert len(mesh.points) == 2 + len(mesh.triangles) // 2
    np.testing.assert_allclose(np.linalg.norm(mesh.points, axis=1), 1, atol=1e-6)
    edges = np.sort(mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_primary_rays_come_in_tiles_and_meet_the_sphere_where_they_should(sphere: Any) -> None:
    rays = load("ray_sets").primary_rays(sphere, 16)
    assert len(rays) == 256
    directions = rays.directions.reshape(2, 2, 8, 8, 3)  # rows of tiles, tiles, rows of pixels, pixels
    picture = directions.swapaxes(1, 2).reshape(16, 16, 3)
    steps = np.diff(picture, axis=1)
    np.testing.assert_allclose(np.cross(steps[:, :-1], steps[:, 1:]), 0, atol=1e-3)
    # The middle of the picture looks at the middle of the sphere.
    middle = picture[7:9, 7:9].mean(axis=(0, 1))
    np.testing.assert_allclose(np.cross(middle, -rays.origins[0]), 0, atol=1e-2)


def test_secondary_rays_start_at_hits_and_obey_their_laws(sphere: Any) -> None:
    ray_sets = load("ray_sets")
    primary = ray_sets.primary_rays(sphere, 16)
    triangle = np.full(len(primary), -1)
    t = np.full(len(primary), np.inf)
    triangle[:20], t[:20] = np.arange(20), 2.0
    normals = ray_sets.face_normals(sphere, triangle[:20])
    incoming = primary.directions[:20].astype(float)
    normals *= -np.sign((normals * incoming).sum(axis=1, keepdims=True))
    for kind in ("mirror", "shadow", "ao", "diffuse"):
        rays = ray_sets.secondary_rays(kind, sphere, primary, t, triangle)
        assert len(rays) == 20
        np.testing.assert_allclose(np.linalg.norm(rays.directions, axis=1), 1, atol=1e-6)
        np.testing.assert_allclose(rays.origins, primary.origins[:20] + 2 * incoming, atol=1e-3)
    mirror = ray_sets.secondary_rays("mirror", sphere, primary, t, triangle).directions
    np.testing.assert_allclose((mirror * normals).sum(axis=1), -(incoming * normals).sum(axis=1), atol=1e-6)
    np.testing.assert_allclose((np.cross(mirror, incoming) * normals).sum(axis=1), 0, atol=1e-6)


def test_cosine_directions_have_the_mean_cosine_of_two_thirds() -> None:
    normals = np.tile([0.0, 0.6, 0.8], (40_000, 1))
    directions = load("ray_sets").cosine_directions(normals, np.random.default_rng(0))
    cosine = (directions * normals).sum(axis=1)
    assert cosine.min() >= 0
    assert cosine.mean() == pytest.approx(2 / 3, abs=0.01)


def test_contenders_agree_on_a_sphere(sphere: Any) -> None:
    rays_module, ray_sets = load("rays"), load("ray_sets")
    contenders = rays_module.build_contenders(sphere, ("warp_rt", "warp_rt, all cores", "embree", "wp.Mesh"))
    assert {"warp_rt", "wp.Mesh"} <= set(contenders)
    sets = rays_module.make_rays(sphere, ray_sets.KINDS, 16)
    assert set(sets) == set(ray_sets.KINDS)
    for kind, rays in sets.items():
        for query in rays_module.QUERIES:
            row = rays_module.compare(rays, query, contenders, 1)
            assert set(row["hit_differences"].values()) == {0}, (kind, query)
            assert rays_module.rate(row, "warp_rt") > 0


def test_rows_are_merged_by_key_and_know_their_commit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    results = load("results")
    monkeypatch.setattr(results, "FOLDER", tmp_path)
    results.save("table", [{"mesh": "a", "value": 1}, {"mesh": "b", "value": 2}], ("mesh",))
    results.save("table", [{"mesh": "b", "value": 3}], ("mesh",))
    document = results.read("table")
    assert [(row["mesh"], row["value"]) for row in document["rows"]] == [("a", 1), ("b", 3)]
    assert {"commit", "date"} <= set(document["rows"][0])
    assert document["machine"]["cores"] >= 1
    assert "warp-lang" in document["versions"]
    assert results.read("another") == {"rows": []}


@pytest.mark.parametrize("mesh", ["torus", "icosphere"])
def test_meshes_for_leaks_are_closed(mesh: str) -> None:
    meshes = load("meshes")
    made = meshes.noisy_torus(1_000, noise=0.05) if mesh == "torus" else meshes.noisy_icosphere(3)
    assert is_closed(made.triangles)
    assert len(made.triangles) == pytest.approx(1_000, rel=0.3)
    low, high = made.points.min(axis=0), made.points.max(axis=0)
    np.testing.assert_allclose(high - low, [2.8, 2.8, 0.8] if mesh == "torus" else [2, 2, 2], rtol=0.06)


def test_no_ray_leaks_and_the_command_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    load("leaks").main(["--rays", "60000"])
    assert capsys.readouterr().out.splitlines()[-1].startswith("60,000 rays, closest hit and any hit: 0 leaks")


def test_all_builders_are_timed() -> None:
    build = load("build")
    row = build.measure(load("meshes").noisy_torus(200), BUILDERS, 1, 1)
    assert {f"warp_rt, {bvh}" for bvh in BUILDERS} <= set(row["seconds"])
    assert set(row["trees"]) == set(BUILDERS)


def test_instances_are_rotated_not_mirrored(sphere: Any) -> None:
    scene = load("scaling").strewn(sphere, 50)
    linear = scene.instances.world_from_local[:, :3, :3]
    np.testing.assert_allclose(linear @ linear.swapaxes(1, 2), np.tile(np.eye(3), (50, 1, 1)), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(linear), 1)


def test_povrays_log_tells_its_cpu_seconds() -> None:
    log = "Trace Time:  0 hours  0 minutes  3 seconds (3.301 seconds)\n  using 1 thread(s) with 3.297 CPU-seconds total"
    assert load("povray_run").trace_cpu_seconds(log) == 3.297


def test_saved_results_can_be_drawn(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    plots = load("plots")
    plots.main(["--output", str(tmp_path)])
    for path in tmp_path.glob("*.svg"):
        text = path.read_text(encoding="utf-8")
        assert "prefers-color-scheme:dark" in text
        ElementTree.fromstring(text)
    drawn = {path.stem for path in tmp_path.glob("*.svg")}
    assert drawn == {name for name, (_, source) in plots.PLOTS.items() if load("results").read(source)["rows"]}


@pytest.mark.parametrize("bvh", BUILDERS)
@pytest.mark.parametrize("volume", ["box", "sphere"])
@pytest.mark.parametrize("is_nearer_first", [False, True])
def test_the_lectures_tree_finds_what_brute_force_finds(bvh: str, volume: str, is_nearer_first: bool) -> None:
    lecture_tree, meshes = load("lecture_tree"), load("meshes")
    mesh = meshes.noisy_torus(400)
    rays = load("ray_sets").primary_rays(mesh, 32)
    tree = lecture_tree.build_tree(mesh, bvh)
    counts = lecture_tree.trace(tree, rays, volume, is_nearer_first)
    np.testing.assert_array_equal(counts.t, lecture_tree.trace_brute_force(lecture_tree.corners_of(mesh), rays))
    assert np.isfinite(counts.t).mean() > 0.2
    # Every ray asks for the root; one that misses it asks for no more.
    assert counts.volume_tests.min() == 1
    assert (counts.triangle_tests[counts.volume_tests == 1] == 0).all()
    # A binary tree: who enters a node asks for both of its children.
    assert (counts.volume_tests % 2 == 1).all()
    assert counts.triangle_tests.max() < len(mesh.triangles) / 4


def test_spheres_of_the_lectures_tree_hold_their_triangles() -> None:
    lecture_tree = load("lecture_tree")
    mesh = load("meshes").noisy_torus(400)
    tree = lecture_tree.build_tree(mesh, "sah")
    right, triangle, center = tree.right.numpy(), tree.triangle.numpy(), tree.center.numpy()
    low, high, radius = tree.low.numpy(), tree.high.numpy(), tree.radius.numpy()

    def check(slot: int) -> list[int]:
        rows = [int(triangle[slot])] if right[slot] < 0 else [*check(slot + 1), *check(int(right[slot]))]
        corners = mesh.points[mesh.triangles[rows]].reshape(-1, 3).astype(float)
        farthest = np.linalg.norm(corners - center[slot], axis=1).max()
        assert farthest <= radius[slot] <= farthest * 1.001
        np.testing.assert_allclose([corners.min(axis=0), corners.max(axis=0)], [low[slot], high[slot]], atol=1e-6)
        return rows

    assert sorted(check(0)) == list(range(len(mesh.triangles)))


def test_why_hierarchies_has_the_saved_counts() -> None:
    rows = load("results").read("hierarchies")["rows"]
    tests = {
        (row["exact_triangles"], row["structure"]): row["volume_tests"] + row["triangle_tests"]
        for row in rows
        if row["structure"] != "warp_rt" and row["volume"] != "sphere" and row["order"] != "nearer first"
    }
    text = (ROOT / "docs" / "why_hierarchies.md").read_text(encoding="utf-8")
    table = [
        line.strip("| \n").replace(",", "").split(" | ") for line in text.splitlines() if re.match(r"\| 1[0,]+ ", line)
    ]
    assert len(table) == 6
    for _, exact, *counts in table:
        expected = [tests[int(exact), name] for name in ("sah", "midpoint", "median", "lbvh", "ploc")]
        assert tests[int(exact), "brute force"] == int(exact)
        np.testing.assert_allclose([float(count) for count in counts], expected, atol=0.051)


def test_costs_of_rays_are_those_of_the_hierarchy(sphere: Any) -> None:
    costs, ray_sets = load("costs"), load("ray_sets")
    accel = build_accel(Scene.from_arrays(sphere.points, sphere.triangles))
    rays = ray_sets.primary_rays(sphere, 16)
    closest, first = (costs.mean_costs(accel, rays, query) for query in ("closest", "any"))
    assert 1 <= first["nodes"] <= closest["nodes"] < accel.statistics.nodes
    assert 0 < first["triangles_tested"] <= closest["triangles_tested"] < len(sphere.triangles)
    away = ray_sets.Rays(rays.origins, -rays.directions)
    assert costs.mean_costs(accel, away, "closest") == {"nodes": 1.0, "triangles_tested": 0.0}


def test_perfs_counts_are_read_and_hidden_ones_are_told() -> None:
    counters = load("counters")
    text = "# started on Sun\n\n1234,,instructions:u,100,100.00,,\n<not supported>,,cycles:u,0,100.00,,\n"
    assert counters.parse(text, ["instructions:u"]) == {"instructions:u": 1234.0}
    with pytest.raises(SystemExit, match="this machine hides it"):
        counters.parse(text, ["cycles:u"])
