# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""UsdLux domes to Dome: their radiance, and the image by latitude and longitude that surrounds the scene."""

from __future__ import annotations

import numpy as np
from pxr import Usd, UsdGeom

from warp_rt.report import Report
from warp_rt.scene import Dome
from warp_rt.usd.attribute_values import AttributeReader
from warp_rt.usd.dome_layouts import LAYOUTS, rotation_and_stretch
from warp_rt.usd.light_inputs import Images, emission, multipliers, read_shadow, shines

DOME_LAYOUT = "W411"

DOMES = ("DomeLight", "DomeLight_1")

# Pole +Y to +Z, image centre +Z to -Y: the rotation of a dome whose pole is Z.
_Z_POLE = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


def read_dome(
    prim: Usd.Prim,
    kind: str,
    matrix: np.ndarray,
    attributes: AttributeReader,
    report: Report,
    images: Images,
    from_rec709: np.ndarray | None,
) -> Dome | None:
    """Return a dome; None, with a diagnostic, where its radiance is not finite.

    Args:
        prim: The dome.
        kind: Its type, of ``DOMES``.
        matrix: World from local, float64, shape [4, 4], acting on column vectors.
        attributes: Reads the prim's.
        report: Takes the diagnostics.
        images: Reads its texture.
        from_rec709: See ``warp_rt.usd.lights.read_lights``.
    """
    path = prim.GetPath()
    if kind == "DomeLight_1":
        pole = attributes.token("poleAxis", "scene", ("scene", "Y", "Z"))
        if pole == "Z" or (pole == "scene" and UsdGeom.GetStageUpAxis(prim.GetStage()) == UsdGeom.Tokens.z):
            matrix = matrix @ _Z_POLE
    radiance = emission(attributes, from_rec709)
    if not shines(radiance, path, report):
        return None
    image, is_srgb = -1, False
    asset = attributes.asset("inputs:texture:file")
    if asset is not None:
        layout = attributes.token("inputs:texture:format", "automatic", ("automatic", *LAYOUTS))
        row, is_srgb = images.decoded(images.image(asset, prim), prim.GetAttribute("inputs:texture:file"), path)
        rotation, stretch = rotation_and_stretch(matrix[:3, :3])
        matrix[:3, :3] = rotation
        image, is_srgb = images.latlong(row, layout, is_srgb=is_srgb, stretch=stretch)
        if image < row:
            message = f"the image @{asset.path}@ has not the proportions of the format {layout}; the dome is uniform"
            report.warn(DOME_LAYOUT, path, message)
    diffuse, specular = multipliers(attributes)
    red, green, blue = (float(c) for c in radiance)
    return Dome(
        str(path),
        matrix,
        (red, green, blue),
        image=image,
        is_srgb=is_srgb,
        diffuse=diffuse,
        specular=specular,
        casts_shadow=attributes.truth("inputs:shadow:enable", True),
        shadow=read_shadow(attributes),
    )
