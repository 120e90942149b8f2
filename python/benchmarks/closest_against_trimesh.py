"""Closest points: run time and error of bth beside trimesh.

    python python/benchmarks/closest_against_trimesh.py MODEL.ply …        models that bth and trimesh read

500,000 points in a box of 1.1 times the size of the model, and as many near its surface. trimesh, which takes much longer, gets the first
3,000 of them. Of these, 100 are compared with the distances to all triangles, computed in f64: those about which both differ most.
"""

import sys
import time

import numpy as np
import trimesh

import bth

COUNT = 500_000
OF_TRIMESH = 3_000
COMPARED = 100
ROUNDS = 5


def sets(mesh, random):
    lower, upper = mesh.bounds
    center, half = (lower + upper) / 2, (upper - lower) / 2
    yield "box", center + 1.1 * half * random.uniform(-1, 1, size=(COUNT, 3))
    moved = 0.01 * np.linalg.norm(upper - lower) * random.normal(size=(COUNT, 3))
    yield "near surface", mesh.triangles_center[random.integers(len(mesh.faces), size=COUNT)] + moved


def of_edges(point, a, b):
    """Distances to the edges from a to b."""
    edge = b - a
    along = np.clip(np.sum((point - a) * edge, axis=1) / np.sum(edge * edge, axis=1), 0, 1)
    return np.linalg.norm(a + along[:, None] * edge - point, axis=1)


def exact(triangles, point):
    """The distance to the nearest of all triangles: to its plane where the point lies above it, else to an edge."""
    a, b, c = triangles.transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    sides = [np.sum(np.cross(q - p, point - p) * normal, axis=1) >= 0 for p, q in ((a, b), (b, c), (c, a))]
    above = np.abs(np.sum((point - a) * normal, axis=1)) / np.linalg.norm(normal, axis=1)
    edges = np.minimum(np.minimum(of_edges(point, a, b), of_edges(point, b, c)), of_edges(point, c, a))
    return np.min(np.where(np.logical_and.reduce(sides), np.minimum(above, edges), edges))


def main(models):
    print(f"{'model':24} {'points':>12} {'bth s':>7} {'bth ns':>8} {'trimesh ns':>11} {'bth error':>10} {'trimesh error':>14}")
    for path in models:
        mesh = trimesh.load(path, process=False)
        scene = bth.compile(path)
        random = np.random.default_rng(1)
        for name, points in sets(mesh, random):
            points = points.astype(np.float32)
            times = []
            for _ in range(ROUNDS):
                start = time.thread_time()
                closest = scene.closest(points, threads=1)
                times.append(time.thread_time() - start)
            own = np.median(times)
            few = points[:OF_TRIMESH].astype(float)
            start = time.thread_time()
            _, theirs, _ = trimesh.proximity.closest_point(mesh, few)
            other = time.thread_time() - start
            ours = closest.distance[:OF_TRIMESH].astype(float)
            most = np.argsort(-np.abs(ours - theirs) / ours)[:COMPARED]
            right = np.array([exact(mesh.triangles, few[i]) for i in most])
            errors = [np.max(np.abs(found[most] - right) / right) for found in (ours, theirs)]
            row = f"{path.rsplit('/', 1)[-1]:24} {name:>12} {own:7.3f} {own / COUNT * 1e9:8.0f} {other / OF_TRIMESH * 1e9:11.0f}"
            print(f"{row} {errors[0]:10.1e} {errors[1]:14.1e}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
