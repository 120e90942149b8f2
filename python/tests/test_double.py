"""Queries in float64, against exact arithmetic: nothing is rounded on the way in, and answers are float64."""

from fractions import Fraction

import numpy as np
import pytest

import bth
from bth.embreex.mesh_construction import TriangleMesh
from bth.embreex.rtcore_scene import EmbreeScene
from bth.open3d import RaycastingScene

#: Bound of the error of t and of distances, relative to them.
CLOSE = 2.0**-40


def grid(corner, step, count):
    """A flat grid of 2 count² triangles in float32 numbers, and a bumpy one below it."""
    x, y = np.meshgrid(np.arange(count + 1), np.arange(count + 1), indexing="ij")
    flat = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3) * step + corner
    low = flat + np.random.default_rng(2).integers(-2, 3, flat.shape) * [0, 0, step] - [0, 0, 8 * step]
    first = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).reshape(-1, 1)
    faces = np.concatenate([first + [0, count + 1, count + 2], first + [0, count + 2, 1]])
    vertices = np.concatenate([flat, low])
    assert (vertices.astype(np.float32) == vertices).all()
    return vertices, np.concatenate([faces, faces + len(flat)])


def exact_hits(vertices, faces, origin, direction):
    """All hits of a ray in rational numbers: pairs (t, triangle), ascending."""
    rational = lambda row: [Fraction(float(x)) for x in row]
    minus = lambda a, b: [x - y for x, y in zip(a, b)]
    cross = lambda a, b: [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    dot = lambda a, b: sum(x * y for x, y in zip(a, b))
    origin, direction, found = rational(origin), rational(direction), []
    for triangle, face in enumerate(faces):
        a, b, c = (rational(vertices[corner]) for corner in face)
        b, c, o = minus(b, a), minus(c, a), minus(origin, a)
        p, q = cross(direction, c), cross(o, b)
        determinant = dot(b, p)
        if determinant:
            u, v, t = dot(o, p) / determinant, dot(direction, q) / determinant, dot(c, q) / determinant
            if min(u, v, t, 1 - u - v) >= 0:
                found.append((t, triangle))
    return sorted(found)


@pytest.fixture(scope="module", params=[((0, 0, 0), 1.0), ((5.5e6, 4.2e5, 300), 0.5), ((-2**23, 2**22, 0), 1.0)], ids=["near", "national", "far"])
def place(request):
    """A grid, its scene, and rays that pass its edges by less than float32 can tell."""
    corner, step = request.param
    vertices, faces = grid(np.array(corner), step, 4)
    random = np.random.default_rng(5)
    a, b = vertices[faces[random.integers(32, size=60), :2]].transpose(1, 0, 2)
    targets = a + random.uniform(size=(60, 1)) * (b - a) + step * random.choice([-1, 1], (60, 3)) * 1e-9
    origins = targets + step * random.uniform(-2, 2, (60, 3)) + [0, 0, 5 * step]
    return vertices, faces, bth.compile((vertices, faces)), origins, targets - origins


def test_rays_against_rational_numbers(place):
    vertices, faces, scene, origins, directions = place
    nearest, every = scene.nearest(origins, directions), scene.all_hits(origins, directions)
    expected = [exact_hits(vertices, faces, *ray) for ray in zip(origins, directions)]
    assert nearest.triangle.tolist() == [hits[0][1] if hits else bth.NONE for hits in expected]
    assert scene.any(origins, directions).tolist() == [bool(hits) for hits in expected]
    assert scene.count(origins, directions).tolist() == np.diff(every.offsets).tolist() == [len(hits) for hits in expected]
    assert sum(map(bool, expected)) > 30
    for i, hits in enumerate(expected):
        rows = slice(every.offsets[i], every.offsets[i + 1])
        assert sorted(every.triangle[rows]) == sorted(triangle for _, triangle in hits)
        assert all(abs(Fraction(t) - exact) <= exact * Fraction(CLOSE) for t, (exact, _) in zip(every.t[rows].tolist(), hits))
        if hits:
            assert nearest.t[i] == every.t[rows][0]
            point = [Fraction(o) + hits[0][0] * Fraction(d) for o, d in zip(origins[i].tolist(), directions[i].tolist())]
            error = max(abs(float(Fraction(x) - y)) for x, y in zip(nearest.position[i].tolist(), point))
            assert error <= 2.0**-52 * np.abs(origins[i]).max() + CLOSE * np.abs(directions[i]).max() * nearest.t[i]
    single = scene.nearest(origins.astype(np.float32), directions.astype(np.float32))
    assert single.t.dtype == np.float32 and (single.triangle != nearest.triangle).any()


def test_ends_of_rays_are_not_rounded(place):
    _, _, scene, origins, directions = place
    hits = scene.nearest(origins, directions)
    origins, directions, t = origins[hits.hit], directions[hits.hit], hits.t[hits.hit]
    before, behind = t * (1 - 2 * CLOSE), t * (1 + 2 * CLOSE)
    assert scene.any(origins, directions, tmax=behind).all() and not scene.any(origins, directions, tmax=before).any()
    assert (scene.nearest(origins, directions, tmin=before).t == t).all()
    assert (scene.nearest(origins, directions, tmin=behind).t > t).all()
    assert (scene.count(origins, directions, tmin=before) > scene.count(origins, directions, tmin=behind)).all()
    passed = [scene.crossings(origins, directions, tmax=end)[0] for end in (before, behind)]
    assert (passed[1] == 1).all() and not passed[0].any()


def test_types_of_answers(mesh, scene):
    single, double, whole = np.float32([0, 0, 3]), np.array([0, 0, 3.0]), np.array([0, 0, -1], np.int8)
    for origins, directions, t in [(single, whole, np.float32), (double, whole, np.float64), (single, [0, 0, -1], np.float64), ([0, 0, 3], whole, np.float64)]:
        assert scene.nearest(origins, directions).t.dtype == scene.all_hits(origins, directions).t.dtype == t
    assert scene.nearest(single, whole, tmax=np.array(9.0)).t.dtype == scene.nearest(single, whole, 0.1, 9.5).t.dtype == np.float32
    assert scene.nearest(single[None], whole, tmax=np.array([9.0])).t.dtype == np.float64
    hits = scene.nearest(double, whole)
    assert hits.u.dtype == hits.v.dtype == np.float32 and hits.position.dtype == np.float64
    out = scene.nearest(None, np.float32([0, 0, 1]), start=hits), scene.nearest(None, [0.0, 0.0, 1.0], start=hits)
    assert [o.t.dtype for o in out] == [np.float32, np.float64] and not out[0].hit and not out[1].hit
    inwards = scene.nearest(None, [0.0, 0.0, -1.0], start=hits)
    assert inwards.t.dtype == np.float64 and abs(inwards.t - 2) < 1e-6
    for points, kind in ((single, np.float32), (double, np.float64), ([0, 0, 3], np.float64)):
        closest = scene.closest(points)
        assert closest.distance.dtype == closest.point.dtype == scene.signed_distance(points).dtype == kind
        assert closest.u.dtype == np.float32 and closest.distance == 2


def test_filters_see_t_in_float64(place):
    _, _, scene, origins, directions = place
    hits, seen = scene.nearest(origins, directions), {}
    filtered = scene.nearest(origins, directions, filter=lambda c: seen.setdefault((c.ray, c.triangle), c.t) >= 0)
    assert (filtered.t == hits.t).all() and (filtered.triangle == hits.triangle).all()
    assert all(seen[i, hits.triangle[i]] == hits.t[i] for i in np.nonzero(hits.hit)[0])


def test_surfaces_nearer_to_each_other_than_float32():
    triangle = np.float32([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), [[0, 1, 2]]
    transforms = np.tile(np.eye(4), (3, 1, 1))
    transforms[:, 2, 3] = [0, 1e-9, -1e-9]
    scene = bth.compile_scene([triangle], [0, 0, 0], transforms)
    ray = [0.2, 0.2, 1.0], [0, 0, -1]
    hits, every = scene.nearest(*ray), scene.all_hits(*ray)
    assert hits.instance == 1 and hits.t == every.t[0] and abs(hits.t - (1 - 1e-9)) < CLOSE
    assert every.instance.tolist() == [1, 0, 2] and (np.diff(every.t) > 0).all()
    assert scene.any(*ray, tmax=np.full((), hits.t)) and scene.nearest(np.array([ray[0]]), ray[1], tmin=np.array([1.0])).instance == 0


def test_points_within_less_than_float32_of_a_surface():
    side, tiny = 2.0**20, 2.0**-30
    corners = np.array([[x, y, z] for x in (0, side) for y in (0, side) for z in (0, side)])
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    scene = bth.compile((corners, faces))
    middle = side / 3
    points = np.array([[side + tiny, middle, middle], [side - tiny, middle, middle], [middle, -tiny, middle], [middle, tiny, middle]])
    assert scene.contains(points).tolist() == [False, True, False, True]
    assert np.abs(scene.winding(points)).tolist() == [0, 1, 0, 1]
    # The errors that docs/accuracy.md states: relative to the distance, and half a unit of a coordinate.
    np.testing.assert_allclose(scene.signed_distance(points), [tiny, -tiny, tiny, -tiny], rtol=2.0**-28)
    closest = scene.closest(points, radius=2 * tiny)
    np.testing.assert_allclose(closest.distance, tiny, rtol=2.0**-28)
    np.testing.assert_allclose(closest.point, np.round(points / side * 3) / 3 * side, rtol=0, atol=CLOSE * side)
    assert not scene.closest(points, radius=tiny / 2).found.any()
    outside = points[[0, 2]]
    assert not scene.overlaps_box(outside, outside + [0.1, 0, 0.1]).any() and scene.overlaps_box(points - tiny, points).tolist() == [True, False, False, True]
    assert not scene.overlaps_sphere(points, np.full(4, tiny * 0.99)).any() and scene.overlaps_sphere(points, np.full(4, tiny)).all()
    assert len(scene.triangles_in_sphere(points, tiny)) >= 4 and len(scene.triangles_in_box(outside, outside)) == 0


def test_integers_are_not_rounded(place):
    vertices, _, scene, _, _ = place
    point = np.array([2**24 + 1, 0, 0])
    assert scene.closest(point).distance == scene.closest(point.astype(np.float64)).distance


def test_arrays_whose_numbers_are_float32_are_the_same_file():
    vertices, faces = grid(np.array([2.0**20, 0, 0]), 0.5, 3)
    single = bth.compile((vertices.astype(np.float32), faces)).to_bytes()
    for positions in (None, "auto", "f32", "f64"):
        assert bth.compile((vertices, faces), positions=positions).to_bytes() == single
    assert bth.compile_scene([(vertices, faces)], positions="f64").to_bytes() == bth.compile_scene([(vertices.astype(np.float32), faces)]).to_bytes()
    with pytest.raises(ValueError, match="positions: expected 'auto', 'f32', 'f64', got 'f16'"):
        bth.compile((vertices, faces), positions="f16")


@pytest.mark.parametrize("positions", [None, "auto", "f64"])
def test_positions_in_float64(positions, recwarn):
    vertices, faces = grid(np.array([5.5e6, 4.2e5, 300]), 0.5, 4)
    vertices += np.random.default_rng(3).uniform(-1e-3, 1e-3, vertices.shape)
    scene = bth.compile((vertices, faces), positions=positions)
    assert not recwarn.list
    middles = vertices[faces].mean(axis=1)
    origins, directions = middles + [0, 0, 20], np.array([0, 0, -1.0])
    hits = scene.nearest(origins[:32], directions)
    expected = [exact_hits(vertices, faces, origin, directions)[0] for origin in origins[:32]]
    assert hits.triangle.tolist() == [triangle for _, triangle in expected]
    np.testing.assert_allclose(hits.t, [float(t) for t, _ in expected], rtol=CLOSE)
    closest = scene.closest(middles)
    assert (closest.distance < 1e-9).all()
    assert (scene.triangle_positions(0, np.arange(len(faces))) == vertices[faces]).all()
    assert scene.vertices().dtype == np.float64 and (scene.vertices()[scene.triangles()] == vertices[faces]).all()


def test_float32_positions_are_warned_of_for_each_mesh():
    vertices, faces = grid(np.array([5.5e6, 4.2e5, 300]), 0.5, 4)
    vertices[:, 0] += 0.1
    with pytest.warns(UserWarning, match=r"moves 50 of 50 positions, by up to 1\.00e-1 .* 0 of 64 triangles lose their area"):
        assert bth.compile((vertices, faces), positions="f32").vertices().dtype == np.float32
    with pytest.warns(UserWarning, match="mesh 1.*moves 50 of 50 positions"):
        bth.compile_scene([(vertices - vertices[0], faces), (vertices, faces)], positions="f32")


def test_drop_ins_round_no_ray(place):
    vertices, faces, scene, origins, directions = place
    hits = scene.nearest(origins, directions)
    first = np.where(hits.hit, hits.triangle.astype(int), -1)
    embree = EmbreeScene()
    TriangleMesh(embree, vertices, faces)
    assert (embree.run(origins, directions) == first).all()
    assert (embree.run(origins, directions, query="DISTANCE") == np.where(hits.hit, hits.t, 1e37)).all()
    assert (embree.run(origins, directions, dists=np.where(hits.hit, hits.t * (1 - 2 * CLOSE), 1.0)) == -1).all()
    open3d = RaycastingScene()
    open3d.add_triangles(vertices, faces)
    cast = open3d.cast_rays(np.concatenate([origins, directions], axis=1))
    assert (cast["primitive_ids"] == hits.triangle).all() and (cast["t_hit"] == hits.t).all() and cast["t_hit"].dtype == np.float64
    assert open3d.compute_distance(origins).dtype == np.float64
    trimesh = pytest.importorskip("trimesh")
    from bth.trimesh import RayMeshIntersector

    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert (RayMeshIntersector(mesh).intersects_first(origins, directions) == first).all()


def test_drop_ins_round_no_vertex(recwarn):
    trimesh = pytest.importorskip("trimesh")
    from bth.trimesh import RayMeshIntersector

    mesh = trimesh.creation.icosphere(subdivisions=2, radius=10)
    mesh.apply_translation([5.5e6, 4.2e5, 300])
    random = np.random.default_rng(9)
    origins = mesh.center_mass + random.normal(size=(60, 3)) * 30
    directions = mesh.triangles_center[random.integers(len(mesh.faces), size=60)] + random.normal(size=(60, 3)) - origins
    expected = [exact_hits(mesh.vertices, mesh.faces, *ray) for ray in zip(origins, directions)]
    first = [hits[0][1] if hits else -1 for hits in expected]
    ray = RayMeshIntersector(mesh)
    triangles, rays, locations = ray.intersects_id(origins, directions, return_locations=True)
    assert triangles.tolist() == [triangle for hits in expected for _, triangle in hits] and len(triangles) > 60
    assert rays.tolist() == [i for i, hits in enumerate(expected) for _ in hits]
    points = (
        [Fraction(o) + t * Fraction(d) for o, d in zip(origins[i].tolist(), directions[i].tolist())]
        for i, hits in enumerate(expected) for t, _ in hits
    )
    assert max(abs(Fraction(x) - y) for found, point in zip(locations.tolist(), points) for x, y in zip(found, point)) < 1e-9
    assert ray.intersects_first(origins, directions).tolist() == first
    embree, open3d = EmbreeScene(), RaycastingScene()
    TriangleMesh(embree, mesh.vertices, mesh.faces)
    open3d.add_triangles(mesh.vertices, mesh.faces)
    assert embree.run(origins, directions).tolist() == first
    assert open3d.cast_rays(np.concatenate([origins, directions], axis=1))["primitive_ids"].astype(np.int32).tolist() == first
    assert not recwarn.list
