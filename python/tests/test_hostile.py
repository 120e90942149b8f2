"""What callers get wrong: exceptions of Python, never a crash, and no growth."""

import copy
import gc
import os
import pickle
import signal
import stat
import subprocess
import sys
import textwrap
import threading
import time

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
        "tmax": lambda: scene.nearest(ones, ones, tmax=numbers), "start": lambda: scene.nearest(ones, ones, start=(rows, rows)),
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


def test_closed_while_others_trace(scene):
    origins, directions = np.random.default_rng(2).normal(size=(2, 50000, 3))
    expected = scene.nearest(origins, directions).t
    for _ in range(10):
        other, failures = bth.load(scene.to_bytes()), []

        def trace():
            try:
                while True:
                    if not (other.nearest(origins, directions).t == expected).all():
                        failures.append("another result")
            except ValueError:
                pass

        threads = [threading.Thread(target=trace) for _ in range(4)]
        for thread in threads:
            thread.start()
        other.close()
        for thread in threads:
            thread.join()
        assert not failures


def test_masks_change_while_others_trace(scene):
    origins, directions = [0, 0, 0], np.random.default_rng(2).normal(size=(30000, 3))
    other, failures, results, stop = bth.load(scene.to_bytes()), [], set(), threading.Event()

    def trace(threads):
        try:
            while not stop.is_set():
                hit = int(other.nearest(origins, directions, mask=1, threads=threads).hit.sum())
                results.add(hit)
                # The whole call sees the masks of one time.
                if hit not in (0, 30000):
                    failures.append(hit)
        except Exception as error:
            failures.append(error)

    tracing = [threading.Thread(target=trace, args=(threads,)) for threads in (1, 2, 2)]
    for thread in tracing:
        thread.start()
    deadline = time.monotonic() + 60
    changes = 0
    while (changes < 40 or len(results) < 2) and time.monotonic() < deadline and not failures:
        other.set_instance_mask(0, (1, 2)[changes % 2])
        other.set_group_mask(0, (1, 3)[changes // 2 % 2])
        time.sleep(0.002)
        changes += 1
    stop.set()
    for thread in tracing:
        thread.join()
    assert not failures and results == {0, 30000} and changes >= 40


def test_masks_change_while_others_filter(scene, rays):
    other, failures, counts, stop = bth.load(scene.to_bytes()), [], [], threading.Event()
    expected = int((scene.all_hits(*rays).u > 0.5).sum())

    def trace():
        try:
            while not stop.is_set():
                # The filter queries the scene that another thread waits to change.
                found = other.count(*rays, mask=1, filter=lambda c: c.u > 0.5 and len(other.nearest(rays[0][:1], rays[1][:1])) == 1)
                counts.append(int(found.sum()))
        except Exception as error:
            failures.append(error)

    tracing = [threading.Thread(target=trace, daemon=True) for _ in range(3)]
    for thread in tracing:
        thread.start()
    for change in range(20):
        other.set_instance_mask(0, (2, 1)[change % 2])
        time.sleep(0.002)
        other.to_bytes()
    stop.set()
    for thread in tracing:
        thread.join(60)
    assert not failures and not any(thread.is_alive() for thread in tracing) and counts and set(counts) <= {0, expected}


def test_the_time_changes_while_others_trace(mesh, tmp_path):
    lines = [f"v {x} {y} {z}" for x, y, z in mesh[0].tolist()] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh[1].tolist()]
    (tmp_path / "ball.obj").write_text("\n".join(lines))
    (tmp_path / "scene.manifest").write_text("""
        version = 1
        frames = { last = 9, rate = 1 }
        objects = [{ name = "ball", model = "ball.obj" }]
        nodes = [{ name = "ball", object = "ball" }]
        tracks = [{ node = "ball", property = "translation", times = [0, 9], values = [[0, 0, 0], [90, 0, 0]] }]
    """)
    other = bth.compile(tmp_path / "scene.manifest")
    x = np.repeat(np.arange(10) * 10.0, 3000)
    origins = np.stack([x, np.full_like(x, 0.01), np.full_like(x, 5)], 1)
    results, stop = [], threading.Event()

    def trace():
        while not stop.is_set():
            results.append(x[other.any(origins, [0, 0, -1])])

    threads = [threading.Thread(target=trace) for _ in range(3)]
    for thread in threads:
        thread.start()
    for frame in [*range(10)] * 5:
        other.set_frame(frame)
        time.sleep(0.001)
    stop.set()
    for thread in threads:
        thread.join()
    # Each call sees the ball at one place.
    assert all(len(found) == 3000 and len(set(found)) == 1 for found in results) and len(results) > 3


def test_wrong_dtypes(scene):
    good = [0.0, 0, 0], [0, 0, 1.0]
    for wrong in (np.zeros(3, complex), np.zeros(3, "U3"), np.zeros(3, object), np.zeros(3, "M8[s]"), np.zeros(3, [("x", "f4")]), b"abc", {"x": 1}):
        calls = [lambda: scene.overlaps_box(wrong, good[1]), lambda: scene.overlaps_sphere(wrong, 1), lambda: scene.contains(wrong),
                 lambda: scene.surface(wrong, 0), lambda: scene.normals(0, wrong), lambda: scene.surface(0, 0, wrong), lambda: scene.closest(wrong),
                 lambda: scene.nearest(*good, tmin=wrong), lambda: scene.nearest(*good, start=(wrong, wrong))]
        for call in calls:
            with pytest.raises((TypeError, ValueError)):
                call()
    for kind in (np.float16, np.int8, np.uint64, bool, ">f8", "<f4"):
        assert scene.any(np.zeros(3, kind), np.ones(3, kind)) and scene.contains(np.zeros((2, 3), kind)).all()
    for start, error in (((-1, 0), IndexError), ((0, 1 << 32), IndexError), ((0.5, 0), TypeError), (7, TypeError), ((1, 2, 3), TypeError),
                         (([0, 0], [0, 0]), ValueError)):
        with pytest.raises(error, match="start"):
            scene.nearest(*good, start=start)


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


def test_huge_shapes(scene):
    huge = np.broadcast_to(np.float32(0), (1 << 45, 3))
    for call in (lambda: scene.contains(huge), lambda: scene.closest(huge), lambda: scene.overlaps_box(huge, huge), lambda: scene.overlaps_sphere(huge, 1),
                 lambda: scene.any(huge, huge), lambda: scene.all_hits(huge, huge), lambda: scene.surface(np.broadcast_to(np.uint32(0), 1 << 45), 0),
                 lambda: scene.overlaps_sphere(np.zeros((1 << 22, 1, 3)), np.zeros(1 << 23))):
        with pytest.raises(MemoryError):
            call()
    deep = np.zeros((1,) * 30 + (3,))
    assert scene.contains(deep).shape == (1,) * 30


@pytest.mark.skipif(sys.platform != "linux", reason="the limit is that of Linux")
@pytest.mark.parametrize("threads", [1, 2])
def test_more_hits_than_memory(threads):
    code = """
        import resource, sys
        import numpy as np, bth
        layers, rays = 500, np.zeros((100000, 3), np.float32)
        sheets = np.concatenate([[[-1, -1, k], [1, -1, k], [0, 1, k]] for k in range(layers)])
        scene = bth.compile((sheets, np.arange(3 * layers).reshape(-1, 3)))
        # The threads that all calls share are started here.
        scene.any(rays, [0, 0, 1], threads=2)
        with open("/proc/self/statm") as file:
            limit = int(file.read().split()[0]) * resource.getpagesize() + (128 << 20)
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        threads = int(sys.argv[1])
        calls = [lambda: scene.all_hits(rays, [0, 0, 1], threads=threads), lambda: scene.triangles_in_box(rays, [1, 1, layers], threads=threads)]
        for call in calls:
            try:
                call()
            except MemoryError as error:
                assert "memory" in str(error)
            else:
                sys.exit(3)
        assert len(scene.all_hits(rays[:10], [0, 0, 1], threads=threads)) == 10 * layers
    """
    assert _exits(code, str(threads)) == 0


def _resident():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="no /proc")
def test_copies_and_pickles_do_not_grow():
    scene = bth.compile(([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))

    def work(times):
        for _ in range(times):
            other = pickle.loads(pickle.dumps(copy.deepcopy(copy.copy(scene))))
            assert other.any([0.2, 0.2, 1], [0, 0, -1])

    scene.set_instance_mask(0, 3)
    work(500)
    gc.collect()
    before = _resident()
    work(10_000)
    gc.collect()
    assert _resident() - before < 4 << 20


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="no /proc")
def test_queries_do_not_grow(scene, rays):
    def fails(candidate):
        raise RuntimeError("enough")

    def work(times):
        for i in range(times):
            hits = scene.nearest(*rays)
            hits.surface(), hits.group_name, scene.all_hits(*rays).normal, scene.closest(rays[0]).texcoord
            scene.triangles_in_sphere(rays[0], 0.5), scene.any(*rays, filter=lambda candidate: candidate.u > 0.5)
            scene.set_group_mask(0, i), scene.set_instance_mask(0, bth.NONE), scene.set_group_mask(0, bth.NONE)
            with pytest.raises(RuntimeError):
                scene.count(*rays, filter=fails)
            with pytest.raises(IndexError):
                scene.surface(0, 10**6)

    work(30)
    gc.collect()
    before = _resident()
    work(300)
    gc.collect()
    assert _resident() - before < 4 << 20


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timers")
@pytest.mark.parametrize("threads", [1, 2])
def test_ctrl_c(scene, threads):
    directions = np.random.default_rng(4).normal(size=(500000, 3)).astype(np.float32)

    def interrupt(*_):
        # A handler may use the scene, but not change it.
        assert scene.any([0, 0, 0], [0, 0, 1])
        try:
            scene.seconds = 1.0
        except RuntimeError:
            raise KeyboardInterrupt from None
        # The signal came between two calls.
        signal.setitimer(signal.ITIMER_REAL, 0.03)

    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, 0.05)
    try:
        with pytest.raises(KeyboardInterrupt):
            while True:
                scene.count(np.zeros(3, np.float32), directions, threads=threads)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timers")
@pytest.mark.parametrize("threads", [1, 2])
def test_ctrl_c_where_each_ray_takes_long(threads):
    """A few thousand rays, boxes and points, each of which meets thousands of triangles: without a look for signals in between, 3 to 15 seconds."""
    count, random = 10000, np.random.default_rng(6)
    corners, faces = np.float32([[-1, -1, 0], [1, -1, 0], [0, 1, 0]]), np.arange(3 * count).reshape(-1, 3)
    layers = np.tile(corners, (count, 1, 1))
    layers[..., 2] = np.arange(count)[:, None]
    stack = bth.compile((layers.reshape(-1, 3), faces), quality="fast")
    outwards = random.normal(size=(count, 1, 3))
    ball = bth.compile(((outwards / np.linalg.norm(outwards, axis=-1, keepdims=True) + 1e-3 * corners).reshape(-1, 3), faces), quality="fast")
    origins, up, points = np.full((4096, 3), -1e-3), [0, 0, 1], 1e-6 * random.normal(size=(4096, 3))
    calls = [
        lambda: stack.count(origins, up, threads=threads), lambda: stack.all_hits(origins, up, threads=threads),
        lambda: stack.crossings(origins, up, threads=threads), lambda: stack.triangles_in_sphere(origins, 1e6, threads=threads),
        lambda: ball.closest(points, threads=threads),
    ]

    def interrupt(*_):
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    try:
        for call in calls:
            start = time.monotonic()
            signal.setitimer(signal.ITIMER_REAL, 0.1)
            with pytest.raises(KeyboardInterrupt):
                call()
            assert time.monotonic() - start < 2
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_fork(scene):
    rays = np.zeros((20000, 3)), np.ones((20000, 3))
    scene.any(*rays, threads=2)
    child = os.fork()
    if child == 0:
        os._exit(0 if scene.any(*rays, threads=2).all() else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def _exits(code, *arguments):
    return subprocess.run([sys.executable, "-c", textwrap.dedent(code), *arguments], timeout=120).returncode


def test_filters_that_call_themselves():
    code = """
        import sys, bth
        scene = bth.compile(([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
        ray = [0.2, 0.2, 1], [0, 0, -1]
        def within(depth):
            return lambda candidate: depth == 0 or bool(scene.any(*ray, filter=within(depth - 1)))
        assert scene.any(*ray, filter=within(10))
        for query in (scene.nearest, scene.any, scene.all_hits, scene.count):
            try:
                query(*ray, filter=within(10**6))
            except RecursionError as error:
                assert "filter" in str(error)
            else:
                sys.exit(3)
        assert scene.any(*ray, filter=within(10))
    """
    assert _exits(code) == 0


@pytest.mark.parametrize("threads", [None, 1])
def test_exit_while_daemons_trace(threads):
    """A thread that still traces must not reach for an interpreter that has ended."""
    code = """
        import sys, threading, time
        import numpy as np, bth
        random = np.random.default_rng(0)
        scene = bth.compile((random.normal(size=(300, 3)), random.integers(0, 300, (600, 3))), quality="fast")
        rays = random.normal(size=(100000, 3)).astype(np.float32)
        threads = int(sys.argv[2]) if sys.argv[2] != "None" else None
        def trace():
            while True:
                scene.nearest(rays, rays, threads=threads)
        for _ in range(4):
            threading.Thread(target=trace, daemon=True).start()
        time.sleep(0.2 + float(sys.argv[1]))
    """
    assert [_exits(code, str(0.01 * i), str(threads)) for i in range(8)] == [0] * 8


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


def test_failed_saves_leave_nothing(scene, tmp_path):
    folder = tmp_path / "folder"
    folder.mkdir()
    closed = copy.copy(scene)
    closed.close()
    with pytest.raises(ValueError, match="closed"):
        closed.save(tmp_path / "a.bth")
    with pytest.raises(OSError):
        scene.save(folder)
    assert list(tmp_path.iterdir()) == [folder] and not list(folder.iterdir())
    scene.save(os.fsencode(tmp_path / "a.bth"))
    threads = [threading.Thread(target=scene.save, args=(tmp_path / "a.bth",)) for _ in range(8)]
    failed = []
    before, threading.excepthook = threading.excepthook, failed.append
    try:
        [thread.start() for thread in threads]
        [thread.join() for thread in threads]
    finally:
        threading.excepthook = before
    assert not failed and sorted(tmp_path.iterdir()) == [tmp_path / "a.bth", folder]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")
def test_saving_replaces_no_pipe(scene, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="regular file"):
        scene.save(tmp_path / "pipe")
    with pytest.raises(IsADirectoryError):
        scene.save(tmp_path)
    assert stat.S_ISFIFO(os.stat(tmp_path / "pipe").st_mode) and os.listdir(tmp_path) == ["pipe"]


@pytest.mark.skipif(sys.platform != "linux", reason="/proc is that of Linux")
def test_saving_replaces_no_link_to_an_open_file(scene, tmp_path):
    """As /dev/stdout is one where the output goes to a file: no program would have it any more."""
    with open(tmp_path / "file", "wb") as file:
        (tmp_path / "stdout").symlink_to(f"/proc/self/fd/{file.fileno()}")
        with pytest.raises(OSError, match="open"):
            scene.save(tmp_path / "stdout")
    assert (tmp_path / "stdout").is_symlink() and sorted(os.listdir(tmp_path)) == ["file", "stdout"]


def test_names_as_long_as_they_can_be(scene, mesh, tmp_path):
    path = tmp_path / ("é" * 125 + "e.bth")
    scene.save(path)
    assert bth.open(path).content_id == scene.content_id and len(os.listdir(tmp_path)) == 1
    bth.bake.write_ply(path, {axis: column for axis, column in zip("xyz", mesh[0].T)}, mesh[1])
    with pytest.raises(FileNotFoundError) as error:
        scene.save(tmp_path / "missing" / "a.bth")
    assert error.value.filename == str(tmp_path / "missing" / "a.bth")


def test_paths_as_bytes(scene, mesh, tmp_path):
    class Path:
        def __init__(self, path):
            self.path = path

        def __fspath__(self):
            return os.fsencode(self.path)

    for path in (os.fsencode(tmp_path / "é.bth"), Path(tmp_path / "ü.bth")):
        scene.save(path)
        assert bth.open(path).content_id == bth.open(path, mmap=True).content_id == scene.content_id
        bth.compile(mesh, output=path)
    (tmp_path / "a.off").write_text("OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
    for path in (Path(tmp_path / "a.off"), os.fsencode(tmp_path / "a.off")):
        assert bth.compile(path, cache=False).triangle_counts == [1]
    for name in ("output", "profile", "shared_cache", "cache"):
        with pytest.raises(TypeError, match=f"^{name}: expected"):
            bth.compile(mesh, **{name: 5})
    for size, error in ((-1, ValueError), (2**64, ValueError), (1.5, TypeError)):
        with pytest.raises(error):
            bth.compile(mesh, cache_size=size)


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


def test_numbers_are_rounded_once():
    """An integer that float64 rounds to the middle between two float32. As a vertex and as a point it is the same."""
    x = 2**60 + 2**36 + 1
    scene = bth.compile((np.array([[x, 0, 0], [x, 8, 0], [x, 0, 8]]), [[0, 1, 2]]))
    assert scene.bounds[0, 0] == 2**60 + 2**37 != np.float32(np.float64(x))
    for kind in (np.int64, np.uint64, np.longdouble, np.dtype(np.int64).newbyteorder()):
        if np.dtype(kind) == np.longdouble and np.finfo(kind).nmant < 60:
            continue
        assert scene.closest(np.array([x, 2, 2], kind)).distance == 0 and scene.overlaps_sphere(np.array([x, 2, 2], kind), 0)
        assert not scene.any([0, 2, 2], [1, 0, 0], tmax=np.array(x, kind) - np.array(2**38, kind))
    wide = np.finfo(np.longdouble).max
    with np.errstate(all="raise"):
        assert not scene.closest(np.array([wide, 0, 0])).found and len(scene.surface(0, [0], 1e300).position) == 1


def test_arrays_that_are_not_aligned(scene, rays):
    packed = np.zeros(len(rays[0]), [("odd", "u1"), ("instance", "u4"), ("triangle", "u4"), ("origin", "f4", 3), ("direction", "f8", 3), ("t", "f4")])
    packed["origin"], packed["direction"], packed["t"] = *rays, np.inf
    hits = scene.nearest(*rays)
    packed["triangle"] = np.where(hits.hit, hits.triangle, 0)
    given = scene.nearest(packed["origin"], packed["direction"], tmax=packed["t"], start=(packed["instance"], packed["triangle"]))
    assert (given.t == hits.t).all() and (given.triangle == hits.triangle).all()
    for indices in _ray_queries._start((packed["instance"][::-1], packed["triangle"]), (len(packed),)):
        assert indices.flags.aligned


def test_ctrl_c_while_waiting_for_a_change(scene, rays):
    """A query that waits until another thread has changed the scene heeds signals, too."""
    tracing = threading.Event()

    def slow(_):
        if not tracing.is_set():
            tracing.set()
            time.sleep(3)
        return True

    def handler(*_):
        raise KeyboardInterrupt

    origins, directions = rays
    tracer = threading.Thread(target=lambda: scene.nearest([[0, 0, 5]], [[0, 0, -1]], filter=slow))
    changer = threading.Thread(target=lambda: scene.set_instance_mask(0, 0xFFFFFFFF))
    before = signal.signal(signal.SIGALRM, handler)
    try:
        tracer.start()
        assert tracing.wait(10)
        changer.start()
        time.sleep(0.2)
        signal.setitimer(signal.ITIMER_REAL, 0.3)
        start = time.monotonic()
        with pytest.raises(KeyboardInterrupt):
            scene.nearest(origins, directions)
            scene.any(origins, directions)
        assert time.monotonic() - start < 1.5
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
        tracer.join()
        changer.join()
