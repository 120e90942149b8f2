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


def _start(start, shape):
    if start is None:
        return None
    pair = (start.instance, start.triangle) if hasattr(start, "instance") else start
    if not isinstance(pair, (tuple, list)) or len(pair) != 2:
        raise TypeError(f"start: expected Hits or a pair (instance, triangle), got {type(start).__name__}")
    pair = [_arrays.indices(a, "start") for a in pair]
    try:
        return tuple(np.broadcast_to(a, shape).reshape(-1) for a in pair)
    except ValueError:
        raise ValueError(f"start: the shapes do not fit {shape}, that of the rays") from None


def rays_and_shape(origins, directions, tmin, tmax):
    """Origins, directions and ranges as the native module takes them, and the leading shape."""
    origins, directions, shape = _arrays.together(origins, "origins", directions, "directions")
    return (origins, directions, _arrays.numbers(tmin, "tmin", shape), _arrays.numbers(tmax, "tmax", shape)), shape


class RayQueries:
    """The queries of a Scene by rays.

    Origins and directions are of shape (..., 3) and are broadcast; tmin and tmax are numbers or arrays that are broadcast to (...).

    mask: instances and groups of triangles whose own mask (`set_instance_mask`, `set_group_mask`) has no bit in common with this one
    are not hit. cull: 'back' or 'front' ignores hits on these sides of triangles.
    filter: a function that is called with a bth.Candidate for hits that meet the other conditions, and returns whether the hit counts.
    Slow: it takes the interpreter's lock for each hit, and the call then uses one thread. An exception from it ends the call.
    """

    __slots__ = ()

    def nearest(
        self, origins, directions, tmin=0.0, tmax=math.inf, start=None, *, mask=NONE, cull=None, filter=None, threads=None,
    ):
        """The nearest hits of rays, as Hits.

        start: the triangles on which rays start, as Hits or a pair (instance, triangle). It is a hint, which never changes an
        answer: see free_directions of `compile`.
        """
        rays, shape = rays_and_shape(origins, directions, tmin, tmax)
        columns = hit_columns(len(rays[0]))
        conditions = _conditions(mask, cull, filter)
        _native.nearest(self._native, rays, _start(start, shape), conditions, _threads.count(threads), columns)
        return Hits([c.reshape(shape) for c in columns], self, rays[:2])

    def any(
        self, origins, directions, tmin=0.0, tmax=math.inf, start=None, *, mask=NONE, cull=None, filter=None, threads=None,
    ):
        """Whether rays hit anything: an array of bool. start: see `nearest`."""
        rays, shape = rays_and_shape(origins, directions, tmin, tmax)
        found = np.empty(len(rays[0]), bool)
        conditions = _conditions(mask, cull, filter)
        _native.any(self._native, rays, _start(start, shape), conditions, _threads.count(threads), found)
        return found.reshape(shape)

    def all_hits(
        self, origins, directions, tmin=0.0, tmax=math.inf, *, most=None, mask=NONE, cull=None, filter=None, threads=None,
    ):
        """All hits of rays in order, or the nearest `most` of each, as AllHits. A ray through an edge hits both triangles at it."""
        if most is not None:
            # No ray has more hits than indices can count.
            most = min(operator.index(most), 2**63 - 1)
            if most < 0:
                raise ValueError(f"most: expected a number from 0, got {most}")
        rays, _ = rays_and_shape(origins, directions, tmin, tmax)
        counts = np.empty(len(rays[0]), np.uint64)
        conditions = _conditions(mask, cull, filter)
        columns = _native.all_hits(self._native, rays, most, conditions, _threads.count(threads), counts)
        return AllHits(offsets_of(counts), columns, self)

    def count(self, origins, directions, tmin=0.0, tmax=math.inf, *, mask=NONE, cull=None, filter=None, threads=None):
        """Number of hits of rays, int64. See `crossings` for passages of closed surfaces."""
        rays, shape = rays_and_shape(origins, directions, tmin, tmax)
        counts = np.empty(len(rays[0]), np.uint64)
        _native.count(self._native, rays, _conditions(mask, cull, filter), _threads.count(threads), counts)
        return counts.astype(np.int64).reshape(shape)

    def crossings(self, origins, directions, tmin=0.0, tmax=math.inf, *, threads=None):
        """How often rays pass through surfaces, each passage of a closed one counted once; and the passages outwards minus those inwards."""
        rays, shape = rays_and_shape(origins, directions, tmin, tmax)
        count, winding = np.empty(len(rays[0]), np.uint32), np.empty(len(rays[0]), np.int32)
        _native.crossings(self._native, rays, _threads.count(threads), count, winding)
        return count.reshape(shape), winding.reshape(shape)
