# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""The stage walk: from prims to a group of what is drawn, lights and cameras.

Prims are visited once, on an explicit stack, and asked for no more than they author: that is what a stage of a hundred
thousand of them takes its time for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pxr import Tf, Usd, UsdSkel

from warp_rt.errors import LimitError
from warp_rt.report import Report
from warp_rt.usd import geometry, implicit
from warp_rt.usd.context import (
    COMPLEXITY,
    SHOWN,
    Context,
    apply_schemas,
    hand_down,
    has_unusual_children,
    own_level,
    own_purpose,
)
from warp_rt.usd.draw_modes import DRAWN_HOW, StandInReader, card_visibility, draw_mode, is_replaced
from warp_rt.usd.gprims import GprimReader
from warp_rt.usd.not_inherited import report_not_inherited
from warp_rt.usd.placement import MAX_INSTANCES, GroupBuilder, PlacedPrim
from warp_rt.usd.primvars import Values, read_constants
from warp_rt.usd.property_checks import ASKED_FOR_PROPERTIES, report_properties
from warp_rt.usd.prototypes import Prototypes
from warp_rt.usd.questions import (
    get_filtered_children,
    get_name,
    get_path,
    get_type_name,
    has_authored_metadata,
    is_instance,
    is_loaded,
    is_model,
)
from warp_rt.usd.schemas import FOREIGN, read_labels, report_ignored, report_meaningless
from warp_rt.usd.skinning import REST_POSE, Skin, SkinReader
from warp_rt.usd.sources import report_unreadable
from warp_rt.usd.stage import UNLOADED, report_missing_clips
from warp_rt.usd.subsets import report_misplaced
from warp_rt.usd.traits import RENDER_TYPES, SKINNING, Traits, TraitsReader
from warp_rt.usd.transforms import TransformReader
from warp_rt.usd.unknown_names import UnknownNameReporter, nearest_type
from warp_rt.usd.unused_selections import report_not_looked_for, report_unused_selections
from warp_rt.usd.visibility import is_invisible

UNSUPPORTED = "W130"
UNKNOWN_TYPE = "N911"

MAX_PRIMS = 10_000_000
MAX_DEPTH = 256  # of namespace
MAX_NESTING = 64  # of instances within instances
ASKED_FOR_METADATA = 10_000  # prims; of more, asking each takes a fifteenth of the time that loading it does

_NOT_GEOMETRY = ("SkelRoot", "Skeleton")
_IDENTITY = np.eye(4)


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
        gprims: Lists the prims that are drawn.
        stand_ins: Makes what models are replaced by, as their draw modes say; None: they are not.
        report: Takes the diagnostics.
        limits: Raise LimitError when exceeded.
        base_time: See ``read_times``; None: ``time``.
    """

    def __init__(
        self,
        stage: Usd.Stage,
        time: Usd.TimeCode,
        purposes: frozenset[str],
        gprims: GprimReader,
        stand_ins: StandInReader | None,
        report: Report,
        limits: Limits | None = None,
        base_time: Usd.TimeCode | None = None,
    ) -> None:
        self.labels: dict[str, dict[str, tuple[str, ...]]] = {}
        self.render_prims: list[str] = []
        """Paths of the RenderSettings and RenderPass prims."""
        self._stage = stage
        self._time = time
        self._purposes = purposes
        self._gprims = gprims
        self._stand_ins = stand_ins
        self._report = report
        self._limits = limits or Limits()
        self._transforms = TransformReader(time, report)
        self._skins = SkinReader(time, report)
        self._traits = TraitsReader()
        self._unknown = UnknownNameReporter(report)
        self._prototypes = Prototypes(stage, time, report, time if base_time is None else base_time)
        self._nesting = 0
        self._visited = 0
        self._asks_all = True
        # Moments of a frame would tell what the frame tells.
        self._asked_for_properties = ASKED_FOR_PROPERTIES if base_time in (None, time) else 0

    def walk(self) -> GroupBuilder:
        """Return all that the stage draws, in world space."""
        context = Context(np.eye(4), path_length=0, tail_start=0, predicate=SHOWN)
        root = self._stage.GetPseudoRoot()
        self._unknown.add_metadata(root)
        group = self._walk_group(root.GetFilteredChildren(SHOWN), context)
        self._unknown.finish()
        return group

    def _walk_group(self, roots: Sequence[Usd.Prim], context: Context) -> GroupBuilder:
        builder = GroupBuilder(self._limits.instances)
        self._nesting += 1
        if self._nesting > self._limits.nesting:
            raise LimitError(f"{roots[0].GetPath()}: instances nested more than {self._limits.nesting} deep")
        if roots:
            context = context._replace(is_proxy=roots[0].IsInstanceProxy())
        folder = str(get_path(roots[0]).GetParentPath()).rstrip("/") + "/" if roots else ""
        pending = [(iter(roots), folder, context, _IDENTITY, True)]
        while pending:
            siblings, folder, above, place, may_be_unusual = pending[-1]
            for prim in siblings:
                # USD takes ten times as long to make a path's text, and keeps it.
                path = folder + get_name(prim)
                self._visited += 1
                if self._visited > self._limits.prims:
                    raise LimitError(f"{path}: the stage holds more than {self._limits.prims} prims")
                try:
                    below = self._visit(prim, path, above, place, may_be_unusual, builder)
                except Tf.ErrorException as error:
                    report_unreadable(prim, error, self._report, "left out with all below it")
                    continue
                if below is None:
                    continue
                if path.count("/") > self._limits.depth:
                    raise LimitError(f"{path}: prims nested more than {self._limits.depth} deep")
                children, passed_on, matrix = below
                pending.append((iter(children), path + "/", passed_on, matrix, has_unusual_children(prim)))
                break
            else:
                pending.pop()
        self._nesting -= 1
        return builder

    def _visit(
        self, prim: Usd.Prim, path: str, above: Context, place: np.ndarray, may_be_unusual: bool, builder: GroupBuilder
    ) -> tuple[Sequence[Usd.Prim], Context, np.ndarray] | None:
        """Add what a prim draws to the group.

        Args:
            prim: The prim.
            path: Its path.
            above: What it has from those above it.
            place: Group from parent, float64, shape [4, 4].
            may_be_unusual: Whether it may be an instance, a model or not loaded.
            builder: The group.

        Returns:
            The children that are visited, what they have from it, and group from prim; None: there are none.
        """
        if may_be_unusual and not is_loaded(prim):
            self._report.warn(UNLOADED, get_path(prim), "its payload is not loaded: left out with all below it")
            return None
        if may_be_unusual or self._visited <= ASKED_FOR_METADATA:
            report_unused_selections(prim, self._report)
            self._unknown.add_metadata(prim)
        elif self._asks_all:
            self._asks_all = False
            report_not_looked_for(prim, ASKED_FOR_METADATA, self._report)
        has_own_clips = has_authored_metadata(prim, "clips")
        traits = self._traits.read(prim, above.has_clips or has_own_clips)
        self._check_properties(prim, traits)
        is_ordinary = (
            traits.is_ordinary
            and not (may_be_unusual or above.is_skinned)
            and above.lod_items is None
            and not has_own_clips
        )
        here = above
        if not is_ordinary:
            if above.lod_items is not None:
                here = above._replace(lod_items=None)  # a level of detail is drawn by choice, whatever its visibility
            elif self._is_hidden(prim, traits, above, builder):
                return None
        matrix = place
        if traits.is_moved:
            local = self._transforms.read(prim, traits.authored)
            if local is None:
                return None
            matrix, resets = local
            if resets:
                builder.is_absolute = True
                matrix = np.linalg.inv(above.world_from_group) @ matrix
            elif place is not _IDENTITY:
                matrix = place.dot(matrix)
        skin = None
        if not is_ordinary:
            heeded = self._heed(prim, path, traits, here, has_own_clips, matrix, may_be_unusual, builder)
            if heeded is None:
                return None
            here, skin = heeded
        is_an_instance = may_be_unusual and is_instance(prim)
        children = get_filtered_children(prim, here.predicate) if here.lod_items is None else here.children(prim)
        passed_on = here
        has_heirs = is_an_instance or traits.is_instancer or bool(children)
        if traits.hands_down and (has_heirs or traits.authored.bindings):
            passed_on = hand_down(prim, here, traits.authored, has_heirs, self._time, self._report)
            if has_heirs and "primvars:normals" in traits.authored.names:
                report_not_inherited(prim, self._report)
        if traits.is_instancer:
            if (here.purpose or "default") not in here.hidden_purposes:  # else prototypes may have their own
                # Handed over here, for what the walk holds must not hold the walk, and with it the stage.
                walks = self._walk_group, self._check_in_passing
                self._prototypes.add_point_instances(prim, passed_on, _posed(matrix, skin), builder, *walks)
            return None  # prototypes are often its children, and are not drawn by themselves
        if traits.type.is_boundable and self._is_shown(here):
            if traits.is_geometry:
                row = self._gprims.add(prim, path, traits.type.name, passed_on, traits.authored, skin, bool(children))
                builder.add_gprim(row, matrix if skin is None else _posed(matrix, skin), here.constants)
            else:
                self._draw_other(prim, path, traits, _posed(matrix, skin), here.constants, passed_on, builder)
        if is_an_instance:
            self._prototypes.add_native_instance(prim, path, passed_on, matrix, builder, self._walk_group)
            return None
        return (children, passed_on, matrix) if children else None

    def _check_properties(self, prim: Usd.Prim, traits: Traits) -> None:
        """Report what a prim's properties say in vain."""
        if traits.unknown_properties or traits.unknown_schemas:
            self._unknown.add(prim, traits.type, traits.unknown_properties, traits.unknown_schemas)
        if self._visited <= self._asked_for_properties:
            report_properties(prim, traits.type, self._unknown, self._report)

    def _check_in_passing(self, prim: Usd.Prim) -> None:
        """Report what a prim that is not visited says in vain."""
        self._unknown.add_metadata(prim)
        self._check_properties(prim, self._traits.read(prim, has_clips=False))

    def _is_hidden(self, prim: Usd.Prim, traits: Traits, above: Context, builder: GroupBuilder) -> bool:
        """Return whether a prim says that it is not seen, with all below it; its cameras are added all the same."""
        if "visibility" not in traits.authored.names or not traits.type.is_imageable:
            return False
        if not is_invisible(prim, self._time, self._report):
            return False
        self._add_unseen_cameras(prim, above, builder)
        return True

    def _heed(
        self,
        prim: Usd.Prim,
        path: str,
        traits: Traits,
        here: Context,
        has_own_clips: bool,
        matrix: np.ndarray,
        may_be_unusual: bool,
        builder: GroupBuilder,
    ) -> tuple[Context, Skin | None] | None:
        """Heed what few prims have.

        Args:
            prim: The prim.
            path: Its path.
            traits: Its own.
            here: What it has from those above it.
            has_own_clips: Whether it has value clips, which hold values of it and of all below it.
            matrix: Group from prim, float64, shape [4, 4].
            may_be_unusual: Whether it may be an instance or a model.
            builder: The group, to which lights, cameras and stand-ins of models are added.

        Returns:
            What its children have from it, bindings and primvars aside, and what deforms it; None: nothing else of it,
            or below it, is drawn.
        """
        above, names, prim_type, kind = here, traits.authored.names, traits.type, traits.type.name
        if not prim_type.is_xformable and not FOREIGN.isdisjoint(names):
            report_meaningless(prim, prim_type, names, self._time, self._report)
        if prim_type.is_imageable and "purpose" in names:
            here = here._replace(purpose=own_purpose(prim, above.purpose, self._time, self._report))
        if has_own_clips:
            here = here._replace(has_clips=True)
            report_missing_clips(prim, self._report)
        if kind == "SkelRoot" and not above.is_skinned:
            here = here._replace(is_skinned=True)
            self._skins.enter(prim, here.predicate)
        if COMPLEXITY in names:
            here = here._replace(level=own_level(prim, here.level, self._time, self._report))
        if prim_type.schemas:
            self._read_schemas(prim, prim_type.schemas)
            here = apply_schemas(prim, here, prim_type.schemas, self._time, self._report)
        if may_be_unusual and self._stand_ins is not None and is_model(prim):
            if not DRAWN_HOW.isdisjoint(names):
                here = here._replace(
                    draw_mode=draw_mode(prim, above.draw_mode, self._report),
                    card_visibility=card_visibility(prim, above.card_visibility, self._report),
                )
            if is_replaced(prim, here.draw_mode, self._report):
                if self._is_shown(here):
                    self._add_stand_in(prim, path, here, matrix, builder)
                self._add_unseen_cameras(prim, above, builder)
                return None
        skin = None
        if prim_type.is_boundable and kind not in _NOT_GEOMETRY and (prim_type.is_light or self._is_shown(here)):
            if here.is_skinned:
                skin = self._read_skin(prim)
            elif not names.isdisjoint(SKINNING):
                self._report.warn(REST_POSE, prim.GetPath(), "no SkelRoot poses it: drawn in its rest pose")
        if prim_type.is_light:
            builder.add_light(PlacedPrim(prim, _posed(matrix, skin), path[here.path_length :]))
        if kind == "Camera":
            builder.add_camera(PlacedPrim(prim, matrix, path[here.path_length :]))
        elif kind in RENDER_TYPES:
            self.render_prims.append(str(get_path(prim)))
        elif kind == "GeomSubset":
            report_misplaced(prim, traits.authored.bindings, self._report)
        elif not prim_type.is_known:
            near = nearest_type(kind)
            meant = f" (did you mean {near}?)" if near else ""
            message = f"USD has no prims of the type {kind}{meant}: it draws nothing itself"
            self._report.warn(UNKNOWN_TYPE, get_path(prim), message)
        return here, skin

    def _add_unseen_cameras(self, prim: Usd.Prim, above: Context, builder: GroupBuilder) -> None:
        """Add the cameras of a prim that is invisible or replaced, which one may look through all the same."""
        if above.predicate is not SHOWN:
            return  # a PointInstancer's prototype is no place to look from
        for camera in Usd.PrimRange(prim, SHOWN):
            if get_type_name(camera) == "Camera":
                matrix = np.linalg.inv(above.world_from_group) @ self._transforms.world_from_local(camera)
                builder.add_camera(PlacedPrim(camera, matrix, above.name(camera)))

    def _draw_other(
        self,
        prim: Usd.Prim,
        path: str,
        traits: Traits,
        matrix: np.ndarray,
        inherited: Values,
        passed_on: Context,
        builder: GroupBuilder,
    ) -> None:
        """Add a prim to the group that is none of ``geometry.TYPES``, if it has any geometry."""
        kind = traits.type.name
        if kind in implicit.TYPES:
            shape = implicit.read_shape(prim, self._time, self._report)
            if shape is not None:
                row = self._gprims.add_shape(prim, path, passed_on, shape)
                values = inherited
                if traits.authored.primvars:
                    values = {**values, **read_constants(prim, self._time, self._report)}
                builder.add_gprim(row, matrix @ shape.local_from_unit, values)
        elif kind not in _NOT_GEOMETRY and not traits.type.is_light:
            self._report.warn(UNSUPPORTED, get_path(prim), f"{kind} is not supported: left out")

    def _add_stand_in(
        self, prim: Usd.Prim, path: str, here: Context, matrix: np.ndarray, builder: GroupBuilder
    ) -> None:
        stand_in = self._stand_ins.read(prim, here.draw_mode, here.card_visibility) if self._stand_ins else None
        if stand_in is not None:
            row = self._gprims.add_stand_in(prim, path, here, stand_in)
            builder.add_gprim(row, matrix, {"displayColor": stand_in.color})

    def _is_shown(self, here: Context) -> bool:
        purpose = here.purpose or "default"
        return purpose in self._purposes and purpose not in here.hidden_purposes

    def _read_skin(self, prim: Usd.Prim) -> Skin | None:
        skin = self._skins.read(prim)
        why = ""
        if skin is None:
            has_joints, has_shapes = (prim.GetAttribute(name).HasAuthoredValue() for name in SKINNING)
            if (has_joints or has_shapes) and not UsdSkel.BindingAPI(prim).GetInheritedSkeleton():
                why = "no skeleton poses it"
            elif has_joints:
                why = "USD takes none of its joint influences"
        elif get_type_name(prim) not in geometry.TYPES and (skin.shapes or not skin.is_rigid):
            why = "joints and blend shapes cannot bend it, only move it as a whole"
        if why:
            self._report.warn(REST_POSE, get_path(prim), f"{why}: drawn in its rest pose")
        return skin

    def _read_schemas(self, prim: Usd.Prim, schemas: Sequence[str]) -> None:
        report_ignored(prim, schemas, self._report)
        labels = read_labels(prim, schemas, self._time, self._report)
        if labels:
            self.labels[str(get_path(prim))] = labels


def _posed(matrix: np.ndarray, skin: Skin | None) -> np.ndarray:
    """Return the transform of a prim that joints may move as a whole."""
    return matrix if skin is None or not skin.is_rigid else matrix @ skin.local_from_rest()
