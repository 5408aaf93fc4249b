# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Layouts of environment images, each painted from one function of the direction by the formulas of its source."""

import numpy as np
import pytest

from warp_rt.upload.dome import irradiance_map
from warp_rt.usd.dome_layouts import guess_layout, has_proportions, rotation_and_stretch, to_latlong

SIZE = 256


def sky(direction):
    """Return a colour for unit directions, shape [..., 3]: smooth, and different along every axis."""
    x, y, z = np.moveaxis(direction, -1, 0)
    return np.stack([1 + 0.8 * x, 1 + 0.6 * y + 0.2 * x * z, 1 + 0.7 * z], axis=-1)


def centers(width, height):
    """Return x and y of the texels' centres, from -1 to 1, bottom row first."""
    return np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, (np.arange(height) + 0.5) / height * 2 - 1)


def opaque(color):
    return np.concatenate([color, np.ones((*color.shape[:2], 1))], axis=2).astype(np.float32)


def ball(angle_of_radius):
    """Paint (u, v) = (Dx r, Dy r): Debevec's formula, r being what the direction's angle to +Z says."""
    u, v = centers(SIZE, SIZE)
    radius = np.hypot(u, v)
    angle = angle_of_radius(np.minimum(radius, 1))
    scale = np.sin(angle) / np.maximum(radius, 1e-9)
    return opaque(sky(np.stack([u * scale, v * scale, np.cos(angle)], axis=-1)))


def mirrored_ball():
    """Reflect the view of a camera that looks along -Z in the unit ball: R = d - 2 (d.n) n."""
    u, v = centers(SIZE, SIZE)
    n = np.stack([u, v, np.sqrt(np.maximum(1 - u**2 - v**2, 0))], axis=-1)
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    view = np.array([0.0, 0.0, -1.0])
    return opaque(sky(view - 2 * (n @ view)[..., None] * n))


def cross():
    """Fold up six faces: right of the middle is +X, above it +Y, below it -Y, and -Z hangs below that."""
    a, b = centers(SIZE, SIZE)
    one = np.ones_like(a)
    faces = {
        (2, 1): (a, b, one),
        (2, 0): (-one, b, a),
        (2, 2): (one, b, -a),
        (3, 1): (a, one, -b),
        (1, 1): (a, -one, b),
        (0, 1): (a, -b, -one),
    }
    image = np.zeros((4 * SIZE, 3 * SIZE, 4), np.float32)
    for (row, column), direction in faces.items():
        d = np.stack(direction, axis=-1)
        color = opaque(sky(d / np.linalg.norm(d, axis=-1, keepdims=True)))
        image[row * SIZE : (row + 1) * SIZE, column * SIZE : (column + 1) * SIZE] = color
    return image


IMAGES = {
    "angular": lambda: ball(lambda radius: np.pi * radius),
    "mirroredBall": mirrored_ball,
    "cubeMapVerticalCross": cross,
}


@pytest.mark.parametrize("layout", IMAGES)
def test_the_same_sky_in_every_layout(layout):
    """UsdLux latlong: the centre is +Z, longitude pi / 2 is +X and left of it, the top is +Y."""
    found = to_latlong(IMAGES[layout](), layout, is_srgb=False)
    direction = latlong_directions(len(found))
    # A ball's rim squeezes all that is behind it into a few texels.
    away = direction[..., 2] > (-0.9 if layout == "mirroredBall" else -2)
    np.testing.assert_allclose(found[away][:, :3], sky(direction)[away], atol=0.02)
    assert (found[..., 3] == 1).all()


def latlong_directions(rows):
    """Return unit directions of texels by UsdLux's rule."""
    latitude = (((np.arange(rows) + 0.5) / rows) - 0.5)[:, None] * np.pi
    longitude = (0.5 - (np.arange(2 * rows) + 0.5) / (2 * rows))[None] * 2 * np.pi
    x, z = np.cos(latitude) * np.sin(longitude), np.cos(latitude) * np.cos(longitude)
    return np.stack([x, np.sin(latitude) + 0 * x, z], axis=-1)


@pytest.mark.parametrize("scale", [(1, 2, 1), (-3, 1, 0.5), (1, 12, 1)])
def test_stretched_skies(scale):
    """Light comes from where the transform takes the image's directions, its lengths being of no matter."""
    turn = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))[0]
    matrix = turn @ np.diag(scale) @ turn.T @ np.roll(np.eye(3), 1, axis=0)
    rotation, stretch = rotation_and_stretch(matrix)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.sign(np.linalg.det(rotation)) == np.sign(np.linalg.det(matrix))
    # At the poles nothing lies beyond the last row, and half a texel counts: 0.8 of pi / 256.
    found = to_latlong(opaque(sky(latlong_directions(128))), "latlong", is_srgb=False, stretch=stretch)
    local = latlong_directions(len(found)) @ rotation.T @ np.linalg.inv(matrix).T
    expected = sky(local / np.linalg.norm(local, axis=-1, keepdims=True))
    np.testing.assert_allclose(found[..., :3], expected, atol=0.01)


def test_even_scales_stretch_nothing():
    matrix = -2 * np.roll(np.eye(3), 1, axis=0)
    rotation, stretch = rotation_and_stretch(matrix)
    assert stretch is None
    assert rotation is matrix


@pytest.mark.parametrize("tall", [0.5, 2.0, 4.0])
def test_a_stretched_cap_of_light(tall):
    """A cap of half angle t about the pole lights what faces it by pi sin^2 t; stretched, tan t shrinks as it grows."""
    pixels = np.zeros((256, 512, 4), np.float32)
    pixels[192:] = 1  # t = 45 degrees
    _, stretch = rotation_and_stretch(np.diag([1.0, tall, 1.0]))
    image = to_latlong(pixels, "latlong", is_srgb=False, stretch=stretch)
    from_above = irradiance_map(image, is_srgb=False, size=(33, 64))[-1]
    np.testing.assert_allclose(from_above, np.pi * np.sin(np.arctan(1 / tall)) ** 2, rtol=0.01)


def test_8_bit_texels_are_decoded():
    found = to_latlong(np.full((4, 4, 4), 188, np.uint8), "angular", is_srgb=True)
    np.testing.assert_allclose(found[..., :3], ((188 / 255 + 0.055) / 1.055) ** 2.4, rtol=1e-5)


@pytest.mark.parametrize(
    ("width", "height", "layout"), [(2048, 1024, "latlong"), (512, 512, "latlong"), (768, 1024, "cubeMapVerticalCross")]
)
def test_automatic_layouts(width, height, layout):
    assert guess_layout(width, height) == layout


def test_proportions():
    assert has_proportions("latlong", 7, 5)
    assert has_proportions("angular", 5, 5)
    assert not has_proportions("mirroredBall", 5, 6)
    assert has_proportions("cubeMapVerticalCross", 6, 8)
    assert not has_proportions("cubeMapVerticalCross", 8, 6)
