# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Linking collections of lights: which placed meshes they hold, by the paths that USD gives those."""

import pytest
from pxr import Usd

from warp_rt.usd.load import load_stage

SHAPES = """
def Xform "World"
{
    def Xform "a"
    {
        def Cube "cube" {}
        def Sphere "ball" {}
    }
    def Cube "b" {}
}
"""
INSTANCES = """
class Xform "Proto"
{
    def Cube "cube" {}
    def Sphere "ball" {}
}
def Xform "World"
{
    def Xform "one" (
        inherits = </Proto>
        instanceable = true
    ) {}
    def Xform "two" (
        inherits = </Proto>
        instanceable = true
    ) {}
}
"""
POINTS = """
def PointInstancer "Inside"
{
    point3f[] positions = [(0, 0, 0), (3, 0, 0)]
    int[] protoIndices = [0, 1]
    rel prototypes = [</Inside/cube>, </Inside/ball>]
    def Cube "cube" {}
    def Sphere "ball" {}
}
class Xform "Elsewhere"
{
    def Cone "cone" {}
}
def PointInstancer "Outside"
{
    point3f[] positions = [(0, 9, 0)]
    int[] protoIndices = [0]
    rel prototypes = [</Elsewhere>]
}
"""


def _linked(body, collection, name="lightLink"):
    """Return the paths, of the prim and its instance, that a light holds; None: all. And the diagnostics' codes."""
    collection = collection.replace("LINK", f"collection:{name}")
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(f'#usda 1.0\n{body}\ndef SphereLight "Light"\n{{\n{collection}\n}}\n')
    scene = load_stage(stage)
    light = scene.lights[0]
    held = light.receivers if name == "lightLink" else light.shadow.casters
    codes = [d.code for d in scene.diagnostics if d.code.startswith("W")]
    if held is None:
        return None, codes
    found = set()
    for is_held, prim, instance in zip(held, scene.instances.prim, scene.instances.instance_id, strict=True):
        if is_held:
            name = scene.prims[prim]
            found.add(name if instance < 0 else f"{scene.instance_paths[instance]}:{name.rsplit('/')[-1]}")
    return found, codes


ONLY = "uniform bool LINK:includeRoot = 0\n"


@pytest.mark.parametrize("name", ["lightLink", "shadowLink"])
@pytest.mark.parametrize(
    ("collection", "expected"),
    [
        ("", None),
        ("rel LINK:excludes = </World/b>", {"/World/a/cube", "/World/a/ball"}),
        ("rel LINK:excludes = </World/a>", {"/World/b"}),
        ("rel LINK:excludes = </World/nothing>", None),
        (ONLY, set()),
        (ONLY + "rel LINK:includes = </World/a>", {"/World/a/cube", "/World/a/ball"}),
        (ONLY + "rel LINK:includes = </World/a>\nrel LINK:excludes = </World/a/ball>", {"/World/a/cube"}),
        (ONLY + 'rel LINK:includes = </World/a>\nuniform token LINK:expansionRule = "explicitOnly"', set()),
        ('uniform token LINK:expansionRule = "explicitOnly"', set()),  # the root alone
        (ONLY + 'pathExpression LINK:membershipExpression = "//{isa:Cube}"', {"/World/a/cube", "/World/b"}),
        (ONLY + 'pathExpression LINK:membershipExpression = "/World/a//"', {"/World/a/cube", "/World/a/ball"}),
        (
            'uniform token LINK:mode = "expression"\npathExpression LINK:membershipExpression = "/World/b"',
            {"/World/b"},
        ),
        # The schema: with includeRoot, a collection of mode "automatic" is one of relationships.
        ('pathExpression LINK:membershipExpression = "/World/b"', None),
    ],
)
def test_collections_hold_what_usd_says(name, collection, expected):
    assert _linked(SHAPES, collection, name) == (expected, [])


@pytest.mark.parametrize(
    ("collection", "expected"),
    [
        ("rel LINK:excludes = </World/one>", {"/World/two:cube", "/World/two:ball"}),
        ("rel LINK:excludes = </World/two>", {"/World/one:cube", "/World/one:ball"}),
        ("rel LINK:excludes = </World/two/ball>", {"/World/one:cube", "/World/one:ball", "/World/two:cube"}),
        (ONLY + "rel LINK:includes = </World/two/ball>", {"/World/two:ball"}),
        (ONLY + 'pathExpression LINK:membershipExpression = "//two//{isa:Sphere}"', {"/World/two:ball"}),
    ],
)
def test_native_instances_have_paths_of_their_own(collection, expected):
    assert _linked(INSTANCES, collection) == (expected, [])


ALL_COPIES = {"/Inside[0]:cube", "/Inside[1]:ball", "/Outside[0]:cone"}


@pytest.mark.parametrize(
    ("collection", "expected"),
    [
        ("rel LINK:excludes = </Inside>", {"/Outside[0]:cone"}),
        ("rel LINK:excludes = </Inside/ball>", ALL_COPIES - {"/Inside[1]:ball"}),
        ("rel LINK:excludes = </Outside>", ALL_COPIES - {"/Outside[0]:cone"}),
        ("rel LINK:excludes = </Elsewhere>", ALL_COPIES - {"/Outside[0]:cone"}),
        (ONLY + "rel LINK:includes = </Inside>", {"/Inside[0]:cube", "/Inside[1]:ball"}),
        (ONLY + "rel LINK:includes = </Inside/cube>", {"/Inside[0]:cube"}),
        (ONLY + "rel LINK:includes = </Outside>", {"/Outside[0]:cone"}),
        (ONLY + "rel LINK:includes = </Elsewhere/cone>", {"/Outside[0]:cone"}),
        (ONLY + 'pathExpression LINK:membershipExpression = "/Outside//"', {"/Outside[0]:cone"}),
        (ONLY + 'pathExpression LINK:membershipExpression = "//{isa:Cone}"', {"/Outside[0]:cone"}),
    ],
)
def test_copies_count_by_their_prototype_and_their_instancer(collection, expected):
    assert _linked(POINTS, collection) == (expected, [])


def test_copies_within_native_instances():
    """The same instancer in two instances: each is excluded by its own path."""
    body = INSTANCES.replace(
        'def Cube "cube" {}',
        """def PointInstancer "points"
    {
        point3f[] positions = [(0, 0, 0)]
        int[] protoIndices = [0]
        rel prototypes = </Proto/points/cone>
        def Cone "cone" {}
    }""",
    )
    both = {"/World/one:ball", "/World/two:ball", "/World/one/points[0]:cone", "/World/two/points[0]:cone"}
    for path, gone in (
        ("/World/one", {"/World/one:ball", "/World/one/points[0]:cone"}),
        ("/World/two/points/cone", {"/World/two/points[0]:cone"}),
    ):
        assert _linked(body, f"rel LINK:excludes = <{path}>") == (both - gone, [])


NESTED = """
class Xform "Asset"
{
    def Cube "cube" {}
    def PointInstancer "points"
    {
        point3f[] positions = [(0, 0, 0)]
        int[] protoIndices = [0]
        rel prototypes = </Asset/points/ball>
        def Sphere "ball" {}
    }
}
def PointInstancer "Set"
{
    point3f[] positions = [(0, 0, 0), (9, 0, 0), (0, 9, 0)]
    int[] protoIndices = [0, 1, 2]
    rel prototypes = [</Set/near>, </Set/far>, </Shelf>]
    def Xform "near" (
        inherits = </Asset>
        instanceable = true
    ) {}
    def Xform "far"
    {
        def Xform "within" (
            inherits = </Asset>
            instanceable = true
        ) {}
    }
}
class Xform "Shelf" (
    inherits = </Asset>
    instanceable = true
) {}
"""


@pytest.mark.parametrize(
    ("path", "gone"),
    [
        ("/Set/near", {"/Set[0]:cube", "/Set[0]/points[0]:ball"}),
        ("/Set/near/cube", {"/Set[0]:cube"}),
        ("/Set/near/points/ball", {"/Set[0]/points[0]:ball"}),
        ("/Set/far", {"/Set[1]/within:cube", "/Set[1]/within/points[0]:ball"}),
        ("/Set/far/within/points", {"/Set[1]/within/points[0]:ball"}),
        ("/Shelf/points", {"/Set[2]/points[0]:ball"}),
    ],
)
def test_instances_within_copies_count_by_the_prototypes_that_they_stand_in(path, gone):
    copies = ("/Set[0]", "/Set[1]/within", "/Set[2]")
    every = {f"{copy}{tail}" for copy in copies for tail in (":cube", "/points[0]:ball")}
    assert _linked(NESTED, f"rel LINK:excludes = <{path}>") == (every - gone, [])
    assert _linked(NESTED, f"{ONLY}rel LINK:includes = <{path}>") == (gone, [])


def test_a_light_in_an_instance_is_linked_to_that_instance():
    body = INSTANCES.replace(
        'def Sphere "ball" {}',
        """def SphereLight "lamp"
    {
        uniform bool collection:lightLink:includeRoot = 0
        rel collection:lightLink:includes = </Proto/cube>
    }""",
    )
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString("#usda 1.0\n" + body)
    scene = load_stage(stage)
    assert [light.path for light in scene.lights] == ["/World/one/lamp", "/World/two/lamp"]
    assert [light.receivers.tolist() for light in scene.lights] == [[True, False], [False, True]]


def test_domes_are_linked_too():
    stage = Usd.Stage.CreateInMemory()
    dome = 'def DomeLight "Light"\n{\nrel collection:lightLink:excludes = </World/b>\n}'
    stage.GetRootLayer().ImportFromString(f"#usda 1.0\n{SHAPES}\n{dome}")
    scene = load_stage(stage)
    assert scene.domes[0].receivers.sum() == 2


def test_a_face_subset_cannot_be_linked_alone():
    body = """def Mesh "mesh"
{
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    def GeomSubset "part"
    {
        int[] indices = [0]
    }
}"""
    held, codes = _linked(body, ONLY + "rel LINK:includes = </mesh/part>")
    assert held == set()
    assert "W404" in codes


def test_collections_in_a_circle_are_named():
    circle = "rel LINK:includes = </Light.LINK>".replace("LINK", "collection:lightLink")
    assert _linked(SHAPES, circle)[1] == ["W404"]


@pytest.mark.parametrize(
    ("collection", "code"),
    [
        ("rel LINK:excludes = </World/nothing>", "N946"),
        ("rel LINK:includes = </World/a.collection:nothing>", "N946"),
        ('uniform token LINK:mode = "excluding"', "W404"),
        ('uniform token LINK:expansionRule = "expand"', "W404"),
        ('string LINK:membershipExpression = "/World/a"', "W404"),
        ("double LINK:includeRoot = 0", "W404"),
    ],
)
def test_what_a_collection_says_in_vain_is_told_and_holds_nothing_back(collection, code):
    collection = collection.replace("LINK", "collection:lightLink")
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(f'#usda 1.0\n{SHAPES}\ndef SphereLight "Light"\n{{\n{collection}\n}}\n')
    scene = load_stage(stage)
    assert scene.lights[0].receivers is None
    assert [record.code for record in scene.diagnostics if record.prim == "/Light"] == [code]
