# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Domes: directions above a surface, in proportion to the cosine, and where an image is bright."""

import warp as wp

from .environment import latlong_from_direction
from .light_direction import LightDirection
from .light_structs import DomeData
from .sampling import concentric_disk
from .scene_structs import SceneData
from .vector import perpendicular_frame


@wp.func
def sample_cosine(n: wp.vec3, u: wp.vec2) -> LightDirection:
    """Return a direction above a surface of unit normal ``n``, in proportion to the cosine.

    Reference: Malley's method: Pharr, Jakob and Humphreys (2023), Physically Based Rendering, section A.5.3.
    """
    q = concentric_disk(u)
    x, y = perpendicular_frame(n)
    cosine = wp.sqrt(wp.max(1.0 - wp.length_sq(q), 0.0))
    s = LightDirection()
    s.wi = wp.normalize(x * q[0] + y * q[1] + n * cosine)
    s.distance = wp.inf
    s.pdf = cosine / wp.pi
    return s


@wp.func
def cosine_pdf(n: wp.vec3, wi: wp.vec3) -> float:
    """Return the density with which :func:`sample_cosine` gives a unit direction [1/sr]."""
    return wp.max(wp.dot(n, wi), 0.0) / wp.pi


@wp.func
def cell_above(cells: wp.array[wp.float32], first: int, count: int, u: float) -> int:
    """Return the first of ``count`` growing sums, the last of which is 1, that is above ``u`` < 1, from 0."""
    low = int(0)
    high = count - 1
    while low < high:
        middle = (low + high) // 2
        if cells[first + middle] > u:
            high = middle
        else:
            low = middle + 1
    return low


@wp.func
def cell_start(cells: wp.array[wp.float32], first: int, cell: int) -> float:
    """Return the sum before a cell."""
    if cell == 0:
        return 0.0
    return cells[first + cell - 1]


@wp.func
def sample_dome_image(scene: wp.ref[SceneData], dome: wp.ref[DomeData], u: wp.vec2) -> LightDirection:
    """Return a direction in proportion to a dome's brightness, all around.

    Args:
        scene: Has the distribution.
        dome: With an image.
        u: Point of the unit square.

    Reference: Pharr, Jakob and Humphreys (2023), Physically Based Rendering, sections A.5.6 and 12.5.1.
    """
    rows = dome.cell_rows
    columns = dome.cell_columns
    row = cell_above(scene.dome_cells, dome.cells_offset, rows, u[1])
    below = cell_start(scene.dome_cells, dome.cells_offset, row)
    share_of_row = scene.dome_cells[dome.cells_offset + row] - below
    first = dome.cells_offset + rows + row * columns
    column = cell_above(scene.dome_cells, first, columns, u[0])
    left = cell_start(scene.dome_cells, first, column)
    share_of_column = scene.dome_cells[first + column] - left
    longitude = (0.5 - (float(column) + (u[0] - left) / share_of_column) / float(columns)) * 2.0 * wp.pi
    # Even in height above the equator is even in solid angle, so that no cell is denser towards its pole.
    height = cell_height(row, rows) * (u[1] - below) / share_of_row - wp.cos(wp.pi * float(row) / float(rows))
    around = wp.sqrt(wp.max(1.0 - height * height, 0.0))
    wi = dome.axis_x * (around * wp.sin(longitude)) + dome.axis_y * height
    s = LightDirection()
    s.wi = wp.normalize(wi + dome.axis_z * (around * wp.cos(longitude)))
    s.distance = wp.inf
    s.pdf = share_of_row * share_of_column / cell_solid_angle(dome, row)
    return s


@wp.func
def cell_height(row: int, rows: int) -> float:
    """Return how high a row of cells is on the unit sphere: the difference of two cosines, without its error."""
    step = 0.5 * wp.pi / float(rows)
    return 2.0 * wp.sin(step) * wp.sin(float(2 * row + 1) * step)


@wp.func
def cell_solid_angle(dome: wp.ref[DomeData], row: int) -> float:
    """Return the solid angle of each cell of a row [sr]."""
    return cell_height(row, dome.cell_rows) * 2.0 * wp.pi / float(dome.cell_columns)


@wp.func
def dome_image_pdf(scene: wp.ref[SceneData], dome: wp.ref[DomeData], wi: wp.vec3) -> float:
    """Return the density with which :func:`sample_dome_image` gives a unit direction [1/sr]."""
    rows = dome.cell_rows
    columns = dome.cell_columns
    st = latlong_from_direction(dome, wi)
    row = wp.clamp(int(st[1] * float(rows)), 0, rows - 1)
    column = wp.clamp(int(st[0] * float(columns)), 0, columns - 1)
    first = dome.cells_offset + rows + row * columns
    of_row = scene.dome_cells[dome.cells_offset + row] - cell_start(scene.dome_cells, dome.cells_offset, row)
    of_column = scene.dome_cells[first + column] - cell_start(scene.dome_cells, first, column)
    return of_row * of_column / cell_solid_angle(dome, row)
