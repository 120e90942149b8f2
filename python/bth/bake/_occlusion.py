"""Ambient occlusion."""

from __future__ import annotations

import math
import warnings

import numpy as np
from numpy.typing import NDArray

from .._scene import Scene
from ._progress import Progress, chunks
from ._sampling import hemisphere
from ._surface import SurfacePoints, at_vertices

#: Share of black points from which on a bake is likely not what is wanted.
_BLACK = 0.5
SIDES = {"front": (1,), "back": (-1,), "both": (1, -1)}


def ambient_occlusion(
    scene: Scene, at: SurfacePoints | None = None, *, rays: int = 64, distance: float = math.inf, side: str = "front", seed: int = 0,
    threads: int | None = None, progress: Progress | None = None,
) -> NDArray[np.float32]:
    """How open surfaces are to a sky all around: 1 where nothing is in the way, 0 within a closed room.

    at: the points, by default `bake.at_vertices(scene)`; for a texture `bake.at_texels(scene, width, height).points`.
    rays: for each point. The standard error of a value p is at most sqrt(p (1 - p) / rays), 0.06 for 64 rays, and less in practice.
    distance: how far occluders count, in world units.
    side: 'front', from which triangles are counter-clockwise; 'back'; or 'both', the more open one, for sheets and for models
    whose triangles have no common orientation.
    seed: another one gives other errors. Results depend neither on threads nor on the machine.
    progress: see `bth.compile`.

    Returns (n,) float32: the share of rays that hit nothing, of directions with a density proportional to the cosine to the normal; NaN
    where the point has no normal. Rays start on the surface itself (`SurfacePoints.leaving`), and no surface
    hides itself.
    """
    if rays < 1:
        raise ValueError(f"rays: expected at least 1, got {rays}")
    if not distance > 0:
        raise ValueError(f"distance: expected a number above 0, got {distance}")
    if side not in SIDES:
        raise ValueError(f"side: expected one of {', '.join(SIDES)}, got {side!r}")
    at = at_vertices(scene) if at is None else at
    result = np.full(len(at), np.nan, np.float32)
    usable = np.nonzero(at.usable)[0]
    sides = SIDES[side]
    for part in chunks(len(usable), rays * len(sides), "ambient occlusion", progress):
        points = usable[part]
        open_rays = []
        for sign in sides:
            directions = hemisphere(sign * at.normal[points], seed, points, rays).astype(np.float32)
            start, leaves = at.leaving(points, directions, sign)
            blocked = scene.any(None, directions, tmax=distance, start=start, threads=threads)
            open_rays.append((leaves & ~blocked).sum(axis=1))
        result[points] = np.maximum.reduce(open_rays) / np.float64(rays)
    black = np.count_nonzero(result == 0) / max(len(usable), 1)
    if black >= _BLACK:
        _warn_of_black(black, at, distance, side)
    return result


def _warn_of_black(black: float, at: SurfacePoints, distance: float, side: str) -> None:
    """Says why everything is black: in a closed room nothing sees the sky."""
    size = float(np.ptp(at.position, axis=0).max())
    hints = [] if math.isfinite(distance) else [f"distance (--distance) counts near occluders only, such as {0.2 * size:.2g} of a room's {size:.2g}"]
    hints += [] if side == "both" else ["side='both' (--side both) takes the more open side of triangles"]
    hint = f" (hint: {'; '.join(hints)})" if hints else ""
    message = f"{100 * black:.0f} % of the points are black: no ray from them reaches the sky, as inside of a closed room{hint}"
    warnings.warn(message, UserWarning, stacklevel=3)
