# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The scene itself."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from warp_rt.errors import OptionError, SceneError
from warp_rt.report import Diagnostic
from warp_rt.scene.bounds import local_boxes
from warp_rt.scene.cameras import Camera
from warp_rt.scene.geometry import Instances, Mesh, Primvar, Shapes, is_closed
from warp_rt.scene.lights import Dome, Light
from warp_rt.scene.materials import Image, Material, MaterialModel, Texture
from warp_rt.scene.rows import check_rows
from warp_rt.scene.settings import Product, Settings

_BLOCK = 1 << 14  # instances at a time: what is computed on the way takes little memory


@dataclass(frozen=True)
class Scene:
    """Everything that a picture needs, and the record of what was left out."""

    meshes: tuple[Mesh | Shapes, ...]
    instances: Instances
    prims: tuple[str, ...] = ()
    """Path of each primId."""
    instance_paths: Sequence[str] = ()
    """Path of each instanceId: the native instance, or ``/Instancer[7]``."""
    object_from_local: Mapping[int, np.ndarray] = field(default_factory=dict)
    """By primId, where the space that programs know the prim by is not that of its mesh, as of shapes that share a unit
    shape: float64, shape [4, 4]."""
    labels: Mapping[str, Mapping[str, tuple[str, ...]]] = field(default_factory=dict)
    """Semantic labels: prim path to taxonomy to labels."""
    materials: tuple[Material, ...] = ()
    textures: tuple[Texture, ...] = ()
    images: tuple[Image, ...] = ()
    lights: tuple[Light, ...] = ()
    domes: tuple[Dome, ...] = ()
    cameras: tuple[Camera, ...] = ()
    settings: Settings = field(default_factory=Settings)
    """With what the first of ``products`` overrides."""
    products: tuple[Product, ...] = ()
    rendering_from_rec709: np.ndarray | None = None
    """Matrix from linear Rec. 709 to the primaries that colours of materials and lights are in, and that are rendered
    in: float64, shape [3, 3], white stays white. Settings and films are in Rec. 709 all the same. None: so is all."""
    up_axis: str = "Y"
    meters_per_unit: float = 0.01
    source: str = ""
    """File that the scene was read from, or empty."""
    time: float | None = None
    """Time code; None: the default time."""
    time_range: tuple[float, float] | None = None
    """First and last time code of the stage, between which frames are meant to be; None where it names none."""
    time_codes_per_second: float = 24.0
    diagnostics: tuple[Diagnostic, ...] = ()

    def __post_init__(self) -> None:
        """Refuse parts that do not fit each other.

        Raises:
            SceneError: An instance names a mesh, a material or a prim that is not there.
        """
        check_rows(self.instances, len(self.meshes), len(self.materials), len(self.prims))

    def __repr__(self) -> str:
        counts = {
            "meshes": sum(isinstance(mesh, Mesh) for mesh in self.meshes),
            "triangles": self.triangle_count,
            **({"shapes": self.shape_count} if self.shape_count else {}),
            "instances": len(self.instances),
            "materials": len(self.materials),
            "lights": len(self.lights) + len(self.domes),
            "cameras": len(self.cameras),
            **({"warnings": warnings} if (warnings := sum(record.is_warning for record in self.diagnostics)) else {}),
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
        boxes = local_boxes(self.meshes)
        found = np.full((2, 3), np.nan)
        for start in range(0, len(self.instances), _BLOCK):
            rows = slice(start, start + _BLOCK)
            local, matrix = boxes[self.instances.mesh[rows]], self.instances.world_from_local[rows]
            center, half = local.mean(axis=1), (local[:, 1] - local[:, 0]) / 2
            center = np.einsum("nij,nj->ni", matrix[:, :3, :3], center) + matrix[:, :3, 3]
            half = np.einsum("nij,nj->ni", np.abs(matrix[:, :3, :3]), half)
            found[0] = np.fmin(found[0], np.fmin.reduce(center - half))
            found[1] = np.fmax(found[1], np.fmax.reduce(center + half))
        return found

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
            SceneError: A shape or type is wrong, an index is out of range, or a number is not finite.
        """
        vertices = _numbers("points", points, np.float32)
        triangles = _numbers("faces", faces, np.int32)
        if vertices.ndim != 2 or vertices.shape[1] != 3 or not np.isfinite(vertices).all():
            raise SceneError(f"points: shape [n, 3] of finite numbers expected, got shape {list(vertices.shape)}")
        if triangles.ndim != 2 or triangles.shape[1] != 3:
            raise SceneError(f"faces: shape [m, 3] expected, got {list(triangles.shape)}")
        if len(triangles) and (triangles.min() < 0 or triangles.max() >= len(vertices)):
            raise SceneError(f"faces: an index is outside 0..{len(vertices) - 1}")
        matrix = np.eye(4) if world_from_local is None else _numbers("world_from_local", world_from_local, np.float64)
        if matrix.shape != (4, 4) or not np.isfinite(matrix).all() or np.linalg.det(matrix[:3, :3]) == 0:
            raise SceneError("world_from_local: an invertible 4 x 4 matrix expected")
        mesh = Mesh(vertices, triangles, _normals_primvar(normals, vertices, triangles), is_closed=is_closed(triangles))
        if not isinstance(material, Material | None):
            raise SceneError(f"material: a Material expected, got {type(material).__name__}")
        row = np.zeros(1, np.int32)
        return Scene(
            meshes=(mesh,) if len(triangles) else (),
            instances=Instances(row, matrix[None], row, row, row, row - 1)
            if len(triangles)
            else Instances(row[:0], matrix[None][:0], row[:0], row, row[:0], row[:0]),
            prims=("/mesh",),
            materials=(material or Material("/material", MaterialModel.WHITTED),),
            lights=_all_of("lights", lights, Light),
            cameras=_all_of("cameras", cameras, Camera),
            settings=settings or Settings(),
        )


def _numbers(name: str, values: Any, dtype: Any) -> np.ndarray:
    """Return numbers as a contiguous array of a type.

    Raises:
        SceneError: They are none, or no whole ones, within its range, where it has no others.
    """
    try:
        given = np.asarray(values)
    except ValueError:  # rows of different lengths
        given = np.array("rows")
    if given.dtype.kind not in "fiu":
        raise SceneError(f"{name}: numbers in rows of one length expected, got {type(values).__name__}")
    with np.errstate(invalid="ignore", over="ignore"):
        array = np.ascontiguousarray(given, dtype)
    if array.dtype.kind == "i" and array is not given and not np.array_equal(array, given):
        raise SceneError(f"{name}: whole numbers of 32 bits expected")
    return array


def _all_of(name: str, values: Any, kind: type) -> tuple[Any, ...]:
    """Return values of a kind.

    Raises:
        SceneError: They are no sequence of such.
    """
    found = tuple(values) if isinstance(values, Iterable) else (None,)
    if not all(isinstance(value, kind) for value in found):
        raise SceneError(f"{name}: a sequence of {kind.__name__} expected")
    return found


def _normals_primvar(normals: Any, vertices: np.ndarray, triangles: np.ndarray) -> Primvar | None:
    if normals is None:
        return None
    values = _numbers("normals", normals, np.float32)
    if not np.isfinite(values).all():
        raise SceneError("normals: every number must be finite")
    if values.shape == vertices.shape:
        return Primvar(values, triangles)
    if values.shape == (len(triangles), 3, 3):
        return Primvar(values.reshape(-1, 3), np.arange(values.size // 3, dtype=np.int32).reshape(-1, 3))
    raise SceneError(f"normals: shape [n, 3] or [m, 3, 3] expected, got {list(values.shape)}")


def check_scene(scene: Any) -> None:
    """Refuse what is no scene, such as the path of a file.

    Raises:
        OptionError: It is none.
    """
    if not isinstance(scene, Scene):
        raise OptionError(f"scene: a Scene expected, got {type(scene).__name__}; load_scene reads a file")
