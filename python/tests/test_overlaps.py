"""Overlaps of triangles with boxes and balls, against plain numpy."""

import numpy as np
import pytest

import bth

INF, NAN = float("inf"), float("nan")


def _overlaps_box(corners, lower, upper):
    """The separating axis theorem in float64, for triangles that do not just touch."""
    center, half = (lower + upper) / 2, (upper - lower) / 2
    corners = corners - center
    edges = np.roll(corners, -1, axis=0) - corners
    axes = np.concatenate([np.eye(3), [np.cross(edges[0], edges[1])], np.cross(np.eye(3)[:, None], edges).reshape(-1, 3)])
    heights, reach = corners @ axes.T, np.abs(axes) @ half
    return not ((heights.min(0) > reach) | (heights.max(0) < -reach)).any()


def test_boxes(scene, mesh):
    random = np.random.default_rng(5)
    lower = random.uniform(-1.2, 1.0, (80, 3)).astype(np.float32)
    upper = lower + random.uniform(0, 0.6, (80, 3)).astype(np.float32)
    corners = mesh[0][mesh[1]].astype(float)
    expected = [[i for i, c in enumerate(corners) if _overlaps_box(c, lo, up)] for lo, up in zip(lower.astype(float), upper.astype(float))]
    found = scene.triangles_in_box(lower, upper)
    assert found.offsets.tolist() == [0, *np.cumsum([len(e) for e in expected])]
    assert found.triangle.tolist() == sum(expected, []) and not found.instance.any()
    assert (np.diff(found.offsets) == np.bincount(found.region, minlength=80)).all() and len(found) == len(found.triangle)
    assert scene.overlaps_box(lower, upper).tolist() == [bool(e) for e in expected]
    assert 20 < sum(map(bool, expected)) < 79
    assert scene.overlaps_box(lower.reshape(8, 10, 3), upper.reshape(8, 10, 3)).shape == (8, 10)


def test_balls(scene):
    random = np.random.default_rng(6)
    centers = random.normal(size=(50, 3)).astype(np.float32)
    distance = scene.closest(centers).distance
    radius = distance * random.choice([0.9, 1.0, 1.5], 50).astype(np.float32)
    assert (scene.overlaps_sphere(centers, radius) == (distance <= radius)).all()
    found = scene.triangles_in_sphere(centers, radius)
    assert ((np.diff(found.offsets) > 0) == (distance <= radius)).all()
    nearest = scene.closest(centers).triangle
    for i in np.nonzero(distance <= radius)[0]:
        assert nearest[i] in found.triangle[found.offsets[i]:found.offsets[i + 1]]
    assert scene.overlaps_sphere([0, 0, 0], [0.5, 0.9, 1.0, 1.1]).tolist() == [False, False, True, True]
    assert scene.overlaps_sphere(np.zeros((2, 1, 3)), [0.5, 1.1, 1.2]).shape == (2, 3)


def test_boxes_and_balls_that_are_none(scene, mesh):
    assert len(scene.triangles_in_box([-INF] * 3, [INF] * 3)) == len(mesh[1])
    assert scene.overlaps_box([-INF] * 3, [INF] * 3) and not scene.overlaps_box([1] * 3, [1] * 3)
    assert not scene.overlaps_box([NAN] * 3, [1] * 3) and not scene.overlaps_sphere([NAN] * 3, 9) and not scene.overlaps_sphere([0] * 3, NAN)
    assert scene.overlaps_sphere([0] * 3, INF)
    assert len(scene.triangles_in_box(np.zeros((0, 3)), np.zeros((0, 3)))) == len(scene.triangles_in_sphere([], 1)) == 0
    for wrong in (lambda: scene.overlaps_box([0, 0], [1, 1, 1]), lambda: scene.overlaps_box(np.zeros((2, 3)), np.zeros((4, 3))),
                  lambda: scene.overlaps_sphere(np.zeros((2, 3)), np.zeros(3))):
        with pytest.raises(ValueError):
            wrong()
    with pytest.raises(TypeError):
        scene.overlaps_sphere([0, 0, 0], "big")


def test_instances():
    mesh = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]
    away = np.eye(4)
    away[:3, 3] = [5, 0, 0]
    scene = bth.compile_scene([mesh], [0, 0], [np.eye(4), away])
    found = scene.triangles_in_box([[-1] * 3, [4, -1, -1], [-1] * 3, [2] * 3], [[2] * 3, [9, 1, 1], [9] * 3, [3] * 3])
    assert found.region.tolist() == [0, 1, 2, 2] and found.instance.tolist() == [0, 1, 0, 1]
    assert "4 regions, 4 triangles" in repr(found)
