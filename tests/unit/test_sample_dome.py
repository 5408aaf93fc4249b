# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Samplers of domes and of GGX lobes: their densities integrate to one, and are those that samples come with."""

from __future__ import annotations

import numpy as np
import pytest
import warp as wp

from warp_rt.kernels.light_structs import DomeData
from warp_rt.kernels.sample_dome import (
    cosine_pdf,
    dome_image_pdf,
    sample_cosine,
    sample_dome_image,
)
from warp_rt.kernels.sample_gloss import ggx_pdf, sample_ggx
from warp_rt.kernels.sampling import sequence_point
from warp_rt.kernels.scene_structs import SceneData
from warp_rt.upload.dome import bright_cells
from warp_rt.warp_setup import init_warp

init_warp()
COUNT = 1 << 15
NORMAL = np.array([0.36, -0.48, 0.8])


@wp.kernel
def sample_image(scenes: wp.array[SceneData], directions: wp.array[wp.vec3], densities: wp.array[wp.vec2]):
    """Sample a dome's image, and ask for the density of what came out."""
    i = wp.tid()
    s = sample_dome_image(scenes[0], scenes[0].domes[0], sequence_point(wp.uint32(i), wp.uint32(5)))
    directions[i] = s.wi
    densities[i] = wp.vec2(s.pdf, dome_image_pdf(scenes[0], scenes[0].domes[0], s.wi))


@wp.kernel
def image_densities(scenes: wp.array[SceneData], directions: wp.array[wp.vec3], densities: wp.array[float]):
    """Ask for the densities of given directions."""
    i = wp.tid()
    densities[i] = dome_image_pdf(scenes[0], scenes[0].domes[0], directions[i])


@wp.kernel
def sample_above(n: wp.vec3, directions: wp.array[wp.vec3], densities: wp.array[wp.vec2]):
    """Sample by the cosine."""
    i = wp.tid()
    s = sample_cosine(n, sequence_point(wp.uint32(i), wp.uint32(5)))
    directions[i] = s.wi
    densities[i] = wp.vec2(s.pdf, cosine_pdf(n, s.wi))


@wp.kernel
def sample_lobe(n: wp.vec3, wo: wp.vec3, alpha: float, directions: wp.array[wp.vec3], densities: wp.array[wp.vec2]):
    """Sample a GGX lobe."""
    i = wp.tid()
    wi = sample_ggx(n, wo, alpha, sequence_point(wp.uint32(i), wp.uint32(5)))
    directions[i] = wi
    densities[i] = wp.vec2(ggx_pdf(n, wo, alpha, wi), 0.0)


@wp.kernel
def lobe_densities(n: wp.vec3, wo: wp.vec3, alpha: float, directions: wp.array[wp.vec3], densities: wp.array[float]):
    """Ask for the densities of given directions."""
    i = wp.tid()
    densities[i] = ggx_pdf(n, wo, alpha, directions[i])


def around(rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Return directions over the sphere, the middles of equal steps of both angles, and their solid angles."""
    theta, phi = np.meshgrid(
        (np.arange(rows) + 0.5) / rows * np.pi, (np.arange(columns) + 0.5) / columns * 2 * np.pi, indexing="ij"
    )
    d = np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], -1).reshape(-1, 3)
    return d, (np.sin(theta) * (np.pi / rows) * (2 * np.pi / columns)).reshape(-1)


def scene_with(pixels: np.ndarray) -> tuple[wp.array, SceneData]:
    """Return a scene of one dome, turned about an axis: for kernels, and what keeps its memory alive."""
    sums, rows, columns = bright_cells(np.float32(pixels), is_srgb=False, size=(512, 1024))
    dome = np.zeros(1, DomeData.numpy_dtype())
    dome["axis_x"], dome["axis_y"], dome["axis_z"] = (0.6, 0, -0.8), (0, 1, 0), (0.8, 0, 0.6)
    dome["cell_rows"], dome["cell_columns"] = rows, columns
    scene = SceneData()
    scene.domes = wp.array(dome, dtype=DomeData, device="cpu")
    scene.dome_cells = wp.array(sums, dtype=wp.float32, device="cpu")
    return wp.array([scene], dtype=SceneData, device="cpu"), scene


def drawn(kernel: wp.Kernel, *inputs: object) -> tuple[np.ndarray, np.ndarray]:
    """Return what a sampling kernel writes: directions and densities."""
    directions = wp.zeros(COUNT, dtype=wp.vec3, device="cpu")
    densities = wp.zeros(COUNT, dtype=wp.vec2, device="cpu")
    wp.launch(kernel, dim=COUNT, inputs=[*inputs, directions, densities], device="cpu")
    return directions.numpy().astype(float), densities.numpy().astype(float)


def density_of(kernel: wp.Kernel, directions: np.ndarray, *inputs: object) -> np.ndarray:
    given = wp.array(np.float32(directions), dtype=wp.vec3, device="cpu")
    out = wp.zeros(len(directions), dtype=float, device="cpu")
    wp.launch(kernel, dim=len(directions), inputs=[*inputs, given, out], device="cpu")
    return out.numpy().astype(float)


@pytest.mark.parametrize("name", ["even", "rough", "sun", "black", "half black"])
def test_images(name: str) -> None:
    rng = np.random.default_rng(2)
    pixels = np.ones((24, 40, 4))
    if name == "rough":
        pixels[..., :3] = rng.random((24, 40, 3)) ** 4
    elif name == "sun":
        pixels[17:19, 30:32, :3] = 1e5
    elif name == "black":
        pixels[..., :3] = 0
    elif name == "half black":
        pixels[:12, :, :3] = 0
    scenes, _alive = scene_with(pixels)
    directions, densities = drawn(sample_image, scenes)
    # At a cell's edge the direction may fall to its neighbour.
    np.testing.assert_allclose(np.median(densities[:, 1] / densities[:, 0]), 1, rtol=1e-4)
    assert (np.abs(densities[:, 1] / densities[:, 0] - 1) < 1e-3).mean() > 0.99
    every, solid_angle = around(480, 800)  # 20 x 20 to a cell
    density = density_of(image_densities, every, scenes)
    assert (density * solid_angle).sum() == pytest.approx(1, rel=2e-3)
    mean = (every * (density * solid_angle)[:, None]).sum(0)
    np.testing.assert_allclose(directions.mean(0), mean, atol=3e-3)


def test_even_images_are_sampled_evenly() -> None:
    scenes, _alive = scene_with(np.ones((64, 128, 4)))
    _, densities = drawn(sample_image, scenes)
    np.testing.assert_allclose(densities[:, 0], 1 / (4 * np.pi), rtol=1e-3)


def test_cosine() -> None:
    """E[wi] = 2/3 n, and no density is off."""
    directions, densities = drawn(sample_above, wp.vec3(*NORMAL))
    np.testing.assert_allclose(directions.mean(0), NORMAL * 2 / 3, atol=1e-4)
    np.testing.assert_allclose(densities[:, 0], np.maximum(directions @ NORMAL, 0) / np.pi, atol=1e-5)
    np.testing.assert_allclose(densities[:, 1], densities[:, 0], atol=1e-5)


@pytest.mark.parametrize("alpha", [0.1, 0.3, 1.0])
@pytest.mark.parametrize("degrees", [0.0, 50.0, 85.0])
def test_ggx_lobes(alpha: float, degrees: float) -> None:
    """The density of all directions, those below the surface too, sums up to 1; its mean is that of the samples."""
    tangent = np.cross(NORMAL, (0, 1, 0))
    tangent /= np.linalg.norm(tangent)
    wo = np.cos(np.radians(degrees)) * NORMAL + np.sin(np.radians(degrees)) * tangent
    inputs = (wp.vec3(*NORMAL), wp.vec3(*wo), alpha)
    directions, _ = drawn(sample_lobe, *inputs)
    every, solid_angle = around(500, 1000)
    density = density_of(lobe_densities, every, *inputs) * solid_angle
    assert density.sum() == pytest.approx(1, rel=5e-3)
    np.testing.assert_allclose(directions.mean(0), (every * density[:, None]).sum(0), atol=6e-3)
    # As many in each octant about the normal as the density says.
    frame = np.stack([tangent, np.cross(NORMAL, tangent), NORMAL])
    for sign in np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T:
        there, drawn_there = ((d @ frame.T * sign > 0).all(1) for d in (every, directions))
        assert drawn_there.mean() == pytest.approx(density[there].sum(), abs=8e-3)
