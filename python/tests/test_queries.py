"""Each query against plain numpy."""

import numpy as np
import pytest
from conftest import hits_by_force

import bth


@pytest.fixture(scope="module")
def by_force(mesh, rays):
    return [hits_by_force(*mesh, o, d) for o, d in zip(*rays)]


def test_nearest(scene, rays, by_force):
    hits = scene.nearest(*rays)
    assert hits.t.dtype == np.float32 and hits.triangle.dtype == np.uint32
    assert 100 < hits.hit.sum() < 400
    for i, expected in enumerate(by_force):
        assert hits.hit[i] == bool(expected)
        if expected:
            t, triangle = expected[0]
            assert hits.triangle[i] == triangle and hits.instance[i] == 0
            assert hits.t[i] == pytest.approx(t, rel=1e-6)
        else:
            assert hits.t[i] == np.inf and hits.triangle[i] == bth.NONE


def test_barycentric_coordinates_give_the_point(scene, mesh, rays):
    hits = scene.nearest(*rays)
    a, b, c = (mesh[0][mesh[1][hits.triangle[hits.hit]][:, k]].astype(float) for k in range(3))
    u, v = hits.u[hits.hit][:, None].astype(float), hits.v[hits.hit][:, None].astype(float)
    np.testing.assert_allclose((1 - u - v) * a + u * b + v * c, hits.position[hits.hit], atol=2e-6)
    assert np.isnan(hits.position[~hits.hit]).all()


def test_normals(scene, mesh, rays):
    hits = scene.nearest(*rays)
    a, b, c = (mesh[0][mesh[1][hits.triangle[hits.hit]][:, k]].astype(float) for k in range(3))
    expected = np.cross(b - a, c - a)
    expected /= np.linalg.norm(expected, axis=1)[:, None]
    np.testing.assert_allclose(hits.normal[hits.hit], expected, atol=1e-12)
    assert not hits.normal[~hits.hit].any()
    assert (np.einsum("ij,ij->i", hits.normal[hits.hit], a) > 0).all()


def test_any_and_ranges(scene, rays):
    hits = scene.nearest(*rays)
    assert (scene.any(*rays) == hits.hit).all()
    beyond = np.where(hits.hit, np.nextafter(hits.t, np.float32(np.inf)), 0)
    second = scene.nearest(*rays, tmin=beyond)
    assert (second.t[hits.hit] > hits.t[hits.hit]).all()
    assert not scene.any(*rays, tmax=np.where(hits.hit, np.nextafter(hits.t, np.float32(0)), np.inf)).any()
    assert (scene.any(*rays, tmax=hits.t) == hits.hit).all()


def test_all_hits_and_count(scene, rays, by_force):
    found = scene.all_hits(*rays)
    assert (scene.count(*rays) == np.diff(found.offsets)).all()
    for i, expected in enumerate(by_force):
        part = slice(found.offsets[i], found.offsets[i + 1])
        assert found.triangle[part].tolist() == [triangle for _, triangle in expected]
        np.testing.assert_allclose(found.t[part], [t for t, _ in expected], rtol=1e-6)
        assert (found.ray[part] == i).all()
    first = scene.all_hits(*rays, most=1)
    hits = scene.nearest(*rays)
    assert (first.t == hits.t[hits.hit]).all() and (first.triangle == hits.triangle[hits.hit]).all()


def test_culling_and_masks(scene, rays):
    origins, directions = rays
    everything = scene.all_hits(origins, directions)
    normals = scene.normals(everything.instance, everything.triangle)
    front = np.einsum("ij,ij->i", normals, directions[everything.ray].astype(float)) < 0
    assert (scene.all_hits(origins, directions, cull="back").triangle == everything.triangle[front]).all()
    assert (scene.all_hits(origins, directions, cull="front").triangle == everything.triangle[~front]).all()
    nearest = scene.nearest(origins, directions, cull="front")
    assert nearest.hit.any() and (np.einsum("ij,ij->i", nearest.normal, directions.astype(float))[nearest.hit] > 0).all()
    assert not scene.nearest(origins, directions, mask=0).hit.any()
    with pytest.raises(ValueError, match="cull"):
        scene.count(origins, directions, cull="left")


def test_points(scene, mesh):
    random = np.random.default_rng(3)
    points = (random.normal(size=(500, 3)) * 0.8).astype(np.float32)
    a, b, c = (mesh[0][mesh[1][:, k]].astype(float) for k in range(3))
    normals = np.cross(b - a, c - a)
    # The sphere is convex: a point is inside if it is behind all triangles.
    inside = (np.einsum("ij,nij->ni", normals, points[:, None].astype(float) - a) < 0).all(axis=1)
    assert (scene.contains(points) == inside).all()
    assert (scene.winding(points) == inside).all()
    closest = scene.closest(points)
    np.testing.assert_allclose(np.linalg.norm(closest.point - points, axis=1), closest.distance, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(scene.signed_distance(points), np.where(inside, -1, 1) * closest.distance, rtol=1e-6)
    samples = np.concatenate([a, (a + b + c) / 3, (a + b) / 2])
    nearest = np.linalg.norm(points[:, None] - samples, axis=2).min(axis=1)
    assert (closest.distance <= nearest + 1e-6).all() and (closest.distance > nearest - 0.2).all()
    assert scene.closest(points, radius=0.1).found.tolist() == (closest.distance <= np.float32(0.1)).tolist()
    assert scene.contains(mesh[0] * 0.99).all() and not scene.contains(mesh[0] * 1.01).any()


def test_crossings(scene, mesh):
    # Rays to vertices and through the middles of edges pass into the sphere and out of it: two crossings.
    targets = np.concatenate([mesh[0], (mesh[0][mesh[1][:, 0]] + mesh[0][mesh[1][:, 1]]) / 2])
    origin = np.array([3, 0.5, 0.25], np.float32)
    count, winding = scene.crossings(origin, targets - origin)
    assert set(np.unique(count)) <= {0, 2} and not winding.any()
    count, winding = scene.crossings([0, 0, 0], targets)
    assert (count == 1).all() and (winding == 1).all()


@pytest.mark.parametrize("threads", [1, 2, 7])
def test_threads_change_nothing(scene, threads):
    random = np.random.default_rng(1)
    origins, directions = random.normal(size=(2, 30000, 3))
    one, many = scene.nearest(origins, directions, threads=1), scene.nearest(origins, directions, threads=threads)
    for name in ("t", "u", "v", "instance", "triangle"):
        assert getattr(one, name).tobytes() == getattr(many, name).tobytes()


def test_shapes(scene, rays):
    origins, directions = (a.reshape(20, 4, 5, 3) for a in rays)
    flat = scene.nearest(*rays)
    hits = scene.nearest(origins, directions)
    assert hits.t.shape == (20, 4, 5) and (hits.t.ravel() == flat.t).all()
    assert hits.normal.shape == hits.position.shape == (20, 4, 5, 3)
    assert scene.nearest([0, 0, 0], [0, 0, 1]).t.shape == ()
    assert scene.nearest([0, 0, 0], rays[1]).t.shape == (400,)
    assert scene.nearest(origins[:, :1], directions[:, :, :1]).t.shape == (20, 4, 5)
    for change in (np.asfortranarray, lambda a: a[::-1][::-1], lambda a: np.repeat(a, 2, axis=0)[::2],
                   lambda a: a.astype(np.float64), lambda a: a.astype(">f4"), _unaligned):
        other = scene.nearest(change(rays[0]), change(rays[1]))
        assert (other.t.astype(np.float32) == flat.t).all() and (other.triangle == flat.triangle).all()
    backwards = scene.nearest(rays[0][::-1, ::-1][:, ::-1], rays[1][::-1])
    assert (backwards.t == flat.t[::-1]).all()
    assert scene.contains(np.zeros((2, 3, 3))).shape == (2, 3)
    assert scene.closest(np.zeros((2, 3, 3))).point.shape == (2, 3, 3)


def _unaligned(array):
    raw = np.empty(array.nbytes + 1, np.uint8)
    view = raw[1:].view(array.dtype).reshape(array.shape)
    view[...] = array
    return view


def test_the_file_is_kept(tmp_path, mesh, scene, rays):
    scene.save(tmp_path / "sphere.bth")
    for other in (bth.open(tmp_path / "sphere.bth"), bth.open(tmp_path / "sphere.bth", mmap=True), bth.load(scene.to_bytes())):
        assert other.to_bytes() == scene.to_bytes()
        assert (other.nearest(*rays).t == scene.nearest(*rays).t).all()
    lines = [f"v {x} {y} {z}" for x, y, z in mesh[0].tolist()] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh[1].tolist()]
    (tmp_path / "sphere.obj").write_text("\n".join(lines))
    compiled = bth.compile(tmp_path / "sphere.obj", output=tmp_path / "out.bth", cache=tmp_path / "cache")
    assert (tmp_path / "out.bth").read_bytes() == compiled.to_bytes()
    assert (compiled.nearest(*rays).t == scene.nearest(*rays).t).all()
    assert bth.compile(tmp_path / "sphere.obj", cache=tmp_path / "cache").to_bytes() == compiled.to_bytes()


def test_geometry(scene, mesh):
    corners = scene.vertices()[scene.triangles()]
    assert (corners == mesh[0][mesh[1]]).all()
    assert scene.triangle_counts.tolist() == [len(mesh[1])]
    np.testing.assert_allclose(scene.bounds, [mesh[0].min(0), mesh[0].max(0)], atol=1e-6)
    assert (scene.transforms == np.eye(4)).all() and scene.visible.all()


def test_t_beyond_float32():
    """Beyond the range of float32 there are no hits; passages are counted by the exact t."""
    scene = bth.compile(([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    ray = np.float32([0.2, 0.2, 1e30]), np.float32([0, 0, -1e-20])
    assert not scene.nearest(*ray).hit and not scene.any(*ray) and not scene.any(*ray, filter=lambda _: True)
    assert scene.count(*ray) == len(scene.all_hits(*ray)) == len(scene.all_hits(*ray, most=1)) == 0
    assert scene.crossings(*ray)[0] == 1
