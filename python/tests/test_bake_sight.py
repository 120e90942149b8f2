"""Lines of sight and viewsheds against a slow walk over a height field, in fractions."""

from fractions import Fraction

import numpy as np
import pytest
from test_bake_occlusion import box, grid

import bth
import bth.bake


def hidden_by_force(vertices, faces, start, end):
    """Whether a triangle lies strictly between two points, in exact arithmetic. For lines that are in no triangle's plane."""
    start, end = ([Fraction(float(x)) for x in point] for point in (start, end))
    cross = lambda a, b: [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    minus = lambda a, b: [x - y for x, y in zip(a, b)]
    dot = lambda a, b: sum(x * y for x, y in zip(a, b))
    direction = minus(end, start)
    for face in faces:
        a, b, c = ([Fraction(float(x)) for x in vertices[k]] for k in face)
        normal = cross(minus(b, a), minus(c, a))
        slope = dot(normal, direction)
        if slope == 0:
            continue
        t = dot(normal, minus(a, start)) / slope
        point = [s + t * d for s, d in zip(start, direction)]
        sides = [dot(cross(minus(q, p), minus(point, p)), normal) for p, q in ((a, b), (b, c), (c, a))]
        if 0 < t < 1 and all(s >= 0 for s in sides):
            return True
    return False


def test_a_viewshed_of_a_height_field():
    vertices, faces = grid(7, 6.0)
    vertices[:, 2] = np.random.default_rng(1).uniform(0, 1.5, len(vertices))
    vertices = vertices.astype(np.float32)
    scene = bth.compile((vertices, faces))
    at = bth.bake.at_vertices(scene)
    observers = np.array([[0.3, 0.2, 2.0], [-2.6, 2.3, 1.8]], np.float32)
    for height in (0.0, 0.25):
        seen = bth.bake.viewshed(scene, observers, at, height=height)
        # Nothing hides a point that is just above its surface and its own.
        up = height * np.array([0, 0, 1.0])
        targets = at.position + up if height else at.position + 1e-9 * at.normal
        expected = [[not hidden_by_force(scene.vertices(), scene.triangles(), t, o) for t in targets] for o in observers]
        assert (seen == expected).all() and 5 < seen.sum() < seen.size - 5
    assert (bth.bake.viewshed(scene, observers, at, height=0.25, threads=3) == seen).all()


def test_lines_of_sight():
    scene = bth.compile(box([-1, -1, -1], [1, 1, 1]))
    outside, behind, beside = [0, 0, 5], [0, 0, -5], [3, 0, 5]
    assert bth.bake.line_of_sight(scene, [outside, beside], beside).tolist() == [True, True]
    assert not bth.bake.line_of_sight(scene, outside, behind)
    # A target on the surface is seen from its own side only, and two points of one face see each other.
    assert bth.bake.line_of_sight(scene, outside, [0.2, 0.3, 1]) and not bth.bake.line_of_sight(scene, behind, [0.2, 0.3, 1])
    assert bth.bake.line_of_sight(scene, [0.5, 0, 1], [-0.5, 0.25, 1])
    assert bth.bake.line_of_sight(scene, outside, outside)
    assert bth.bake.line_of_sight(scene, np.tile(outside, (4, 1, 1)), np.tile(beside, (3, 1))).shape == (4, 3)


def test_far_and_wrong_points():
    scene = bth.compile(box([-1e37, -1e37, -1e37], [1e37, 1e37, 1e37]))
    assert not bth.bake.line_of_sight(scene, [3e38, 0, 0], [-3e38, 0, 0])
    assert bth.bake.line_of_sight(scene, [3e38, 3e37, 0], [-3e38, 3e37, 0])
    assert not bth.bake.line_of_sight(scene, [[np.nan, 0, 0], [np.inf, 0, 0]], [0, 9e37, 0]).any()
    with pytest.raises(ValueError, match="observers"):
        bth.bake.line_of_sight(scene, [1, 2], [0, 0, 0])
    with pytest.raises(ValueError, match="height"):
        bth.bake.viewshed(scene, [0, 0, 0], height=np.nan)


@pytest.mark.parametrize("axis", [1, 2])
def test_above_ground(axis):
    scene, up = bth.compile(box([-1, -1, -1], [1, 1, 1])), np.eye(3)[axis]
    points = bth.bake.above_ground(scene, [[0.25, 0.25, 0.25], [7, 7, 7]], 1.5, up)
    expected = np.full(3, 0.25)
    expected[axis] = 2.5
    np.testing.assert_allclose(points[0], expected, rtol=1e-6)
    assert np.isnan(points[1]).any()


def test_lines_longer_than_float32_are_followed_to_their_end():
    vertices = np.float32([[1e38, -1e37, -1e37], [1e38, 1e37, -1e37], [1e38, 0, 1e37]])
    with pytest.warns(UserWarning):
        scene = bth.compile((vertices, [[0, 1, 2]]))
    ends = [[3e38, 0, 0], [9e37, 0, 0]]
    assert bth.bake.line_of_sight(scene, ends, [-3e38, 0, 0]).tolist() == [False, True]


def test_points_without_normal_are_not_seen():
    scene = bth.compile((np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 2, 0], [3, 3, 0], [4, 4, 0]]), [[0, 1, 2], [3, 4, 5]]))
    at = bth.bake.at_vertices(scene)
    assert at.usable.tolist() == [True] * 3 + [False] * 3
    assert bth.bake.viewshed(scene, [[0.5, 0.5, 9]], at).tolist() == [at.usable.tolist()]
