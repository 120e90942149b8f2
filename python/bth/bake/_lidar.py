"""A spinning laser scanner with several beams."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _arrays
from .._hits import NONE
from .._scene import Scene
from ._arithmetic import Floats, dot, turn, unit
from ._progress import Progress, chunks
from ._sampling import uniform


@dataclass(frozen=True)
class LidarScan:
    """What a scanner has measured. The leading shape of all arrays is (revolutions, columns, beams).

    range: float32, distance to what is hit, with noise, in world units; infinite where nothing is within the scanner's range.
    point: float64 (..., 3), the measured points in world space: at the measured range along the beam; NaN for none.
    instance, triangle: uint32, what is hit; bth.NONE for nothing.
    origin: float64 (revolutions, columns, 3), where the scanner was.
    direction: float64 (..., 3), unit vectors along the beams, world space.
    """

    range: NDArray[np.float32]
    point: Floats
    instance: NDArray[np.uint32]
    triangle: NDArray[np.uint32]
    origin: Floats
    direction: Floats

    @property
    def hit(self) -> NDArray[np.bool_]:
        """Whether there is a measurement."""
        return self.triangle != NONE


def lidar(
    scene: Scene, poses: ArrayLike, *, elevations: ArrayLike | None = None, columns: int = 1024,
    nearest: float = 0.0, farthest: float = math.inf, noise: float = 0.0, seed: int = 0,
    threads: int | None = None, progress: Progress | None = None,
) -> LidarScan:
    """Scans a scene with a spinning scanner.

    poses: where the scanner is, one of
      (3,) or (revolutions, 3): positions in world space, with the scanner's z axis that of the world;
      (4, 4) or (revolutions, 4, 4): rigid transforms from the scanner to world space;
      (revolutions, columns, 4, 4): one for each column, for a scanner that moves while it spins; see `poses_along`.
    elevations: angles of the beams above the scanner's xy plane, in degrees; by default 32 from -25 to 15.
    columns: directions of one revolution, counter-clockwise about the scanner's z axis from its x axis.
    nearest, farthest: the range of the scanner in world units. What is nearer than `nearest` is looked through.
    noise: standard deviation of the ranges in world units, normally distributed and independent. The same seed gives the same noise.
    threads, progress: see `bth.compile`.
    """
    if not 0 <= nearest <= farthest:
        raise ValueError(f"nearest, farthest: expected 0 <= nearest <= farthest, got {nearest} and {farthest}")
    if not 0 <= noise < math.inf:
        raise ValueError(f"noise: expected a number from 0, got {noise}")
    if columns < 1:
        raise ValueError(f"columns: expected at least 1, got {columns}")
    elevations = np.linspace(-25.0, 15.0, 32) if elevations is None else elevations
    angles = np.atleast_1d(np.asarray(_arrays.plain(elevations, "elevations"), np.float64))
    if angles.ndim != 1 or not (np.abs(angles) <= 90).all():
        raise ValueError("elevations: expected degrees from -90 to 90")
    transforms = _transforms(poses, columns)
    beams = _beams(angles, columns)
    shape = (len(transforms), columns, len(angles))
    direction = np.stack([dot(transforms[:, :, None, k, :3], beams) for k in range(3)], axis=-1)
    origin = np.broadcast_to(transforms[:, :, :3, 3], (*shape[:2], 3))
    distance = np.empty(shape, np.float32)
    instance, triangle = np.empty(shape, np.uint32), np.empty(shape, np.uint32)
    for part in chunks(shape[0], columns * len(angles), "scan", progress):
        hits = scene.nearest(origin[part, :, None], direction[part], tmin=nearest, tmax=farthest, threads=threads)
        distance[part], instance[part], triangle[part] = hits.t, hits.instance, hits.triangle
    if noise > 0:
        distance = np.maximum(distance + noise * _normal(seed, distance.size).reshape(shape), 0.0).astype(np.float32)
    reach = np.where(triangle != NONE, distance, np.nan).astype(np.float64)
    return LidarScan(distance, origin[:, :, None] + reach[..., None] * direction, instance, triangle, origin, direction)


def _transforms(poses: ArrayLike, columns: int) -> Floats:
    """Transforms (revolutions, columns or 1, 4, 4)."""
    poses = np.asarray(_arrays.plain(poses, "poses"), np.float64)
    if not np.isfinite(poses).all():
        raise ValueError("poses: expected finite numbers")
    if poses.ndim in (1, 2) and poses.shape[-1] == 3:
        positions = np.atleast_2d(poses)
        poses = np.tile(np.eye(4), (len(positions), 1, 1))
        poses[:, :3, 3] = positions
    if poses.ndim == 2 and poses.shape == (4, 4):
        poses = poses[None]
    if poses.ndim == 3:
        poses = poses[:, None]
    if poses.ndim != 4 or poses.shape[-2:] != (4, 4) or poses.shape[1] not in (1, columns):
        raise ValueError(f"poses: expected the shape (r, 3), (r, 4, 4) or (r, {columns}, 4, 4), got {np.shape(poses)}")
    linear = poses[..., :3, :3]
    # The rows of a rotation are unit and perpendicular; in float64 they are so to some 2^-50 and after a round trip by float32 to 2^-22.
    if (np.abs(linear @ np.swapaxes(linear, -1, -2) - np.eye(3)) > 2.0**-20).any():
        raise ValueError("poses: expected rotations without scale in the upper left 3x3 part of the transforms")
    return poses


def _beams(angles: Floats, columns: int) -> Floats:
    """Unit directions (columns, beams, 3) in the space of the scanner."""
    x, y = turn(np.arange(columns) / columns)
    flat, height = turn(angles / 360.0 % 1.0)
    return np.stack(np.broadcast_arrays(x[:, None] * flat, y[:, None] * flat, height[None, :]), axis=-1)


def _normal(seed: int, count: int) -> Floats:
    """Independent numbers of the standard normal distribution (Box and Muller 1958)."""
    numbers = np.arange(count, dtype=np.int64) * 2
    radius = np.sqrt(-2.0 * np.log(uniform(seed, numbers)))
    return radius * turn(uniform(seed, numbers + 1))[0]


def poses_along(path: ArrayLike, revolutions: int, columns: int, up: ArrayLike = (0.0, 0.0, 1.0)) -> Floats:
    """Transforms (revolutions, columns, 4, 4) of a scanner that moves along a path while it spins.

    path: (n, 3), at least two points in world space, that are passed in straight lines and at constant speed; the first column of the
    first revolution is at the first point.
    up: the scanner's z axis in world space. Its x axis points along the path, as far as that is perpendicular to z.
    """
    path, up = np.asarray(_arrays.plain(path, "path"), np.float64), unit(np.asarray(up, np.float64))
    if path.ndim != 2 or path.shape[1:] != (3,) or len(path) < 2 or not np.isfinite(path).all():
        raise ValueError(f"path: expected the shape (n, 3) with n >= 2 and finite numbers, got {path.shape}")
    if revolutions < 1 or columns < 1:
        raise ValueError(f"revolutions, columns: expected at least 1, got {revolutions} and {columns}")
    steps = np.diff(path, axis=0)
    lengths = np.sqrt(dot(steps, steps))
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    if not ends[-1] > 0:
        raise ValueError("path: all points are the same")
    way = np.arange(revolutions * columns) / (revolutions * columns) * ends[-1]
    leg = np.clip(np.searchsorted(ends, way, side="right") - 1, 0, len(steps) - 1)
    position = path[leg] + ((way - ends[leg]) / np.where(lengths[leg] > 0, lengths[leg], 1.0))[:, None] * steps[leg]
    flat = steps - dot(steps, up)[:, None] * up
    # A leg along `up` keeps the direction of the one before it, and the first any perpendicular one.
    side = np.eye(3)[int(np.argmin(np.abs(up)))]
    heading = unit(side - (side @ up) * up)
    headings = []
    for leg_direction, length in zip(flat, lengths):
        heading = unit(leg_direction) if np.sqrt(dot(leg_direction, leg_direction)) > 2.0**-20 * length else heading
        headings.append(heading)
    x = np.array(headings)[leg]
    poses = np.zeros((len(way), 4, 4))
    poses[:, :3, 0], poses[:, :3, 1], poses[:, :3, 2], poses[:, :3, 3] = x, np.cross(up, x), up, position
    poses[:, 3, 3] = 1.0
    return poses.reshape(revolutions, columns, 4, 4)
