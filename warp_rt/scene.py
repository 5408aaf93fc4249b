# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The scene: frozen dataclasses of NumPy arrays that know neither pxr nor Warp.

Everything in a :class:`Scene` has been validated by whoever made it, for kernels check nothing: indices are in
range, numbers are finite, transforms are invertible. Matrices act on column vectors and read right to left,
``p_world = world_from_local @ p_local``. Colours are linear Rec. 709. Lengths are scene units, angles radians.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum, IntFlag
from typing import Any

import numpy as np

from warp_rt.errors import SceneError
from warp_rt.report import Diagnostic

# --- geometry


@dataclass(frozen=True)
class Primvar:
    """Values over a mesh, looked up by triangle corner, or along shapes. Every USD interpolation fits: ``indices``."""

    values: np.ndarray
    """float32, shape [k, c] with c = 1 to 4 components, k >= 1."""
    indices: np.ndarray | None = None
    """Rows of ``values``, int32; None: constant, row 0 everywhere.

    Of a mesh: shape [triangle_count, 3], one row a corner; vertex interpolation shares ``Mesh.triangles``, uniform
    repeats one row thrice. Of shapes: shape [shape_count, r], the r = 1, 2 or 4 Bernstein coefficients of a polynomial
    in the shape's u: r = 1 is uniform, 2 is linear from end to end, 4 follows a cubic curve."""


@dataclass(frozen=True)
class Mesh:
    """Triangles in their own space, shared by any number of instances."""

    points: np.ndarray
    """float32, shape [n, 3], local space."""
    triangles: np.ndarray
    """int32, shape [m, 3], wound so that cross(p1 - p0, p2 - p0) is the outward geometric normal
    (leftHanded orientation is undone here; a mirroring transform is not)."""
    normals: Primvar | None = None
    """Shading normals, local space, three components; None: flat shading with the geometric normal."""
    primvars: Mapping[str, Primvar] = field(default_factory=dict)
    """By name without the ``primvars:`` prefix: ``st``, ``displayColor``, ..."""
    material_slots: np.ndarray | None = None
    """int32, shape [m], slot of each triangle in its instance's materials; None: slot 0 for all."""
    face_ids: np.ndarray | None = None
    """int32, shape [m], face of the source mesh that each triangle was cut from; None: the triangle's own index."""
    is_closed: bool = False
    """Whether the surface bounds a volume (every edge used once each way): only then does refraction bend rays."""


class ShapeKind(IntEnum):
    """Curved primitives that rays meet exactly, without triangles."""

    SPHERE = 1
    """About one point."""
    FRUSTUM = 2
    """A truncated cone about the line between two points, each the centre of a circle; a cylinder, a cone."""
    ROUND_CONE = 3
    """What a ball sweeps on its way between two points, its radius changing linearly; a capsule."""
    LINEAR_TUBE = 4
    """A segment of a curve: a round cone that rays meet from outside only, so that its joints do not show."""
    CUBIC_TUBE = 5
    """What a ball sweeps along a cubic Bezier curve, its radius a cubic too; met from outside only."""


SHAPE_POINTS: Mapping[ShapeKind, int] = {
    ShapeKind.SPHERE: 1,
    ShapeKind.FRUSTUM: 2,
    ShapeKind.ROUND_CONE: 2,
    ShapeKind.LINEAR_TUBE: 2,
    ShapeKind.CUBIC_TUBE: 4,
}
"""Control points of each kind."""


@dataclass(frozen=True)
class Shapes:
    """Curved primitives of one kind in their own space, shared by any number of instances like a ``Mesh``.

    Where a ray meets one, u runs from the first point (0) to the last (1). The primvar ``st`` of a solid that has none
    of its own is its parametrisation: s the turn about the line from the first to the last point (of a sphere: about
    z), counter-clockwise from x, t the way along it (of a sphere: the latitude), both from 0 to 1.
    """

    kind: ShapeKind
    points: np.ndarray
    """float32, shape [n, k, 3], k as ``SHAPE_POINTS`` has it, local space."""
    radii: np.ndarray
    """float32, shape [n, k], at the points, not negative."""
    caps: tuple[bool, bool] = (True, True)
    """Whether disks close frusta at their first and at their last points."""
    primvars: Mapping[str, Primvar] = field(default_factory=dict)
    """By name without the ``primvars:`` prefix."""
    face_ids: np.ndarray | None = None
    """int32, shape [n], element of the source prim that each was made from; None: its own index."""
    is_closed: bool = True
    """Whether each bounds a volume: only then does refraction bend rays."""
    is_inside_out: bool = False
    """Whether normals point inwards, as ``orientation`` leftHanded asks for."""
    has_st: bool = False
    """Whether the parametrisation stands in for a primvar ``st``; never of tubes."""

    def __post_init__(self) -> None:
        """Refuse numbers that a hierarchy cannot be built over.

        Raises:
            SceneError: A point is not finite, or a radius is not or is negative.
        """
        if not (np.isfinite(self.points).all() and np.isfinite(self.radii).all() and (self.radii >= 0).all()):
            raise SceneError("shapes: finite points and finite radii of at least 0 expected")


class RayMask(IntFlag):
    """Kinds of rays."""

    EYE = 1
    BOUNCES = 2
    """Reflection and refraction."""
    SHADOWS = 4
    ALL = 7


@dataclass(frozen=True)
class Instances:
    """The placed meshes and sets of shapes, one row each."""

    mesh: np.ndarray
    """int32, shape [n], row of ``Scene.meshes``."""
    world_from_local: np.ndarray
    """float64, shape [n, 4, 4], invertible and affine."""
    material_offset: np.ndarray
    """int32, shape [n]: the material of a triangle is ``material_table[material_offset[i] + slot]``."""
    material_table: np.ndarray
    """int32, shape [k], rows of ``Scene.materials``."""
    prim: np.ndarray
    """int32, shape [n], row of ``Scene.prims``: the primId."""
    instance_id: np.ndarray
    """int32, shape [n], row of ``Scene.instance_paths`` or -1 where the geometry is not instanced: the instanceId."""
    primvars: Mapping[str, np.ndarray] = field(default_factory=dict)
    """Values that take precedence over the mesh's primvar of that name: float32, shape [n, c]; a row of NaN: none."""
    seen_by: np.ndarray | None = None
    """uint8, shape [n], ``RayMask`` of the rays that each is there for; others pass straight through. None: all."""
    is_matte: np.ndarray | None = None
    """bool, shape [n], which hold out: where eye rays meet them, the picture is black and transparent. None: none."""

    def __post_init__(self) -> None:
        """Refuse transforms that place nothing anywhere.

        Raises:
            SceneError: A number is not finite.
        """
        if not np.isfinite(self.world_from_local).all():
            raise SceneError("instances: finite transforms expected")

    def __len__(self) -> int:
        return len(self.mesh)

    def __getitem__(self, rows: np.ndarray) -> Instances:
        """Return some of them, in the order of ``rows``."""
        return replace(
            self,
            mesh=self.mesh[rows],
            world_from_local=self.world_from_local[rows],
            material_offset=self.material_offset[rows],
            prim=self.prim[rows],
            instance_id=self.instance_id[rows],
            primvars={name: values[rows] for name, values in self.primvars.items()},
            seen_by=None if self.seen_by is None else self.seen_by[rows],
            is_matte=None if self.is_matte is None else self.is_matte[rows],
        )


# --- materials


class MaterialModel(IntEnum):
    """Which illumination a material asks for."""

    WHITTED = 0
    """The lecture's terms: spec of ``WhittedSurface``."""
    PREVIEW = 1
    """UsdPreviewSurface."""


class Wrap(IntEnum):
    """What a texture holds outside [0, 1]."""

    BLACK = 0
    CLAMP = 1
    REPEAT = 2
    MIRROR = 3
    TILES = 4
    """Nothing, black, beyond half a texel: UDIM tiles, whose seams end on the outermost edge."""


class OpacityMode(IntEnum):
    """What opacity below one means: light through the material, or less of the material."""

    TRANSPARENT = 0
    PRESENCE = 1


@dataclass(frozen=True)
class Image:
    """Texels. Row 0 is the bottom one, where v = 0, as USD has it."""

    path: str
    pixels: np.ndarray
    """uint8 or float32, shape [height, width, 4]."""


@dataclass(frozen=True)
class Texture:
    """An image with all that a UsdUVTexture and what feeds its ``st`` say: out = decode(texel) * scale + bias."""

    image: int
    """Row of ``Scene.images``, or -1 where the file is unreadable: the result is then ``fallback``, unscaled."""
    primvar: str = "st"
    """Name of the two-component primvar that holds the texture coordinates."""
    uv_fallback: tuple[float, float] = (0.0, 0.0)
    uv_transform: np.ndarray = field(default_factory=lambda: np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], np.float32))
    """float32, shape [2, 3], applied to (u, v, 1)."""
    wrap_s: Wrap = Wrap.BLACK
    wrap_t: Wrap = Wrap.BLACK
    scale: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    bias: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    fallback: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    is_srgb: bool = False
    """Whether red, green and blue are decoded by the sRGB curve before filtering; alpha never is."""


@dataclass(frozen=True)
class Input:
    """One input of a surface: a constant, a texture's channel(s), or a primvar."""

    value: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    """The constant; for a primvar, the fallback where the mesh has none of that name. Scalars sit in element 0."""
    texture: int = -1
    """Row of ``Scene.textures``; -1: not textured."""
    primvar: str = ""
    """Name of the primvar that is read directly; empty: none."""
    channel: int = -1
    """0 to 3 picks red, green, blue or alpha; -1 takes the vector."""
    scale: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    """Of a primvar, or its fallback: what is read is value * scale + bias. A texture has its own."""
    bias: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)


MATERIAL_DEFAULTS: Mapping[MaterialModel, Mapping[str, tuple[float, ...]]] = {
    MaterialModel.WHITTED: {
        "ambient": (0.1, 0.1, 0.1),
        "diffuse": (0.8, 0.8, 0.8),
        "specular": (0.0, 0.0, 0.0),
        "shininess": (32.0,),
        "reflection": (0.0, 0.0, 0.0),
        "transmission": (0.0, 0.0, 0.0),
        "ior": (1.5,),
    },
    MaterialModel.PREVIEW: {
        "diffuseColor": (0.18, 0.18, 0.18),
        "emissiveColor": (0.0, 0.0, 0.0),
        "specularColor": (0.0, 0.0, 0.0),
        "metallic": (0.0,),
        "roughness": (0.5,),
        "clearcoat": (0.0,),
        "clearcoatRoughness": (0.01,),
        "opacity": (1.0,),
        "ior": (1.5,),
        "normal": (0.0, 0.0, 1.0),
        "occlusion": (1.0,),
    },
}
"""Inputs of each model and what they are where a material says nothing: docs/whitted.md, UsdPreviewSurface 2.6."""


@dataclass(frozen=True)
class Material:
    """A surface. Inputs that are absent have the defaults of their model's specification."""

    path: str
    model: MaterialModel
    inputs: Mapping[str, Input] = field(default_factory=dict)
    """By the specification's names: ``diffuse``, ``reflection``, ... or ``diffuseColor``, ``roughness``, ..."""
    use_specular_workflow: bool = False
    opacity_mode: OpacityMode = OpacityMode.TRANSPARENT
    opacity_threshold: float = 0.0
    is_single_sided: bool = False
    """Whether it is not there for rays that meet it from behind, as the cards of a model's draw mode are."""


# --- lights and cameras


class LightKind(IntEnum):
    """Shape of a light in its own space, as UsdLux has it."""

    POINT = 0
    """At the origin. ``radiance`` times the projected area ``pi radius^2`` is its radiant intensity."""
    DISTANT = 1
    """Light travels along -Z: ``radiance`` over a cone of full angle ``angle``; at angle 0, the irradiance itself."""
    SPHERE = 2
    """About the origin, of ``radius``."""
    RECT = 3
    """In the XY plane, ``width`` by ``height``, shining along -Z."""
    DISK = 4
    """In the XY plane, of ``radius``, shining along -Z."""
    CYLINDER = 5
    """Along X, of ``length`` and ``radius``, without caps."""
    MESH = 6
    """``triangles``, shining outwards."""


@dataclass(frozen=True)
class Shadow:
    """What a light's shadows are like: UsdLux ShadowAPI and the collection shadowLink."""

    color: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """What is left of the light where nothing of it arrives."""
    distance: float = np.inf
    """From a surface, beyond which nothing casts a shadow on it."""
    falloff: float = 0.0
    """Length at the end of ``distance`` over which shadows fade."""
    falloff_gamma: float = 1.0
    """Exponent of the strength that falls linearly over that length."""
    casters: np.ndarray | None = None
    """bool, shape [n], which of ``Scene.instances`` cast shadows; None: all."""


@dataclass(frozen=True)
class Profile:
    """How much a light sends where: an IES profile, read linearly between its angles; beyond them it sends nothing.

    Angles are those of the direction that light leaves in, in the light's own space.
    """

    vertical: np.ndarray
    """float32, shape [n], n >= 2, from -Z, ascending, within [0, pi]."""
    horizontal: np.ndarray
    """float32, shape [m], m >= 2, about the axis from -X towards -Y, ascending, within [0, 2 pi]."""
    values: np.ndarray
    """float32, shape [m, n], factors of the light's radiance."""


@dataclass(frozen=True)
class Light:
    """A light with UsdLux's units resolved: ``radiance`` is what its surface sends out."""

    path: str
    kind: LightKind
    world_from_light: np.ndarray
    """float64, shape [4, 4]; its scale applies to the shape."""
    radiance: tuple[float, float, float]
    """intensity * 2^exposure * color * temperature, over the world-space area where normalised [nit]."""
    radius: float = 0.5
    width: float = 1.0
    height: float = 1.0
    length: float = 1.0
    angle: float = 0.0
    """Full cone angle of a distant light [rad]."""
    has_falloff: bool = True
    """False: a point light of the lecture, I_l = radiance at every distance (``warp_rt:falloff`` = "none")."""
    casts_shadow: bool = True
    diffuse: float = 1.0
    """Multiplier of the diffuse response."""
    specular: float = 1.0
    """Multiplier of the specular response."""
    focus: float = 0.0
    focus_tint: tuple[float, float, float] = (0.0, 0.0, 0.0)
    cone_angle: float = np.pi
    """Half angle outside of which there is no light [rad]; pi: no cone."""
    cone_softness: float = 0.0
    receivers: np.ndarray | None = None
    """bool, shape [n], which of ``Scene.instances`` it illuminates; None: all."""
    shadow: Shadow = Shadow()
    profile: Profile | None = None
    image: int = -1
    """Texture of a rect light, row of ``Scene.images``, a factor of the radiance; -1: none. Its left edge is at local
    +X, its top at +Y: seen from the side that shines it is upright and unmirrored."""
    is_srgb: bool = False
    triangles: np.ndarray | None = None
    """Of a mesh light: float32, shape [n, 3, 3], its own space, wound as seen from outside. Rays meet the mesh that is
    drawn there, and not these."""
    is_double_sided: bool = False
    """Whether a mesh light shines inwards, too."""
    glows: bool = False
    """Whether the mesh of a mesh light emits by its material: what mirrors show of that is no highlight, too."""
    profile_angle_scale: float = 0.0
    """Above 0, vertical angles are divided by it before the profile is read; below 0, their distance from pi is by its
    negative; 0: neither."""

    @property
    def has_extent(self) -> bool:
        """Whether it is more than a point, so that its shadows are soft where it is sampled."""
        return self.kind != LightKind.POINT and (self.kind != LightKind.DISTANT or self.angle > 0)


@dataclass(frozen=True)
class Dome:
    """Light from infinitely far in all directions; the background where visible."""

    path: str
    world_from_light: np.ndarray
    """float64, shape [4, 4], only its rotation counts. Latitude-longitude images have their pole at local +Y, the
    image's centre at local +Z and u growing towards local -X, seen from inside."""
    radiance: tuple[float, float, float]
    """Multiplier of the image, or the radiance itself where there is none [nit]."""
    image: int = -1
    """Row of ``Scene.images`` or -1; row 0 of the image is the bottom, direction -Y."""
    is_srgb: bool = False
    is_visible: bool = True
    """Whether eye rays that leave the scene see it. Reflection and refraction rays always do."""
    diffuse: float = 1.0
    specular: float = 1.0
    casts_shadow: bool = True
    """Where it is sampled; as a whole it casts none."""
    receivers: np.ndarray | None = None
    """bool, shape [n], which of ``Scene.instances`` it illuminates; None: all."""
    shadow: Shadow = Shadow()


@dataclass(frozen=True)
class Camera:
    """A perspective or an orthographic camera that looks along its local -Z with +Y up."""

    path: str
    world_from_camera: np.ndarray
    """float64, shape [4, 4], with whatever scale and shear the stage gives it."""
    window: tuple[float, float, float, float]
    """left, right, bottom, top: on the plane z = -1 (perspective) or in scene units (orthographic)."""
    is_perspective: bool = True
    clipping_range: tuple[float, float] = (0.0, np.inf)
    """Nearest and farthest distance along -Z that eye rays see."""
    clipping_planes: tuple[tuple[float, float, float, float], ...] = ()
    """(a, b, c, d) in the camera's space: eye rays do not see points where a x + b y + c z + d < 0."""
    lens_radius: float = 0.0
    """Half the aperture's diameter [scene unit]; 0: a pinhole."""
    focus_distance: float = 0.0
    """Distance along -Z of the plane in focus [scene unit]; 0: all is sharp, whatever the lens."""
    exposure_scale: float = 1.0
    """Linear factor on colour from the camera's exposure attributes."""
    shutter: tuple[float, float] = (0.0, 0.0)
    """When it opens and closes, time codes from the frame's; zeros also where nothing moves meanwhile."""


@dataclass(frozen=True)
class Settings:
    """What the stage's RenderSettings ask for; None where they say nothing."""

    path: str = ""
    resolution: tuple[int, int] | None = None
    data_window: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 1.0)
    """Part of the picture that is made: left, bottom, right, top, as shares of its sides from the bottom left."""
    pixel_aspect_ratio: float = 1.0
    aspect_policy: str = "expandAperture"
    camera: str | None = None
    ambient: tuple[float, float, float] | None = None
    background: tuple[float, float, float] | None = None
    depth: int | None = None
    threshold: float | None = None
    disables_depth_of_field: bool = False
    light_samples: int | None = None
    disables_motion_blur: bool = False
    has_instantaneous_shutter: bool = False
    """Whether shutters close as soon as they open."""


@dataclass(frozen=True)
class RenderVar:
    """A layer of a product."""

    path: str
    layer: str
    """Its name in the file."""
    aov: str
    """Of ``options.AOVS``, or ``alpha``."""
    is_half: bool = False
    """Whether 16-bit floats are asked for."""


@dataclass(frozen=True)
class Product:
    """A picture that the render settings ask for."""

    path: str
    name: str
    """Its file, as the stage says it; empty: the stage does not."""
    settings: Settings
    """What the product authors itself, else the render settings."""
    variables: tuple[RenderVar, ...] = ()
    """In order; none: colour."""


_SMALL = 1024  # triangles of a mesh up to which many are measured at once, and how many

# --- the whole


@dataclass(frozen=True)
class Scene:
    """Everything that a picture needs, and the record of what was left out."""

    meshes: tuple[Mesh | Shapes, ...]
    instances: Instances
    prims: tuple[str, ...] = ()
    """Path of each primId."""
    instance_paths: Sequence[str] = ()
    """Path of each instanceId: the native instance, or ``/Instancer[7]``."""
    labels: Mapping[str, Mapping[str, tuple[str, ...]]] = field(default_factory=dict)
    """Semantic labels: prim path to taxonomy to labels."""
    materials: tuple[Material, ...] = ()
    textures: tuple[Texture, ...] = ()
    images: tuple[Image, ...] = ()
    lights: tuple[Light, ...] = ()
    domes: tuple[Dome, ...] = ()
    cameras: tuple[Camera, ...] = ()
    settings: Settings = Settings()
    """With what the first of ``products`` overrides."""
    products: tuple[Product, ...] = ()
    up_axis: str = "Y"
    meters_per_unit: float = 0.01
    source: str = ""
    """File that the scene was read from, or empty."""
    time: float | None = None
    """Time code; None: the default time."""
    diagnostics: tuple[Diagnostic, ...] = ()

    def __repr__(self) -> str:
        counts = {
            "meshes": len(self.meshes),
            "triangles": self.triangle_count,
            **({"shapes": self.shape_count} if self.shape_count else {}),
            "instances": len(self.instances),
            "materials": len(self.materials),
            "lights": len(self.lights) + len(self.domes),
            "cameras": len(self.cameras),
        }
        source = f" {self.source!r}" if self.source else ""
        return f"<warp_rt.Scene{source}: {', '.join(f'{name} {count:,}' for name, count in counts.items())}>"

    @property
    def triangle_count(self) -> int:
        """Triangles in memory; instances share theirs."""
        return sum(len(mesh.triangles) for mesh in self.meshes if isinstance(mesh, Mesh))

    @property
    def shape_count(self) -> int:
        """Spheres, cones and segments of curves in memory; instances share theirs."""
        return sum(len(mesh.points) for mesh in self.meshes if isinstance(mesh, Shapes))

    def bounds(self) -> np.ndarray:
        """Return the world-space box of all instances: float64, shape [2, 3]; NaN where there is no geometry."""
        if not len(self.instances):
            return np.full((2, 3), np.nan)
        local = local_boxes(self.meshes)[self.instances.mesh]
        center, half = local.mean(axis=1), (local[:, 1] - local[:, 0]) / 2
        matrix = self.instances.world_from_local
        center = np.einsum("nij,nj->ni", matrix[:, :3, :3], center) + matrix[:, :3, 3]
        half = np.einsum("nij,nj->ni", np.abs(matrix[:, :3, :3]), half)
        return np.array([np.nanmin(center - half, axis=0), np.nanmax(center + half, axis=0)])

    def origin(self) -> np.ndarray:
        """Return the world point that float32 coordinates are taken relative to: float64, shape [3].

        The world's own origin, unless the geometry lies so far from it (beyond 8 times its extent) that float32
        would lose digits; then the centre of the bounds.
        """
        low, high = self.bounds()
        center = (low + high) / 2
        if not np.isfinite(center).all() or np.abs(center).max() <= 8 * np.linalg.norm(high - low):
            return np.zeros(3)
        return center

    @staticmethod
    def from_arrays(
        points: Any,
        faces: Any,
        *,
        normals: Any = None,
        world_from_local: Any = None,
        material: Material | None = None,
        lights: Sequence[Light] = (),
        cameras: Sequence[Camera] = (),
        settings: Settings | None = None,
    ) -> Scene:
        """Return a scene of one triangle mesh, without USD.

        Args:
            points: Vertices, shape [n, 3], local space.
            faces: Vertex indices, shape [m, 3], counter-clockwise seen from outside.
            normals: Shading normals, one a vertex [n, 3] or one a corner [m, 3, 3]; None: flat shading.
            world_from_local: Placement, shape [4, 4]; None: the identity.
            material: Surface; None: a grey diffuse WhittedSurface.
            lights: Lights; where there are none, a renderer adds a headlight.
            cameras: Cameras; where there are none, the scene is framed.
            settings: Scene-wide terms such as ambient light and background.

        Raises:
            SceneError: A shape is wrong, an index is out of range, or a number is not finite.
        """
        vertices = np.ascontiguousarray(points, np.float32)
        triangles = np.ascontiguousarray(faces, np.int32)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
            raise SceneError(f"points: shape [n, 3] of finite numbers expected, got shape {list(vertices.shape)}")
        if triangles.ndim != 2 or triangles.shape[1] != 3:
            raise SceneError(f"faces: shape [m, 3] expected, got {list(triangles.shape)}")
        if len(triangles) and (triangles.min() < 0 or triangles.max() >= len(vertices)):
            raise SceneError(f"faces: an index is outside 0..{len(vertices) - 1}")
        matrix = np.eye(4) if world_from_local is None else np.asarray(world_from_local, float)
        if matrix.shape != (4, 4) or not np.isfinite(matrix).all() or np.linalg.det(matrix[:3, :3]) == 0:
            raise SceneError("world_from_local: an invertible 4 x 4 matrix expected")
        mesh = Mesh(vertices, triangles, _normals_primvar(normals, vertices, triangles), is_closed=is_closed(triangles))
        row = np.zeros(1, np.int32)
        return Scene(
            meshes=(mesh,) if len(triangles) else (),
            instances=Instances(row, matrix[None], row, row, row, row - 1)
            if len(triangles)
            else Instances(row[:0], matrix[None][:0], row[:0], row, row[:0], row[:0]),
            prims=("/mesh",),
            materials=(material or Material("/material", MaterialModel.WHITTED),),
            lights=tuple(lights),
            cameras=tuple(cameras),
            settings=settings or Settings(),
        )


def _normals_primvar(normals: Any, vertices: np.ndarray, triangles: np.ndarray) -> Primvar | None:
    if normals is None:
        return None
    values = np.ascontiguousarray(normals, np.float32)
    if not np.isfinite(values).all():
        raise SceneError("normals: every number must be finite")
    if values.shape == vertices.shape:
        return Primvar(values, triangles)
    if values.shape == (len(triangles), 3, 3):
        return Primvar(values.reshape(-1, 3), np.arange(values.size // 3, dtype=np.int32).reshape(-1, 3))
    raise SceneError(f"normals: shape [n, 3] or [m, 3, 3] expected, got {list(values.shape)}")


def primitive_count(geometry: Mesh | Shapes) -> int:
    """Return the number of triangles of a mesh, or of shapes."""
    return len(geometry.triangles if isinstance(geometry, Mesh) else geometry.points)


def local_bounds(geometry: Mesh | Shapes) -> np.ndarray:
    """Return the box of a mesh's triangles, or of shapes: float64, shape [2, 3]; NaN where there are none."""
    if not primitive_count(geometry):
        return np.full((2, 3), np.nan)
    if isinstance(geometry, Shapes):
        low, high = shape_boxes(geometry)
        return np.array([low.min(axis=0), high.max(axis=0)])
    is_used = np.zeros(len(geometry.points), bool)
    is_used[geometry.triangles.reshape(-1)] = True
    return point_bounds(geometry.points if is_used.all() else geometry.points[is_used])


def local_boxes(geometry: Sequence[Mesh | Shapes]) -> np.ndarray:
    """Return the box of each mesh's triangles, or of shapes: float64, shape [n, 2, 3]; NaN where there are none."""
    boxes = np.full((len(geometry), 2, 3), np.nan)
    small: list[int] = []
    for row, one in enumerate(geometry):
        if isinstance(one, Mesh) and 0 < len(one.triangles) < _SMALL and len(one.points) < _SMALL:
            small.append(row)
        else:
            boxes[row] = local_bounds(one)
    for first in range(0, len(small), _SMALL):
        rows = small[first : first + _SMALL]
        meshes = [one for one in (geometry[row] for row in rows) if isinstance(one, Mesh)]
        points = np.concatenate([mesh.points for mesh in meshes])
        counts = np.array([len(mesh.points) for mesh in meshes])
        starts = np.cumsum(counts) - counts
        sides = np.repeat(starts, [len(mesh.triangles) for mesh in meshes])
        is_used = np.zeros(len(points), bool)
        is_used[np.concatenate([mesh.triangles for mesh in meshes]) + sides[:, None]] = True
        for side, (reduce, nothing) in enumerate(((np.minimum, np.inf), (np.maximum, -np.inf))):
            boxes[rows, side] = reduce.reduceat(np.where(is_used[:, None], points, np.float32(nothing)), starts)
    return boxes


def point_bounds(points: np.ndarray) -> np.ndarray:
    """Return the box of points, float64, shape [2, 3].

    Args:
        points: shape [n, 3], n >= 1.
    """
    # Rows of 32 points at once: twenty times as fast as reducing rows of three.
    whole = len(points) // 32 * 32
    rows = np.ascontiguousarray(points[:whole]).reshape(-1, 96)
    rest = points[whole:]
    reduced = [np.concatenate([f(rows, axis=0).reshape(32, 3), rest]) if whole else rest for f in (np.min, np.max)]
    return np.array([reduced[0].min(axis=0), reduced[1].max(axis=0)], float)


def shape_boxes(shapes: Shapes) -> tuple[np.ndarray, np.ndarray]:
    """Return boxes around shapes, their lower and upper corners: float64, shape [n, 3] each.

    They are tight but for cubic tubes, whose box is that of the balls about their control points.
    """
    points, radii = shapes.points.astype(float), shapes.radii.astype(float)[:, :, None]
    if shapes.kind == ShapeKind.FRUSTUM:
        # A disk reaches as far along an axis as its radius by the sine of its normal's angle to that.
        along = points[:, 1] - points[:, 0]
        length = np.linalg.norm(along, axis=1, keepdims=True)
        cosine = np.divide(along, length, out=np.zeros_like(along), where=length > 0)
        radii = radii * np.sqrt(np.maximum(1 - cosine**2, 0))[:, None]
    return (points - radii).min(axis=1), (points + radii).max(axis=1)


def is_closed(triangles: np.ndarray) -> bool:
    """Return whether a triangle mesh is closed: each directed edge is matched by just as many opposite ones.

    Args:
        triangles: Vertex indices, shape [m, 3]. Vertices that merely coincide count as different ones.
    """
    if not len(triangles):
        return False
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).astype(np.int64)
    edges = edges[edges[:, 0] != edges[:, 1]]
    key = edges.min(axis=1) * (int(triangles.max()) + 1) + edges.max(axis=1)
    _, edge = np.unique(key, return_inverse=True)
    balance = np.bincount(edge.reshape(-1), weights=np.where(edges[:, 0] < edges[:, 1], 1.0, -1.0))
    return bool((balance == 0).all())
