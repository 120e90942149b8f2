#!/usr/bin/env python3
"""Makes a terrain of 40,000 triangles to try `python -m bth sight` with: python3 python/examples/terrain.py terrain.ply

It is 100 units wide, z is up. Heights are a sum of waves of random directions, shorter ones lower.
"""

import sys

import numpy as np

import bth.bake


def terrain(points: int = 142, seed: int = 5) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) and faces (m, 3) of a square of so many points along each side."""
    random = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(-50, 50, points), np.linspace(-50, 50, points), indexing="ij")
    height = np.zeros_like(x)
    for length in np.geomspace(90, 5, 24):
        angle, phase = random.uniform(0, 2 * np.pi, 2)
        wave = np.sin((x * np.cos(angle) + y * np.sin(angle)) * 2 * np.pi / length + phase)
        # Ridges are sharp, as those of mountains.
        height += 0.0045 * length**1.3 * (1 - 2 * np.abs(wave))
    corner = (np.arange(points - 1)[:, None] * points + np.arange(points - 1)).reshape(-1)
    faces = np.concatenate([
        np.stack([corner, corner + points, corner + points + 1], axis=-1), np.stack([corner, corner + points + 1, corner + 1], axis=-1)
    ])
    return np.stack([x, y, height], axis=-1).reshape(-1, 3), faces


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    vertices, faces = terrain()
    x, y, z = vertices.astype(np.float32).T
    bth.bake.write_ply(sys.argv[1], {"x": x, "y": y, "z": z}, faces)
