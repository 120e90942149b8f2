"""Catmull-Clark subdivision with creases, corners and boundaries, as OpenSubdiv defines it: level by level."""

import numpy as np


def catmull_clark(points, counts, indices, corners, creases, sharp_corners, keeps_corners):
    """One level. Returns points (n, 3), indices of quads (m, 4), the corners' values, creases, and sharp corners.

    points: (v, 3). counts, indices: of the faces' corners. corners: values (c, k) at corners, interpolated linearly.
    creases: dict from pairs of vertices, in ascending order, to sharpness. sharp_corners: (v,) sharpness.
    keeps_corners: True if a vertex of one face stays where it is.
    """
    start = np.cumsum(counts) - counts
    face = np.repeat(np.arange(len(counts)), counts)
    place = np.arange(len(indices)) - start[face]
    after = start[face] + (place + 1) % counts[face]
    before = start[face] + (place - 1) % counts[face]
    centers = np.add.reduceat(points[indices], start, axis=0) / counts[:, None]
    pairs = np.sort(np.stack([indices, indices[after]], 1), axis=1)
    edges, edge = np.unique(pairs, axis=0, return_inverse=True)
    edge = edge.reshape(-1)
    uses = np.bincount(edge, minlength=len(edges))
    sharpness = np.array([creases.get((a, b), 0.0) for a, b in edges.tolist()]) if creases else np.zeros(len(edges))
    # A boundary is infinitely sharp, and so is an edge of more than two faces.
    sharp = np.where(uses == 2, sharpness, np.inf)

    middles = points[edges].mean(axis=1)
    beside = _sum(edge, centers[face], len(edges))
    smooth = (points[edges].sum(axis=1) + beside) / np.maximum(2 + uses, 1)[:, None]
    share = np.clip(sharp, 0, 1)[:, None]
    on_edges = (1 - share) * smooth + share * middles

    count = len(points)
    valence = np.bincount(edges.reshape(-1), minlength=count)
    faces_of = np.bincount(indices, minlength=count)
    n = np.maximum(valence, 1)[:, None]
    around = _sum(indices, centers[face], count) / np.maximum(faces_of, 1)[:, None]
    between = _sum(edges.reshape(-1), np.repeat(middles, 2, axis=0), count) / n
    soft = (around + 2 * between + (n - 3) * points) / n
    is_sharp = sharp > 0
    ends = edges[is_sharp]
    sharp_edges = np.bincount(ends.reshape(-1), minlength=count)
    others = _sum(ends.reshape(-1), points[ends[:, ::-1].reshape(-1)], count)
    crease = (6 * points + others) / 8
    mean = np.bincount(ends.reshape(-1), np.repeat(np.minimum(sharp[is_sharp], 1e9), 2), count) / np.maximum(sharp_edges, 1)
    fixed = (sharp_edges > 2) | (keeps_corners & (faces_of == 1)) | (faces_of == 0)
    ruled = np.where(fixed[:, None], points, crease)
    weight = np.where((sharp_edges >= 2) | fixed, np.where(fixed & (sharp_edges <= 2), 1, np.clip(mean, 0, 1)), 0)[:, None]
    moved = (1 - weight) * soft + weight * ruled
    corner = np.clip(sharp_corners, 0, 1)[:, None]
    moved = (1 - corner) * moved + corner * points

    quads = np.stack([indices, count + edge, count + len(edges) + face, count + edge[before]], 1)
    values = np.add.reduceat(corners, start, axis=0) / counts[:, None] if len(corners.T) else np.zeros((len(counts), 0))
    halves = (corners + corners[after]) / 2
    new_corners = np.stack([corners, halves, values[face], halves[before]], 1)
    left = np.maximum(sharpness - 1, 0)
    new_creases = {}
    for k in np.nonzero(left)[0].tolist():
        for end in edges[k].tolist():
            new_creases[end, count + k] = float(left[k])
    new_sharp = np.zeros(count + len(edges) + len(counts))
    new_sharp[:count] = np.maximum(sharp_corners - 1, 0)
    new_corners = new_corners.reshape(4 * len(quads), corners.shape[1])
    return np.concatenate([moved, on_edges, centers]), quads, new_corners, new_creases, new_sharp


def _sum(rows, values, count):
    """Sums of rows of three, by their index."""
    return np.stack([np.bincount(rows, values[:, k], count) for k in range(3)], 1)
