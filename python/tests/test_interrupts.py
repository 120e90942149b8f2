"""Ctrl-C ends calls that take long."""

import signal
import threading
import time

import numpy as np
import pytest

import bth


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timers")
@pytest.mark.parametrize("threads", [1, 2])
def test_ctrl_c(scene, threads):
    directions = np.random.default_rng(4).normal(size=(500000, 3)).astype(np.float32)

    def interrupt(*_):
        # A handler may use the scene, but not change it.
        assert scene.any([0, 0, 0], [0, 0, 1])
        try:
            scene.set_instance_mask(0, 2**32 - 1)
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
