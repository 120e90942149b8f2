"""Queries of scenes by points, boxes and balls."""

import math

import numpy as np

from . import _arrays, _native, _threads
from ._hits import Closest, Overlaps, hit_columns, offsets_of
from ._open_meshes import warn_if_open


def _rows(points):
    """Points as rows of three numbers, and their leading shape."""
    points = _arrays.vectors(points, "points")
    return _arrays.rows(points, points.shape), points.shape[:-1]


def _boxes(lower, upper):
    lower, upper, shape = _arrays.together(lower, "lower", upper, "upper")
    inverted = (lower > upper).any(axis=-1)
    if inverted.any():
        box = int(np.argmax(inverted))
        found = f"{lower[box].tolist()} and {upper[box].tolist()}"
        raise ValueError(f"lower, upper: expected ends in ascending order along each axis, got {found} (box {box})")
    return (lower, upper), shape


def _balls(center, radius):
    center = _arrays.vectors(center, "center")
    radius_shape = np.shape(radius)
    try:
        shape = np.broadcast_shapes(center.shape[:-1], radius_shape)
    except ValueError:
        raise ValueError(f"radius: the shape {radius_shape} does not fit {center.shape[:-1]}, that of the centers") from None
    radius = _arrays.numbers(radius, "radius", shape)
    if np.any(np.less(radius, 0)):
        raise ValueError(f"radius: expected numbers from 0, got {np.min(radius)}")
    return (_arrays.rows(center, (*shape, 3)), radius), shape


class PointQueries:
    """The queries of a Scene by points, of shape (..., 3), and by boxes and balls.

    `contains`, `winding` and `signed_distance` warn once (bth.OpenMeshWarning) where a surface is not closed.
    Numbers in float64 are taken as they are, and distances and positions of answers are then float64.
    """

    __slots__ = ()

    def _by_points(self, query, points, kind, threads):
        rows, shape = _rows(points)
        out = np.empty(len(rows), kind or rows.dtype)
        query(self._native, rows, _threads.count(threads), out)
        return out.reshape(shape)

    def contains(self, points, *, threads=None):
        """Whether points lie inside of closed surfaces; exact, and the same on every call."""
        warn_if_open(self)
        return self._by_points(_native.contains, points, bool, threads)

    def winding(self, points, *, threads=None):
        """How often closed surfaces enclose points, int32."""
        warn_if_open(self)
        return self._by_points(_native.winding, points, np.int32, threads)

    def signed_distance(self, points, *, threads=None):
        """Distances of points to the nearest surface, in the type of the points, negative inside of closed surfaces; NaN for a point that is not finite."""
        warn_if_open(self)
        return self._by_points(_native.signed_distance, points, None, threads)

    def closest(self, points, radius=math.inf, *, threads=None):
        """The closest points of surfaces within a radius, as Closest."""
        rows, shape = _rows(points)
        radius = _arrays.number(radius, "radius")
        if not radius >= 0:
            raise ValueError(f"radius: expected a number from 0, got {radius}")
        columns, position = hit_columns(len(rows), rows.dtype), np.empty(len(rows) * 3, rows.dtype)
        feature = np.empty(len(rows), np.uint8)
        out = columns, position, feature
        _native.closest(self._native, rows, radius, _threads.count(threads), out)
        columns = [c.reshape(shape) for c in columns]
        return Closest(columns, position.reshape(*shape, 3), feature.reshape(shape), self)

    def _overlaps(self, regions, shape, threads):
        found = np.empty(len(regions[0]), bool)
        _native.overlaps(self._native, regions, _threads.count(threads), found)
        return found.reshape(shape)

    def _triangles_in(self, regions, threads):
        counts = np.empty(len(regions[0]), np.uint64)
        instance, triangle = _native.triangles_in(self._native, regions, _threads.count(threads), counts)
        return Overlaps(offsets_of(counts), instance, triangle)

    def overlaps_box(self, lower, upper, *, threads=None):
        """Whether any triangle overlaps closed boxes along the axes of the world; exact. Ends are (..., 3), are broadcast, and may be infinite."""
        return self._overlaps(*_boxes(lower, upper), threads)

    def triangles_in_box(self, lower, upper, *, threads=None):
        """The triangles that overlap boxes as in `overlaps_box`, as Overlaps."""
        return self._triangles_in(_boxes(lower, upper)[0], threads)

    def overlaps_sphere(self, center, radius, *, threads=None):
        """Whether any triangle is as near to the centers (..., 3) as the radii (...): in float64 exactly, in float32 by the distance that `closest` reports."""
        return self._overlaps(*_balls(center, radius), threads)

    def triangles_in_sphere(self, center, radius, *, threads=None):
        """The triangles within the radii of centers as in `overlaps_sphere`, as Overlaps."""
        return self._triangles_in(_balls(center, radius)[0], threads)
