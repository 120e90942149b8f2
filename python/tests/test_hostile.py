"""What callers get wrong: exceptions of Python, never a crash."""

import pickle
import warnings

import numpy as np
import pytest

import bth
import bth.bake
from bth import _meshes, _ray_queries

NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize("origins, directions, error", [
    (np.zeros((4, 2)), np.zeros((4, 3)), ValueError),
    (np.zeros((4, 3)), np.zeros((5, 3)), ValueError),
    (np.zeros(()), np.zeros((5, 3)), ValueError),
    (["a", "b", "c"], [0, 0, 1], TypeError),
    (None, [0, 0, 1], TypeError),
    (np.zeros((2, 3), complex), [0, 0, 1], TypeError),
    (np.zeros((2, 3), object), [0, 0, 1], TypeError),
    ([[0, 0, 0], [0, 0]], [0, 0, 1], ValueError),
])
def test_wrong_arrays(scene, origins, directions, error):
    for query in (scene.nearest, scene.any, scene.count, scene.all_hits, scene.crossings):
        with pytest.raises(error):
            query(origins, directions)


def test_masked_arrays(scene, mesh):
    masked = np.ma.masked_array(np.zeros((4, 3)), mask=np.eye(4, 3))
    unmasked = np.ma.masked_array(np.zeros((4, 3)))
    numbers, ones = np.ma.masked_array(np.ones(4), mask=[0, 0, 1, 0]), np.ones((4, 3))
    rows = np.ma.masked_array(np.zeros(4, np.uint32), mask=[1, 0, 0, 0])
    calls = {
        "origins": lambda: scene.nearest(masked, ones), "directions": lambda: scene.any(ones, masked),
        "tmax": lambda: scene.nearest(ones, ones, tmax=numbers), "start: instances": lambda: scene.nearest(None, ones, start=(rows, 0, [0, 0])),
        "start: uv": lambda: scene.any(None, ones, start=(0, 0, masked[:, :2])),
        "points": lambda: scene.contains(masked), "u": lambda: scene.surface(0, 0, numbers, 0),
        "vertices": lambda: bth.compile((masked, [[0, 1, 2]])), "faces": lambda: bth.compile((ones, masked.astype(int))),
        "transforms": lambda: bth.compile_scene([mesh], [0], np.ma.masked_equal(np.eye(4), 1)),
        "poses": lambda: bth.bake.lidar(scene, masked), "box": lambda: bth.bake.sdf(scene, 8, box=masked[:2]),
    }
    for name, call in calls.items():
        with pytest.raises(ValueError, match=f"^{name}: .* masked"):
            call()
    np.testing.assert_array_equal(scene.contains(unmasked), scene.contains(np.zeros((4, 3))))


def test_wrong_options(scene, mesh):
    rays = np.zeros((4, 3)), np.ones((4, 3))
    with pytest.raises(ValueError, match="tmin"):
        scene.nearest(*rays, tmin=np.zeros(3))
    with pytest.raises(TypeError, match="tmax"):
        scene.nearest(*rays, tmax="far")
    with pytest.raises(ValueError, match="threads"):
        scene.nearest(*rays, threads=-1)
    with pytest.raises(ValueError, match="quality"):
        bth.compile(mesh, quality="superb")
    with pytest.raises(TypeError):
        bth.compile(mesh, colour="red")
    with pytest.raises(FileNotFoundError):
        bth.compile("no such file.obj")
    with pytest.raises(FileNotFoundError):
        bth.open("no such file.bth")
    with pytest.raises(IndexError):
        scene.vertices(7)
    with pytest.raises(IndexError):
        scene.normals([0], [10**6])
    with pytest.raises(IndexError):
        scene.normals([5], [0])


@pytest.mark.parametrize("mesh, error", [
    (([[0, 0, 0]], [[0, 0, 1]]), ValueError), (([[0, 0, 0]], [[0, 0, -1]]), ValueError),
    (([[0, 0]], [[0, 0, 0]]), ValueError), (([[0, 0, NAN]], [[0, 0, 0]]), bth.Error),
    (([[0, 0, 1e300]], [[0, 0, 0]]), bth.Error), (([[0, 0, 0]], [[0.5, 0, 0]]), TypeError),
    ((1, 2, 3), ValueError), (object(), TypeError), (7, TypeError),
])
def test_wrong_meshes(mesh, error):
    with pytest.raises(error):
        bth.compile(mesh)


def test_rays_that_are_none(scene):
    origins = np.array([[NAN, 0, 0], [INF, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0], [1e300, 0, 0]])
    directions = np.array([[0, 0, 1], [0, 0, 1], [0, 0, 0], [NAN, 0, 1], [0, -INF, 0], [0, 0, 1]])
    assert not scene.nearest(origins, directions).hit.any() and not scene.any(origins, directions).any()
    assert not scene.any([0, 0, 0], [0, 0, 1], tmin=NAN) and not scene.any([0, 0, 0], [0, 0, 1], tmin=2, tmax=1)
    assert not scene.contains([[NAN, 0, 0], [INF, 0, 0]]).any()
    assert not scene.closest([[NAN, 0, 0]]).found.any()


def test_nothing(scene):
    for shape in ((0, 3), (0, 5, 3), (5, 0, 3)):
        empty = np.zeros(shape)
        assert scene.nearest(empty, empty).t.shape == shape[:-1]
        assert scene.any(empty, empty).shape == scene.contains(empty).shape == shape[:-1]
        assert len(scene.all_hits(empty, empty)) == 0
    assert len(scene.nearest([], [])) == 0
    nothing = bth.compile((np.zeros((0, 3)), np.zeros((0, 3), int)))
    assert not nothing.nearest([0, 0, 0], [0, 0, 1]).hit and nothing.bounds is None


def test_too_many_rays(scene):
    huge = np.broadcast_to(np.zeros(3, np.float32), (1 << 45, 3))
    with pytest.raises(MemoryError):
        scene.nearest(huge, huge)


def test_damaged_files(scene):
    data = bytearray(scene.to_bytes())
    for wrong in (b"", b"x", bytes(data[:200]), bytes(data[:-64]), bytes(len(data))):
        with pytest.raises(bth.Error) as error:
            bth.load(wrong)
        assert error.value.code.startswith("BTH-F")
    random = np.random.default_rng(5)
    for _ in range(200):
        damaged = bytearray(data)
        damaged[random.integers(len(data))] ^= 1 << int(random.integers(8))
        try:
            bth.load(bytes(damaged)).nearest(np.zeros((10, 3)), random.normal(size=(10, 3)))
        except bth.Error:
            pass


def test_closed(scene):
    with bth.load(scene.to_bytes()) as other:
        pass
    assert other.closed and "closed" in repr(other)
    other.close()
    for query in (lambda: other.any([0, 0, 0], [0, 0, 1]), other.to_bytes, lambda: other.bounds, lambda: pickle.dumps(other)):
        with pytest.raises(ValueError, match="closed"):
            query()


def test_wrong_dtypes(scene):
    good = [0.0, 0, 0], [0, 0, 1.0]
    for wrong in (np.zeros(3, complex), np.zeros(3, "U3"), np.zeros(3, object), np.zeros(3, "M8[s]"), np.zeros(3, [("x", "f4")]), b"abc", {"x": 1}):
        calls = [lambda: scene.overlaps_box(wrong, good[1]), lambda: scene.overlaps_sphere(wrong, 1), lambda: scene.contains(wrong),
                 lambda: scene.surface(wrong, 0), lambda: scene.normals(0, wrong), lambda: scene.surface(0, 0, wrong), lambda: scene.closest(wrong),
                 lambda: scene.nearest(*good, tmin=wrong), lambda: scene.nearest(None, good[1], start=(wrong, 0, [0, 0])),
                 lambda: scene.nearest(None, good[1], start=(0, 0, wrong))]
        for call in calls:
            with pytest.raises((TypeError, ValueError)):
                call()
    for kind in (np.float16, np.int8, np.uint64, bool, ">f8", "<f4"):
        assert scene.any(np.zeros(3, kind), np.ones(3, kind)) and scene.contains(np.zeros((2, 3), kind)).all()


def test_strides(scene, rays):
    hits = scene.nearest(*rays)
    # Backwards along both axes, every other one, and a stride of zero.
    for view in (np.s_[::-1], np.s_[::2], np.s_[-1::-3]):
        origins, directions = (np.concatenate([a[:, ::-1], a], 1)[view][:, 2::-1] for a in rays)
        assert (scene.nearest(origins, directions).t == hits.t[view]).all()
        assert (scene.surface(hits.instance[view], hits.triangle[view], hits.u[view], hits.v[view]).group == hits.group[view]).all()
        assert (scene.overlaps_sphere(origins, 0.5) == scene.overlaps_sphere(rays[0], 0.5)[view]).all()
        assert (scene.overlaps_box(origins, origins + 1) == scene.overlaps_box(rays[0], rays[0] + np.float32(1))[view]).all()
        assert (scene.closest(origins).feature == scene.closest(rays[0]).feature[view]).all()
        assert (scene.any(origins, directions, tmax=np.broadcast_to(np.float32(1), len(origins))) == (hits.t[view] <= 1)).all()


def test_positions_stay_when_the_rays_are_moved_there(scene):
    origins, directions = np.array([[0.2, 0.2, 5.0]], np.float32), np.array([[0.0, 0.0, -1.0]], np.float32)
    hits = scene.nearest(origins, directions)
    expected = origins + hits.t[:, None] * directions
    origins[:] = hits.position
    assert np.array_equal(hits.position, expected, equal_nan=True)
    # What is returned is the caller's own.
    moved = hits.position
    moved += 1
    assert np.array_equal(hits.position, expected, equal_nan=True)


@pytest.mark.parametrize("kinds", [(np.float32, np.uint32), (np.float64, np.int64)])
def test_meshes_are_those_of_the_call(mesh, kinds):
    """The compiler reads arrays while other threads run, so it has its own."""
    vertices, faces = mesh[0].astype(kinds[0]), mesh[1].astype(kinds[1])
    for own, given in zip(_meshes.triangles_of((vertices, faces)), (vertices, faces)):
        assert not np.shares_memory(own, given) and own.flags.c_contiguous

    other = bth.compile(mesh, quality="fast")

    def change(*_):
        vertices[:], faces[:] = NAN, 2**31 - 1
        assert other.any([0, 0, 0], [0, 0, 1])
        with pytest.raises(RuntimeError, match="progress"):
            other.seconds = 1

    # Enough triangles for some calls of the function, which may come at any time.
    vertices, faces = np.tile(vertices, (200, 1)), np.tile(faces, (200, 1))
    expected = bth.compile((vertices.copy(), faces.copy()), quality="fast").content_id
    assert bth.compile((vertices, faces), quality="fast", threads=1, progress=change).content_id == expected


def test_numbers_out_of_range(scene):
    rays = np.zeros((4, 3)), np.ones((4, 3))
    for threads in (2**70, 65536):
        with pytest.raises(ValueError, match="threads"):
            scene.nearest(*rays, threads=threads)
        with pytest.raises(ValueError, match="threads"):
            bth.set_threads(threads)
    assert len(scene.all_hits(*rays, most=2**70)) == len(scene.all_hits(*rays))
    for mask in (1.5, "5", float("inf")):
        with pytest.raises(TypeError):
            scene.nearest(*rays, mask=mask)
    for most in (2.7, "2"):
        with pytest.raises(TypeError):
            scene.all_hits(*rays, most=most)


def test_numbers_that_are_none(scene):
    rays = np.zeros((4, 3)), np.ones((4, 3))
    calls = {
        "radius": lambda x: scene.closest(rays[0], radius=x), "tmin": lambda x: scene.nearest(*rays, tmin=x), "tmax": lambda x: scene.any(*rays, tmax=x),
        "seconds": lambda x: setattr(scene, "seconds", x), "share": lambda x: scene.set_positions_between(rays[0], rays[0], x),
    }
    for name, call in calls.items():
        for wrong, error in (("1", TypeError), (b"1", TypeError), (None, TypeError), ({}, TypeError), (10**400, ValueError), (10**5000, ValueError)):
            with pytest.raises(error, match=f"^{name}: expected"):
                call(wrong)
    for frame in (2**31, -(10**30)):
        with pytest.raises(ValueError, match="frame"):
            scene.set_frame(frame)
    for frame in (1.0, "1"):
        with pytest.raises(TypeError):
            scene.set_frame(frame)
    for cull in ("", "none", "both"):
        with pytest.raises(ValueError, match="cull"):
            scene.any(*rays, cull=cull)


def test_numbers_of_other_types_become_float64():
    """An integer that float32 would round. As a vertex and as a point it is the same."""
    x = 2**24 + 1
    scene = bth.compile((np.array([[2**24, 0, 0], [2**24, 8, 0], [2**24, 0, 8]]), [[0, 1, 2]]))
    for kind in (np.int64, np.uint64, np.longdouble, np.dtype(np.int64).newbyteorder()):
        assert scene.closest(np.array([x, 2, 2], kind)).distance == 1 and not scene.overlaps_sphere(np.array([x, 2, 2], kind), 0)


def test_arrays_that_are_not_aligned(scene, rays):
    packed = np.zeros(len(rays[0]), [("odd", "u1"), ("instance", "u4"), ("triangle", "u4"), ("uv", "f4", 2), ("origin", "f4", 3), ("direction", "f8", 3), ("t", "f4")])
    packed["origin"], packed["direction"], packed["t"] = *rays, np.inf
    hits = scene.nearest(*rays)
    packed["triangle"] = np.where(hits.hit, hits.triangle, 0)
    given = scene.nearest(packed["origin"], packed["direction"], tmax=packed["t"])
    assert (given.t.astype(np.float32) == hits.t).all() and (given.triangle == hits.triangle).all()
    packed["uv"] = [0.25, 0.5]
    start = packed["instance"][::-1], packed["triangle"], packed["uv"]
    onward, expected = (scene.nearest(None, packed["direction"], start=[a.copy() if copied else a for a in start]) for copied in (0, 1))
    assert onward.hit.any() and (onward.t == expected.t).all()
    columns = _ray_queries._start_columns(start)
    assert all(column.flags.aligned for column in _ray_queries._flat(columns, (len(packed),)))


def test_what_rounding_to_float32_loses_is_told():
    steps = 5e6 + np.arange(9) * 0.125
    x, y = np.meshgrid(steps, steps)
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(81)], axis=1)
    first = np.array([9 * (i // 8) + i % 8 for i in range(64)])
    faces = np.concatenate([first[:, None] + [0, 1, 10], first[:, None] + [0, 10, 9]])
    with pytest.warns(UserWarning, match="moves 72 of 81 positions, by up to 2.50e-1 .*triangles lose their area"):
        bth.compile((vertices, faces), positions="f32")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        bth.compile((vertices, faces))
        bth.compile((vertices - 5e6, faces))
        bth.compile((vertices.astype(np.float32), faces))
