# SPDX-FileCopyrightText: The warp_rt maintainers
# SPDX-License-Identifier: Apache-2.0
"""What a hierarchy saves: the lecture's intersect(node, ray, hits) in NumPy, every test of every ray counted.

python examples/07_why_hierarchies.py
"""

import argparse

import numpy as np


def wavy_surface(n):
    """Return the corners of 2 (n - 1)^2 triangles: shape [m, 3, 3]."""
    x, y = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), indexing="ij")
    p = np.stack([x, y, 0.2 * np.cos(6 * np.hypot(x, y))], axis=-1)
    halves = (p[:-1, :-1], p[1:, :-1], p[1:, 1:]), (p[:-1, :-1], p[1:, 1:], p[:-1, 1:])
    return np.concatenate([np.stack(half, axis=2).reshape(-1, 3, 3) for half in halves])


def build(corners, rule):
    """Split at the midpoint, or sort and put half of the triangles on each side; until a leaf has one or two."""
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    radius = np.linalg.norm(corners - (low + high) / 2, axis=2).max()
    node = {"low": low, "high": high, "radius": radius, "triangles": corners, "children": ()}
    centroid = corners.mean(axis=1)[:, np.ptp(corners.mean(axis=1), axis=0).argmax()]
    middle = (centroid.min() + centroid.max()) / 2 if rule == "midpoint" else np.median(centroid)
    if len(corners) > 2 and 0 < (left := centroid < middle).sum() < len(corners):
        node["children"] = build(corners[left], rule), build(corners[~left], rule)
    return node


def is_met(node, origin, direction, volume):
    """Return which rays' lines meet the node's bounding volume."""
    if volume == "spheres":
        to_center = (node["low"] + node["high"]) / 2 - origin
        return np.linalg.norm(np.cross(to_center, direction), axis=1) <= node["radius"]  # unit directions
    planes = (np.stack([node["low"], node["high"]])[:, None] - origin) / direction
    return planes.min(axis=0).max(axis=1) <= planes.max(axis=0).min(axis=1)


def intersect(node, origin, direction, volume):
    """Return the number of tests: those of this node's volume, and of what lies beneath where it is met."""
    met = is_met(node, origin, direction, volume)
    if met.any() and node["children"]:
        return len(met) + sum(intersect(child, origin[met], direction[met], volume) for child in node["children"])
    return len(met) + met.sum() * len(node["triangles"])


argparse.ArgumentParser(description=__doc__.partition("\n")[0]).parse_args()
rng = np.random.default_rng(0)
direction = rng.normal((0.0, 0.0, -1.0), 0.3, (1000, 3))
direction /= np.linalg.norm(direction, axis=1, keepdims=True)
origin = rng.uniform((-0.5, -0.5, 2.0), (0.5, 0.5, 2.0), (1000, 3))
print("triangles  brute force  midpoint: boxes  spheres  median: boxes  spheres   tests a ray")
for n in (8, 23, 72):
    trees = [build(wavy_surface(n), rule) for rule in ("midpoint", "median")]
    tests = [intersect(tree, origin, direction, volume) / 1000 for tree in trees for volume in ("boxes", "spheres")]
    print("{0:9}{0:13}{1:17.1f}{2:9.1f}{3:15.1f}{4:9.1f}".format(len(trees[0]["triangles"]), *tests))
