"""Rays per second of bth and of embreex through their numpy interfaces: the same rays, one thread, in turns.

    python python/benchmarks/against_embreex.py MODEL.ply …        models that bth and trimesh read

Rays come from points around the model to points of its box, 1e6 a batch.
"""

import os
import sys
import time

os.environ["TBB_NUM_THREADS"] = "1"

import numpy as np
import trimesh
from trimesh.ray import ray_pyembree

import bth

COUNT, ROUNDS = 1_000_000, 5


def rays(mesh, random):
    lower, upper = mesh.bounds
    center, radius = (lower + upper) / 2, np.linalg.norm(upper - lower)
    away = random.normal(size=(COUNT, 3))
    origins = center + radius * away / np.linalg.norm(away, axis=1)[:, None]
    return origins, random.uniform(lower, upper, size=(COUNT, 3)) - origins


def main(models):
    try:
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    except AttributeError:
        print("the threads of embreex cannot be limited here", file=sys.stderr)
    bth.set_threads(1)
    print(f"{'model':24} {'triangles':>10} {'query':>6} {'bth Mrays/s':>12} {'embreex':>9} {'ratio':>6} {'differ':>7}")
    for model in models:
        mesh = trimesh.load(model, process=False, force="mesh")
        origins, directions = rays(mesh, np.random.default_rng(1))
        scene = bth.compile(mesh, quality="best")
        other = ray_pyembree.RayMeshIntersector(mesh)
        first = {
            "first": (lambda: scene.nearest(origins, directions).triangle,
                      lambda: other.intersects_id(origins, directions, multiple_hits=False)),
            "any": (lambda: scene.any(origins, directions), lambda: other.intersects_any(origins, directions)),
        }
        hit = scene.nearest(origins, directions).hit
        missed = int((hit != other.intersects_any(origins, directions)).sum())
        for name, queries in first.items():
            times = [[], []]
            for _ in range(ROUNDS):
                for query, seconds in zip(queries, times):
                    start = time.perf_counter()
                    query()
                    seconds.append(time.perf_counter() - start)
            ours, theirs = (COUNT / min(seconds) / 1e6 for seconds in times)
            label = os.path.basename(model)
            print(f"{label:24} {len(mesh.faces):10} {name:>6} {ours:12.2f} {theirs:9.2f} {ours / theirs:6.2f} {missed:7}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
