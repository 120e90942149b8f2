"""Signed distances on a grid."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _arrays
from .._scene import Scene
from ._arithmetic import Floats
from ._errors import lacks_surface
from ._progress import Progress, chunks

#: Most values of a volume: 4 GiB of float32.
MOST_VALUES = 1 << 30


@dataclass(frozen=True)
class Volume:
    """Signed distances at the points of a grid.

    distance: (nx, ny, nz) float32, world units, negative inside of closed surfaces.
    origin: (3,) float64, the point of distance[0, 0, 0] in world space.
    spacing: distance of neighbouring points in world units, the same along all axes. Point (i, j, k) is origin + spacing (i, j, k).
    """

    distance: NDArray[np.float32]
    origin: Floats
    spacing: float

    def axis(self, axis: int) -> Floats:
        """Coordinates of the points along an axis."""
        return self.origin[axis] + self.spacing * np.arange(self.distance.shape[axis])


def sdf(
    scene: Scene, resolution: int = 64, *, margin: float = 0.1, box: ArrayLike | None = None, threads: int | None = None,
    progress: Progress | None = None,
) -> Volume:
    """Samples the signed distance to the surfaces of a scene on a grid.

    resolution: number of points along the longest side of the box; the other sides have as many as fit, at least 2.
    margin: how far the grid extends beyond the scene on each side, as a share of its longest side.
    box: (2, 3), lower and upper end in world space, in place of the scene's own box; the margin is added to it as well.
    threads, progress: see `bth.compile`.

    The points are rounded to float32 where that moves none by more than 2^-24 of the grid's longest side; elsewhere they are float64. The
    distance of the point is exact to 0.55 units in the last place (docs/accuracy.md). The sign is exact for closed surfaces. For others
    there is a bth.OpenMeshWarning: they have no inside (docs/inside.md).
    """
    if resolution < 2:
        raise ValueError(f"resolution: expected at least 2, got {resolution}")
    if not 0 <= margin < math.inf:
        raise ValueError(f"margin: expected a number from 0, got {margin}")
    if scene.bounds is None:
        raise lacks_surface()
    low, high = _box(scene.bounds if box is None else box)
    longest = float((high - low).max())
    sides = high - low + 2 * margin * longest
    spacing = float(sides.max()) / (resolution - 1)
    # A side that is a whole number of spacings long is not to lose its last point to rounding: hence the relative 2^-40.
    counts = [max(2, math.floor(side / spacing * (1 + 2.0**-40)) + 1) for side in sides]
    if math.prod(counts) > MOST_VALUES:
        size = "x".join(map(str, counts))
        raise ValueError(f"resolution: {size} points are more than the {MOST_VALUES} that a volume may have; take a lower resolution")
    # What a side has too much or too little is shared out to both ends.
    origin = 0.5 * (low + high) - 0.5 * spacing * (np.array(counts) - 1)
    volume = Volume(np.empty(counts, np.float32), origin, spacing)
    moved = max(np.abs(axis.astype(np.float32) - axis).max() for axis in map(volume.axis, range(3)))
    kind = np.float64 if moved > 2.0**-24 * sides.max() else np.float32
    x, (y, z) = volume.axis(0), np.meshgrid(volume.axis(1), volume.axis(2), indexing="ij")
    for part in chunks(counts[0], counts[1] * counts[2], "signed distance", progress):
        slab = np.empty((len(x[part]), *y.shape, 3), kind)
        slab[..., 0], slab[..., 1], slab[..., 2] = x[part, None, None], y, z
        volume.distance[part] = scene.signed_distance(slab, threads=threads)
    return volume


def _box(box: ArrayLike) -> tuple[Floats, Floats]:
    box = np.asarray(_arrays.plain(box, "box"), np.float64)
    if box.shape != (2, 3) or not np.isfinite(box).all() or (box[0] > box[1]).any() or not (box[1] > box[0]).any():
        raise ValueError("box: expected two finite points, the lower end and the upper end, (2, 3)")
    return box[0], box[1]
