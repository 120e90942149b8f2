"""Many threads, processes and filters at once: changes wait for queries, and nothing crashes."""

import os
import sys
import threading
import time

import numpy as np
import pytest
from processes import exits

import bth


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


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_fork(scene):
    rays = np.zeros((20000, 3)), np.ones((20000, 3))
    scene.any(*rays, threads=2)
    child = os.fork()
    if child == 0:
        os._exit(0 if scene.any(*rays, threads=2).all() else 1)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


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
    assert exits(code) == 0


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
    assert [exits(code, str(0.01 * i), str(threads)) for i in range(8)] == [0] * 8
