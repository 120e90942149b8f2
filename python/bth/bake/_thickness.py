"""Thickness of solids."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .._scene import Scene
from ._arithmetic import Floats, arctangent, dot
from ._progress import Progress, chunks
from ._sampling import cone
from ._surface import SurfacePoints, at_vertices

REDUCTIONS = ("median", "mean", "diameter")


def thickness(
    scene: Scene, at: SurfacePoints | None = None, *, rays: int = 32, angle: float = 60.0, reduce: str = "median", seed: int = 0,
    threads: int | None = None, progress: Progress | None = None,
) -> NDArray[np.float32]:
    """How thick the solid below points of its surface is, in world units.

    From each point rays go inwards, evenly within a cone around the reversed normal, to where they leave the solid.

    at: the points, by default `bake.at_vertices(scene)`.
    rays: for each point. angle: half the opening of the cone in degrees, below 90; with 0 all rays go straight in, and one is enough.
    reduce: 'median' or 'mean' of the lengths; or 'diameter', the shape diameter function of Shapira, Shamir and Cohen-Or (2008):
    the mean of the lengths within one standard deviation of the median, weighted by the inverse of the angle to the cone's axis.
    seed, threads, progress: see `ambient_occlusion`.

    Returns (n,) float32; NaN where no ray leaves the solid through the back of a triangle, as on open sheets, and where the point has
    no normal. Rays start at the point itself and never hit the triangles around it. Rays that
    hit a front first were outside of the solid already and do not count.
    """
    if rays < 1:
        raise ValueError(f"rays: expected at least 1, got {rays}")
    if not 0 <= angle < 90:
        raise ValueError(f"angle: expected degrees from 0 to less than 90, got {angle}")
    if reduce not in REDUCTIONS:
        raise ValueError(f"reduce: expected one of {', '.join(REDUCTIONS)}, got {reduce!r}")
    at = at_vertices(scene) if at is None else at
    result = np.full(len(at), np.nan, np.float32)
    usable = np.nonzero(at.usable)[0]
    cosine = math.cos(math.radians(angle))
    for part in chunks(len(usable), rays, "thickness", progress):
        points = usable[part]
        directions, cosines = cone(-at.normal[points], cosine, seed, points, rays)
        hits = scene.nearest(None, directions, start=at.starts(points[:, None]), threads=threads)
        inside = hits.hit & (dot(hits.normal, directions) > 0)
        result[points] = _reduced(np.where(inside, hits.t.astype(np.float64), np.nan), cosines, reduce)
    return result


def _reduced(lengths: Floats, cosines: Floats, reduce: str) -> Floats:
    """One length for each row; NaN are left out, and rows of nothing else give NaN."""
    known = ~np.isnan(lengths)
    count = known.sum(axis=1)
    median = _median(lengths, count)
    if reduce == "median":
        return median
    weights = known.astype(np.float64)
    if reduce == "diameter":
        mean = _mean(lengths, weights)
        deviation = np.sqrt(_mean((lengths - mean[:, None]) ** 2, weights))
        near = known & (np.abs(lengths - median[:, None]) <= deviation[:, None])
        # A ray along the axis has no angle; it weighs as much as one at the least angle that is not zero in float32.
        angles = 2.0 * arctangent(np.sqrt((1.0 - cosines) / (1.0 + cosines)))
        weights = np.where(near, 1.0 / np.maximum(angles, 2.0**-24), 0.0)
        # With two lengths both may be farther from their median than the deviation.
        weights = np.where(near.any(axis=1, keepdims=True), weights, known)
    return _mean(lengths, weights)


def _median(lengths: Floats, count: NDArray[np.int64]) -> Floats:
    # NaN are sorted to the end.
    ordered, rows = np.sort(lengths, axis=1), np.arange(len(lengths))
    low, high = ordered[rows, np.maximum(count - 1, 0) // 2], ordered[rows, np.minimum(count // 2, lengths.shape[1] - 1)]
    return np.where(count > 0, 0.5 * (low + high), np.nan)


def _mean(lengths: Floats, weights: Floats) -> Floats:
    total = weights.sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(weights > 0, lengths * weights, 0.0).sum(axis=1) / np.where(total > 0, total, np.nan)
