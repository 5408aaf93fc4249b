# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What native instances and PointInstancers repeat: walked once, as a group of its own, and copied with its matrices.

A walk through instance proxies would take a thousand times as long.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdLux

from warp_rt.report import Report, first_of
from warp_rt.scene.instance_paths import NumberedPaths
from warp_rt.scene.instance_transforms import choose, nest
from warp_rt.usd.authored import AuthoredReader
from warp_rt.usd.bindings import read_bindings
from warp_rt.usd.context import SHOWN, SHOWN_IN_PROTOTYPE, Context, hand_down_primvars, handed_width, said_above
from warp_rt.usd.draw_modes import draw_mode, inherited_card_visibility
from warp_rt.usd.instance_bindings import SharedBindings
from warp_rt.usd.motion import read_times
from warp_rt.usd.not_inherited import report_widths_by_instance
from warp_rt.usd.placement import GroupBuilder
from warp_rt.usd.point_instancer import BAD_PROTOTYPE, read_point_instances
from warp_rt.usd.primvars import Values, constants_of_instances
from warp_rt.usd.stage import OUTSIDE_MASK, is_outside_mask

CYCLE = "W123"
IDLE_OPINION = "N922"
IDLE_CHILD = "N923"

_CHILDREN = "primChildren"  # field of a prim that a layer has, where that names some below it


WalkGroup = Callable[[Sequence[Usd.Prim], Context], GroupBuilder]
"""Returns the group of some prims and all below them."""


class Prototypes:
    """Adds the copies that instances make to groups.

    Args:
        stage: Of the instances.
        time: When they are read.
        report: Takes the diagnostics.
        base_time: See ``read_times``.
    """

    def __init__(self, stage: Usd.Stage, time: Usd.TimeCode, report: Report, base_time: Usd.TimeCode) -> None:
        self._stage = stage
        self._layers = stage.GetLayerStack()
        self._time = time
        self._base_time = base_time
        self._report = report
        self._groups: dict[tuple[object, ...], GroupBuilder] = {}
        self._shared_bindings = SharedBindings(stage)
        self._authored = AuthoredReader()
        self._open: list[Sdf.Path] = []

    def add_native_instance(
        self,
        prim: Usd.Prim,
        path: str,
        context: Context,
        matrix: np.ndarray,
        builder: GroupBuilder,
        walk_group: WalkGroup,
    ) -> None:
        """Copy the group of an instance's prototype.

        The prototype is walked through the first instance that shows it; others share its group if all that they
        hand down is the same: what of it is visited, value clips, purposes, the draw mode, levels of detail, the width
        of curves and the materials. (Primvars they hand down are kept apart by copy.)

        Args:
            prim: The instance.
            path: Its path.
            context: What its children have from it.
            matrix: Group from prim, float64, shape [4, 4].
            builder: Takes the copy.
            walk_group: Walks the prototype.
        """
        if not context.is_proxy:
            self._note_opinions_below(prim)
        if context.has_clips and prim.HasAuthoredMetadata("clips"):
            self._note_clips(prim)
        # Below a SkelRoot each instance has a pose of its own.
        pose = prim.GetPath() if context.is_skinned else None
        style = (
            *(context.predicate, context.has_clips),
            *(context.purpose, context.draw_mode, context.card_visibility),
            *(context.hidden_purposes, context.lod_override, context.lod_items, context.level),
            context.width,
        )
        key = (prim.GetPrototype().GetPath(), style, pose, self._shared_bindings.key(prim, context.bindings))
        group = self._groups.get(key)
        if group is None:
            inside = context._replace(
                world_from_group=context.world_from_group @ matrix,
                path_length=len(path),
                tail_start=len(path),
                primvars=(),
                constants={},
            )
            group = walk_group(context.children(prim), inside)
            if group.is_absolute:  # nothing to share, for something in it stands still while instances move
                builder.is_absolute = True
            else:
                self._groups[key] = group
        builder.add_copy(group, matrix, path[context.path_length :], context.constants)

    def add_point_instances(
        self,
        prim: Usd.Prim,
        context: Context,
        matrix: np.ndarray,
        builder: GroupBuilder,
        walk_group: WalkGroup,
        check: Callable[[Usd.Prim], None],
    ) -> None:
        """Copy the groups of a PointInstancer's prototypes.

        Args:
            prim: The instancer.
            context: What its children have from it.
            matrix: Group from prim, float64, shape [4, 4].
            builder: Takes the copies.
            walk_group: Walks the prototypes.
            check: Reports what a prim says in vain that no walk comes by.
        """
        times = read_times(prim, self._time, self._base_time, self._report)
        instances = read_point_instances(prim, *times, self._report)
        self._note_children(prim, instances.prototypes, check)
        if "widths" in instances.values:
            report_widths_by_instance(prim, instances.prototypes, self._report)
        name = context.name(prim)
        own = constants_of_instances(prim, self._time, self._report)  # of prototypes elsewhere too
        rows = np.argsort(instances.prototype, kind="stable")
        counts = np.bincount(instances.prototype, minlength=len(instances.prototypes))
        for path, end, count in zip(instances.prototypes, np.cumsum(counts), counts, strict=True):
            if not count:
                continue
            chosen = rows[end - count : end]
            group = self._instancer_group(prim, path, context, own, walk_group)
            if group is None:
                continue
            is_below = path.HasPrefix(prim.GetPath())
            inherited = {**context.constants, **own} if is_below else own
            is_only = len(chosen) == len(instances.matrices)
            builder.add_copies(
                group,
                nest(matrix[None], instances.matrices if is_only else choose(instances.matrices, chosen)),
                NumberedPaths(name, instances.index[chosen]),
                {key: np.tile(value, (len(chosen), 1)) for key, value in inherited.items()},
                {key: values[chosen] for key, values in instances.values.items()},
                is_sealed=not is_below,
            )

    def _note_opinions_below(self, instance: Usd.Prim) -> None:
        """Note what the stage's own layers say below an instance, which USD does not compose."""
        path = instance.GetPath()
        specs = [spec for layer in self._layers if (spec := layer.GetPrimAtPath(path)) and spec.HasInfo(_CHILDREN)]
        names = sorted({child.name for spec in specs for child in spec.nameChildren})
        if names:
            message = f"opinions about {', '.join(names)} below it do not count, for it is instanceable"
            self._report.warn(IDLE_OPINION, path, message)

    def _note_clips(self, instance: Usd.Prim) -> None:
        """Note value clips on an instance that hold values of prims below it, which USD does not give these."""
        clips = Usd.ClipsAPI(instance)
        for name, clip_set in (clips.GetClips() or {}).items():
            paths = clips.ComputeClipAssetPaths(name)
            layer = Sdf.Layer.FindOrOpen(paths[0].resolvedPath or paths[0].path) if paths else None
            root = layer.GetPrimAtPath(clip_set.get("primPath", "")) if layer else None
            if root and root.nameChildren:
                message = f"what its value clips ({name}) hold of prims below it does not count, for it is instanceable"
                self._report.warn(IDLE_OPINION, instance.GetPath(), message)

    def _note_children(
        self, instancer: Usd.Prim, prototypes: Sequence[Sdf.Path], check: Callable[[Usd.Prim], None]
    ) -> None:
        """Note what stands below a PointInstancer, belongs to none of its prototypes, and so shows nothing."""
        roots = frozenset(prototypes)  # there may be tens of thousands
        above = frozenset(root.GetParentPath() for root in roots)
        idle, moved = [], []
        pending = instancer.GetFilteredChildren(SHOWN)[::-1]
        while pending:
            prim = pending.pop()
            path = prim.GetPath()
            if path in roots:
                continue
            if _would_be_drawn(prim):
                idle.append(path)
                continue
            check(prim)
            if self._is_moved(prim) and any(root.HasPrefix(path) for root in above):
                moved.append(path)
            pending.extend(prim.GetFilteredChildren(SHOWN)[::-1])
        for paths, kind, what in (
            (idle, "prim", "below it, but of none of its prototypes: not drawn"),
            (moved, "transform", "does not move its prototypes, whose own transform alone counts"),
        ):
            if paths:
                self._report.warn(IDLE_CHILD, instancer.GetPath(), f"{first_of(list(map(str, paths)), kind)} {what}")

    def _is_moved(self, prim: Usd.Prim) -> bool:
        """Return whether a prim has a transform that moves anything."""
        if not prim.IsA(UsdGeom.Xformable) or not prim.GetAttribute("xformOpOrder").HasAuthoredValue():
            return False
        try:
            return bool(UsdGeom.Xformable(prim).GetLocalTransformation(self._time) != Gf.Matrix4d(1))
        except Tf.ErrorException:  # its values are of no use
            return False

    def _instancer_group(
        self, instancer: Usd.Prim, path: Sdf.Path, context: Context, own: Values, walk_group: WalkGroup
    ) -> GroupBuilder | None:
        """Return the group of a PointInstancer's prototype, its root's own transform included.

        Args:
            instancer: The PointInstancer.
            path: Of the prototype.
            context: What the instancer's children have from it.
            own: Primvars of the instancer that each instance has at its root, where they precede inherited ones.
            walk_group: Walks the prototype.
        """
        prototype = self._stage.GetPrimAtPath(path)
        if not prototype and is_outside_mask(self._stage, path):
            self._report.warn(OUTSIDE_MASK, instancer.GetPath(), f"the prototype {path} is left out by the mask")
            return None
        if not prototype or not prototype.IsActive():
            self._report.warn(BAD_PROTOTYPE, instancer.GetPath(), f"the prototype {path} is no prim that can be drawn")
            return None
        if path in self._open:
            self._report.warn(CYCLE, instancer.GetPath(), f"the prototype {path} contains this instancer: left out")
            return None
        is_below = path.HasPrefix(instancer.GetPath())
        tail_start = len(str(path)) if is_below else 0
        width = handed_width(own) if "widths" in own else context.width if is_below else None
        key = (path, tail_start, context.purpose, width, frozenset(own))
        group = self._groups.get(key)
        if group is None:
            parent = prototype.GetParent()
            inside = Context(
                world_from_group=np.eye(4),
                path_length=len(str(path)),
                tail_start=tail_start,
                predicate=SHOWN_IN_PROTOTYPE,
                purpose=context.purpose,
                bindings=read_bindings(parent),
                width=width,
                draw_mode=draw_mode(parent, "", self._report) if parent else "default",
                card_visibility=inherited_card_visibility(parent, self._report),
            )
            inside = said_above(parent, inside, self._time, self._report)
            inside = self._with_primvars_above(prototype, inside, instancer if is_below else None, own)
            self._open.append(path)
            group = self._groups[key] = walk_group([prototype], inside)
            self._open.pop()
        return group

    def _with_primvars_above(
        self, prototype: Usd.Prim, inside: Context, instancer: Usd.Prim | None, own: Values
    ) -> Context:
        """Return a prototype's context with what the prims above it hand on, up to the instancer that it is below of.

        Where an instancer has such a primvar, it has it at the root of each instance, and so before those.
        """
        above = [self._stage.GetPrimAtPath(path) for path in prototype.GetPath().GetPrefixes()[:-1]]
        for prim in above:
            if instancer is None or (prim != instancer and prim.GetPath().HasPrefix(instancer.GetPath())):
                authored = self._authored.read(prim, inside.has_clips)
                if authored.primvars:
                    inside = hand_down_primvars(prim, inside, authored, self._time, self._report)
        return inside._replace(
            primvars=[primvar for primvar in inside.primvars if primvar.GetPrimvarName() not in own],
            constants={name: value for name, value in inside.constants.items() if name not in own},
            width=handed_width(own) if "widths" in own else inside.width,
        )


def _would_be_drawn(prim: Usd.Prim) -> bool:
    """Return whether a prim would add something to the picture, or to its cameras, if it stood elsewhere."""
    is_camera = prim.IsA(UsdGeom.Camera)
    return is_camera or prim.IsA(UsdGeom.Boundable) or prim.IsInstance() or prim.HasAPI(UsdLux.LightAPI)
