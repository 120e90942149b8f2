"""Points inside of closed meshes: how many answers of trimesh with embreex are wrong, and how many of bth.

    python python/benchmarks/inside_against_trimesh.py MODEL.ply …        closed models that bth and trimesh read

Three sets of 1e6 points: anywhere in the bounds; such that the ray along which trimesh looks passes a vertex; and likewise the middle of an
edge. The reference is `Scene.contains`, which `bth-bench stress` checks along two rays and, on samples, against all triangles in exact
arithmetic. trimesh asks embreex along two opposite rays, and where they disagree along others.
"""

import sys
import time

import numpy as np
import trimesh
from trimesh.ray import ray_pyembree

import bth

COUNT = 1_000_000
# The direction of trimesh.ray.ray_util.contains_points.
DIRECTION = np.array([0.4395064455, 0.617598629942, 0.652231566745])


def aimed(targets, size, random):
    chosen = targets[random.integers(len(targets), size=COUNT)]
    return chosen - DIRECTION * size * random.uniform(0.001, 0.5, size=(COUNT, 1)) * random.choice([-1, 1], size=(COUNT, 1))


def sets(mesh, random):
    lower, upper = mesh.bounds
    size = np.linalg.norm(upper - lower)
    yield "anywhere", random.uniform(lower, upper, size=(COUNT, 3))
    yield "vertices", aimed(mesh.vertices, size, random)
    yield "edges", aimed(mesh.vertices[mesh.edges_unique].mean(axis=1), size, random)


def main(models):
    print(f"{'model':24} {'points':>10} {'inside':>8} {'trimesh wrong':>14} {'trimesh ns':>11} {'bth ns':>7}")
    for path in models:
        mesh = trimesh.load(path, process=False)
        scene = bth.compile(path)
        rival = ray_pyembree.RayMeshIntersector(mesh)
        random = np.random.default_rng(1)
        for name, points in sets(mesh, random):
            # What both are asked about: the points as they are in f32.
            points = points.astype(np.float32)
            start = time.process_time()
            inside = scene.contains(points, threads=1)
            own = time.process_time() - start
            start = time.process_time()
            theirs = rival.contains_points(points)
            other = time.process_time() - start
            wrong = np.count_nonzero(inside != theirs)
            row = f"{path.rsplit('/', 1)[-1]:24} {name:>10} {inside.sum():8} {wrong:14}"
            print(f"{row} {other / COUNT * 1e9:11.0f} {own / COUNT * 1e9:7.0f}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
