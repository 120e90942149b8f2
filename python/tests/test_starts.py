"""Rays that start on surfaces."""

import math

import numpy as np
import pytest
from conftest import sphere

import bth


@pytest.fixture(scope="module")
def hits(scene, rays):
    return scene.nearest(*rays)


@pytest.fixture(scope="module")
def directions(hits):
    return np.random.default_rng(11).normal(size=(*hits.t.shape, 3)).astype(np.float32)


def test_rays_leave_the_surface_on_which_they_start(scene, hits, directions):
    onward = scene.nearest(None, directions, start=hits)
    # Inside of a convex solid every ray hits another triangle; outside none does.
    inward = np.einsum("ij,ij->i", hits.normal, directions.astype(float)) < 0
    assert (onward.hit == (hits.hit & inward)).all() and 50 < onward.hit.sum() < len(directions) - 50
    assert (onward.t > 0).all() and (onward.triangle != hits.triangle)[onward.hit].all()
    assert (scene.any(None, directions, start=hits) == onward.hit).all()
    expected = hits.surface().position + onward.t.astype(float)[:, None] * directions
    np.testing.assert_allclose(onward.position[onward.hit], expected[onward.hit], atol=1e-5)
    assert np.isnan(onward.position[~onward.hit]).all()
    every = scene.all_hits(None, directions, start=hits)
    assert (np.diff(every.offsets) == onward.hit).all() and (every.t == onward.t[onward.hit]).all()
    assert (scene.all_hits(None, directions, start=hits, most=1).triangle == every.triangle).all()
    assert (scene.count(None, directions, start=hits) == onward.hit).all()
    crossings, winding = scene.crossings(None, directions, start=hits)
    assert (crossings == onward.hit).all() and (winding == onward.hit).all()


def test_the_ends_of_rays(scene, hits, directions):
    t = scene.nearest(None, directions, start=hits).t
    assert (scene.any(None, directions, tmax=t, start=hits) == np.isfinite(t)).all()
    before = np.where(np.isfinite(t), np.nextafter(t, np.float32(0)), np.float32(np.inf))
    assert not scene.any(None, directions, tmax=before, start=hits).any()
    assert not scene.nearest(None, directions, tmax=0, start=hits).hit.any()


def test_batches_are_the_same_as_single_rays_on_any_number_of_threads(scene, hits, directions):
    expected = scene.nearest(None, directions, start=hits, threads=1)
    for threads in (2, 5):
        assert (scene.nearest(None, directions, start=hits, threads=threads).t == expected.t).all()
    for row in range(0, len(directions), 29):
        start = hits.instance[row], hits.triangle[row], [hits.u[row], hits.v[row]]
        one = scene.nearest(None, directions[row], start=start)
        assert one.t.shape == () and one.t == expected.t[row] and one.triangle == expected.triangle[row]


def test_shapes_are_broadcast(scene, hits, directions):
    uv = np.stack([hits.u, hits.v], -1)
    start = hits.instance[:, None], hits.triangle[:, None], uv[:, None]
    found = scene.nearest(None, directions[:7], start=start)
    assert found.t.shape == (len(directions), 7)
    for k in range(7):
        assert (found.t[:, k] == scene.nearest(None, directions[k], start=hits).t).all()
    # Starts alone, directions alone, a triangle with several points.
    assert scene.any(None, [0, 0, 1], start=hits).shape == hits.t.shape
    assert scene.any(None, directions, start=(0, 5, [0.25, 0.25])).shape == (len(directions),)
    assert scene.count(None, [0, 0, 1], start=(0, 5, np.full((2, 3, 2), 0.25))).shape == (2, 3)
    assert scene.nearest(None, np.zeros((0, 3)), start=(0, 5, [0.25, 0.25])).t.shape == (0,)
    assert len(scene.all_hits(None, np.zeros((0, 3)), start=(np.zeros(0, int), np.zeros(0, int), np.zeros((0, 2))))) == 0
    # Points of other queries are starts, too.
    closest = scene.closest([[0, 0, 2], [0.9, 0, 0]])
    assert not scene.any(None, closest.point, start=closest).any() and scene.any(None, -closest.point, start=closest).all()


def test_no_offset_is_needed_anywhere():
    """Two sheets nearer to each other than any offset, far from the origin: every ray between them hits the other one."""
    low = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]) + 1000.0
    high = low.astype(np.float32)
    high[:, 2] = np.nextafter(high[:, 2], np.float32(np.inf))
    scene = bth.compile((np.concatenate([low.astype(np.float32), high]), [[0, 1, 2], [3, 4, 5]]))
    uv = np.random.default_rng(2).dirichlet([1, 1, 1], 500)[:, :2] * 0.99
    up, down = (scene.nearest(None, [0, 0, z], start=(0, triangle, uv)) for z, triangle in ((1, 0), (-1, 1)))
    assert (up.triangle == 1).all() and (down.triangle == 0).all()
    assert (up.t == np.float32(high[0, 2]) - np.float32(1000)).all() and (down.t == up.t).all()


def test_what_is_no_start_is_a_miss_that_is_explained(scene, mesh):
    count = len(mesh[1])
    for start, code, says in (
        ((1, 0, [0, 0]), "BTH-S003", "an instance below 1"), ((0, count, [0, 0]), "BTH-S008", f"triangle {count} of instance 0"),
        ((0, 0, [-0.5, 0]), "BTH-S008", "u = -0.5"), ((0, 0, [0.75, 0.5]), "BTH-S008", r"u \+ v <= 1"), ((0, 0, [math.nan, 0]), "BTH-S008", "NaN"),
        ((bth.NONE, bth.NONE, [0, 0]), "BTH-S003", "4294967295"),
    ):
        assert not scene.nearest(None, [0, 0, 1], start=start).hit and not scene.any(None, np.eye(3), start=start).any()
        with pytest.raises(bth.Error, match=f"^start: .*{says}") as error:
            scene.check_start(start)
        assert error.value.code == code
    scene.check_start((0, np.arange(count), np.full((count, 2), 1 / 3)))
    with pytest.raises(bth.Error, match="^start 2: BTH-S008"):
        scene.check_start((0, [0, 1, count], [0.25, 0.25]))
    misses = scene.nearest([9, 9, 9], [[1, 0, 0], [0, 1, 0]])
    assert not scene.any(None, [-1, -1, -1], start=misses).any()
    with pytest.raises(bth.Error, match="^start 0: BTH-S003"):
        scene.check_start(misses)


def test_scenes_of_instances():
    vertices, faces = sphere(6, 8)
    matrices = np.tile(np.eye(4), (3, 1, 1))
    matrices[:, 0, 3] = [0, 4, 8]
    matrices[1, :3, :3] *= [[-1], [1], [1]]
    row = bth.compile_scene([(vertices, faces)], [0, 0, 0], matrices, quality="fast")
    hits = row.nearest([[-5, 0.1, 0.2], [13, 0.1, 0.2]], [[1, 0, 0], [-1, 0, 0]])
    assert hits.instance.tolist() == [0, 2]
    every = row.all_hits(None, [[1, 0, 0], [-1, 0, 0]], start=hits)
    assert every.instance.tolist() == [0, 1, 1, 2, 2, 2, 1, 1, 0, 0] and (np.diff(every.t[:5]) > 0).all()
    row.set_instance_mask(1, 2)
    assert row.all_hits(None, [1, 0, 0], start=(0, hits.triangle[0], [hits.u[0], hits.v[0]]), mask=1).instance.tolist() == [0, 2, 2]


@pytest.mark.parametrize("given, error, says", [
    (dict(start=None), TypeError, r"^origins: expected an array .*, got None \(hint: None takes start=\)"),
    (dict(tmin=0.5), ValueError, r"^tmin: expected none together with start, got 0.5 \(hint: "),
    (dict(tmin=np.zeros(2)), ValueError, "^tmin: expected none together with start"),
    (dict(tmin=math.nan), ValueError, "^tmin: expected none together with start"),
    (dict(origins=[0, 0, 0]), ValueError, r"^origins: expected None together with start, got both \(hint: "),
    (dict(start=7), TypeError, r"^start: expected Hits or \(instances, triangles, uv\), got int"),
    (dict(start=(0, 0)), TypeError, r"^start: expected Hits or \(instances, triangles, uv\), got 2 of them"),
    (dict(start=(-1, 0, [0, 0])), IndexError, "^start: instances: expected indices from 0, got -1"),
    (dict(start=(0, 1 << 32, [0, 0])), IndexError, "^start: triangles: expected indices from 0, got 4294967296"),
    (dict(start=(0.5, 0, [0, 0])), TypeError, "^start: instances: expected integers"),
    (dict(start=(0, 0, "ab")), TypeError, "^start: uv: expected numbers"),
    (dict(start=(0, 0, 0.5)), ValueError, r"^start: expected uv of the shape \(..., 2\), got \(\)"),
    (dict(start=(0, 0, [0, 0, 1])), ValueError, r"^start: expected uv of the shape \(..., 2\), got \(3,\)"),
    (dict(start=([0, 0, 0], [0, 1], [0, 0])), ValueError, r"^start: expected shapes that fit together, got instances \(3,\), triangles \(2,\) and uv \(2,\)"),
    (dict(start=(0, [0, 1, 2], [0, 0]), directions=np.ones((2, 3))), ValueError, r"^start and directions: .* got \(3,\) starts and directions of the shape \(2, 3\)"),
    (dict(tmax=np.ones(3), directions=np.ones((2, 3))), ValueError, r"^tmax: the shape \(3,\) does not fit \(2,\)"),
    (dict(directions=[0, 1]), ValueError, r"^directions: expected the shape \(..., 3\), got \(2,\)"),
])
def test_wrong_arguments(scene, given, error, says):
    given = {"origins": None, "directions": [0, 0, 1], "start": (0, 0, [0.25, 0.25]), **given}
    for query in (scene.nearest, scene.any, scene.count, scene.all_hits, scene.crossings):
        with pytest.raises(error, match=says):
            query(**given)
