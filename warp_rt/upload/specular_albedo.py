# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""How much light a rough specular lobe reflects in all: a table, for a BRDF has to know what is left below its gloss.

python -m warp_rt.upload.specular_albedo    # makes the table anew: half a minute
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from warp_rt.kernels.constants import ALBEDO_COLUMNS, ALBEDO_ROWS, MIRROR_FADE_START

_FILE = Path(__file__).with_suffix(".npy")


@cache
def specular_albedo() -> np.ndarray:
    """Return the table: float32, shape [ALBEDO_ROWS, ALBEDO_COLUMNS, 2].

    The lobe of reflectance F0 head on and F90 grazing reflects F0 times the first number plus F90 times the second.
    Rows are roughnesses from MIRROR_FADE_START to 1, below which mirror rays carry all of it; columns the cube roots of
    N.V from 0 to 1.
    """
    return np.load(_FILE)


def integrate(roughness: np.ndarray, cosine: np.ndarray, count: int) -> np.ndarray:
    """Return the directional albedo of ``kernels.brdf.ggx_specular``, for N.V above 0: shape [n, 2].

    Facet normals are taken as the viewer sees them, at the middles of count^2 equal parts; each then counts by
    Fresnel's term and by what masks the way out.

    Args:
        roughness: Shape [n].
        cosine: N.V, shape [n].
        count: Parts of either parameter.

    Reference: Heitz (2018), Sampling the GGX Distribution of Visible Normals, JCGT 7(4).
    """
    alpha, mu = (np.asarray(values, float)[:, None, None] ** power for values, power in ((roughness, 2), (cosine, 1)))
    parts = (np.arange(count) + 0.5) / count
    radius, turn = np.sqrt(parts)[:, None], (2 * np.pi * parts)[None, :]
    sine = np.sqrt(1 - mu * mu)
    stretched = np.hypot(alpha * sine, mu)
    v_x, v_z = alpha * sine / stretched, mu / stretched
    a = radius * np.cos(turn)
    lower = 0.5 * (1 + v_z)
    b = (1 - lower) * np.sqrt(1 - a * a) + lower * radius * np.sin(turn)
    c = np.sqrt(np.maximum(1 - a * a - b * b, 0))
    h = np.stack([alpha * (v_x * c - v_z * b), alpha * a, np.maximum(v_x * b + v_z * c, 0)])
    h /= np.linalg.norm(h, axis=0)
    v_h = sine * h[0] + mu * h[2]
    n_l = 2 * v_h * h[2] - mu
    k = 0.5 * alpha
    masked = (n_l / (n_l * (1 - k) + k)) * (mu / (mu * (1 - k) + k))
    smith = 2 * mu / (mu + np.sqrt(alpha**2 + (1 - alpha**2) * mu**2))
    weight = np.where((n_l > 0) & (v_h > 0), masked / smith, 0)
    grazing = np.clip(1 - v_h, 0, 1) ** 5
    return np.stack([(weight * (1 - grazing)).mean((1, 2)), (weight * grazing).mean((1, 2))], -1)


def make_table() -> np.ndarray:
    """Return what the file holds: float32, shape [ALBEDO_ROWS, ALBEDO_COLUMNS, 2] as ``integrate`` gives it."""
    roughness = np.linspace(float(MIRROR_FADE_START), 1, int(ALBEDO_ROWS))
    cosine = np.maximum(np.linspace(0, 1, int(ALBEDO_COLUMNS)) ** 3, 1e-5)
    rows = [integrate(np.full(len(cosine), r), cosine, 512) for r in roughness]
    return np.array(rows, np.float32)


if __name__ == "__main__":
    np.save(_FILE, make_table())
