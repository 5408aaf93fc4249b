# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Stages of many prims, many instances and many triangles, written as crate files."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from pxr import Sdf, Vt

from .meshes import noisy_icosphere, noisy_torus

BRANCHES = 10  # children of each Xform of the deep hierarchy
MATERIALS = 100  # of the exported stage; and assets of the assembly
PROTOTYPE_LEVELS = 3  # of the icosphere: 1280 triangles
_SIDES = "[0, 4, 6, 2, 1, 3, 7, 5, 0, 1, 5, 4, 2, 6, 7, 3, 0, 2, 3, 1, 4, 5, 7, 6]"
_CORNERS = np.array([[(k & 1), (k >> 1) & 1, k >> 2] for k in range(8)]) - 0.5
_SQUARES = ", ".join(["(0, 0)", "(1, 0)", "(1, 1)", "(0, 1)"] * 6)
_NORMALS = ", ".join(
    normal
    for normal in ("(-1, 0, 0)", "(1, 0, 0)", "(0, -1, 0)", "(0, 1, 0)", "(0, 0, -1)", "(0, 0, 1)")
    for _ in "1234"
)


def write(name: str, count: int, path: Path) -> None:
    """Write a stage.

    Args:
        name: One of ``FORMS``.
        count: Its gprims, instances or triangles.
        path: The crate file.
    """
    if name == "triangles":
        _triangle_layer(count).Export(str(path))
        return
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString("#usda 1.0\n" + "".join(FORMS[name](count)))
    if name == "instancer":
        _fill_instancer(layer, count)
    layer.Export(str(path))


def plain(count: int) -> Iterator[str]:
    """Yield boxes side by side, each a mesh with a translation: nothing but points and topology."""
    yield 'def Xform "World"\n{\n'
    for k in range(count):
        yield _mesh(k, count)
    yield "}\n"


def deep(count: int) -> Iterator[str]:
    """Yield boxes at the ends of a tree of Xforms, each of which translates and turns."""

    def level(first: int, last: int, name: str) -> Iterator[str]:
        if last - first == 1:
            yield _mesh(first, count)
            return
        yield f'def Xform "{name}" {{\ndouble3 xformOp:translate = ({first % 7}, {first % 5}, 0)\n'
        yield f"float3 xformOp:rotateXYZ = (0, {first % 11}, 0)\n"
        yield 'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]\n'
        step = -(-(last - first) // BRANCHES)
        for branch, start in enumerate(range(first, last, step)):
            yield from level(start, min(start + step, last), f"x{branch}")
        yield "}\n"

    yield from level(0, count, "World")


def colored(count: int) -> Iterator[str]:
    """Yield boxes that have a displayColor each."""
    yield 'def Xform "World"\n{\n'
    for k in range(count):
        yield _mesh(k, count, f"color3f[] primvars:displayColor = [({k % 7 / 7}, {k % 5 / 5}, {k % 3 / 3})]\n")
    yield "}\n"


def exported(count: int) -> Iterator[str]:
    """Yield boxes as exporters write them: an Xform and a mesh each, materials, st, normals, extent."""
    yield 'def Xform "World"\n{\ndef Scope "Looks"\n{\n'
    for k in range(MATERIALS):
        yield f'def Material "m{k}" {{ token outputs:surface.connect = </World/Looks/m{k}/s.outputs:surface>\n'
        yield 'def Shader "s" { uniform token info:id = "UsdPreviewSurface"\n'
        yield f"color3f inputs:diffuseColor = ({k / MATERIALS}, 0.5, 0.5)\ntoken outputs:surface\n}}\n}}\n"
    yield "}\n"
    for k in range(count):
        body = f"rel material:binding = </World/Looks/m{k % MATERIALS}>\nuniform bool doubleSided = 1\n"
        body += f'texCoord2f[] primvars:st = [{_SQUARES}] (interpolation = "faceVarying")\n'
        body += f'normal3f[] normals = [{_NORMALS}] (interpolation = "faceVarying")\n'
        body += "float3[] extent = [(-0.5, -0.5, -0.5), (0.5, 0.5, 0.5)]\n"
        mesh = _mesh(k, count, body, schemas='prepend apiSchemas = ["MaterialBindingAPI"]', is_placed=False)
        yield f'def Xform "x{k}" (kind = "component")\n{{\n{_place(k, count)}{mesh}}}\n'
    yield "}\n"


def assembly(count: int) -> Iterator[str]:
    """Yield Xforms that each reference one of the assets, an Xform with a mesh in it; none of them is instanceable."""
    for k in range(MATERIALS):
        yield f'class Xform "Asset{k}"\n{{\n' + _mesh(k, MATERIALS, is_placed=False) + "}\n"
    yield 'def Xform "World"\n{\n'
    for k in range(count):
        yield f'def Xform "x{k}" (references = </Asset{k % MATERIALS}>)\n{{\n{_place(k, count)}}}\n'
    yield "}\n"


def native(count: int) -> Iterator[str]:
    """Yield native instances of one asset of two meshes."""
    yield 'class Xform "Asset"\n{\n' + _mesh(0, 1) + _mesh(1, 2) + "}\n"
    yield 'def Xform "World"\n{\n'
    for k in range(count):
        yield f'def Xform "i{k}" (instanceable = true\nreferences = </Asset>)\n{{\n{_place(k, count)}}}\n'
    yield "}\n"


def implicit(count: int) -> Iterator[str]:
    """Yield spheres, cubes and cones of all sizes."""
    yield 'def Xform "World"\n{\n'
    for k in range(count):
        size = 0.5 + k % 100 / 200
        what = (f"double radius = {size}", f"double size = {size}", f"double height = {size}\ndouble radius = 0.5")[
            k % 3
        ]
        yield f'def {("Sphere", "Cube", "Cone")[k % 3]} "s{k}"\n{{\n{what}\n{_place(k, count)}}}\n'
    yield "}\n"


def instancer(count: int) -> Iterator[str]:
    """Yield a PointInstancer of one mesh of 1280 triangles; its arrays are filled in afterwards."""
    mesh = noisy_icosphere(PROTOTYPE_LEVELS, noise=0.0)
    points, triangles = mesh.points.tolist(), mesh.triangles.reshape(-1).tolist()
    yield 'def PointInstancer "Many"\n{\nrel prototypes = </Many/One>\n'
    yield "int[] protoIndices\npoint3f[] positions\nquath[] orientations\nfloat3[] scales\n"
    yield f'def Mesh "One"\n{{\npoint3f[] points = [{", ".join(str(tuple(p)) for p in points)}]\n'
    yield f"int[] faceVertexCounts = {[3] * len(mesh.triangles)}\nint[] faceVertexIndices = {triangles}\n"
    yield 'uniform token subdivisionScheme = "none"\n}\n}\n'


FORMS: dict[str, Callable[[int], Iterator[str]]] = {
    "plain": plain,
    "deep": deep,
    "colored": colored,
    "exported": exported,
    "assembly": assembly,
    "native": native,
    "implicit": implicit,
    "instancer": instancer,
    "triangles": lambda count: iter(()),
}


def _place(k: int, count: int) -> str:
    side = round(count ** (1 / 3)) + 1
    where = (2 * (k % side), 2 * (k // side % side), 2 * (k // side**2))
    return f'double3 xformOp:translate = {where}\nuniform token[] xformOpOrder = ["xformOp:translate"]\n'


def _mesh(k: int, count: int, body: str = "", *, schemas: str = "", is_placed: bool = True) -> str:
    """Return a box; no two of them are alike, so that none can be shared."""
    points = _CORNERS * (1 - k / (2 * count))
    place = _place(k, count) if is_placed else ""
    return (
        f'def Mesh "m{k}" ({schemas})\n{{\npoint3f[] points = [{", ".join(str(tuple(p)) for p in points.tolist())}]\n'
        f"int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]\nint[] faceVertexIndices = {_SIDES}\n"
        f'uniform token subdivisionScheme = "none"\n{place}{body}}}\n'
    )


def _fill_instancer(layer: Sdf.Layer, count: int) -> None:
    rng = np.random.default_rng(1)
    quaternions = rng.normal(size=(count, 4)).astype(np.float16)
    arrays = {
        "protoIndices": Vt.IntArray.FromNumpy(np.zeros(count, np.int32)),
        "positions": Vt.Vec3fArray.FromNumpy((rng.random((count, 3)) * 4 * count ** (1 / 3)).astype(np.float32)),
        "orientations": Vt.QuathArray.FromNumpy(quaternions),
        "scales": Vt.Vec3fArray.FromNumpy(rng.uniform(0.5, 1.0, (count, 3)).astype(np.float32)),
    }
    for name, array in arrays.items():
        layer.GetAttributeAtPath(f"/Many.{name}").default = array


def _triangle_layer(count: int) -> Sdf.Layer:
    """Return a torus of about ``count`` triangles, with normals and texture coordinates of a kind."""
    mesh = noisy_torus(count)
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.ImportFromString(
        '#usda 1.0\ndef Mesh "Torus"\n{\npoint3f[] points\nint[] faceVertexCounts\nint[] faceVertexIndices\n'
        'texCoord2f[] primvars:st (interpolation = "vertex")\nuniform token subdivisionScheme = "none"\n'
        'normal3f[] normals (interpolation = "vertex")\n}\n'
    )
    points = np.ascontiguousarray(mesh.points, np.float32)
    normals = points / np.maximum(np.linalg.norm(points, axis=1, keepdims=True), 1e-9).astype(np.float32)
    arrays = {
        "points": Vt.Vec3fArray.FromNumpy(points),
        "faceVertexCounts": Vt.IntArray.FromNumpy(np.full(len(mesh.triangles), 3, np.int32)),
        "faceVertexIndices": Vt.IntArray.FromNumpy(mesh.triangles.astype(np.int32).reshape(-1)),
        "primvars:st": Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(points[:, :2])),
        "normals": Vt.Vec3fArray.FromNumpy(normals),
    }
    for name, array in arrays.items():
        layer.GetAttributeAtPath(f"/Torus.{name}").default = array
    return layer
