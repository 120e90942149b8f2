"""Rays per second of the Python package and of the library through its C interface: the same rays, one thread, in turns.

    python python/benchmarks/against_library.py libbth.so MODEL …        models that bth reads

Two sets of 1e6 rays a batch: from points around the model to points of its box, and a picture's rays from one point. The library gets
arrays of `bth_ray` that are made before the time is taken, so the figures show what conversion from numpy costs. Arrays are f32.
"""

import ctypes
import os
import sys
import time

import numpy as np

import bth

SIDE, ROUNDS = 1000, 9
# BTH_READ of bth.h.
READ = 0
RAY = np.dtype([("origin", np.float32, 3), ("tmin", np.float32), ("direction", np.float32, 3), ("tmax", np.float32)])
HIT = np.dtype([("t", np.float32), ("u", np.float32), ("v", np.float32), ("instance", np.uint32), ("triangle", np.uint32)])


def library(path):
    lib = ctypes.CDLL(path)
    lib.bth_open_memory.argtypes = [ctypes.c_char_p, ctypes.c_size_t, ctypes.c_uint32, ctypes.POINTER(ctypes.c_void_p)]
    lib.bth_close.argtypes = [ctypes.c_void_p]
    for query in (lib.bth_nearest, lib.bth_any):
        query.argtypes = [ctypes.c_void_p] * 4 + [ctypes.c_size_t]
        query.restype = None
    return lib


def around(bounds, random):
    lower, upper = bounds.astype(np.float64)
    away = random.normal(size=(SIDE * SIDE, 3))
    origins = (lower + upper) / 2 + np.linalg.norm(upper - lower) * away / np.linalg.norm(away, axis=1)[:, None]
    return origins, random.uniform(lower, upper, size=origins.shape) - origins


def picture(bounds, _):
    """Row by row, from a corner beyond the box."""
    lower, upper = bounds.astype(np.float64)
    eye = upper + 0.5 * (upper - lower)
    forward = (lower + upper) / 2 - eye
    right = np.cross(forward, [0.3, 1.0, 0.1])
    right *= 0.5 * np.linalg.norm(upper - lower) / np.linalg.norm(right)
    up = np.cross(right, forward)
    up *= np.linalg.norm(right) / np.linalg.norm(up)
    y, x = np.meshgrid(np.linspace(1, -1, SIDE), np.linspace(-1, 1, SIDE), indexing="ij")
    directions = forward + x.reshape(-1, 1) * right + y.reshape(-1, 1) * up
    return np.broadcast_to(eye, directions.shape), directions


def measure(queries):
    best = [np.inf] * len(queries)
    for _ in range(ROUNDS):
        for i, query in enumerate(queries):
            start = time.perf_counter()
            query()
            best[i] = min(best[i], time.perf_counter() - start)
    return best


def compare(lib, scene, handle, rays):
    origins, directions = (np.ascontiguousarray(a, np.float32) for a in rays)
    packed = np.zeros(len(origins), RAY)
    packed["origin"], packed["direction"], packed["tmax"] = origins, directions, np.inf
    hits, found = np.empty(len(packed), HIT), np.empty(len(packed), np.uint8)
    own = {"first": lambda: scene.nearest(origins, directions), "any": lambda: scene.any(origins, directions)}
    theirs = {
        "first": lambda: lib.bth_nearest(handle, packed.ctypes.data, None, hits.ctypes.data, len(packed)),
        "any": lambda: lib.bth_any(handle, packed.ctypes.data, None, found.ctypes.data, len(packed)),
    }
    for name in own:
        numpy_seconds, library_seconds = measure([own[name], theirs[name]])
        yield name, len(packed) / numpy_seconds / 1e6, len(packed) / library_seconds / 1e6
    nearest = scene.nearest(origins, directions)
    assert (nearest.triangle == hits["triangle"]).all() and (nearest.t == hits["t"]).all(), "the answers differ"
    assert (scene.any(origins, directions) == found.astype(bool)).all(), "the answers differ"


def main(path, models):
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    bth.set_threads(1)
    lib = library(path)
    print(f"{'model':30} {'rays':>8} {'query':>6} {'numpy Mrays/s':>14} {'library':>9} {'ratio':>6}")
    ratios = []
    for model in models:
        scene, handle = bth.compile(model), ctypes.c_void_p()
        data = scene.to_bytes()
        if lib.bth_open_memory(data, len(data), READ, ctypes.byref(handle)) != 0:
            sys.exit("the library does not open the compiled file")
        for name, rays in (("around", around), ("picture", picture)):
            for query, ours, theirs in compare(lib, scene, handle, rays(scene.bounds, np.random.default_rng(1))):
                ratios.append(ours / theirs)
                label = os.path.basename(model)
                print(f"{label:30} {name:>8} {query:>6} {ours:14.2f} {theirs:9.2f} {ours / theirs:6.2f}", flush=True)
        lib.bth_close(handle)
    print(f"mean {np.exp(np.mean(np.log(ratios))):.3f}, least {min(ratios):.2f}")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2:])
