# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""A rational B-spline surface: points, derivatives, normals, and what else its basis interpolates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from warp_rt.splines.pieces import Pieces, bernstein

# A derivative below this part of the largest coordinate is the rounding of zero.
_ROUNDING = 1e-12

# Derivatives are taken for parallel where the sine of the angle between them is less.
_PARALLEL = 1e-9

# How far from a degenerate corner, in pieces, a normal is taken where no derivative tells it.
_STEP_INSIDE = 1e-3

# Bounds the temporary arrays to some ten megabytes.
_BLOCK = 1 << 14


@dataclass(frozen=True, eq=False)
class Places:
    """Points of a surface's domain, each seen from one of the pieces that meet there."""

    u_piece: np.ndarray
    """int64, shape [m]."""
    v_piece: np.ndarray
    """int64, shape [m]."""
    u: np.ndarray
    """float64, shape [m], from 0 to 1 along the piece."""
    v: np.ndarray
    """float64, shape [m]."""

    def __len__(self) -> int:
        return len(self.u)

    def __getitem__(self, chosen: np.ndarray | slice) -> Places:
        return Places(self.u_piece[chosen], self.v_piece[chosen], self.u[chosen], self.v[chosen])


class Patch:
    """A surface.

    Args:
        points: Control points, u fastest, shape [v_count * u_count, 3].
        weights: Of the control points, not negative, shape [v_count * u_count].
        u: Pieces along u.
        v: Pieces along v.
        u_count: Control points along u.
    """

    def __init__(self, points: np.ndarray, weights: np.ndarray, u: Pieces, v: Pieces, u_count: int) -> None:
        self.u = u
        self.v = v
        self._u_count = u_count
        self._weights = weights.astype(np.float64)[:, None]
        self._points = points.astype(np.float64)
        self._controls = np.concatenate([self._points * self._weights, self._weights], axis=1)

    def points(self, at: Places) -> np.ndarray:
        """Return points of the surface, float64, shape [m, 3]; not finite where the weights cancel out."""
        homogeneous = self._blend(self._controls, at)
        with np.errstate(divide="ignore", invalid="ignore"):
            return homogeneous[:, :3] / homogeneous[:, 3:]

    def values(self, values: np.ndarray, at: Places) -> np.ndarray:
        """Return values of the control points, shape [v_count * u_count, c], as the surface blends its points."""
        homogeneous = self._blend(np.concatenate([values * self._weights, self._weights], axis=1), at)
        with np.errstate(divide="ignore", invalid="ignore"):
            return homogeneous[:, :-1] / homogeneous[:, -1:]

    def derivatives(self, at: Places) -> dict[str, np.ndarray]:
        """Return the derivatives ``u``, ``v``, ``uu``, ``uv``, ``vv`` by places along the pieces: shape [m, 3] each.

        Reference: Piegl and Tiller (1997), The NURBS Book, equation 4.20.
        """
        orders = {"": (0, 0), "u": (1, 0), "v": (0, 1), "uu": (2, 0), "uv": (1, 1), "vv": (0, 2)}
        blended = {name: self._blend(self._controls, at, *order) for name, order in orders.items()}
        a = {name: rows[:, :3] for name, rows in blended.items()}
        w = {name: rows[:, 3:] for name, rows in blended.items()}
        with np.errstate(divide="ignore", invalid="ignore"):
            s = a[""] / w[""]
            s_u = (a["u"] - w["u"] * s) / w[""]
            s_v = (a["v"] - w["v"] * s) / w[""]
            return {
                "u": s_u,
                "v": s_v,
                "uu": (a["uu"] - 2 * w["u"] * s_u - w["uu"] * s) / w[""],
                "uv": (a["uv"] - w["u"] * s_v - w["v"] * s_u - w["uv"] * s) / w[""],
                "vv": (a["vv"] - 2 * w["v"] * s_v - w["vv"] * s) / w[""],
            }

    def normals(self, at: Places) -> np.ndarray:
        """Return unit normals, along the cross product of the derivatives by u and v; zero where there is none: [n, 3].

        Where an edge of the surface is one point, at a pole, the derivative along that edge is zero: its change across
        the edge takes its place. Where that does not help, the normal is one a thousandth of a piece further inside.
        """
        normals = self._limit_normals(at)
        missing = np.flatnonzero(~(np.square(normals).sum(axis=1) > 0))
        if len(missing):
            inside = at[missing]
            u, v = (_STEP_INSIDE + (1 - 2 * _STEP_INSIDE) * x for x in (inside.u, inside.v))
            normals[missing] = self._limit_normals(Places(inside.u_piece, inside.v_piece, u, v))
        return normals

    def _limit_normals(self, at: Places) -> np.ndarray:
        s = self.derivatives(at)
        # Seen from the end of a piece, its inside lies the other way.
        to_v, to_u = np.where(at.v > 0.5, -1.0, 1.0)[:, None], np.where(at.u > 0.5, -1.0, 1.0)[:, None]
        least = _ROUNDING * np.abs(self._points).max()
        normals = np.zeros((len(at), 3))
        for along_u, along_v in ((s["u"], s["v"]), (to_v * s["uv"], s["v"]), (s["u"], to_u * s["uv"])):
            lengths = [np.linalg.norm(side, axis=1, keepdims=True) for side in (along_u, along_v)]
            crossed = np.cross(along_u, along_v)
            area = np.linalg.norm(crossed, axis=1, keepdims=True)
            is_normal = (np.minimum(*lengths) > least) & (area > _PARALLEL * lengths[0] * lengths[1])
            is_next = is_normal & (np.square(normals).sum(axis=1, keepdims=True) == 0)
            normals = np.where(is_next, np.divide(crossed, area, out=np.zeros_like(crossed), where=is_next), normals)
        return normals

    def speeds(self) -> np.ndarray:
        """Return how far a unit of u, and one of v, at most leads on the surface: float64, shape [2].

        The derivatives are those at the corners and in the middle of each piece.
        """
        grid = np.meshgrid(np.arange(len(self.v)), np.arange(len(self.u)), [0.0, 0.5, 1.0], [0.0, 0.5, 1.0])
        v_piece, u_piece, v, u = (axis.reshape(-1) for axis in grid)
        derivatives = self.derivatives(Places(u_piece, v_piece, u, v))
        lengths = (
            np.linalg.norm(derivatives["u"], axis=1) / (self.u.end - self.u.start)[u_piece],
            np.linalg.norm(derivatives["v"], axis=1) / (self.v.end - self.v.start)[v_piece],
        )
        return np.array([np.nan_to_num(length, posinf=0).max() for length in lengths])

    @property
    def size(self) -> float:
        """Diagonal of the box about the control points."""
        return float(np.linalg.norm(np.ptp(self._points, axis=0)))

    def _blend(self, values: np.ndarray, at: Places, u_order: int = 0, v_order: int = 0) -> np.ndarray:
        """Return the sum of values by the B-spline basis, or its derivative by ``at``'s u and v."""
        blended = np.empty((len(at), values.shape[1]))
        for begin in range(0, len(at), _BLOCK):
            block = at[begin : begin + _BLOCK]
            u_basis = np.einsum(
                "mk,mkj->mj", bernstein(self.u.degree, block.u, u_order), self.u.bezier_weights[block.u_piece]
            )
            v_basis = np.einsum(
                "mk,mkj->mj", bernstein(self.v.degree, block.v, v_order), self.v.bezier_weights[block.v_piece]
            )
            column = self.u.first[block.u_piece][:, None] + np.arange(self.u.degree + 1)
            row = self.v.first[block.v_piece][:, None] + np.arange(self.v.degree + 1)
            net = values[row[:, :, None] * self._u_count + column[:, None, :]]
            along_u = np.einsum("mj,mijc->mic", u_basis, net)
            blended[begin : begin + len(block)] = np.einsum("mi,mic->mc", v_basis, along_u)
        return blended
