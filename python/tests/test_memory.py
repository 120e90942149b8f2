"""Memory: errors where there is too little, and no growth."""

import copy
import gc
import os
import pickle
import sys

import numpy as np
import pytest
from processes import exits

import bth


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
    assert exits(code, str(threads)) == 0


def _resident():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def _assert_does_not_grow(work, first, times):
    """After `first` times of `work`, which fill what is kept, `times` more of it take no memory."""
    work(first)
    gc.collect()
    before = _resident()
    work(times)
    gc.collect()
    assert _resident() - before < 4 << 20


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="no /proc")
def test_copies_and_pickles_do_not_grow():
    scene = bth.compile(([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]))

    def work(times):
        for _ in range(times):
            other = pickle.loads(pickle.dumps(copy.deepcopy(copy.copy(scene))))
            assert other.any([0.2, 0.2, 1], [0, 0, -1])

    scene.set_instance_mask(0, 3)
    _assert_does_not_grow(work, 500, 10_000)


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

    _assert_does_not_grow(work, 30, 300)
