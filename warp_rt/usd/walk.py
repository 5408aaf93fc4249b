# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The stage walk: from prims to a group of placed meshes, lights and cameras.

Prims are visited once, on an explicit stack. What native instances and PointInstancers repeat is walked once too, as
a group of its own, and then copied with its matrices: a walk through instance proxies would take a thousand times
as long.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field, replace

import numpy as np
from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdSemantics, Vt

from warp_rt.errors import LimitError
from warp_rt.report import Report
from warp_rt.scene import Mesh, Shapes
from warp_rt.usd import curves, implicit
from warp_rt.usd.attribute_values import AttributeReader, shown
from warp_rt.usd.draw_modes import StandInReader, card_visibility, draw_mode, inherited_card_visibility, is_replaced
from warp_rt.usd.lights import is_light
from warp_rt.usd.materials import MaterialReader
from warp_rt.usd.mesh import INVALID_VALUE, MeshSource, read_mesh
from warp_rt.usd.placement import MAX_INSTANCES, Group, GroupBuilder, PlacedPrim, Values
from warp_rt.usd.point_instancer import BAD_PROTOTYPE, is_regular, read_point_instances
from warp_rt.usd.primvars import inherited_constants, read_constants
from warp_rt.usd.skinning import REST_POSE, Skin, SkinReader
from warp_rt.usd.stage import error_text
from warp_rt.usd.tet_mesh import read_tet_mesh

BAD_TRANSFORM = "W105"
CYCLE = "W123"
UNSUPPORTED = "W130"
UNSUPPORTED_SCHEMA = "W133"
UNLOADED = "N906"
UNKNOWN_TYPE = "N911"

MAX_PRIMS = 10_000_000
MAX_DEPTH = 256  # of namespace
MAX_NESTING = 64  # of instances within instances

# Unloaded prims are met, for they are told; nothing of them is drawn.
_SHOWN = Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimIsDefined & ~Usd.PrimIsAbstract)
_RESET = "!resetXformStack!"
_IDENTITY = Gf.Matrix4d(1)
# A prototype may be a class or stand below an over, neither of which is drawn by itself.
_SHOWN_IN_PROTOTYPE = Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimHasDefiningSpecifier)
_NOT_GEOMETRY = ("SkelRoot", "Skeleton")
# Relationships that hold for all prims below.
_HANDED_DOWN = ("material:binding", "skel:skeleton", "skel:animationSource")
_PURPOSES = ("default", "render", "proxy", "guide")
_RENDER_TYPES = ("RenderSettings", "RenderPass")
# What applied schemas would change, and what happens instead.
_IGNORED_SCHEMAS = {
    "LODRootAPI": "all levels of detail are drawn",
    "VisibilityAPI": "the visibility of single purposes does not count",
    "ColorSpaceAPI": "colours are read as linear Rec. 709",
}


@dataclass(frozen=True)
class TypeTraits:
    """What a prim type takes part in."""

    is_imageable: bool
    is_xformable: bool
    is_boundable: bool
    is_known: bool


@dataclass(frozen=True)
class Context:
    """What a prim has from those above it."""

    matrix: np.ndarray
    """float64, shape [4, 4], group from parent."""
    world_from_group: np.ndarray
    """float64, shape [4, 4]; within a PointInstancer's prototype, the world is that prototype's space."""
    path_length: int
    """Length of the path that the group's names leave out."""
    tail_start: int
    """Length of the path of the innermost instance; 0: none, or a prototype that stands elsewhere."""
    predicate: object
    """Which children are visited."""
    purpose: str = ""
    """Purpose authored above; empty: none."""
    primvars: list[UsdGeom.Primvar] = field(default_factory=list)
    """Constant primvars authored above."""
    constants: Values = field(default_factory=dict)
    """Their values."""
    draw_mode: str = "default"
    card_visibility: str = "full"
    is_skinned: bool = False
    """Whether a SkelRoot is above."""
    depth: int = 0


@dataclass(frozen=True)
class Limits:
    """Bounds that a stage may not exceed."""

    instances: int = MAX_INSTANCES
    prims: int = MAX_PRIMS
    depth: int = MAX_DEPTH
    nesting: int = MAX_NESTING


class StageWalk:
    """Walks a stage once.

    Args:
        stage: What is walked.
        time: When attributes are read.
        purposes: Those that are drawn.
        materials: Gives the material of each prim.
        report: Takes the diagnostics.
        limits: Raise LimitError when exceeded.
        level: Refinements of subdivision surfaces.
        has_draw_modes: Whether models are replaced as their draw modes say.
    """

    def __init__(
        self,
        stage: Usd.Stage,
        time: Usd.TimeCode,
        purposes: frozenset[str],
        materials: MaterialReader,
        report: Report,
        limits: Limits | None = None,
        level: int = 0,
        has_draw_modes: bool = True,
    ) -> None:
        self.meshes: list[Mesh | Shapes] = []
        self.prims: list[str] = []
        self.tail_starts: list[int] = []
        """Where, in each of these paths, what belongs to the innermost instance begins: see ``Context``."""
        self.labels: dict[str, dict[str, tuple[str, ...]]] = {}
        self.render_prims: list[str] = []
        """Paths of the RenderSettings and RenderPass prims."""
        self.material_sets: dict[tuple[int, ...], int] = {}
        self._stage = stage
        self._time = time
        self._purposes = purposes
        self._materials = materials
        self._report = report
        self._limits = limits or Limits()
        self._level = level
        self._has_draw_modes = has_draw_modes
        self._stand_ins = StandInReader(stage, time, materials, report)
        self._transforms = UsdGeom.XformCache(time)
        self._skins = SkinReader(time)
        self._mesh_primvars: list[frozenset[str]] = []
        self._prim_rows: dict[tuple[str, int], int] = {}
        self._sources: dict[Sdf.Path, tuple[int, MeshSource] | None] = {}
        self._shapes: dict[tuple[object, ...], int] = {}
        self._traits: dict[str, TypeTraits] = {}
        self._bindings: dict[Sdf.Path, tuple[object, ...]] = {}
        self._groups: dict[tuple[object, ...], GroupBuilder | None] = {}
        self._open_prototypes: list[Sdf.Path] = []
        self._nesting = 0
        self._visited = 0
        self._is_absolute = False  # whether the group being walked has met !resetXformStack!

    def walk(self) -> Group:
        """Return all that the stage draws, in world space."""
        context = Context(np.eye(4), np.eye(4), path_length=0, tail_start=0, predicate=_SHOWN)
        return self._walk_group(list(self._stage.GetPseudoRoot().GetFilteredChildren(_SHOWN)), context).build()

    def _walk_group(self, roots: list[Usd.Prim], context: Context) -> GroupBuilder:
        builder = GroupBuilder(self._mesh_primvars, self._limits.instances)
        self._nesting += 1
        if self._nesting > self._limits.nesting:
            raise LimitError(f"{roots[0].GetPath()}: instances nested more than {self._limits.nesting} deep")
        pending = [(prim, context) for prim in reversed(roots)]
        while pending:
            prim, inherited = pending.pop()
            self._visited += 1
            if self._visited > self._limits.prims:
                raise LimitError(f"{prim.GetPath()}: the stage holds more than {self._limits.prims} prims")
            try:
                passed_on = self._visit(prim, inherited, builder)
            except Tf.ErrorException as error:
                self._report.warn(BAD_TRANSFORM, prim.GetPath(), f"left out with all below it: {error_text(error)}")
                continue
            if passed_on is None:
                continue
            children = prim.GetFilteredChildren(passed_on.predicate)
            if children and passed_on.depth > self._limits.depth:
                raise LimitError(f"{prim.GetPath()}: prims nested more than {self._limits.depth} deep")
            if children:
                passed_on = self._below(prim, passed_on)
            pending.extend((child, passed_on) for child in reversed(children))
        self._nesting -= 1
        return builder

    def _visit(self, prim: Usd.Prim, above: Context, builder: GroupBuilder) -> Context | None:
        """Add what a prim draws to the group; return what its children have from it, None to leave them out."""
        if not prim.IsLoaded():
            self._report.warn(UNLOADED, prim.GetPath(), "its payload is not loaded: left out with all below it")
            return None
        time = self._time
        kind = str(prim.GetTypeName())
        traits = self._type_traits(prim, kind)
        purpose = above.purpose
        if traits.is_imageable:
            visibility = prim.GetAttribute("visibility").Get(time)
            if visibility == "invisible":
                return None
            if visibility not in ("inherited", None):
                message = f"visibility is {shown(visibility)}, neither inherited nor invisible: drawn"
                self._report.warn(INVALID_VALUE, prim.GetPath(), message)
            if prim.GetAttribute("purpose").HasAuthoredValue():
                purpose = AttributeReader(prim, time, INVALID_VALUE, self._report).token("purpose", purpose, _PURPOSES)
        matrix = self._matrix(prim, above) if traits.is_xformable else above.matrix
        if matrix is None:
            return None
        here = replace(
            above,
            matrix=matrix,
            purpose=purpose,
            depth=above.depth + 1,
            is_skinned=above.is_skinned or kind == "SkelRoot",
        )
        is_model = self._has_draw_modes and prim.IsModel()
        if is_model:
            mode = draw_mode(prim, above.draw_mode, self._report)
            here = replace(here, draw_mode=mode, card_visibility=card_visibility(prim, above.card_visibility))
        if kind == "SkelRoot" and not above.is_skinned:
            self._skins.enter(prim, here.predicate)
        self._read_schemas(prim)
        is_shown = (purpose or UsdGeom.Tokens.default_) in self._purposes
        if is_model and is_replaced(prim, here.draw_mode):
            if is_shown:
                self._add_stand_in(prim, here, builder)
            return None
        if is_light(prim):
            builder.add_light(PlacedPrim(prim, matrix, self._name(prim, here)))
        elif kind == "Camera":
            builder.add_camera(PlacedPrim(prim, matrix, self._name(prim, here)))
        elif kind in _RENDER_TYPES:
            self.render_prims.append(str(prim.GetPath()))
        elif not traits.is_known:
            self._report.warn(UNKNOWN_TYPE, prim.GetPath(), f"the type {kind} is unknown to USD: left out")
        if kind in ("Mesh", "TetMesh", *curves.TYPES):
            if is_shown:
                self._add_mesh(prim, here, builder)
        elif kind in implicit.TYPES:
            if is_shown:
                self._add_shape(prim, here, builder)
        elif kind == "PointInstancer":
            if is_shown:
                self._add_point_instances(prim, self._below(prim, here), builder)
            return None  # prototypes are often its children, and are not drawn by themselves
        elif traits.is_boundable and is_shown and kind not in _NOT_GEOMETRY and not is_light(prim):
            self._report.warn(UNSUPPORTED, prim.GetPath(), f"{kind} is not supported yet: left out")
        if prim.IsInstance():
            self._add_native_instance(prim, self._below(prim, here), builder)
            return None
        return here

    def _below(self, prim: Usd.Prim, context: Context) -> Context:
        """Return the context with the primvars that a prim passes on."""
        primvars = UsdGeom.PrimvarsAPI(prim).FindIncrementallyInheritablePrimvars(context.primvars)
        if not primvars:
            return context
        return replace(context, primvars=primvars, constants=inherited_constants(primvars, self._time, self._report))

    # --- geometry

    def _add_mesh(self, prim: Usd.Prim, context: Context, builder: GroupBuilder) -> None:
        skin = self._read_skin(prim) if context.is_skinned else None
        # Instances of a mesh share it, but each skeleton makes another one of it.
        shared = prim.GetPrimInPrototype() if prim.IsInstanceProxy() and skin is None else prim
        key = shared.GetPath()
        if key not in self._sources:
            if prim.GetTypeName() in curves.TYPES:
                source = curves.read_shapes(prim, self._time, self._report, skin)
            elif prim.GetTypeName() == "TetMesh":
                source = read_tet_mesh(prim, self._time, self._report, skin)
            else:
                source = read_mesh(prim, self._time, self._report, skin=skin, level=self._level)
            self._sources[key] = None if source is None else (self._add(source.mesh), source)
        known = self._sources[key]
        if known is None:
            return
        row, source = known
        bound = (prim, *(prim.GetChild(name) for name in source.subsets))
        materials = tuple(self._materials.bind(part) for part in bound)
        own = source.mesh.primvars
        values = {name: value for name, value in context.constants.items() if name not in own}
        self._place(row, prim, _posed(context, skin), materials, values, builder)

    def _read_skin(self, prim: Usd.Prim) -> Skin | None:
        skin = self._skins.read(prim)
        if skin is None and _has_joints(prim):
            self._report.warn(REST_POSE, prim.GetPath(), "no skeleton moves its joints: drawn in its rest pose")
        return skin

    def _add_shape(self, prim: Usd.Prim, context: Context, builder: GroupBuilder) -> None:
        shape = implicit.read_shape(prim, self._time, self._report)
        if shape is None:
            return
        if shape.key not in self._shapes:
            self._shapes[shape.key] = self._add(implicit.make_shape(shape.key))
        values = {**context.constants, **read_constants(prim, self._time, self._report)}
        posed = _posed(context, self._read_skin(prim) if context.is_skinned else None)
        sized = replace(posed, matrix=posed.matrix @ shape.local_from_unit)
        self._place(self._shapes[shape.key], prim, sized, (self._materials.bind(prim),), values, builder)

    def _add_stand_in(self, prim: Usd.Prim, context: Context, builder: GroupBuilder) -> None:
        stand_in = self._stand_ins.read(prim, context.draw_mode, context.card_visibility)
        if stand_in is None:
            return
        if stand_in.key not in self._shapes:
            self._shapes[stand_in.key] = self._add(stand_in.geometry)
        values = {"displayColor": stand_in.color}
        self._place(self._shapes[stand_in.key], prim, context, stand_in.materials, values, builder)

    def _add(self, mesh: Mesh | Shapes) -> int:
        self.meshes.append(mesh)
        self._mesh_primvars.append(frozenset(mesh.primvars))
        return len(self.meshes) - 1

    def _place(
        self,
        mesh: int,
        prim: Usd.Prim,
        context: Context,
        materials: tuple[int, ...],
        values: Values,
        builder: GroupBuilder,
    ) -> None:
        path = str(prim.GetPath())
        row = self._prim_rows.setdefault((path, context.tail_start), len(self.prims))
        if row == len(self.prims):
            self.prims.append(path)
            self.tail_starts.append(context.tail_start)
        material_set = self.material_sets.setdefault(materials, len(self.material_sets))
        builder.add_mesh(mesh, context.matrix, material_set, row, values)

    # --- instances

    def _add_native_instance(self, prim: Usd.Prim, context: Context, builder: GroupBuilder) -> None:
        """Copy the group of an instance's prototype.

        The prototype is walked through the first instance that shows it; others share its group if all that they
        hand down is the same: the purpose, the draw mode and the materials. (Primvars they hand down are kept apart
        by copy.)
        """
        bindings = self._handed_down_bindings(prim)
        # Below a SkelRoot each instance has a pose of its own.
        pose = prim.GetPath() if context.is_skinned else None
        style = (context.purpose, context.draw_mode, context.card_visibility)
        key = (prim.GetPrototype().GetPath(), style, pose, bindings)
        group = self._groups.get(key)
        if group is None:
            world_from_group = context.world_from_group @ context.matrix
            inside = replace(
                context,
                matrix=np.eye(4),
                world_from_group=world_from_group,
                path_length=len(str(prim.GetPath())),
                tail_start=len(str(prim.GetPath())),
                primvars=[],
                constants={},
            )
            was_absolute, self._is_absolute = self._is_absolute, False
            group = self._walk_group(list(prim.GetFilteredChildren(context.predicate)), inside)
            # A prim that leaves its parents' transforms stands still while instances move: nothing to share.
            self._groups[key] = None if self._is_absolute else group
            self._is_absolute = self._is_absolute or was_absolute
        builder.add_copy(group, context.matrix, self._name(prim, context), context.constants)

    def _add_point_instances(self, prim: Usd.Prim, context: Context, builder: GroupBuilder) -> None:
        instances = read_point_instances(prim, self._time, self._report)
        name = self._name(prim, context)
        for row, path in enumerate(instances.prototypes):
            chosen = np.flatnonzero(instances.prototype == row)
            if not len(chosen):
                continue
            group = self._prototype_group(prim, path, context)
            if group is None:
                continue
            is_below = path.HasPrefix(prim.GetPath())
            inherited = context.constants if is_below else {}
            builder.add_copies(
                group,
                context.matrix @ instances.matrices[chosen],
                [f"{name}[{index}]" for index in instances.index[chosen]],
                {key: np.tile(value, (len(chosen), 1)) for key, value in inherited.items()},
                {key: values[chosen] for key, values in instances.values.items()},
            )

    def _prototype_group(self, instancer: Usd.Prim, path: Sdf.Path, context: Context) -> GroupBuilder | None:
        """Return the group of a PointInstancer's prototype, its root's own transform included."""
        prototype = self._stage.GetPrimAtPath(path)
        if not prototype or not prototype.IsActive():
            self._report.warn(BAD_PROTOTYPE, instancer.GetPath(), f"the prototype {path} is no prim that can be drawn")
            return None
        if path in self._open_prototypes:
            self._report.warn(CYCLE, instancer.GetPath(), f"the prototype {path} contains this instancer: left out")
            return None
        key = (path, context.purpose)
        group = self._groups.get(key)
        if group is None:
            parent = prototype.GetParent()
            is_below = path.HasPrefix(instancer.GetPath())
            primvars = (
                UsdGeom.PrimvarsAPI(parent).FindInheritablePrimvars() if parent.IsValid() and not is_below else []
            )
            inside = Context(
                matrix=np.eye(4),
                world_from_group=np.eye(4),
                path_length=len(str(path)),
                tail_start=len(str(instancer.GetPath())) if is_below else 0,
                predicate=_SHOWN_IN_PROTOTYPE,
                purpose=context.purpose,
                primvars=primvars,
                constants=inherited_constants(primvars, self._time, self._report),
                draw_mode=draw_mode(parent, "", self._report) if parent else "default",
                card_visibility=inherited_card_visibility(parent),
            )
            was_absolute, self._is_absolute = self._is_absolute, False
            self._open_prototypes.append(path)
            group = self._groups[key] = self._walk_group([prototype], inside)
            self._open_prototypes.pop()
            self._is_absolute = was_absolute
        return group

    def _handed_down_bindings(self, prim: Usd.Prim) -> tuple[object, ...]:
        """Return what material and skeleton bindings on a prim and above it say, so that equal ones compare equal."""
        chain = []
        while prim and not prim.IsPseudoRoot() and prim.GetPath() not in self._bindings:
            chain.append(prim)
            prim = prim.GetParent()
        said = self._bindings[prim.GetPath()] if prim and not prim.IsPseudoRoot() else ()
        for prim in reversed(chain):
            authored = (prim.GetAuthoredPropertiesInNamespace(name) for name in ("material", "skel"))
            for relationship in itertools.chain.from_iterable(authored):
                name = relationship.GetName()
                if not name.startswith(_HANDED_DOWN) or not isinstance(relationship, Usd.Relationship):
                    continue
                strength = relationship.GetMetadata("bindMaterialAs")
                said = (*said, (name, tuple(relationship.GetForwardedTargets()), strength))
                if name.startswith("material:binding:collection:"):
                    # Which prims a collection holds goes by their paths, so that instances may differ.
                    said = (*said, prim.GetPath())
            self._bindings[prim.GetPath()] = said
        return said

    def _name(self, prim: Usd.Prim, context: Context) -> str:
        return str(prim.GetPath())[context.path_length :]

    # --- what prims say

    def _matrix(self, prim: Usd.Prim, above: Context) -> np.ndarray | None:
        """Return group-from-local, or None, with a diagnostic, where nothing below could be drawn."""
        self._check_operations(prim)
        local, resets = self._transforms.GetLocalTransformation(prim)
        if not resets and local == _IDENTITY:
            return above.matrix
        parent_from_local = np.array(local).T
        if not is_regular(parent_from_local[None])[0]:
            self._report.warn(
                BAD_TRANSFORM, prim.GetPath(), "left out with all below it: its transform is singular or not finite"
            )
            return None
        if resets:
            self._is_absolute = True
            return np.linalg.inv(above.world_from_group) @ parent_from_local
        return above.matrix @ parent_from_local

    def _check_operations(self, prim: Usd.Prim) -> None:
        """Report entries of ``xformOpOrder`` that USD passes over because there is no such operation."""
        order = prim.GetAttribute("xformOpOrder").Get()
        if order is None:
            return
        if not isinstance(order, Vt.TokenArray):
            self._report.warn(BAD_TRANSFORM, prim.GetPath(), f"not moved: xformOpOrder is {shown(order)}")
            return
        for index in range(len(order)):  # a Vt array's own iterator takes ten times as long
            name = order[index]
            if name != _RESET and not prim.HasAttribute(name.removeprefix("!invert!")):
                self._report.warn(BAD_TRANSFORM, prim.GetPath(), f"moved without {name}, which it does not have")

    def _type_traits(self, prim: Usd.Prim, kind: str) -> TypeTraits:
        traits = self._traits.get(kind)
        if traits is None:
            traits = TypeTraits(
                is_imageable=prim.IsA(UsdGeom.Imageable),
                is_xformable=prim.IsA(UsdGeom.Xformable),
                is_boundable=prim.IsA(UsdGeom.Boundable),
                is_known=not kind or not prim.GetPrimTypeInfo().GetSchemaType().isUnknown,
            )
            self._traits[kind] = traits
        return traits

    def _read_schemas(self, prim: Usd.Prim) -> None:
        has_labels = False
        for schema in prim.GetAppliedSchemas():
            has_labels = has_labels or schema.startswith("SemanticsLabelsAPI:")
            if schema in _IGNORED_SCHEMAS:
                self._report.warn(
                    UNSUPPORTED_SCHEMA, prim.GetPath(), f"{schema} is not supported: {_IGNORED_SCHEMAS[schema]}"
                )
        if has_labels:
            self._read_labels(prim)

    def _read_labels(self, prim: Usd.Prim) -> None:
        found = {}
        for taxonomy in UsdSemantics.LabelsAPI.GetDirectTaxonomies(prim):
            labels = UsdSemantics.LabelsAPI(prim, taxonomy).GetLabelsAttr().Get(self._time)
            if labels:
                found[str(taxonomy)] = tuple(str(label) for label in labels)
        if found:
            self.labels[str(prim.GetPath())] = found


def _posed(context: Context, skin: Skin | None) -> Context:
    """Return the context of a prim that joints may move as a whole."""
    if skin is None or not skin.is_rigid:
        return context
    return replace(context, matrix=context.matrix @ skin.local_from_rest())


def _has_joints(prim: Usd.Prim) -> bool:
    return UsdGeom.PrimvarsAPI(prim).HasPrimvar("skel:jointIndices")
