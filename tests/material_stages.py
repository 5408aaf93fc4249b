# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Materials made of a few lines of shaders, read as a stage's are."""

from pxr import Usd

from warp_rt.report import Report
from warp_rt.scene import Material
from warp_rt.usd.materials import MaterialReader


def read_material(nodes: str) -> tuple[Material, list[tuple[str, str]], MaterialReader]:
    """Return the material whose surface is the output of shader ``S``, the codes and messages, and the reader.

    Args:
        nodes: The shaders of a material at /M, as .usda has them.
    """
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(
        f'#usda 1.0\ndef Sphere "s" (prepend apiSchemas = ["MaterialBindingAPI"]) {{\nrel material:binding = </M>\n}}\n'
        f'def Material "M" {{\ntoken outputs:mtlx:surface.connect = </M/S.outputs:out>\n{nodes}}}'
    )
    report = Report()
    reader = MaterialReader(stage, Usd.TimeCode.Default(), report)
    material = reader.materials[reader.bind(stage.GetPrimAtPath("/s"))]
    return material, [(d.code, d.message) for d in report], reader
