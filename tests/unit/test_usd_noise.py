# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""Noises: their hash against published values, their definitions cell by cell."""

import numpy as np

from warp_rt.usd.noise import cells, final_mix, hashed, perlin, worley, worley_vector

MASK = 0xFFFFFFFF
RNG = np.random.default_rng(2)


def mixed(a: int, b: int, c: int) -> tuple[int, int, int]:
    """Return lookup3's macro ``mix`` of three words."""

    def rot(x: int, k: int) -> int:
        return ((x << k) | (x >> (32 - k))) & MASK

    for first, second, third in ((4, 6, 8), (16, 19, 4)):
        a = ((a - c) & MASK) ^ rot(c, first)
        c = (c + b) & MASK
        b = ((b - a) & MASK) ^ rot(a, second)
        a = (a + c) & MASK
        c = ((c - b) & MASK) ^ rot(b, third)
        b = (b + a) & MASK
    return a, b, c


def hash_little(text: bytes, start: int) -> int:
    """Return lookup3's ``hashlittle``, whose last step is the hash that noises take."""
    a = b = c = (0xDEADBEEF + len(text) + start) & MASK
    while len(text) > 12:
        words = np.frombuffer(text[:12], "<u4").tolist()
        a, b, c = mixed((a + words[0]) & MASK, (b + words[1]) & MASK, (c + words[2]) & MASK)
        text = text[12:]
    words = np.frombuffer(text.ljust(12, b"\0"), "<u4").tolist()
    parts = [np.array([(x + y) & MASK], np.uint32) for x, y in zip((a, b, c), words, strict=True)]
    return int(final_mix(*parts)[0])


def test_the_hash_is_that_of_lookup3() -> None:
    """The values that its own driver prints."""
    text = b"Four score and seven years ago"
    assert (hash_little(text, 0), hash_little(text, 1)) == (0x17770551, 0xCD628161)


def test_hashes_of_all_numbers_spread_evenly() -> None:
    x, y = np.meshgrid(np.arange(-50, 50), np.arange(-50, 50))
    bits = hashed(x.ravel(), y.ravel())
    counts = np.histogram(bits, 16, (0, 2**32))[0]
    assert np.abs(counts - 625).max() < 4 * np.sqrt(625)


def test_perlin_noise_is_0_at_whole_places_and_goes_on_smoothly() -> None:
    whole = RNG.integers(-9, 9, (50, 2)).astype(float)
    assert not perlin(whole).any()
    edge = np.stack([RNG.integers(-9, 9, 50), RNG.uniform(-9, 9, 50)], axis=1)
    step = np.array([1e-6, 0.0])
    before, at, after = perlin(edge - step), perlin(edge), perlin(edge + step)
    np.testing.assert_allclose(before, after, atol=2e-5)
    np.testing.assert_allclose(after - at, at - before, atol=1e-10)
    everywhere = perlin(RNG.uniform(-99, 99, (20000, 2)))
    assert np.abs(everywhere).max() < 1.05
    assert np.abs(everywhere.mean(axis=0)).max() < 0.02


def test_cells_have_one_number_each() -> None:
    places = RNG.integers(-9, 9, (500, 2)) + RNG.uniform(0, 1, (500, 2))
    np.testing.assert_array_equal(cells(places), cells(np.floor(places)))
    assert cells(places).min() >= 0
    assert cells(places).max() <= 1
    assert len(np.unique(cells(places))) == len(np.unique(np.floor(places), axis=0))


def test_worley_noise_is_the_distance_to_the_nearest_point() -> None:
    """Without jitter points are in the middles of cells; a field of distances has slopes of 1 and is 0 at points."""
    places = RNG.uniform(-9, 9, (500, 2))
    regular = np.linalg.norm(places - np.floor(places) - 0.5, axis=1)[:, None]
    np.testing.assert_allclose(worley(places, np.zeros((500, 1))), regular, atol=1e-12)
    one = np.ones((500, 1))
    step = 1e-6
    slopes = [(worley_vector(places + way, one) - worley_vector(places, one)) / step for way in np.eye(2) * step]
    np.testing.assert_allclose(np.hypot(*slopes), 1.0, atol=1e-3)
    three = worley_vector(places, one)
    np.testing.assert_array_equal(three[:, :1], worley(places, one))
    assert (np.diff(three, axis=1) >= 0).all()
