"""Scenes, their queries, and what these return."""

import io
import math
import os

import numpy as np

from . import _arrays, _native, _threads

#: The index of no triangle and of no instance, in hits of rays that hit nothing.
NONE = 0xFFFFFFFF


def open(path, mmap=False):
    """Opens a compiled file. It is checked as a whole, and then safe to trace whatever is in it.

    mmap: maps the file instead of reading it, in a time that does not depend on its size. Use it for unchanged files that the compiler
    has written, and do not change the file while the scene is open.
    """
    path = os.fspath(path)
    os.stat(path)
    return Scene(_native.open(path, bool(mmap)))


def load(data):
    """Opens the bytes of a compiled file, as `Scene.to_bytes` returns them."""
    if not isinstance(data, bytes):
        data = bytes(memoryview(data))
    return Scene(_native.load(data))


def _restore(data, seconds):
    scene = load(data)
    if seconds:
        scene.seconds = seconds
    return scene


class Hits:
    """Nearest hits of rays, each an array of the rays' leading shape.

    t: distance in units of the direction's length, infinite for a miss.
    u, v: weights of the triangle's second and third vertex.
    triangle, instance: indices; bth.NONE for a miss.
    """

    __slots__ = ("t", "u", "v", "instance", "triangle", "_scene", "_rays")

    def __init__(self, columns, scene=None, rays=None):
        self.t, self.u, self.v, self.instance, self.triangle = columns
        self._scene, self._rays = scene, rays

    @property
    def hit(self):
        """Whether the ray hits anything."""
        return self.triangle != NONE

    @property
    def position(self):
        """The points hit in world space, in float64, computed from t; NaN for a miss."""
        origins, directions = self._rays
        t = np.where(self.hit, self.t, np.nan).astype(np.float64)
        return np.asarray(origins, np.float64) + t[..., None] * np.asarray(directions, np.float64)

    @property
    def normal(self):
        """Unit normals of the triangles hit, in world space and float64, on the side from which their vertices are counter-clockwise; zeros for a miss."""
        return self._scene.normals(self.instance, self.triangle)

    def __len__(self):
        return len(self.t)

    def __repr__(self):
        return f"<bth.Hits of shape {self.t.shape}, {int(self.hit.sum())} hit>"


class AllHits:
    """All hits of rays: those of ray i are the rows offsets[i] to offsets[i + 1] of the arrays t, u, v, instance and triangle.

    They ascend by t, and by instance and triangle where t is the same. Rays of several axes count in C order.
    """

    __slots__ = ("offsets", "t", "u", "v", "instance", "triangle")

    def __init__(self, offsets, columns):
        self.offsets = offsets
        self.t, self.u, self.v, self.instance, self.triangle = columns

    @property
    def ray(self):
        """For each hit the index of its ray."""
        return np.repeat(np.arange(len(self.offsets) - 1), np.diff(self.offsets))

    def __len__(self):
        return len(self.t)

    def __repr__(self):
        return f"<bth.AllHits of {len(self.offsets) - 1} rays, {len(self)} hits>"


class Closest:
    """Closest points: distance (infinite where nothing is within the radius), point (NaN there), u, v, instance and triangle."""

    __slots__ = ("distance", "point", "u", "v", "instance", "triangle")

    def __init__(self, columns, point):
        self.distance, self.u, self.v, self.instance, self.triangle = columns
        self.point = point

    @property
    def found(self):
        return self.triangle != NONE

    def __len__(self):
        return len(self.distance)

    def __repr__(self):
        return f"<bth.Closest of shape {self.distance.shape}>"


def _hit_columns(count):
    return tuple(np.empty(count, kind) for kind in (np.float32, np.float32, np.float32, np.uint32, np.uint32))


def _mask(mask):
    mask = int(mask)
    if not 0 <= mask <= NONE:
        raise ValueError(f"mask: expected 32 bits, got {mask}")
    return mask


def _start(start, shape):
    if start is None:
        return None
    instance, triangle = (start.instance, start.triangle) if hasattr(start, "instance") else start
    try:
        return tuple(np.broadcast_to(np.asarray(a, np.uint32), shape).reshape(-1) for a in (instance, triangle))
    except ValueError:
        raise ValueError(f"start: the shapes do not fit {shape}, that of the rays") from None


class Scene:
    """An open scene. Queries may run on several threads at once; changing the time waits for them."""

    __slots__ = ("_native", "__weakref__")

    def __init__(self, native):
        if not isinstance(native, _native.Scene):
            raise TypeError("scenes are made by bth.compile, bth.open and bth.load")
        self._native = native

    # Queries by rays.

    def _rays(self, origins, directions, tmin, tmax):
        origins, directions, shape = _arrays.together(origins, "origins", directions, "directions")
        return (origins, directions, _arrays.numbers(tmin, "tmin", shape), _arrays.numbers(tmax, "tmax", shape)), shape

    def nearest(self, origins, directions, tmin=0.0, tmax=math.inf, start=None, *, mask=NONE, cull=None, threads=None):
        """The nearest hits of rays. Origins and directions are of shape (..., 3) and are broadcast.

        start: the triangles on which rays start, as Hits or a pair (instance, triangle): a hint for files with tetrahedra.
        mask, cull: see `all_hits`.
        """
        rays, shape = self._rays(origins, directions, tmin, tmax)
        if mask != NONE or cull is not None:
            found = self._many(rays, 1, mask, cull, threads)
            columns = _hit_columns(len(rays[0]))
            for column, value in zip(columns, (np.inf, 0, 0, NONE, NONE)):
                column.fill(value)
            for column, values in zip(columns, (found.t, found.u, found.v, found.instance, found.triangle)):
                column[np.diff(found.offsets) > 0] = values
        else:
            columns = _hit_columns(len(rays[0]))
            _native.nearest(self._native, rays, _start(start, shape), _threads.count(threads), columns)
        return Hits([c.reshape(shape) for c in columns], self, (origins, directions))

    def any(self, origins, directions, tmin=0.0, tmax=math.inf, start=None, *, threads=None):
        """Whether rays hit anything: an array of bool."""
        rays, shape = self._rays(origins, directions, tmin, tmax)
        found = np.empty(len(rays[0]), bool)
        _native.any(self._native, rays, _start(start, shape), _threads.count(threads), found)
        return found.reshape(shape)

    def _many(self, rays, most, mask, cull, threads):
        counts = np.empty(len(rays[0]), np.uint64)
        arguments = (most, _mask(mask), cull or "none", _threads.count(threads), counts)
        columns = _native.all_hits(self._native, rays, *arguments)
        offsets = np.zeros(len(counts) + 1, np.int64)
        np.cumsum(counts.astype(np.int64), out=offsets[1:])
        return AllHits(offsets, columns)

    def all_hits(self, origins, directions, tmin=0.0, tmax=math.inf, *, most=None, mask=NONE, cull=None, threads=None):
        """All hits of rays in order, or the nearest `most` of each.

        mask: only what has a bit of its mask in common with this one is hit. cull: 'back' or 'front' ignores hits on these sides.
        """
        if most is not None and int(most) < 0:
            raise ValueError(f"most: expected a number from 0, got {most}")
        rays, _ = self._rays(origins, directions, tmin, tmax)
        return self._many(rays, None if most is None else int(most), mask, cull, threads)

    def count(self, origins, directions, tmin=0.0, tmax=math.inf, *, mask=NONE, cull=None, threads=None):
        """Number of hits of rays. See `crossings` for passages of closed surfaces."""
        rays, shape = self._rays(origins, directions, tmin, tmax)
        counts = np.empty(len(rays[0]), np.uint64)
        _native.count(self._native, rays, _mask(mask), cull or "none", _threads.count(threads), counts)
        return counts.astype(np.int64).reshape(shape)

    def crossings(self, origins, directions, tmin=0.0, tmax=math.inf, *, threads=None):
        """How often rays pass through surfaces, each passage of a closed one counted once; and the passages outwards minus those inwards."""
        rays, shape = self._rays(origins, directions, tmin, tmax)
        count, winding = np.empty(len(rays[0]), np.uint32), np.empty(len(rays[0]), np.int32)
        _native.crossings(self._native, rays, _threads.count(threads), count, winding)
        return count.reshape(shape), winding.reshape(shape)

    # Queries by points.

    def _points(self, query, points, kind, threads):
        points = _arrays.vectors(points, "points")
        shape = points.shape[:-1]
        rows = _arrays.rows(points, points.shape)
        out = np.empty(len(rows), kind)
        query(self._native, rows, _threads.count(threads), out)
        return out.reshape(shape)

    def contains(self, points, *, threads=None):
        """Whether points lie inside of closed surfaces; exact, and the same on every call."""
        return self._points(_native.contains, points, bool, threads)

    def winding(self, points, *, threads=None):
        """How often closed surfaces enclose points."""
        return self._points(_native.winding, points, np.int32, threads)

    def signed_distance(self, points, *, threads=None):
        """Distances of points to the nearest surface, negative inside of closed surfaces."""
        return self._points(_native.signed_distance, points, np.float32, threads)

    def closest(self, points, radius=math.inf, *, threads=None):
        """The closest points of surfaces within a radius."""
        points = _arrays.vectors(points, "points")
        shape = points.shape[:-1]
        rows = _arrays.rows(points, points.shape)
        columns, position = _hit_columns(len(rows)), np.empty(len(rows) * 3, np.float32)
        _native.closest(self._native, rows, float(radius), _threads.count(threads), columns, position)
        return Closest([c.reshape(shape) for c in columns], position.reshape(*shape, 3))

    # What the scene consists of.

    def normals(self, instance, triangle):
        """Unit normals of triangles in world space, float64; zeros for bth.NONE and for triangles without area."""
        instance, triangle = np.broadcast_arrays(np.asarray(instance, np.uint32), np.asarray(triangle, np.uint32))
        normals = self._native.normals(instance.reshape(-1), triangle.reshape(-1))
        with np.errstate(all="ignore"):
            normals /= np.abs(normals).max(axis=1, keepdims=True, initial=0)
            normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        return np.nan_to_num(normals, nan=0.0).reshape(*instance.shape, 3)

    def vertices(self, obj=0):
        """Distinct positions of an object, (n, 3) float32, in the space of the object."""
        return self._native.geometry(obj)[0]

    def triangles(self, obj=0):
        """For each triangle of an object its rows of `vertices`, (m, 3) uint32."""
        return self._native.geometry(obj)[1]

    @property
    def bounds(self):
        """Lower and upper end of a box in world space around all that can be hit, (2, 3) float32; None if there is nothing."""
        bounds = self._native.bounds()
        return None if bounds is None else np.array(bounds, np.float32)

    @property
    def transforms(self):
        """For each instance the transform from its object's space to world space at the scene's time, (n, 4, 4) float64."""
        rows = self._native.placements()[0]
        matrices = np.zeros((len(rows), 4, 4))
        matrices[:, :3] = rows
        matrices[:, 3, 3] = 1
        return matrices

    @property
    def objects_of_instances(self):
        """For each instance the index of its object."""
        return np.array(self._native.placements()[1], np.uint32)

    @property
    def visible(self):
        """For each instance whether rays can hit it at the scene's time."""
        return np.array(self._native.placements()[2], bool)

    @property
    def triangle_counts(self):
        """For each object its number of triangles."""
        return np.array(self._native.facts()["triangles"], np.int64)

    @property
    def frames(self):
        """First frame, last frame and frames per second; None for a scene without time."""
        return self._native.facts()["frames"]

    @property
    def nbytes(self):
        """Size of the compiled file."""
        return self._native.facts()["file_bytes"]

    # Time.

    @property
    def seconds(self):
        """The scene's time. Setting it waits for the queries of other threads."""
        return self._native.seconds()

    @seconds.setter
    def seconds(self, seconds):
        self._native.set_seconds(float(seconds))

    def set_frame(self, frame):
        """Sets the time to that of a frame."""
        self._native.set_frame(frame)

    # Life.

    def to_bytes(self):
        """The bytes of the compiled file."""
        return self._native.to_bytes()

    def save(self, path):
        """Writes the compiled file; it appears whole or not at all."""
        path = os.fspath(path)
        part = f"{path}.{os.getpid()}.part"
        with io.open(part, "xb") as file:
            file.write(self.to_bytes())
        os.replace(part, path)

    def close(self):
        """Frees the scene as soon as no query of another thread uses it. Queries then raise ValueError."""
        self._native.close()

    @property
    def closed(self):
        return self._native.closed

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def __reduce__(self):
        return _restore, (self.to_bytes(), self.seconds)

    def __repr__(self):
        if self.closed:
            return "<bth.Scene, closed>"
        facts = self._native.facts()
        return f"<bth.Scene of {facts['instances']} instances, {sum(facts['triangles'])} triangles>"
