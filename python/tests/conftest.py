"""Meshes that the tests share, and an exact oracle."""

import os

import numpy as np
import pytest

os.environ["BTH_NO_CACHE"] = "1"


def sphere(rings=12, sectors=24):
    """A closed sphere of radius 1 around the origin, its triangles counter-clockwise seen from outside."""
    theta = np.linspace(0, np.pi, rings + 1)[1:-1]
    phi = np.linspace(0, 2 * np.pi, sectors, endpoint=False)
    ring = np.stack([np.outer(np.sin(theta), np.cos(phi)), np.outer(np.sin(theta), np.sin(phi)),
                     np.repeat(np.cos(theta)[:, None], sectors, 1)], -1)
    vertices = np.concatenate([[[0, 0, 1]], ring.reshape(-1, 3), [[0, 0, -1]]])
    at = lambda r, s: 1 + r * sectors + s % sectors
    faces = [[0, at(0, s), at(0, s + 1)] for s in range(sectors)]
    for r in range(rings - 2):
        for s in range(sectors):
            faces += [[at(r, s), at(r + 1, s), at(r + 1, s + 1)], [at(r, s), at(r + 1, s + 1), at(r, s + 1)]]
    faces += [[len(vertices) - 1, at(rings - 2, s + 1), at(rings - 2, s)] for s in range(sectors)]
    return vertices.astype(np.float32), np.array(faces, np.uint32)


def hits_by_force(vertices, faces, origin, direction):
    """All hits of one ray in float64: pairs (t, triangle), ascending. For rays that meet no edge and no vertex."""
    a, b, c = (vertices[faces[:, k]].astype(np.float64) for k in range(3))
    origin, direction = np.asarray(origin, np.float64), np.asarray(direction, np.float64)
    normal = np.cross(b - a, c - a)
    with np.errstate(all="ignore"):
        t = np.einsum("ij,ij->i", normal, a - origin) / (normal @ direction)
    point = origin + t[:, None] * direction
    inside = np.isfinite(t) & (t >= 0)
    for p, q in ((a, b), (b, c), (c, a)):
        inside &= np.einsum("ij,ij->i", np.cross(q - p, point - p), normal) >= 0
    order = np.nonzero(inside)[0]
    return sorted(zip(t[order], order))


@pytest.fixture(scope="session")
def mesh():
    return sphere()


@pytest.fixture(scope="session")
def scene(mesh):
    import bth

    return bth.compile(mesh)


@pytest.fixture(scope="session")
def rays():
    random = np.random.default_rng(7)
    origins = random.normal(size=(400, 3)) * 2
    directions = random.normal(size=(400, 3))
    directions[::2] = random.normal(size=(200, 3)) * 0.3 - origins[::2]
    return origins.astype(np.float32), directions.astype(np.float32)
