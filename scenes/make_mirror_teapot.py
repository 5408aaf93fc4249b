# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Write mirror_teapot.usda: the ray tracing lecture's test scene, at any tessellation.

    python scenes/make_mirror_teapot.py                              # rewrites scenes/mirror_teapot.usda
    python scenes/make_mirror_teapot.py big.usdc --segments 125      # a million triangles
    python scenes/make_mirror_teapot.py mesh.usdc --ball-segments 48 # the ball of triangles as well

Mirror and teapot have no diffuse term, so that a ray tree of depth 1 shows only their ambient shade and each further
level adds one more reflection, as in the lecture's series of pictures.
"""

from __future__ import annotations

import argparse
from itertools import pairwise
from pathlib import Path

import numpy as np
from make_teapot import tessellate
from pxr import Gf, Kind, Sdf, Usd, UsdGeom, UsdLux, UsdRender, UsdShade, Vt

DOCUMENTATION = """The ray tracing lecture's test scene: the Utah teapot and a glass ball on a checkered floor in front
of a tilted mirror. What must be seen: at depth 1 mirror and teapot in their ambient shade alone; from depth 2 on the
scene in the mirror and the floor in the teapot; then the teapot's reflection in the mirror with the mirror's
reflection in it, one level deeper at each depth. The ball shows the scene upside down. Written by
make_mirror_teapot.py."""

TILE_COUNT = 24
TILE_SIZE = 1.0

# Linear Rec. 709: the terms of a WhittedSurface, and the UsdPreviewSurface that stands in for it elsewhere.
MATERIALS = {
    "Cream": (
        {"ambient": (0.17, 0.16, 0.14), "diffuse": (0.75, 0.70, 0.60)},
        {"diffuseColor": (0.75, 0.70, 0.60), "roughness": 0.6},
    ),
    "Teal": (
        {"ambient": (0.012, 0.045, 0.055), "diffuse": (0.04, 0.20, 0.25)},
        {"diffuseColor": (0.04, 0.20, 0.25), "roughness": 0.6},
    ),
    "Wood": (
        {"ambient": (0.06, 0.03, 0.015), "diffuse": (0.28, 0.13, 0.06), "specular": (0.15, 0.15, 0.15)},
        {"diffuseColor": (0.28, 0.13, 0.06), "roughness": 0.4},
    ),
    "Mirror": (
        {"ambient": (0.03, 0.04, 0.05), "diffuse": (0.0, 0.0, 0.0), "reflection": (0.86, 0.89, 0.90)},
        {"diffuseColor": (0.86, 0.89, 0.90), "metallic": 1.0, "roughness": 0.0},
    ),
    "Lacquer": (
        {
            "ambient": (0.34, 0.018, 0.010),
            "diffuse": (0.0, 0.0, 0.0),
            "specular": (0.7, 0.7, 0.7),
            "shininess": 120.0,
            "reflection": (0.34, 0.30, 0.30),
        },
        {"diffuseColor": (0.40, 0.03, 0.02), "clearcoat": 1.0, "roughness": 0.3},
    ),
    "Glass": (
        {
            "ambient": (0.005, 0.005, 0.005),
            "diffuse": (0.0, 0.0, 0.0),
            "specular": (0.6, 0.6, 0.6),
            "shininess": 200.0,
            "reflection": (0.10, 0.10, 0.10),
            "transmission": (0.88, 0.88, 0.88),
            "ior": 1.5,
        },
        {"diffuseColor": (0.0, 0.0, 0.0), "roughness": 0.0, "opacity": 0.1, "ior": 1.5},
    ),
}


def main() -> None:
    """Write the stage that the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("output", nargs="?", type=Path, default=Path(__file__).with_name("mirror_teapot.usda"))
    parser.add_argument("--segments", type=int, default=12, help="steps along a side of each teapot patch")
    parser.add_argument("--ball-segments", type=int, default=0, help="steps from pole to pole; 0: a Sphere (default)")
    arguments = parser.parse_args()
    write_stage(arguments.output, arguments.segments, arguments.ball_segments)


def write_stage(path: Path, segments: int, ball_segments: int) -> None:
    """Write the whole stage to ``path`` (.usda or .usdc), over whatever is there."""
    path.unlink(missing_ok=True)
    stage = Usd.Stage.CreateNew(str(path))
    stage.GetRootLayer().documentation = DOCUMENTATION
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 0.05)
    world = UsdGeom.Xform.Define(stage, "/World")
    stage.SetDefaultPrim(world.GetPrim())
    Usd.ModelAPI(world).SetKind(Kind.Tokens.component)
    for name, (whitted, preview) in MATERIALS.items():
        define_material(stage, name, whitted, preview)
    define_floor(stage)
    define_mirror(stage)
    define_teapot(stage, segments)
    define_ball(stage, ball_segments)
    define_lights(stage)
    define_camera(stage)
    stage.GetRootLayer().Save()


def define_material(stage: Usd.Stage, name: str, whitted: dict, preview: dict) -> None:
    """Define a material with a WhittedSurface for warp_rt and a UsdPreviewSurface for every other renderer."""
    material = UsdShade.Material.Define(stage, f"/World/Materials/{name}")
    for kind, context, inputs in (("WhittedSurface", "warp_rt", whitted), ("UsdPreviewSurface", "", preview)):
        shader = UsdShade.Shader.Define(stage, material.GetPath().AppendChild(kind.replace("Usd", "")))
        shader.CreateIdAttr(kind)
        for key, value in inputs.items():
            if isinstance(value, tuple):
                shader.CreateInput(key, Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*value))
            else:
                shader.CreateInput(key, Sdf.ValueTypeNames.Float).Set(value)
        output = material.CreateSurfaceOutput(context) if context else material.CreateSurfaceOutput()
        output.ConnectToSource(shader.CreateOutput("surface", Sdf.ValueTypeNames.Token))


def define_mesh(stage: Usd.Stage, path: str, points, polygons, material: str, normals=None) -> UsdGeom.Mesh:
    """Define a polygon mesh of one material; ``normals``, one a point, make it smooth."""
    mesh = UsdGeom.Mesh.Define(stage, path)
    points = np.asarray(points, np.float32)
    mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points))
    mesh.CreateFaceVertexCountsAttr([len(polygon) for polygon in polygons])
    mesh.CreateFaceVertexIndicesAttr([index for polygon in polygons for index in polygon])
    mesh.CreateExtentAttr(Vt.Vec3fArray.FromNumpy(np.array([points.min(axis=0), points.max(axis=0)])))
    if normals is not None:
        mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(np.asarray(normals, np.float32)))
        mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    bind(stage, mesh.GetPrim(), material)
    return mesh


def bind(stage: Usd.Stage, prim: Usd.Prim, material: str) -> None:
    """Bind one of ``MATERIALS`` to a prim."""
    UsdShade.MaterialBindingAPI.Apply(prim).Bind(UsdShade.Material.Get(stage, f"/World/Materials/{material}"))


def define_floor(stage: Usd.Stage) -> None:
    """Define the floor in the plane z = 0: square tiles, the dark ones a GeomSubset."""
    side = TILE_COUNT + 1
    line = (np.arange(side) - TILE_COUNT / 2) * TILE_SIZE
    x, y = np.meshgrid(line, line)
    points = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3)
    corner = (np.arange(TILE_COUNT)[:, None] * side + np.arange(TILE_COUNT)).reshape(-1)
    polygons = np.stack([corner, corner + 1, corner + 1 + side, corner + side], axis=-1).tolist()
    mesh = define_mesh(stage, "/World/Floor", points, polygons, "Cream")
    row, column = np.divmod(np.arange(TILE_COUNT**2), TILE_COUNT)
    dark = np.flatnonzero((row + column) % 2).astype(np.int32)
    subset = UsdShade.MaterialBindingAPI(mesh).CreateMaterialBindSubset("DarkTiles", Vt.IntArray.FromNumpy(dark))
    bind(stage, subset.GetPrim(), "Teal")


def define_mirror(stage: Usd.Stage) -> None:
    """Define the mirror, a sheet that leans back, and the wooden frame around it."""
    mirror = UsdGeom.Xform.Define(stage, "/World/Mirror")
    mirror.AddTranslateOp().Set(Gf.Vec3d(0.6, 3.9, 0.0))
    mirror.AddRotateXYZOp().Set(Gf.Vec3f(4.0, 0.0, -14.0))
    width, height, rim, thickness = 9.2, 4.4, 0.22, 0.3
    glass = [(-width / 2, 0, rim), (width / 2, 0, rim), (width / 2, 0, rim + height), (-width / 2, 0, rim + height)]
    define_mesh(stage, "/World/Mirror/Glass", glass, [[0, 1, 2, 3]], "Mirror")
    half = width / 2 + rim
    bars = {
        "Bottom": ((-half, half), (0, rim)),
        "Top": ((-half, half), (rim + height, 2 * rim + height)),
        "Left": ((-half, -width / 2), (rim, rim + height)),
        "Right": ((width / 2, half), (rim, rim + height)),
        "Back": ((-half, half), (0, 2 * rim + height)),
    }
    for name, ((x0, x1), (z0, z1)) in bars.items():
        y0, y1 = (0.05, thickness) if name == "Back" else (-0.12, 0.05)
        points = [(x, y, z) for z in (z0, z1) for y in (y0, y1) for x in (x0, x1)]
        faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
        define_mesh(stage, f"/World/Mirror/Frame{name}", points, faces, "Wood")


def define_teapot(stage: Usd.Stage, segments: int) -> None:
    """Define the teapot with the analytic normals of its patches."""
    points, polygons, normals = tessellate(segments)
    mesh = define_mesh(stage, "/World/Teapot", points, polygons, "Lacquer", normals)
    mesh.AddTranslateOp().Set(Gf.Vec3d(-1.5, -0.6, 0.0))
    mesh.AddRotateZOp().Set(-28.0)
    mesh.AddScaleOp().Set(Gf.Vec3f(0.95))


def define_ball(stage: Usd.Stage, segments: int) -> None:
    """Define the glass ball, resting on the floor: a Sphere, or a mesh of so many steps from pole to pole."""
    if segments:
        points, polygons = tessellate_ball(segments)
        ball = define_mesh(stage, "/World/Ball", points, polygons, "Glass", normals=points)
    else:
        ball = UsdGeom.Sphere.Define(stage, "/World/Ball")
        ball.CreateRadiusAttr(1.0)
        ball.CreateExtentAttr([(-1, -1, -1), (1, 1, 1)])
        bind(stage, ball.GetPrim(), "Glass")
    ball.AddTranslateOp().Set(Gf.Vec3d(2.6, -2.2, 1.0))


def tessellate_ball(segments: int) -> tuple[np.ndarray, list[list[int]]]:
    """Return the vertices of a unit ball and its quads, triangles at the poles: 2 ``segments`` of them around."""
    around = 2 * segments
    polar, azimuth = np.meshgrid(
        np.arange(1, segments) * (np.pi / segments), np.arange(around) * (np.pi / segments), indexing="ij"
    )
    rings = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], axis=-1)
    points = np.concatenate([[[0, 0, 1]], rings.reshape(-1, 3), [[0, 0, -1]]])
    ends = [(k, (k + 1) % around) for k in range(around)]
    starts = range(1, len(points) - 1, around)
    polygons = [[0, starts[0] + k, starts[0] + n] for k, n in ends]
    for upper, lower in pairwise(starts):
        polygons += [[upper + k, lower + k, lower + n, upper + n] for k, n in ends]
    polygons += [[starts[-1] + k, len(points) - 1, starts[-1] + n] for k, n in ends]
    return points, polygons


def define_lights(stage: Usd.Stage) -> None:
    """Define the lecture's point light, which does not weaken with distance, and a weaker one from infinitely far."""
    lamp = UsdLux.SphereLight.Define(stage, "/World/Lights/Lamp")
    lamp.CreateTreatAsPointAttr(True)
    lamp.CreateIntensityAttr(0.72)
    lamp.CreateColorAttr(Gf.Vec3f(1.0, 0.93, 0.82))
    lamp.GetPrim().CreateAttribute("warp_rt:falloff", Sdf.ValueTypeNames.Token).Set("none")
    lamp.AddTranslateOp().Set(Gf.Vec3d(-4.5, -5.5, 8.5))
    sky = UsdLux.DistantLight.Define(stage, "/World/Lights/Sky")
    sky.CreateAngleAttr(0.0)
    sky.CreateIntensityAttr(0.9)
    sky.CreateColorAttr(Gf.Vec3f(0.75, 0.88, 1.0))
    sky.AddRotateXYZOp().Set(Gf.Vec3f(50.0, 0.0, 48.0))


def define_camera(stage: Usd.Stage) -> None:
    """Define the camera and the render settings that use it."""
    eye, target = Gf.Vec3d(-0.6, -11.5, 5.4), Gf.Vec3d(0.35, 0.6, 1.75)
    camera = UsdGeom.Camera.Define(stage, "/World/Camera")
    camera.AddTransformOp().Set(Gf.Matrix4d().SetLookAt(eye, target, Gf.Vec3d.ZAxis()).GetInverse())
    camera.CreateFocalLengthAttr(35.0)
    camera.CreateHorizontalApertureAttr(30.0)
    camera.CreateVerticalApertureAttr(22.5)
    camera.CreateClippingRangeAttr(Gf.Vec2f(0.1, 1000.0))
    settings = UsdRender.Settings.Define(stage, "/Render/Settings")
    settings.CreateResolutionAttr(Gf.Vec2i(1024, 768))
    settings.CreateCameraRel().SetTargets([camera.GetPath()])
    prim = settings.GetPrim()
    for name, value in (("ambient", (1.0, 1.0, 1.0)), ("background", (0.16, 0.29, 0.48))):
        prim.CreateAttribute(f"warp_rt:{name}", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*value))
    prim.CreateAttribute("warp_rt:depth", Sdf.ValueTypeNames.Int).Set(7)
    stage.SetMetadata("renderSettingsPrimPath", "/Render/Settings")


if __name__ == "__main__":
    main()
