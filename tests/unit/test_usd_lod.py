# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Levels of detail and the visibility of purposes: the rules of UsdLod, and what ComputeEffectiveVisibility gives."""

from __future__ import annotations

import itertools

import pytest
from pxr import UsdGeom

from warp_rt.scene import Scene
from warp_rt.usd.load import load_stage

from ..stages import stage_of

ROOT = 'prepend apiSchemas = ["LODRootAPI"]'
OVERRIDE = 'prepend apiSchemas = ["LODOverrideAPI"]'
LEVELS = """
    def Sphere "fine" {}
    def Sphere "middle" {
        token visibility = "invisible"
    }
    def Xform "coarse" {
        token visibility = "invisible"
        def Sphere "s" {}
        def Sphere "hidden" {
            token visibility = "invisible"
        }
    }
"""


def load(body: str, **options) -> Scene:
    return load_stage(stage_of(body), **options)


def drawn(scene: Scene) -> set[str]:
    return {scene.prims[row].removeprefix("/w") for row in scene.instances.prim}


def codes(scene: Scene) -> dict[str, str]:
    return {record.prim: record.code for record in scene.diagnostics if record.code != "N905"}


def lod(body: str = "", *, root: str = "", levels: str = LEVELS) -> str:
    """Return a root /w/lod below a prim /w with LODOverrideAPI."""
    return f'def Xform "w" ({OVERRIDE}) {{\n{body}\ndef Xform "lod" ({ROOT}) {{\n{root}\n{levels}\n}}\n}}\n'


@pytest.mark.parametrize(
    ("index", "items"),
    [(None, {"/lod/fine"}), (0, {"/lod/fine"}), (1, {"/lod/middle"}), (2, {"/lod/coarse/s"}), (9, {"/lod/coarse/s"})],
)
def test_the_default_level_is_drawn_whatever_its_visibility(index: int | None, items: set[str]) -> None:
    scene = load(lod(root="" if index is None else f"int lod:default:index = {index}"))
    assert (drawn(scene), codes(scene)) == (items, {})


@pytest.mark.parametrize(
    ("mode", "index", "items"),
    [
        ("indexedLOD", 1.0, {"/lod/middle"}),
        ("indexedLOD", 0.4, {"/lod/fine"}),
        ("indexedLOD", 1.5, {"/lod/coarse/s"}),
        ("indexedLOD", -3.0, {"/lod/fine"}),
        ("indexedLOD", 7.0, {"/lod/coarse/s"}),
        ("noLOD", 1.0, set()),
        ("allLOD", 1.0, {"/lod/fine", "/lod/middle", "/lod/coarse/s"}),
        ("noOverride", 1.0, {"/lod/fine"}),
        ("inherited", 1.0, {"/lod/fine"}),
    ],
)
def test_overrides(mode: str, index: float, items: set[str]) -> None:
    says = f'token lod:override:mode = "{mode}"\nfloat lod:override:index = {index}'
    assert drawn(load(lod(says))) == items


def test_the_nearest_override_holds() -> None:
    inner = f"""
        def Xform "a" ({OVERRIDE}) {{
            token lod:override:mode = "noOverride"
            def Xform "lod" ({ROOT}) {{ {LEVELS} }}
        }}
        def Xform "b" ({OVERRIDE}) {{
            def Xform "lod" ({ROOT}) {{ {LEVELS} }}
        }}
    """
    says = 'token lod:override:mode = "indexedLOD"\nfloat lod:override:index = 1\n'
    assert drawn(load(lod(says + inner))) == {"/a/lod/fine", "/b/lod/middle", "/lod/middle"}


def test_roots_within_levels() -> None:
    levels = f"""
        def Xform "near" ({ROOT}) {{
            int lod:default:index = 1
            {LEVELS}
        }}
        def Xform "far" ({ROOT}) {{ {LEVELS} }}
    """
    assert drawn(load(lod(levels=levels))) == {"/lod/near/middle"}


def test_lights_of_the_level_that_is_drawn_shine_whatever_its_visibility() -> None:
    levels = 'def Xform "fine" {\ntoken visibility = "invisible"\ndef SphereLight "lamp" {}\n}'
    assert [light.path for light in load(lod(levels=levels)).lights] == ["/w/lod/fine/lamp"]


def test_what_is_invisible_above_stays_so() -> None:
    assert drawn(load(lod('token visibility = "invisible"'))) == set()


@pytest.mark.parametrize(("domain", "told"), [("imaging", {"/w/lod": "W133"}), ("physics", {})])
def test_heuristics_for_pictures_are_told(domain: str, told: dict[str, str]) -> None:
    rule = f'def LODDistanceHeuristic "rule" {{\nuniform token lod:domain = "{domain}"\n}}\n'
    scene = load(lod(root="rel lod:heuristics = </rule>") + rule)
    assert (drawn(scene), codes(scene)) == ({"/lod/fine"}, told)


def test_instances_of_one_prototype_may_show_different_levels() -> None:
    copies = "".join(
        f"""def Xform "{name}" (instanceable = true
            inherits = </asset>
            {OVERRIDE}) {{
            token lod:override:mode = "indexedLOD"
            float lod:override:index = {index}
        }}
        """
        for name, index in (("a", 0), ("b", 1))
    )
    scene = load(f'class Xform "asset" {{\ndef Xform "lod" ({ROOT}) {{ {LEVELS} }}\n}}\n{copies}')
    found = {
        (scene.instance_paths[row], scene.prims[prim].rpartition("/")[2])
        for row, prim in zip(scene.instances.instance_id, scene.instances.prim, strict=True)
    }
    assert found == {("/a", "fine"), ("/b", "middle")}


def test_an_instance_may_be_a_root_itself() -> None:
    scene = load(
        f'class Xform "asset" ({ROOT}) {{ {LEVELS} }}\ndef "a" (instanceable = true\ninherits = </asset>) {{}}\n'
    )
    assert len(scene.instances) == 1


def test_prototypes_obey_the_overrides_above_them() -> None:
    scene = load(
        f"""
        def PointInstancer "i" ({OVERRIDE}) {{
            token lod:override:mode = "indexedLOD"
            float lod:override:index = 1
            int[] protoIndices = [0]
            point3f[] positions = [(0,0,0)]
            rel prototypes = </i/lod>
            def Xform "lod" ({ROOT}) {{ {LEVELS} }}
        }}
        """
    )
    assert drawn(scene) == {"/i/lod/middle"}


# --- the visibility of purposes

_VALUES = (None, "inherited", "invisible", "visible")


@pytest.mark.parametrize(("above", "own"), list(itertools.product(_VALUES, _VALUES)))
@pytest.mark.parametrize("purpose", ["proxy", "render", "guide"])
def test_purposes_are_seen_as_usd_computes_it(purpose: str, above: str | None, own: str | None) -> None:
    def says(value: str | None) -> str:
        return f'uniform token {purpose}Visibility = "{value}"' if value else ""

    stage = stage_of(
        f"""
        def Xform "w" (prepend apiSchemas = ["VisibilityAPI"]) {{
            {says(above)}
            def Sphere "s" (prepend apiSchemas = ["VisibilityAPI"]) {{
                uniform token purpose = "{purpose}"
                {says(own)}
            }}
            def Sphere "other" {{}}
        }}
        """
    )
    scene = load_stage(stage, purposes=(purpose,))
    computed = UsdGeom.Imageable(stage.GetPrimAtPath("/w/s")).ComputeEffectiveVisibility(purpose)
    # Guides are invisible there unless something makes them visible; here asking for them does.
    is_asked_for = purpose == "guide" and "invisible" not in (above, own)
    is_seen = computed != "invisible" or is_asked_for
    assert drawn(scene) == ({"/s", "/other"} if is_seen else {"/other"})
    assert codes(scene) == {}


def test_a_purpose_that_is_not_asked_for_is_not_drawn() -> None:
    scene = load(
        """
        def Xform "w" (prepend apiSchemas = ["VisibilityAPI"]) {
            uniform token renderVisibility = "visible"
            def Sphere "s" {
                uniform token purpose = "render"
            }
        }
        """
    )
    assert drawn(scene) == set()


def test_visibility_of_purposes_on_a_prim_that_is_no_imageable_is_without_effect() -> None:
    """The schema can be applied to Imageables alone."""
    stage = stage_of(
        """
        def "w" (prepend apiSchemas = ["VisibilityAPI"]) {
            uniform token proxyVisibility = "invisible"
            def Sphere "s" {
                uniform token purpose = "proxy"
            }
        }
        """
    )
    scene = load_stage(stage)
    assert UsdGeom.Imageable(stage.GetPrimAtPath("/w/s")).ComputeEffectiveVisibility("proxy") == "inherited"
    assert (drawn(scene), codes(scene)) == ({"/s"}, {"/w": "N924"})


def test_a_visibility_of_purposes_that_is_none_is_told() -> None:
    scene = load(
        """
        def Xform "w" (prepend apiSchemas = ["VisibilityAPI"]) {
            uniform token proxyVisibility = "maybe"
            def Sphere "s" {
                uniform token purpose = "proxy"
            }
        }
        """
    )
    assert (drawn(scene), codes(scene)) == ({"/s"}, {"/w": "W114"})
