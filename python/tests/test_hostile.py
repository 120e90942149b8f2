"""What callers get wrong: exceptions of Python, never a crash, and no growth."""

import copy
import gc
import os
import pickle
import signal
import threading

import numpy as np
import pytest

import bth

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

    work(500)
    gc.collect()
    before = _resident()
    work(3000)
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


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_fork(scene):
    rays = np.zeros((20000, 3)), np.ones((20000, 3))
    scene.any(*rays, threads=2)
    child = os.fork()
    if child == 0:
        os._exit(0 if scene.any(*rays, threads=2).all() else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
