# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdSkel: what skeletons and blend shapes make of the prims that are bound to them.

USD's own BakeSkinning would write into the user's stage; the queries used here do not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, Vt

from warp_rt.report import Report
from warp_rt.usd.arrays import integers, vector_rows
from warp_rt.usd.skel_types import report_wrong_types

REST_POSE = "W131"


@dataclass(frozen=True)
class SubShape:
    """A blend shape or one of its in-betweens, with the weight that it has at a time."""

    weight: float
    rows: np.ndarray | None
    """int64, shape [k], the points that it moves; None: point i by offset i."""
    offsets: np.ndarray
    """float32, shape [k, 3], local space."""
    normal_offsets: np.ndarray | None
    """float32, shape [k, 3]."""

    def fits(self, point_count: int) -> bool:
        """Return whether each offset belongs to a point of a prim that has so many."""
        count = point_count if self.rows is None else len(self.rows)
        offsets = [part for part in (self.offsets, self.normal_offsets) if part is not None and len(part)]
        are_points = self.rows is None or bool(((self.rows >= 0) & (self.rows < point_count)).all())
        return are_points and all(len(part) == count for part in offsets)


@dataclass(frozen=True)
class Skin:
    """How a prim is deformed at one time: by blend shapes first, then by joints."""

    time: Usd.TimeCode
    query: UsdSkel.SkinningQuery
    shapes: tuple[SubShape, ...]
    joints: Vt.Matrix4dArray | None
    """Skinning transforms of the skeleton's joints, in its space; None: no joint moves the prim."""
    local_from_skeleton: Gf.Matrix4d
    """For row vectors, as all of USD's matrices are."""

    @property
    def is_rigid(self) -> bool:
        """Whether the joints move the prim as a whole: its transform changes instead of its points."""
        return self.joints is not None and self.query.IsRigidlyDeformed()

    def local_from_rest(self) -> np.ndarray:
        """Return what happens to a rigid prim: float64, shape [4, 4], for column vectors."""
        return np.array(self.query.ComputeSkinnedTransform(self.joints, self.time) * self.local_from_skeleton).T

    def points(self, rest: np.ndarray) -> np.ndarray | None:
        """Return the deformed points of rest points, both float32, shape [n, 3]; None if the influences do not fit."""
        points = rest + _sum_of_offsets(len(rest), [(s.weight, s.rows, s.offsets) for s in self.shapes])
        points = np.ascontiguousarray(points, np.float32)
        if self.joints is None or self.is_rigid:
            return points
        skinned = Vt.Vec3fArray.FromNumpy(points)
        if not self.query.ComputeSkinnedPoints(self.joints, skinned, self.time):
            return None
        matrix = np.array(self.local_from_skeleton)
        with np.errstate(over="ignore", invalid="ignore"):  # points that are not finite are told where they are drawn
            return (np.array(skinned, np.float64) @ matrix[:3, :3] + matrix[3, :3]).astype(np.float32)

    def normals(self, rest: np.ndarray, vertices: np.ndarray, point_count: int) -> np.ndarray:
        """Return deformed normals of any length: float32, shape [m, 3].

        Args:
            rest: Normals of the rest pose, shape [m, 3].
            vertices: The point that each belongs to, shape [m].
            point_count: Of the prim.
        """
        moves = [(s.weight, s.rows, s.normal_offsets) for s in self.shapes if s.normal_offsets is not None]
        normals = np.ascontiguousarray(rest + _sum_of_offsets(point_count, moves)[vertices], np.float32)
        if self.joints is None or self.is_rigid:
            return normals
        count = self.query.GetNumInfluencesPerComponent()
        indices, weights = self.query.ComputeVaryingJointInfluences(point_count, self.time)
        skinned = Vt.Vec3fArray.FromNumpy(normals)
        UsdSkel.SkinNormals(
            self.query.GetSkinningMethod(),
            _normal_matrix(self.query.GetGeomBindTransform(self.time)),
            Vt.Matrix3dArray([_normal_matrix(matrix) for matrix in self._own_joints()]),
            Vt.IntArray.FromNumpy(np.array(indices).reshape(-1, count)[vertices].reshape(-1)),
            Vt.FloatArray.FromNumpy(np.array(weights).reshape(-1, count)[vertices].reshape(-1)),
            count,
            skinned,
        )
        matrix = np.array(_normal_matrix(self.local_from_skeleton))
        with np.errstate(over="ignore", invalid="ignore"):
            return (np.array(skinned, np.float64) @ matrix).astype(np.float32)

    def _own_joints(self) -> Vt.Matrix4dArray:
        """Return the transforms of the joints that the prim names, in its order; USD does so itself for points."""
        mapper = self.query.GetJointMapper()
        if not mapper:
            return self.joints
        # A joint that the skeleton lacks takes what was there before: for points, USD lets it be the skeleton's own.
        return mapper.RemapTransforms(self.joints, Vt.Matrix4dArray(self.joints))


def pose(points: np.ndarray, skin: Skin | None, prim: Usd.Prim, report: Report) -> tuple[np.ndarray, Skin | None]:
    """Return a prim's points, local space, shape [n, 3], as its skin deforms them, and the skin.

    Where it does not fit, that is told, and the points are returned alone.
    """
    if skin is None:
        return points, None
    if not all(shape.fits(len(points)) for shape in skin.shapes):
        message = "offsets of a blend shape are not as many as its points, or of none that is there: what fits counts"
        report.warn(REST_POSE, prim.GetPath(), message)
    posed = skin.points(points)
    if posed is None:
        report.warn(REST_POSE, prim.GetPath(), "joint influences do not fit the points: drawn in its rest pose")
        return points, None
    return posed, skin


class SkinReader:
    """Finds the skins of the prims below SkelRoots.

    Args:
        time: When they are computed.
        report: Takes the diagnostics.
    """

    def __init__(self, time: Usd.TimeCode, report: Report) -> None:
        self._time = time
        self._report = report
        self._cache = UsdSkel.Cache()
        self._transforms = UsdGeom.XformCache(time)
        self._skins: dict[Sdf.Path, tuple[UsdSkel.Skeleton, UsdSkel.SkeletonQuery, UsdSkel.SkinningQuery]] = {}

    def enter(self, prim: Usd.Prim, predicate: object) -> None:
        """Read the bindings below a SkelRoot that is in no other one."""
        root = UsdSkel.Root(prim)
        self._cache.Populate(root, predicate)
        for binding in self._cache.ComputeSkelBindings(root, predicate):
            bones = binding.GetSkeleton()
            skeleton = self._cache.GetSkelQuery(bones)
            if skeleton:
                targets = binding.GetSkinningTargets()
                if targets:
                    self._report_pose(bones, skeleton)
                self._skins |= {query.GetPrim().GetPath(): (bones, skeleton, query) for query in targets}

    def _report_pose(self, bones: UsdSkel.Skeleton, skeleton: UsdSkel.SkeletonQuery) -> None:
        """Report what USD does not take of a skeleton and its animation, of which all is lost where a part is."""
        report_wrong_types(bones.GetPrim(), "Skeleton", self._time, REST_POSE, self._report)
        animation = skeleton.GetAnimQuery()
        if not animation:
            self._report_unplayed(bones.GetPrim())
            return
        report_wrong_types(animation.GetPrim(), "SkelAnimation", self._time, REST_POSE, self._report)
        if animation.GetJointOrder() and not animation.ComputeJointLocalTransforms(self._time):
            message = (
                f"{animation.GetPrim().GetPath()} has not a translation, a rotation and a scale for each joint: "
                "joints are as restTransforms say"
            )
            self._report.warn(REST_POSE, bones.GetPath(), message)

    def _report_unplayed(self, bones: Usd.Prim) -> None:
        """Report why a skeleton is not animated, where it or a prim above it names an animation."""
        prim = bones
        while prim and not prim.IsPseudoRoot():
            source = prim.GetRelationship("skel:animationSource")
            targets = source.GetForwardedTargets() if source else []
            if targets:
                is_applied = prim.HasAPI(UsdSkel.BindingAPI)
                why = "is no SkelAnimation" if is_applied else "does not count without an applied SkelBindingAPI"
                message = f"skel:animationSource of {prim.GetPath()}, {targets[0]}, {why}: no animation plays"
                self._report.warn(REST_POSE, bones.GetPath(), message)
                return
            prim = prim.GetParent()

    def read(self, prim: Usd.Prim) -> Skin | None:
        """Return how a prim is deformed; None: not at all."""
        found = self._skins.get(prim.GetPath())
        if found is None:
            return None
        bones, skeleton, query = found
        report_wrong_types(prim, "SkelBindingAPI", self._time, REST_POSE, self._report)
        joints = None
        if query.HasJointInfluences():
            lacking = set(query.GetJointOrder() or ()) - set(skeleton.GetJointOrder())
            if lacking:
                message = f"skel:joints names {', '.join(sorted(lacking))}, which {bones.GetPath()} has not"
                self._report.warn(REST_POSE, prim.GetPath(), f"{message}: what they weigh stands anywhere")
            joints = skeleton.ComputeSkinningTransforms(self._time)
        shapes = self._read_shapes(prim, skeleton, query) if query.HasBlendShapes() else ()
        if joints is None and not shapes:
            return None
        to_world = self._transforms.GetLocalToWorldTransform
        # In an instance the skeleton's query knows the prototype's prim, which stands somewhere else.
        local_from_skeleton = to_world(bones.GetPrim()) * to_world(prim).GetInverse()
        return Skin(self._time, query, shapes, joints, local_from_skeleton)

    def _read_shapes(
        self, prim: Usd.Prim, skeleton: UsdSkel.SkeletonQuery, query: UsdSkel.SkinningQuery
    ) -> tuple[SubShape, ...]:
        animation = skeleton.GetAnimQuery()
        weights = animation.ComputeBlendShapeWeights(self._time) if animation else None
        if weights is None:
            return ()
        blending = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(prim))
        names, driven = query.GetBlendShapeOrder(), animation.GetBlendShapeOrder()
        for count, what, expected in (
            (len(weights), f"blendShapeWeights of {animation.GetPrim().GetPath()}", len(driven)),
            (blending.GetNumBlendShapes(), "skel:blendShapeTargets", len(names)),
        ):
            if count != expected:
                message = f"{what} are {count} for {expected} blend shapes: not all of them count"
                self._report.warn(REST_POSE, prim.GetPath(), message)
        mapper = query.GetBlendShapeMapper()
        if mapper:
            weights = mapper.Remap(weights, Vt.FloatArray(len(names)))
        parts = blending.ComputeSubShapeWeights(weights)
        if not parts:
            return ()
        shapes = []
        for weight, row, sub_shape in zip(*parts, strict=True):
            shape, between = blending.GetBlendShape(int(row)), blending.GetInbetween(int(sub_shape))
            if not shape:
                self._report.warn(REST_POSE, prim.GetPath(), "a target of blendShapeTargets is no BlendShape: left out")
                continue
            report_wrong_types(shape.GetPrim(), "BlendShape", self._time, REST_POSE, self._report)
            offsets = _rows(between.GetOffsets() if between else shape.GetOffsetsAttr().Get())
            normals = _rows(between.GetNormalOffsets() if between else shape.GetNormalOffsetsAttr().Get())
            rows = integers(shape.GetPointIndicesAttr().Get())
            if normals is not None and not np.isfinite(normals).all():
                self._report.warn(REST_POSE, shape.GetPath(), "its normalOffsets are not all finite: left out")
                normals = None
            if offsets is None:
                name = between.GetAttr().GetName() if between else "offsets"
                self._report.warn(REST_POSE, shape.GetPath(), f"it has no {name} of no time: left out")
            else:
                shapes.append(
                    SubShape(float(weight), rows if rows is not None and len(rows) else None, offsets, normals)
                )
        return tuple(shapes)


def _sum_of_offsets(count: int, moves: list[tuple[float, np.ndarray | None, np.ndarray]]) -> np.ndarray:
    """Return the weighted sum of offsets for each of ``count`` points; those of points that are not there are lost."""
    total = np.zeros((count, 3))
    for weight, rows, offsets in moves:
        rows = np.arange(len(offsets)) if rows is None else rows
        shared = min(len(rows), len(offsets))
        inside = (rows[:shared] >= 0) & (rows[:shared] < count)
        with np.errstate(invalid="ignore"):  # points that are not finite are told where they are drawn
            np.add.at(total, rows[:shared][inside], weight * offsets[:shared][inside].astype(np.float64))
    return total


def _rows(value: object) -> np.ndarray | None:
    return vector_rows(value, 3) if isinstance(value, Vt.Vec3fArray) else None


def _normal_matrix(matrix: Gf.Matrix4d) -> Gf.Matrix3d:
    return matrix.ExtractRotationMatrix().GetInverse().GetTranspose()
