"""Queries of scenes by rays."""

import math
import operator

import numpy as np

from . import _arrays, _native, _threads
from ._hits import NONE, AllHits, Hits, hit_columns, offsets_of


def mask_bits(mask):
    """A mask of 32 bits."""
    mask = operator.index(mask)
    if not 0 <= mask <= NONE:
        raise ValueError(f"mask: expected 32 bits, got {mask}")
    return mask


def _conditions(mask, cull, filter):
    if filter is not None and not callable(filter):
        raise TypeError(f"filter: expected a function, got {type(filter).__name__}")
    if cull is not None and not isinstance(cull, str):
        raise TypeError(f"cull: expected None, 'back' or 'front', got {type(cull).__name__}")
    if cull not in (None, "back", "front"):
        raise ValueError(f"cull: expected None, 'back' or 'front', got {cull!r}")
    return mask_bits(mask), cull or "none", filter


def _start_columns(start):
    """Instances, triangles, u and v of points at which rays start, broadcast to one shape."""
    if hasattr(start, "triangle"):
        instance, triangle, u, v = start.instance, start.triangle, start.u, start.v
    elif isinstance(start, (tuple, list)) and len(start) == 3:
        instance, triangle, uv = start
        uv = _arrays.weights(uv, "start: uv")
        if uv.ndim == 0 or uv.shape[-1] != 2:
            raise ValueError(f"start: expected uv of the shape (..., 2), got {uv.shape}")
        u, v = uv[..., 0], uv[..., 1]
    else:
        found = f"{len(start)} of them" if isinstance(start, (tuple, list)) else type(start).__name__
        raise TypeError(f"start: expected Hits or (instances, triangles, uv), got {found}")
    instance, triangle = _arrays.indices(instance, "start: instances"), _arrays.indices(triangle, "start: triangles")
    columns = instance, triangle, _arrays.weights(u, "start: u"), _arrays.weights(v, "start: v")
    try:
        return np.broadcast_arrays(*columns)
    except ValueError:
        found = f"instances {instance.shape}, triangles {triangle.shape} and uv {(*np.shape(u), 2)}"
        raise ValueError(f"start: expected shapes that fit together, got {found}") from None


def _flat(columns, shape):
    """Columns that are broadcast to a shape as the native module takes them."""
    return tuple(np.require(np.broadcast_to(column, shape).reshape(-1), None, "A") for column in columns)


def rays_and_shape(origins, directions, tmin, tmax, start=None):
    """Rays as the native module takes them, and their leading shape."""
    if start is None:
        if origins is None:
            raise TypeError("origins: expected an array of the shape (..., 3), got None (hint: None takes start=)")
        origins, directions, shape = _arrays.together(origins, "origins", directions, "directions")
        return (origins, directions, _arrays.numbers(tmin, "tmin", shape), _arrays.numbers(tmax, "tmax", shape), None), shape
    if origins is not None:
        raise ValueError("origins: expected None together with start, got both (hint: the start is the origin)")
    if np.ndim(tmin) > 0 or tmin != 0:
        hint = "hint: these rays hit what lies at t > 0, and never the surface that they leave"
        raise ValueError(f"tmin: expected none together with start, got {tmin} ({hint})")
    columns, directions = _start_columns(start), _arrays.vectors(directions, "directions")
    try:
        shape = np.broadcast_shapes(columns[0].shape, directions.shape[:-1])
    except ValueError:
        found = f"{columns[0].shape} starts and directions of the shape {directions.shape}"
        raise ValueError(f"start and directions: expected shapes that fit together, got {found}") from None
    directions = _arrays.rows(directions, (*shape, 3))
    return (None, directions, 0.0, _arrays.numbers(tmax, "tmax", shape), _flat(columns, shape)), shape


class RayQueries:
    """The queries of a Scene by rays.

    Origins and directions are of shape (..., 3) and are broadcast; tmin and tmax are numbers or arrays that are broadcast to (...).
    If one of the arrays is float64, as lists become, the rays are float64, and so is t. Nothing is rounded. If all are float32, so is t,
    and queries are faster. tmin and tmax that are one number take the type of the arrays.

    start: the points of surfaces at which rays start; origins are then None, and there is no tmin.
    Hits (or Closest), or (instances, triangles, uv) of the shapes (...), (...) and (..., 2),
    broadcast against directions. A ray starts at the exact point, not at a rounded one, and hits
    what lies at t > 0: never the surface that it leaves, and it never skips a wall. A ray is a miss
    if its start is not a point of a visible instance; `check_start` says why. Starts, their directions
    and tmax are rounded to float32; t is of the type of the directions.

    mask: instances and groups of triangles whose own mask (`set_instance_mask`, `set_group_mask`) has no bit in common with this one
    are not hit. cull: 'back' or 'front' ignores hits on these sides of triangles.
    filter: a function that is called with a bth.Candidate for hits that meet the other conditions, and returns whether the hit counts.
    Slow: it takes the interpreter's lock for each hit, and the call then uses one thread. An exception from it ends the call.
    """

    __slots__ = ()

    def nearest(
        self, origins, directions, tmin=0.0, tmax=math.inf, *, start=None, mask=NONE, cull=None, filter=None, threads=None,
    ):
        """The nearest hits of rays, as Hits."""
        rays, shape = rays_and_shape(origins, directions, tmin, tmax, start)
        columns = hit_columns(len(rays[1]), _arrays.answers(*rays))
        _native.nearest(self._native, rays, _conditions(mask, cull, filter), _threads.count(threads), columns)
        return Hits([c.reshape(shape) for c in columns], self, rays[:2])

    def any(
        self, origins, directions, tmin=0.0, tmax=math.inf, *, start=None, mask=NONE, cull=None, filter=None, threads=None,
    ):
        """Whether rays hit anything: an array of bool."""
        rays, shape = rays_and_shape(origins, directions, tmin, tmax, start)
        found = np.empty(len(rays[1]), bool)
        _native.any(self._native, rays, _conditions(mask, cull, filter), _threads.count(threads), found)
        return found.reshape(shape)

    def all_hits(
        self, origins, directions, tmin=0.0, tmax=math.inf, *, start=None, most=None, mask=NONE, cull=None, filter=None,
        threads=None,
    ):
        """All hits of rays in order, or the nearest `most` of each, as AllHits. A ray through an edge hits both triangles at it."""
        if most is not None:
            # No ray has more hits than indices can count.
            most = min(operator.index(most), 2**63 - 1)
            if most < 0:
                raise ValueError(f"most: expected a number from 0, got {most}")
        rays, _ = rays_and_shape(origins, directions, tmin, tmax, start)
        counts = np.empty(len(rays[1]), np.uint64)
        conditions = _conditions(mask, cull, filter)
        columns = _native.all_hits(self._native, rays, most, conditions, _threads.count(threads), counts)
        return AllHits(offsets_of(counts), columns, self)

    def count(
        self, origins, directions, tmin=0.0, tmax=math.inf, *, start=None, mask=NONE, cull=None, filter=None, threads=None,
    ):
        """Number of hits of rays, int64. See `crossings` for passages of closed surfaces."""
        rays, shape = rays_and_shape(origins, directions, tmin, tmax, start)
        counts = np.empty(len(rays[1]), np.uint64)
        _native.count(self._native, rays, _conditions(mask, cull, filter), _threads.count(threads), counts)
        return counts.astype(np.int64).reshape(shape)

    def crossings(self, origins, directions, tmin=0.0, tmax=math.inf, *, start=None, threads=None):
        """How often rays pass through surfaces, each passage of a closed one counted once; and the passages outwards minus those inwards."""
        rays, shape = rays_and_shape(origins, directions, tmin, tmax, start)
        count, winding = np.empty(len(rays[1]), np.uint32), np.empty(len(rays[1]), np.int32)
        _native.crossings(self._native, rays, _threads.count(threads), count, winding)
        return count.reshape(shape), winding.reshape(shape)

    def check_start(self, start):
        """Raises bth.Error unless rays can start at all of these points; see `start` above.

        Its code is BTH-S003 if there is no such instance. It is BTH-S008 if the instance is hidden,
        if it has no such triangle, if the triangle has no area, or if u and v are not the weights of
        a point of the triangle. Queries do not check starts.
        """
        columns = _start_columns(start)
        _native.check_start(self._native, _flat(columns, columns[0].shape))
