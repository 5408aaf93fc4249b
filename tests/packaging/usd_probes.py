# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Small stages on which each property of each USD schema shows, and the values that show it.

A type has a stage on which its prim does something. A property is tried there with another value than it has: one
that is made from its type, unless ``PROBES`` names a better one, which is where a property acts only together with
others, or holds an array.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from pxr import Gf

DIR = "DIR"  # stands for the folder of the assets

GRID = """
    point3f[] points = [(0,0,0), (1,0,0), (2,0,0), (0,1,0), (1,1,1), (2,1,0), (0,2,0), (1,2,0), (2,2,0.5)]
    int[] faceVertexCounts = [4, 4, 4, 4]
    int[] faceVertexIndices = [0,1,4,3, 1,2,5,4, 3,4,7,6, 4,5,8,7]
"""
ST = 'texCoord2f[] primvars:st = [(0,0), (1,0), (1,1), (0,1)] (interpolation = "vertex")'
SEAMED_ST = """texCoord2f[] primvars:st = [(0,0),(1,0),(1,1),(0,1), (0,0),(1,0),(1,1),(0,1), (0,0),(1,0),(1,1),(0,1),
        (0,0),(1,0),(1,1),(0,1)] (interpolation = "faceVarying")"""
QUAD = """
    point3f[] points = [(0,0,0), (1,0,0), (1,1,0), (0,1,0)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    uniform token subdivisionScheme = "none"
"""
CURVE = """
    point3f[] points = [(0,0,0), (1,1,0), (2,0,0), (3,1,0), (4,0,0), (5,1,0), (6,0,0)]
    int[] curveVertexCounts = [7]
    float[] widths = [0.5] (interpolation = "constant")
"""
PATCH = """
    int uVertexCount = 3
    int vVertexCount = 3
    int uOrder = 3
    int vOrder = 3
    double[] uKnots = [0, 0, 0, 1, 1, 1]
    double[] vKnots = [0, 0, 0, 1, 1, 1]
    double2 uRange = (0, 1)
    double2 vRange = (0, 1)
    point3f[] points = [(0,0,0), (1,0,0), (2,0,0), (0,1,0), (1,1,1), (2,1,0), (0,2,0), (1,2,0), (2,2,0)]
"""
TRIM = {
    "trimCurve:counts": [1],
    "trimCurve:orders": [3],
    "trimCurve:vertexCounts": [9],
    "trimCurve:knots": [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4],
    "trimCurve:ranges": [(0, 4)],
    "trimCurve:points": [
        *((0.8, 0.5, 1), (0.8, 0.8, 1), (0.5, 0.8, 1), (0.2, 0.8, 1), (0.2, 0.5, 1)),
        *((0.2, 0.2, 1), (0.5, 0.2, 1), (0.8, 0.2, 1), (0.8, 0.5, 1)),
    ],
}
FLOOR = """
def Mesh "floor" {
    point3f[] points = [(-9,0,-9), (-9,0,9), (9,0,9), (9,0,-9)]
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    uniform token subdivisionScheme = "none"
}
"""
SHINING = f"""
{FLOOR}
def Xform "world" {{
    def Sphere "other" {{}}
}}
"""
SKINNED = f"""
def SkelRoot "root" {{
    def Skeleton "skeleton" (prepend apiSchemas = ["SkelBindingAPI"]) {{
        uniform token[] joints = ["a", "a/b"]
        uniform matrix4d[] bindTransforms = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1)),
            ((1,0,0,0),(0,1,0,0),(0,0,1,0),(1,0,0,1))]
        uniform matrix4d[] restTransforms = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1)),
            ((1,0,0,0),(0,1,0,0),(0,0,1,0),(1,0,0,1))]
        rel skel:animationSource = </root/animation>
    }}
    def Skeleton "skeleton2" (prepend apiSchemas = ["SkelBindingAPI"]) {{
        uniform token[] joints = ["a", "a/b"]
        uniform matrix4d[] bindTransforms = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1)),
            ((1,0,0,0),(0,1,0,0),(0,0,1,0),(1,0,0,1))]
        uniform matrix4d[] restTransforms = [((1,0,0,0),(0,1,0,0),(0,0,1,0),(0,0,0,1)),
            ((1,0,0,0),(0,1,0,0),(0,0,1,0),(2,0,3,1))]
    }}
    def SkelAnimation "animation" {{
        uniform token[] joints = ["a", "a/b"]
        float3[] translations = [(0,0,0), (1,0.5,0)]
        quatf[] rotations = [(1,0,0,0), (0.8,0,0.6,0)]
        half3[] scales = [(1,1,1), (1,1,1)]
        uniform token[] blendShapes = ["up", "more"]
        float[] blendShapeWeights = [0.5, 0.25]
    }}
    def SkelAnimation "animation3" {{
        uniform token[] joints = ["a"]
        float3[] translations = [(0,0,1)]
        quatf[] rotations = [(1,0,0,0)]
        half3[] scales = [(1,1,1)]
    }}
    def SkelAnimation "animation2" {{
        uniform token[] joints = ["a", "a/b"]
        float3[] translations = [(0,0,0), (5,0.5,0)]
        quatf[] rotations = [(1,0,0,0), (0.8,0,0.6,0)]
        half3[] scales = [(1,1,1), (1,1,1)]
    }}
    def Mesh "mesh" (prepend apiSchemas = ["SkelBindingAPI"]) {{
        {QUAD}
        normal3f[] normals = [(0,0,1), (0,0,1), (0,0,1), (0,0,1)] (interpolation = "vertex")
        rel skel:skeleton = </root/skeleton>
        int[] primvars:skel:jointIndices = [0,1, 0,1, 0,1, 0,1] (elementSize = 2
            interpolation = "vertex")
        float[] primvars:skel:jointWeights = [1,0, 0.5,0.5, 0.25,0.75, 1,0] (elementSize = 2
            interpolation = "vertex")
        uniform token[] skel:blendShapes = ["up", "more"]
        rel skel:blendShapeTargets = [</root/mesh/up>, </root/mesh/more>]
        def BlendShape "up" {{
            uniform vector3f[] offsets = [(0,0,1), (0,0,2)]
            uniform vector3f[] normalOffsets = [(1,0,0), (0,0,0)]
            uniform int[] pointIndices = [0, 1]
        }}
        def BlendShape "more" {{
            uniform vector3f[] offsets = [(0,1,1), (0,0,0)]
            uniform int[] pointIndices = [0, 1]
        }}
    }}
}}
"""
SETTINGS = f"""
def Camera "camera" {{}}
def Camera "camera2" {{ float focalLength = 20 }}
def Sphere "other" {{}}
def RenderSettings "settings" {{
    rel products = </settings/product>
    rel camera = </camera>
    def RenderProduct "product" {{
        ORDERED
    }}
    def RenderProduct "product2" {{ uniform int2 resolution = (33, 44) }}
    def RenderVar "var" {{ uniform string sourceName = "Ci" }}
    def RenderVar "var2" {{ uniform string sourceName = "depth" }}
}}
def RenderSettings "settings2" {{ uniform int2 resolution = (77, 88) }}
def RenderPass "pass" {{
    rel renderSource = </settings3>
}}
def RenderSettings "settings3" {{ uniform int2 resolution = (7, 8) }}
{FLOOR}
"""
ORDERED = SETTINGS.replace("ORDERED", "rel orderedVars = </settings/var>")
SETTINGS = SETTINGS.replace("ORDERED", "")
LEVELS = """
def Xform "lod" (prepend apiSchemas = ["LODRootAPI"]) {
    rel lod:heuristics = </lod/rule>
    def Sphere "near" {}
    def Cube "far" {}
    def HEURISTIC "rule" {
        uniform token lod:domain = "imaging"
        float[] thresholds = [10]
    }
}
"""
VOLUME = """
def Volume "volume" {
    rel field:density = </volume/p>
    def FIELD "p" { asset filePath = @smoke.vdb@
        token fieldName = "density"
    }
}
def Sphere "other" {}
"""


def material(node: str, port: str, node_type: str, inputs: str = "", others: str = "") -> str:
    """Return a quad of a UsdPreviewSurface, one of whose inputs comes from the node /M/p."""
    surface = "" if node == "UsdPreviewSurface" else f"{port}.connect = </M/p.outputs:{node_type.split()[-1]}>"
    output = "{} outputs:{}".format(*node_type.split()) if surface else "token outputs:surface"
    if not surface:
        output += "\n            token outputs:displacement"
    probed = f"""
        def Shader "p" {{
            uniform token info:id = "{node}"
            {inputs}
            {output}
        }}
    """
    preview = f"""
        def Shader "surface" {{
            uniform token info:id = "UsdPreviewSurface"
            {surface}
            token outputs:surface
        }}
    """
    return f"""
        def Mesh "quad" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
            {QUAD}
            {ST}
            float[] primvars:a = [0.3] (interpolation = "constant")
            texCoord2f[] primvars:st2 = [(0,0.5), (1,0), (1,1), (0,1)] (interpolation = "vertex")
            rel material:binding = </M>
        }}
        def Material "M" {{
            token outputs:surface.connect = </M/{"surface" if surface else "p"}.outputs:surface>
            {preview if surface else ""}
            {probed}
            {others}
        }}
    """


READER = """
    def Shader "reader" {
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "st"
        float2 outputs:result
    }
    def Shader "reader2" {
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "st2"
        float2 outputs:result
    }
"""
TEXTURE = """
    def Shader "texture" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @DIR/a.png@
        float2 inputs:st.connect = </M/p.outputs:result>
        float3 outputs:rgb
    }
"""

_READER_INPUT = 'string inputs:varname = "a"'
_NODES = {
    "UsdPreviewSurface": material("UsdPreviewSurface", "", ""),
    "UsdUVTexture": material(
        "UsdUVTexture",
        "color3f inputs:diffuseColor",
        "float3 rgb",
        "asset inputs:file = @DIR/a.png@\nfloat2 inputs:st.connect = </M/reader.outputs:result>",
        READER,
    ),
}


def _coordinates(node: str, inputs: str, others: str = "") -> str:
    """Return a quad whose texture takes its coordinates from the node /M/p."""
    stage = material(node, "color3f inputs:diffuseColor", "float2 result", inputs, TEXTURE + others)
    return stage.replace(
        "inputs:diffuseColor.connect = </M/p.outputs:result>", "inputs:diffuseColor.connect = </M/texture.outputs:rgb>"
    )


_NODES["UsdTransform2d"] = _coordinates(
    "UsdTransform2d", "float2 inputs:in.connect = </M/reader.outputs:result>", READER
)
_NODES["UsdPrimvarReader_float2"] = _coordinates("UsdPrimvarReader_float2", 'string inputs:varname = "st"')
for _hydra in ("FieldReader_1", "FieldReader_float", "FieldReader_float2", "FieldReader_float3", "Primvar_1"):
    _NODES[f"Hw{_hydra}"] = material(f"Hw{_hydra}", "color3f inputs:diffuseColor", "float3 result")
for _hydra in ("PtexTexture_1", "UvTexture_1"):
    _NODES[f"Hw{_hydra}"] = material(f"Hw{_hydra}", "color3f inputs:diffuseColor", "float3 result")
for _kind, _type, _port in (
    ("float", "float", "float inputs:roughness"),
    ("float3", "float3", "color3f inputs:diffuseColor"),
    ("float4", "float4", "color3f inputs:diffuseColor"),
    ("int", "int", "float inputs:roughness"),
    ("normal", "normal3f", "normal3f inputs:normal"),
    ("point", "point3f", "color3f inputs:diffuseColor"),
    ("vector", "vector3f", "color3f inputs:diffuseColor"),
    ("string", "string", "color3f inputs:diffuseColor"),
    ("matrix", "matrix4d", "color3f inputs:diffuseColor"),
):
    _NODES[f"UsdPrimvarReader_{_kind}"] = material(f"UsdPrimvarReader_{_kind}", _port, f"{_type} result", _READER_INPUT)


@dataclass(frozen=True)
class Fixture:
    """A stage, and the prim in it that is tried."""

    text: str
    path: str = "/p"


def _simple(kind: str, body: str = "") -> Fixture:
    return Fixture(f'def {kind} "p" {{\n{body}\n}}\n')


def _light(kind: str, body: str = "") -> Fixture:
    return Fixture(SHINING + f'def {kind} "p" {{\n{body}\n}}\n')


FIXTURES: dict[str, Fixture] = {
    **{kind: _simple(kind) for kind in ("Sphere", "Cube", "Cylinder", "Cylinder_1", "Cone", "Capsule", "Capsule_1")},
    "Plane": _simple("Plane"),
    "Xform": _simple("Xform", 'def Sphere "s" {}'),
    "Scope": _simple("Scope", 'def Sphere "s" {}'),
    "Mesh": _simple("Mesh", GRID + SEAMED_ST),
    "GeomSubset": Fixture(
        f"""
        def Mesh "m" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
            {GRID}
            def GeomSubset "p" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
                uniform token elementType = "face"
                uniform token familyName = "materialBind"
                int[] indices = [0]
                rel material:binding = </M>
            }}
        }}
        def Material "M" {{
            token outputs:surface.connect = </M/s.outputs:surface>
            def Shader "s" {{
                uniform token info:id = "UsdPreviewSurface"
                token outputs:surface
            }}
        }}
        """,
        "/m/p",
    ),
    "Points": _simple("Points", "point3f[] points = [(0,0,0), (3,0,0)]\nfloat[] widths = [1, 2]"),
    "BasisCurves": _simple("BasisCurves", CURVE),
    "NurbsCurves": _simple(
        "NurbsCurves",
        CURVE + "int[] order = [4]\ndouble[] knots = [0,0,0,0,1,2,3,4,4,4,4]\ndouble2[] ranges = [(0, 4)]",
    ),
    "HermiteCurves": _simple(
        "HermiteCurves",
        CURVE + "vector3f[] tangents = [(1,0,0),(1,0,0),(1,0,0),(1,0,0),(1,0,0),(1,0,0),(1,0,0)]",
    ),
    "NurbsPatch": _simple("NurbsPatch", PATCH),
    "TetMesh": _simple(
        "TetMesh",
        "point3f[] points = [(0,0,0), (1,0,0), (0,1,0), (0,0,1)]\nint4[] tetVertexIndices = [(0,1,2,3)]\n"
        "int3[] surfaceFaceVertexIndices = [(0,2,1), (0,1,3), (0,3,2), (1,2,3)]",
    ),
    "PointInstancer": _simple(
        "PointInstancer",
        """
        int[] protoIndices = [0, 0]
        point3f[] positions = [(0,0,0), (4,0,0)]
        rel prototypes = [</p/a>, </p/b>]
        def Sphere "a" {}
        def Cube "b" {}
        """,
    ),
    "Camera": Fixture('def Sphere "other" {}\ndef Camera "p" {}\n'),
    "Material": Fixture(material("UsdPreviewSurface", "", ""), "/M"),
    "NodeGraph": Fixture(
        material("UsdPreviewSurface", "", "", "float inputs:roughness.connect = </M/g.outputs:r>").replace(
            'def Shader "p"',
            """def NodeGraph "g" { float outputs:r.connect = </M/g/n.outputs:result>
                def Shader "n" { uniform token info:id = "UsdPrimvarReader_float"
                    string inputs:varname = "a"
                    float outputs:result
                }
            }
            def Shader "p" """,
        ),
        "/M/g",
    ),
    "Shader": Fixture(material("UsdPreviewSurface", "", ""), "/M/p"),
    **{f"{node} node": Fixture(text, "/M/p") for node, text in _NODES.items()},
    "SphereLight": _light("SphereLight"),
    "DiskLight": _light("DiskLight"),
    "RectLight": _light("RectLight"),
    "CylinderLight": _light("CylinderLight"),
    "DistantLight": _light("DistantLight"),
    "DomeLight": _light("DomeLight"),
    "DomeLight_1": _light("DomeLight_1"),
    "GeometryLight": _light("GeometryLight", "rel geometry = </world/other>"),
    "PortalLight": _light("PortalLight"),
    "PluginLight": _light("PluginLight", 'uniform token info:id = "TheirLight"'),
    "LightFilter": Fixture(SHINING + 'def SphereLight "l" { rel light:filters = </p>\n}\ndef LightFilter "p" {}\n'),
    "PluginLightFilter": Fixture(
        SHINING + 'def SphereLight "l" { rel light:filters = </p>\n}\ndef PluginLightFilter "p" {}\n'
    ),
    "RenderSettings": Fixture(SETTINGS, "/settings"),
    "RenderProduct": Fixture(SETTINGS, "/settings/product"),
    "RenderVar": Fixture(ORDERED, "/settings/var"),
    "RenderPass": Fixture(SETTINGS, "/pass"),
    "SkelRoot": Fixture(SKINNED, "/root"),
    "Skeleton": Fixture(SKINNED, "/root/skeleton"),
    "SkelAnimation": Fixture(SKINNED, "/root/animation"),
    "BlendShape": Fixture(SKINNED, "/root/mesh/up"),
    "Volume": _simple("Volume", 'def OpenVDBAsset "f" {}'),
    "Field3DAsset": Fixture(VOLUME.replace("FIELD", "Field3DAsset"), "/volume/p"),
    "OpenVDBAsset": Fixture(VOLUME.replace("FIELD", "OpenVDBAsset"), "/volume/p"),
    "ParticleField": _simple("ParticleField"),
    "ParticleField3DGaussianSplat": _simple("ParticleField3DGaussianSplat", "point3f[] positions = [(0,0,0)]"),
    "LODDistanceHeuristic": Fixture(LEVELS.replace("HEURISTIC", "LODDistanceHeuristic"), "/lod/rule"),
    "LODScreenSizeHeuristic": Fixture(LEVELS.replace("HEURISTIC", "LODScreenSizeHeuristic"), "/lod/rule"),
    "GenerativeProcedural": _simple("GenerativeProcedural"),
}

# Which prims an applied schema is tried on: a type of FIXTURES, or a stage of its own.
_ALL_LIGHTS = ("SphereLight", "DiskLight", "RectLight", "CylinderLight", "DistantLight", "DomeLight", "DomeLight_1")
_MODEL = Fixture(
    """
    def Xform "p" (kind = "component"
        prepend apiSchemas = ["GeomModelAPI"]) {
        uniform token model:drawMode = "cards"
        def Sphere "s" {}
    }
    """
)
_SKINNED_MESH = Fixture(SKINNED, "/root/mesh")
HOSTS: dict[str, tuple[str | Fixture, ...]] = {
    "CollectionAPI": ("Xform",),
    "ColorSpaceAPI": ("Mesh",),
    "ColorSpaceDefinitionAPI": ("Mesh",),
    "BackPlateAPI": ("Camera",),
    "GeomModelAPI": (_MODEL,),
    "MotionAPI": ("Mesh",),
    "VisibilityAPI": ("Mesh",),
    "CoordSysAPI": ("Xform",),
    "MaterialBindingAPI": (
        Fixture(
            """
            def Sphere "p" (prepend apiSchemas = ["MaterialBindingAPI", "CollectionAPI:c"]) {
                rel material:binding = </L>
                rel collection:c:includes = </p>
            }
            def Material "L" { token outputs:surface.connect = </L/s.outputs:surface>
                def Shader "s" { uniform token info:id = "UsdPreviewSurface"
                    float inputs:roughness = 1
                    token outputs:surface
                }
            }
            def Material "M" { token outputs:surface.connect = </M/s.outputs:surface>
                def Shader "s" { uniform token info:id = "UsdPreviewSurface"
                    token outputs:surface
                }
            }
            """
        ),
    ),
    "NodeDefAPI": (),  # Shader has it built in
    "MeshLightAPI": (Fixture(SHINING + f'def Mesh "p" {{ {QUAD.replace("(1,0,0), (1,1,0)", "(2,0,0), (2,1,0)")} }}'),),
    "VolumeLightAPI": ("Volume",),
    "LightAPI": (),  # every light has it built in
    "LightListAPI": ("SphereLight",),
    "ListAPI": ("SphereLight",),
    "ShadowAPI": _ALL_LIGHTS,
    "ShapingAPI": _ALL_LIGHTS,
    "SkelBindingAPI": (_SKINNED_MESH,),
    "ParticleFieldOpacityAttributeAPI": ("ParticleField",),
    "ParticleFieldOrientationAttributeAPI": ("ParticleField",),
    "ParticleFieldPositionAttributeAPI": ("ParticleField",),
    "ParticleFieldScaleAttributeAPI": ("ParticleField",),
    "ParticleFieldSphericalHarmonicsAttributeAPI": ("ParticleField",),
    "LODRootAPI": (Fixture(LEVELS.replace("HEURISTIC", "LODDistanceHeuristic"), "/lod"),),
    "LODOverrideAPI": (Fixture(LEVELS.replace("HEURISTIC", "LODDistanceHeuristic"), "/lod"),),
    "SemanticsLabelsAPI": ("Sphere",),
    "HydraGenerativeProceduralAPI": ("GenerativeProcedural",),
    "HydraPrimAPI": ("Xform",),
    "HydraRenderPassAPI": ("RenderPass",),
    "RiMaterialAPI": (
        Fixture(
            material("UsdPreviewSurface", "", "").replace("token outputs:surface.connect = </M/p.outputs:surface>", ""),
            "/M",
        ),
    ),
    "StatementsAPI": ("Sphere",),
    "RiSplineAPI": ("Xform",),
    **{
        f"ParticleField{name}API": ("ParticleField",)
        for name in (
            "KernelBase",
            "KernelConstantSurflet",
            "KernelGaussianEllipsoid",
            "KernelGaussianSurflet",
            "PositionBase",
            "RadianceBase",
        )
    },
    "PrimvarsAPI": ("Mesh", "Sphere", "Points", "BasisCurves"),
}


@dataclass(frozen=True)
class Probe:
    """How a property is made to show."""

    values: tuple[object, ...] = ()
    """Tried one after the other; empty: made from the type."""
    given: dict[str, object] = field(default_factory=dict)
    """Other properties of the prim, set in both stages."""
    type_name: str = ""
    """Of a property that the schema's definition does not hold; ``rel``: a relationship."""
    interpolation: str = ""
    fixture: Fixture | None = None
    """Stage on which the property is tried, where it is not its type's."""
    time: float = 0.0
    """When the stage is read."""
    edits: tuple[tuple[str, str, object], ...] = ()
    """Path, property and value that are set elsewhere, in both stages."""


def one(value: object, **others: object) -> Probe:
    """Return a probe of one value."""
    return Probe((value,), **others)


_PURPOSES = Fixture(
    """
    def RenderSettings "settings" {
        uniform token[] includedPurposes = ["default", "render", "guide"]
    }
    def Sphere "p" {}
    def Sphere "other" {}
    """
)
_LINKED = {
    f"collection:{name}:{part}": value
    for name in ("lightLink", "shadowLink")
    for part, value in (("includes", "/world"), ("includeRoot", False))
}
_MOVING = Fixture(
    """
    def PointInstancer "p" {
        int[] protoIndices = [0, 0]
        point3f[] positions.timeSamples = { 0: [(0,0,0), (4,0,0)], 24: [(0,0,9), (4,0,9)] }
        quath[] orientations.timeSamples = { 0: [(1,0,0,0), (1,0,0,0)], 24: [(1,0,0,0), (1,0,0,0)] }
        vector3f[] velocities.timeSamples = { 0: [(0,0,1), (0,0,1)], 24: [(0,0,1), (0,0,1)] }
        vector3f[] accelerations.timeSamples = { 0: [(0,0,0), (0,0,0)], 24: [(0,0,0), (0,0,0)] }
        vector3f[] angularVelocities.timeSamples = { 0: [(0,0,0), (0,0,0)], 24: [(0,0,0), (0,0,0)] }
        rel prototypes = [</p/a>]
        def Cube "a" {}
    }
    """
)
_MOVING_MESH = Fixture(
    f"""
    def Mesh "p" {{
        {QUAD}
        point3f[] points.timeSamples = {{ 0: [(0,0,0), (1,0,0), (1,1,0), (0,1,0)],
            24: [(0,0,9), (1,0,9), (1,1,9), (0,1,9)] }}
        vector3f[] velocities.timeSamples = {{ 0: [(0,0,0), (0,0,0), (0,0,0), (0,0,0)], 24: [] }}
        vector3f[] accelerations.timeSamples = {{ 0: [(0,0,0), (0,0,0), (0,0,0), (0,0,0)], 24: [] }}
    }}
    """
)
_UNBOUND = Fixture(
    """
    def Sphere "p" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    }
    def Material "M" { token outputs:surface.connect = </M/s.outputs:surface>
        def Shader "s" { uniform token info:id = "UsdPreviewSurface"
            token outputs:surface
        }
    }
    """
)
_BOUND_TWICE = Fixture(
    """
    def RenderSettings "settings" {}
    def Sphere "other" (prepend apiSchemas = ["MaterialBindingAPI"]) {
        rel material:binding:full = </a>
        rel material:binding:preview = </b>
    }
    def Material "a" {
        token outputs:surface.connect = </a/S.outputs:surface>
        def Shader "S" { uniform token info:id = "UsdPreviewSurface"
            token outputs:surface
        }
    }
    def Material "b" {
        token outputs:surface.connect = </b/S.outputs:surface>
        def Shader "S" { uniform token info:id = "WhittedSurface"
            token outputs:surface
        }
    }
    """,
    "/settings",
)
# Something that changes while shutters are open.
_GROWING = Fixture('def Sphere "other" { double radius.timeSamples = { -1: 1, 1: 2 } }\ndef Camera "p" {}\n')
# By number of points: what can be carried by velocities, and what is.
_SAMPLED = {count: {"points": {0: [(x, x * x, x % 3) for x in range(count)]}} for count in (2, 4, 7, 9)}
_CARRIED = {count: {**points, "velocities": {0: [(0, 0, 0)] * count}} for count, points in _SAMPLED.items()}

_NORMALS = [(0, 0, 1)] * 8 + [(0, 0.6, 0.8)]
_MOVED_GRID = [(x, y, 0.3 * x) for y in range(3) for x in range(3)]
_MATRIX = ((0, 1, 0, 0), (-1, 0, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))
_CREASES = {
    "creaseIndices": [3, 4, 5, 4, 1],
    "creaseLengths": [2, 3],
    "creaseSharpnesses": [1.0, 3.0],
}
_CORNERS = {"cornerIndices": [4], "cornerSharpnesses": [2.0]}
_TRIANGLES = {
    "faceVertexCounts": [3] * 8,
    "faceVertexIndices": [0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4, 3, 4, 7, 3, 7, 6, 4, 5, 8, 4, 8, 7],
    "primvars:st=texCoord2f[]": [(0, 0)] * 24,
}

# By "schema.property"; the prim's own type goes before the schema that the property comes from.
PROBES: dict[str, Probe] = {
    "Imageable.visibility": one("invisible"),
    "Imageable.purpose": Probe(("render", "guide")),
    "Xformable.xformOpOrder": one(["xformOp:translate"], given={"xformOp:translate=double3": (1, 2, 3)}),
    "Xformable.xformOp:NAME": one(
        (1, 2, 3),
        type_name="double3",
        given={"xformOpOrder": ["xformOp:translate"], "xformOp:translate=double3": (0,) * 3},
    ),
    "Boundable.extent": one([(-0.5, -0.5, -0.5), (0.5, 0.5, 0.5)]),
    "Gprim.primvars:displayColor": one([(1, 0, 0)]),
    "Gprim.primvars:displayOpacity": one([0.5]),
    "PrimvarsAPI.primvars:NAME": one([0.5], type_name="float[]", interpolation="constant"),
    "PrimvarsAPI.primvars:NAME:indices": one([1], type_name="int[]", given={"primvars:a=float[]": [0.5, 0.75]}),
    "PointBased.normals": one(_NORMALS, given={"subdivisionScheme": "none"}),
    "Points.normals": one([(0, 0, 1)] * 2),
    "BasisCurves.normals": one([(0, 0, 1)] * 7),
    "NurbsCurves.normals": one([(0, 0, 1)] * 7),
    "HermiteCurves.normals": one([(0, 0, 1)] * 7),
    "TetMesh.normals": one([(0, 0, 1)] * 4),
    "NurbsPatch.normals": one([(0, 0.6, 0.8)] * 9),
    "PointBased.points": one(_MOVED_GRID),
    "Points.points": one([(0, 0, 0), (0, 3, 0)]),
    "BasisCurves.points": one([(0, 0, 0)] + [(1, 1, 1)] * 6),
    "NurbsCurves.points": one([(x, 0, 0) for x in range(7)]),
    "HermiteCurves.points": one([(x, 0, 0) for x in range(7)]),
    "TetMesh.points": one([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 2)]),
    "Curves.curveVertexCounts": one([4]),
    "NurbsCurves.curveVertexCounts": one([6]),
    "Curves.widths": one([0.25]),
    "Points.widths": one([3, 2]),
    "Points.ids": one([5, 6]),
    "BasisCurves.basis": Probe(("bspline", "catmullRom")),
    "BasisCurves.wrap": Probe(("periodic", "pinned"), given={"basis": "bspline"}),
    "HermiteCurves.tangents": one([(0, 1, 0)] * 7),
    "NurbsCurves.knots": one([0, 0, 0, 0, 1, 3, 3, 4, 4, 4, 4]),
    "NurbsCurves.order": one([3], given={"knots": [0, 0, 0, 1, 2, 3, 4, 4, 4, 4]}),
    "NurbsCurves.ranges": one([(1, 3)]),
    "NurbsCurves.pointWeights": one([1, 2, 3, 1, 1, 1, 1]),
    "NurbsPatch.pointWeights": one([1, 2, 1, 1, 3, 1, 1, 1, 1]),
    "NurbsPatch.uKnots": one([0, 0, 0.5, 1, 1, 1]),
    "NurbsPatch.vKnots": one([0, 0, 0.5, 1, 1, 1]),
    "NurbsPatch.uOrder": one(2),
    "NurbsPatch.vOrder": one(2),
    "NurbsPatch.uRange": one((0, 0.5)),
    "NurbsPatch.vRange": one((0, 0.5)),
    "NurbsPatch.uVertexCount": one(1),
    "NurbsPatch.vVertexCount": one(1),
    "NurbsPatch.trimCurve:counts": one([1], given=TRIM | {"trimCurve:counts": []}),
    "NurbsPatch.trimCurve:knots": one([0, 0, 0, 2, 2, 3, 3, 4, 4, 5, 5, 5], given=TRIM),
    "NurbsPatch.trimCurve:orders": one([4], given=TRIM),
    "NurbsPatch.trimCurve:points": one([(u / 2, v / 2, 1) for u, v, _ in TRIM["trimCurve:points"]], given=TRIM),
    "NurbsPatch.trimCurve:ranges": one([(0, 3)], given=TRIM),
    "NurbsPatch.trimCurve:vertexCounts": one([8], given=TRIM),
    "TetMesh.tetVertexIndices": one([(0, 1, 3, 2)], given={"surfaceFaceVertexIndices": []}),
    "TetMesh.surfaceFaceVertexIndices": one([(0, 2, 1), (0, 1, 3)]),
    "Mesh.faceVertexCounts": one([4, 4, 4]),
    "Mesh.faceVertexIndices": one([0, 1, 4, 3, 1, 2, 5, 4, 3, 4, 7, 6, 4, 5, 8, 4]),
    "Mesh.holeIndices": one([1]),
    "Mesh.cornerIndices": one([5], given=_CORNERS),
    "Mesh.cornerSharpnesses": one([0.5], given=_CORNERS),
    "Mesh.creaseIndices": one([3, 4, 7, 4, 1], given=_CREASES),
    "Mesh.creaseLengths": one([3, 2], given=_CREASES),
    "Mesh.creaseSharpnesses": one([2, 2], given=_CREASES),
    "Mesh.triangleSubdivisionRule": one("smooth", given=_TRIANGLES),
    "GeomSubset.indices": one([1]),
    "GeomSubset.familyName": one("other"),
    "PointInstancer.accelerations": one({0: [(0, 100, 0)] * 2}, fixture=_MOVING, time=12),
    "PointInstancer.angularVelocities": one({0: [(0, 0, 90)] * 2}, fixture=_MOVING, time=12),
    "PointInstancer.velocities": one({0: [(1, 0, 0)] * 2}, fixture=_MOVING, time=12),
    "PointInstancer.ids": one([7, 8], given={"invisibleIds": [7]}),
    "PointInstancer.invisibleIds": one([0]),
    "PointInstancer.orientations": one([(0, 1, 0, 0), (0.8, 0, 0.6, 0)]),
    "PointInstancer.orientationsf": one([(0, 1, 0, 0), (0.8, 0, 0.6, 0)]),
    "PointInstancer.positions": one([(0, 0, 1), (4, 0, 1)]),
    "PointInstancer.protoIndices": one([1, 0]),
    "PointInstancer.prototypes": one(["/p/b", "/p/a"]),
    "PointInstancer.scales": one([(1, 2, 1)] * 2),
    "VisibilityAPI.guideVisibility": one("invisible", fixture=_PURPOSES, given={"purpose": "guide"}),
    "VisibilityAPI.proxyVisibility": one("invisible", given={"purpose": "proxy"}),
    "VisibilityAPI.renderVisibility": one("invisible", fixture=_PURPOSES, given={"purpose": "render"}),
    "LODRootAPI.lod:default:index": one(1),
    "LODOverrideAPI.lod:override:index": one(1.0, given={"lod:override:mode": "indexedLOD"}),
    "LODOverrideAPI.lod:override:mode": one("noLOD"),
    "GeomModelAPI.model:applyDrawMode": one(
        True, fixture=Fixture(_MODEL.text.replace('kind = "component"', 'kind = "group"'))
    ),
    "GeomModelAPI.model:drawMode": Probe(("bounds", "origin")),
    "GeomModelAPI.model:drawModeColor": one((1, 0, 0), given={"model:drawMode": "bounds"}),
    "Camera.clippingPlanes": one([(0, 0, 1, 0)]),
    "Camera.clippingRange": one((0.5, 50)),
    "Camera.fStop": one(2, given={"focusDistance": 5.0}),
    "Camera.focusDistance": one(7, given={"fStop": 2.0}),
    "Camera.shutter:close": one(0.25, fixture=_GROWING),
    "Camera.shutter:open": one(-0.25, fixture=_GROWING),
    "MotionAPI.motion:blurScale": one(0.5),
    "MotionAPI.motion:velocityScale": one(0.5),
    "ColorSpaceAPI.colorSpace:name": one("srgb_rec709_scene", given={"primvars:displayColor": [(0.5, 0.2, 0.1)]}),
    "MaterialBindingAPI.material:binding": one("/M", type_name="rel"),
    "MaterialBindingAPI.material:binding:full": one("/M", type_name="rel"),
    "MaterialBindingAPI.material:binding:preview": one("/M", type_name="rel", fixture=_UNBOUND),
    "NodeDefAPI.info:id": Probe(("WhittedSurface", "NobodysSurface")),
    "NodeDefAPI.info:implementationSource": Probe(("sourceAsset", "sourceCode")),
    "Material.outputs:surface": one("/L.outputs:surface"),
    "LightAPI.inputs:colorTemperature": one(3000.0, given={"inputs:enableColorTemperature": True}),
    "LightAPI.inputs:enableColorTemperature": one(True, given={"inputs:colorTemperature": 3000.0}),
    "LightAPI.inputs:normalize": one(True),
    "SphereLight.inputs:normalize": one(True, given={"inputs:radius": 2.0}),
    "RectLight.inputs:normalize": one(True, given={"inputs:width": 2.0}),
    "LightAPI.collection:lightLink:includeRoot": one(False),
    "LightAPI.collection:shadowLink:includeRoot": one(False),
    "RenderSettingsBase.camera": one("/camera2"),
    "RenderSettingsBase.resolution": one(Gf.Vec2i(11, 22)),
    "RenderSettingsBase.dataWindowNDC": one((0.25, 0.25, 0.75, 0.75)),
    "RenderSettings.includedPurposes": one(["default", "guide"], edits=(("/other", "purpose", "guide"),)),
    "RenderSettings.materialBindingPurposes": one(["preview", ""], fixture=_BOUND_TWICE),
    "RenderSettings.renderingColorSpace": one("lin_ap1_scene"),
    "RenderVar.dataType": one("color3h"),
    "RenderSettings.products": one("/settings/product2"),
    "RenderProduct.*prim*": Probe(
        fixture=Fixture(
            SETTINGS.replace('RenderProduct "product" {', 'RenderProduct "product" { uniform int2 resolution = (3, 4)'),
            "/settings/product",
        )
    ),
    "RenderProduct.orderedVars": one("/settings/var2"),
    "RenderPass.renderSource": one("/settings2"),
    **{
        f"RenderPass.collection:{name}:{part}": one("/other", given={f"collection:{name}:includeRoot": root})
        for names, parts, root in (
            (("cameraVisibility", "renderVisibility"), ("includes", "membershipExpression"), False),
            (("matte", "prune"), ("excludes",), True),
        )
        for name in names
        for part in parts
    },
    "SkelBindingAPI.primvars:skel:geomBindTransform": one(_MATRIX),
    "SkelBindingAPI.primvars:skel:jointIndices": one([1, 0] * 4),
    "SkelBindingAPI.primvars:skel:jointWeights": one([0.5, 0.5] * 4),
    "SkelBindingAPI.skel:animationSource": one("/root/animation2", fixture=Fixture(SKINNED, "/root/skeleton")),
    "SkelBindingAPI.skel:skeleton": one("/root/skeleton2"),
    "SkelBindingAPI.skel:joints": one(["a/b", "a"]),
    "SkelBindingAPI.skel:blendShapes": one(["more", "up"]),
    "SkelBindingAPI.skel:blendShapeTargets": one(["/root/mesh/more", "/root/mesh/up"]),
    "BlendShape.normalOffsets": one([(0, 1, 0), (0, 0, 0)]),
    "BlendShape.offsets": one([(1, 0, 1), (0, 0, 2)]),
    "BlendShape.pointIndices": one([2, 3]),
    "SkelAnimation.blendShapeWeights": one([1.0, 0.0]),
    "SkelAnimation.blendShapes": one(["more", "up"]),
    "SkelAnimation.joints": one(["a/b", "a"]),
    "SkelAnimation.rotations": one([(1, 0, 0, 0), (0.6, 0, 0, 0.8)]),
    "SkelAnimation.scales": one([(1, 1, 1), (1, 2, 1)]),
    "SkelAnimation.translations": one([(0, 0, 0), (0, 3, 0)]),
    "Skeleton.bindTransforms": one([_MATRIX, _MATRIX]),
    "Skeleton.joints": one(["b", "b/a"]),
    "Skeleton.restTransforms": one([_MATRIX, _MATRIX], given={"skel:animationSource": "/root/animation3"}),
    "Skeleton.jointNames": one(["x", "y"]),
    "SemanticsLabelsAPI.semantics:labels:NAME": one(["chair"]),
    "UsdPreviewSurface node.inputs:opacityMode": one("presence"),
    "UsdUVTexture node.inputs:sourceColorSpace": Probe(("raw", "sRGB")),
    "UsdUVTexture node.inputs:wrapS": Probe(("repeat", "clamp", "mirror", "black")),
    "UsdUVTexture node.inputs:wrapT": Probe(("repeat", "clamp", "mirror", "black")),
    "Points.velocities": one({0: [(1, 0, 0)] * 2}, given=_SAMPLED[2], time=12),
    "Points.accelerations": one({0: [(1, 0, 0)] * 2}, given=_CARRIED[2], time=12),
    "BasisCurves.velocities": one({0: [(1, 0, 0)] * 7}, given=_SAMPLED[7], time=12),
    "BasisCurves.accelerations": one({0: [(1, 0, 0)] * 7}, given=_CARRIED[7], time=12),
    "NurbsCurves.velocities": one({0: [(1, 0, 0)] * 7}, given=_SAMPLED[7], time=12),
    "NurbsCurves.accelerations": one({0: [(1, 0, 0)] * 7}, given=_CARRIED[7], time=12),
    "HermiteCurves.velocities": one({0: [(1, 0, 0)] * 7}, given=_SAMPLED[7], time=12),
    "HermiteCurves.accelerations": one({0: [(1, 0, 0)] * 7}, given=_CARRIED[7], time=12),
    "TetMesh.velocities": one({0: [(1, 0, 0)] * 4}, given=_SAMPLED[4], time=12),
    "NurbsPatch.velocities": one({0: [(1, 0, 0)] * 9}, given=_SAMPLED[9], time=12),
    "NurbsPatch.accelerations": one({0: [(1, 0, 0)] * 9}, given=_CARRIED[9], time=12),
    "TetMesh.accelerations": one({0: [(1, 0, 0)] * 4}, given=_CARRIED[4], time=12),
    "Mesh.velocities": one({0: [(1, 0, 0)] * 4}, fixture=_MOVING_MESH, time=12),
    "Mesh.accelerations": one({0: [(1, 0, 0)] * 4}, fixture=_MOVING_MESH, time=12),
    "MaterialBindingAPI.material:binding:collection:NAME": one(["/p.collection:c", "/M"], type_name="rel"),
    "UsdUVTexture node.inputs:st": one("/M/reader2.outputs:result"),
    "UsdTransform2d node.inputs:in": one("/M/reader2.outputs:result"),
    "DomeLight.inputs:texture:format": Probe(
        ("latlong", "mirroredBall", "angular"), given={"inputs:texture:file": "DIR/a.png"}
    ),
    "DomeLight_1.inputs:texture:format": Probe(
        ("latlong", "mirroredBall", "angular"), given={"inputs:texture:file": "DIR/a.png"}
    ),
    "ShadowAPI.inputs:shadow:distance": one(3.0),
    "ShadowAPI.inputs:shadow:falloff": one(2.0, given={"inputs:shadow:distance": 3.0}),
    "ShadowAPI.inputs:shadow:falloffGamma": one(
        2.0, given={"inputs:shadow:distance": 3.0, "inputs:shadow:falloff": 2.0}
    ),
    "ShapingAPI.inputs:shaping:ies:file": one("DIR/a.ies"),
    "ShapingAPI.inputs:shaping:ies:angleScale": one(0.5, given={"inputs:shaping:ies:file": "DIR/a.ies"}),
    "ShapingAPI.inputs:shaping:ies:normalize": one(True, given={"inputs:shaping:ies:file": "DIR/a.ies"}),
    "LightAPI.light:shaderId": one("TheirLight"),
    "LightAPI.collection:lightLink:expansionRule": one("explicitOnly", given=_LINKED),
    "LightAPI.collection:lightLink:includes": one("/world/other", given={"collection:lightLink:includeRoot": False}),
    "LightAPI.collection:lightLink:excludes": one("/world/other"),
    "LightAPI.collection:lightLink:membershipExpression": one(
        "/world/other", given={"collection:lightLink:mode": "expression"}
    ),
    "LightAPI.collection:lightLink:mode": one(
        "expression", given={"collection:lightLink:membershipExpression": "/world/other"}
    ),
    "LightAPI.collection:shadowLink:expansionRule": one("explicitOnly", given=_LINKED),
    "LightAPI.collection:shadowLink:includes": one("/world/other", given={"collection:shadowLink:includeRoot": False}),
    "LightAPI.collection:shadowLink:excludes": one("/world/other"),
    "LightAPI.collection:shadowLink:membershipExpression": one(
        "/world/other", given={"collection:shadowLink:mode": "expression"}
    ),
    "LightAPI.collection:shadowLink:mode": one(
        "expression", given={"collection:shadowLink:membershipExpression": "/world/other"}
    ),
    "Material.outputs:displacement": one(
        "/M/p.outputs:displacement", edits=(("/M/p", "inputs:displacement=float", 0.5),)
    ),
    "UsdPreviewSurface node.inputs:displacement": one(
        0.5, edits=(("/M", "outputs:displacement", "/M/p.outputs:displacement"),)
    ),
    "RiMaterialAPI.outputs:ri:surface": one("/M/p.outputs:surface"),
    "RiMaterialAPI.outputs:ri:displacement": one(
        "/M/p.outputs:displacement",
        fixture=FIXTURES["Material"],
        edits=(("/M/p", "inputs:displacement=float", 0.5),),
    ),
    "RiMaterialAPI.outputs:ri:volume": one("/M/p.outputs:volume", fixture=FIXTURES["Material"]),
    "ParticleFieldOrientationAttributeAPI.orientations": one([(1, 0, 0, 0)]),
    "ParticleFieldOrientationAttributeAPI.orientationsh": one([(1, 0, 0, 0)]),
}
