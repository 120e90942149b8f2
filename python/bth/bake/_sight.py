"""Visibility between points, and what is seen from points of a terrain."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _arrays
from .._scene import Scene
from ._arithmetic import Floats
from ._progress import Progress, chunks
from ._surface import SurfacePoints, at_vertices

#: The least normal number of float32: what touches a line at its very beginning is not in the way.
_BEGIN = float(np.finfo(np.float32).tiny)
#: Lines end short of the observer by this share of their length: four times what rounding their direction to float32 may move the end.
_END = 1.0 - 2.0**-22


def line_of_sight(scene: Scene, observers: ArrayLike, targets: ArrayLike, *, threads: int | None = None) -> NDArray[np.bool_]:
    """Whether nothing of the scene lies between observers and targets.

    observers, targets: (..., 3) in world space, broadcast against each other.

    Returns bool of the leading shape. The line starts at the target. A surface that contains the target only touches the line there and
    does not hide it, and neither does anything within 2^-22 of the line's length of the observer. Between points that are the same,
    nothing can be. Points beyond the range of float32 see nothing and are not seen.
    """
    starts, ends, shape = _arrays.together(targets, "targets", observers, "observers")
    directions, tmax, finite = _lines(starts, ends)
    blocked = scene.any(starts, directions, tmin=_BEGIN, tmax=tmax, threads=threads)
    return (finite & ~blocked).reshape(shape)


def _lines(starts: NDArray[np.floating], ends: NDArray[np.floating]) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Directions and largest t of lines between points (..., 3), and whether both ends are within the range of float32."""
    most = np.finfo(np.float32).max
    finite = (np.abs(starts) <= most).all(axis=-1) & (np.abs(ends) <= most).all(axis=-1)
    with np.errstate(over="ignore", invalid="ignore"):
        directions = ends.astype(np.float64) - starts
        # Halved where the difference has no float32.
        far = np.abs(directions).max(axis=-1, initial=0.0) > most
        directions[far] *= 0.5
    return directions, np.where(far, 2.0, 1.0) * _END, finite


def viewshed(
    scene: Scene, observers: ArrayLike, at: SurfacePoints | None = None, *, height: float = 0.0, up: ArrayLike = (0.0, 0.0, 1.0),
    threads: int | None = None, progress: Progress | None = None,
) -> NDArray[np.bool_]:
    """Which points of surfaces are seen by observers, as on a terrain.

    observers: (k, 3) in world space; see `above_ground`.
    at: the points, by default `bake.at_vertices(scene)`.
    height: of targets above the points, along the unit vector `up`, in world units: that of a mast, say. With 0 lines start on the
    surface itself (`SurfacePoints.leaving`), and points are seen from the front.

    Returns (k, n) bool. Points without normal are not seen.
    """
    if not np.isfinite(height):
        raise ValueError(f"height: expected a finite number, got {height}")
    observers = np.atleast_2d(_arrays.vectors(observers, "observers"))
    if observers.ndim != 2:
        raise ValueError(f"observers: expected the shape (k, 3), got {observers.shape}")
    at = at_vertices(scene) if at is None else at
    seen = np.zeros((len(observers), len(at)), bool)
    for part in chunks(len(at), len(observers), "lines of sight", progress):
        if height != 0:
            targets = at.position[part] + height * np.asarray(up, np.float64)
            seen[:, part] = line_of_sight(scene, observers[:, None], targets, threads=threads)
            continue
        directions, tmax, finite = _lines(at.position[part, None], observers)
        start, leaves = at.leaving(np.arange(len(at))[part], directions)
        blocked = scene.any(None, directions, tmax=tmax, start=start, threads=threads)
        seen[:, part] = (finite & leaves & ~blocked).T
    return seen & at.usable


def above_ground(scene: Scene, points: ArrayLike, height: float, up: ArrayLike = (0.0, 0.0, 1.0)) -> Floats:
    """Points at a height above the uppermost surface below or above them.

    points: (..., 3) in world space; where they are along `up` does not matter. up: one of the axes, a unit vector.
    height: in world units.

    Returns (..., 3) float64; NaN where there is no surface.
    """
    points, up = np.array(_arrays.vectors(points, "points"), np.float64), np.asarray(up, np.float64)
    bounds = scene.bounds
    if bounds is None:
        return np.full(points.shape, np.nan)
    box = bounds.astype(np.float64)
    axis = int(np.argmax(np.abs(up)))
    top = box[1 if up[axis] > 0 else 0, axis]
    points[..., axis] = top + up[axis] * max(float(np.ptp(box, axis=0).max()), float(np.abs(box).max()) * 2.0**-20)
    hits = scene.nearest(points, -up)
    ground = points - np.where(hits.hit, hits.t, np.nan)[..., None] * up
    return ground + height * up
