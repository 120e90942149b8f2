"""Scenes: opening, time, and what becomes of them."""

import errno
import math
import operator
import os
import warnings

import numpy as np

from . import _arrays, _native
from ._contents import Contents, _index
from ._placing import Placing
from ._point_queries import PointQueries
from ._ray_queries import RayQueries


#: Endings of files that `bth.compile` takes.
_MODELS = (".obj", ".ply", ".stl", ".off", ".gltf", ".glb", ".manifest", ".toml")


def open(path, mmap=False):
    """Opens a compiled file. It is checked as a whole, and then safe to trace whatever is in it.

    mmap: maps the file instead of reading it, in a time that does not depend on its size. Use it for unchanged files that the compiler
    has written, and do not change the file while the scene is open.
    """
    path = os.fsdecode(path)
    os.stat(path)
    try:
        return Scene(_native.open(path, bool(mmap)))
    except _native.Error as error:
        ending = os.path.splitext(path)[1].lower()
        if error.code in ("BTH-F001", "BTH-F002") and ending in _MODELS:
            hint = f"hint: bth.compile({path!r}) compiles it and returns its scene"
            told = _native.Error(f"{path}: {error.code}: expected a compiled file, found a model ({ending}) ({hint})")
            told.code = error.code
            raise told from None
        raise


def load(data):
    """Opens the bytes of a compiled file, as `Scene.to_bytes` returns them."""
    if not isinstance(data, bytes):
        data = bytes(memoryview(data))
    return Scene(_native.load(data))


def _restore(data, seconds, masks, deformed, placement):
    scene = load(data)
    if placement is not None:
        scene._place(*placement)
    elif scene.seconds != seconds:
        scene.seconds = seconds
    for obj, positions in deformed:
        # Those of files that move vertices follow from the time.
        if scene.vertices(obj).tobytes() != positions.tobytes():
            scene.set_positions(positions, obj)
    if any(masks):
        _native.set_masks(scene._native, masks)
    return scene


def _positions(values, name):
    values = _arrays.vectors(values, name)
    if values.ndim != 2:
        raise ValueError(f"{name}: expected the shape (n, 3), got {values.shape}")
    with np.errstate(over="ignore"):
        rounded = np.require(values, np.float32, "CA")
    # What is not finite is refused.
    moved = _arrays.moved_by_rounding(values) if values.dtype == np.float64 and np.isfinite(rounded).all() else None
    if moved is not None:
        hint = "hint: keep positions near the origin, and move the object with set_transforms"
        message = f"{name}: rounding to float32 moves {np.count_nonzero(moved)} of {len(values)} positions, by up to {moved.max():.2e} ({hint})"
        warnings.warn(message, UserWarning, stacklevel=3)
    return rounded


class Scene(RayQueries, PointQueries, Contents, Placing):
    """An open scene.

    Any number of threads may query it at once. Changes (the time, positions, instances, masks) wait until no query of another thread uses it, so that each
    query sees the scene as it was before or as it is after. A filter, or the handler of a signal that interrupts a query, may query the
    scene, but not change it. Copies and pickles have the file, the time,
    positions, instances and the masks.
    """

    __slots__ = ("_native", "_closed", "_looked_for_open", "__weakref__")

    def __init__(self, native):
        if not isinstance(native, _native.Scene):
            raise TypeError("scenes are made by bth.compile, bth.compile_scene, bth.open and bth.load")
        self._native = native
        # What `is_object_closed` found, by object, and whether `OpenMeshWarning` has been considered.
        self._closed, self._looked_for_open = {}, False

    # Facts.

    @property
    def instance_count(self):
        """Number of instances."""
        return self._native.facts()["instances"]

    @property
    def object_count(self):
        """Number of objects."""
        return self._native.facts()["objects"]

    @property
    def nbytes(self):
        """Size of the compiled file."""
        return self._native.facts()["file_bytes"]

    @property
    def resident_bytes(self):
        """Bytes of the file that tracing reads."""
        return self._native.facts()["resident_bytes"]

    @property
    def content_id(self):
        """Hash of what the file says: equal for files of equal content."""
        return self._native.facts()["content_id"].hex()

    # Time.

    @property
    def frames(self):
        """First frame, last frame and frames per second; None for a scene without time."""
        return self._native.facts()["frames"]

    @property
    def seconds(self):
        """The scene's time. Setting it waits for the queries of other threads; beyond the frames nothing moves."""
        return self._native.seconds()

    @seconds.setter
    def seconds(self, seconds):
        seconds = _arrays.number(seconds, "seconds")
        if not math.isfinite(seconds):
            raise ValueError(f"seconds: expected a finite number, got {seconds}")
        # First, since it refuses changes by filters and the like. It has no effect on a model.
        self._native.set_seconds(seconds)
        self._frames()

    def set_frame(self, frame):
        """Sets the time to that of a frame. It may lie outside of `frames`, where nothing moves."""
        frame = operator.index(frame)
        if not -(2**31) <= frame < 2**31:
            raise ValueError(f"frame: expected a number from {-(2**31)} to {2**31 - 1}, got {frame}")
        self.seconds = frame / self._frames()[2]

    def _frames(self):
        """`frames` of a scene that has time."""
        frames = self.frames
        if frames is None:
            raise ValueError("the file is a model, which has no frames and no time (hint: scenes are glTF files and manifests)")
        return frames

    # Deformation.

    def vertex_count(self, obj=0):
        """Number of positions that `set_positions` takes; None for an object that cannot be deformed."""
        return self._native.vertex_count(_index(obj, "obj"))

    def set_positions(self, positions, obj=0):
        """Gives an object new positions, (n, 3) in its space: one for each vertex of its source, in the source's order. They are rounded to
        float32. The object must be compiled with `deformable=True`.

        All queries then answer for the new positions, as exactly as before. Returns how much rays are expected to cost, relative to the
        pose that was compiled.
        """
        return self._native.set_positions(_index(obj, "obj"), _positions(positions, "positions"))

    def set_positions_between(self, open, close, share, obj=0):
        """Gives an object positions on the straight lines between those at two times, at `share` of the way from `open` to `close`, from
        0 to 1: for motion blur. The rest is as for `set_positions`."""
        ends = _positions(open, "open"), _positions(close, "close")
        return self._native.set_positions_between(_index(obj, "obj"), *ends, _arrays.number(share, "share"))

    # Life.

    def to_bytes(self):
        """The bytes of the compiled file. Time, new positions and masks are not part of them."""
        return self._native.to_bytes()

    def save(self, path):
        """Writes the compiled file; it appears whole or not at all. Time, new positions and masks are not part of it."""
        path = os.fsdecode(path)
        if os.path.isdir(path):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), path)
        self._native.save(path)

    def close(self):
        """Frees the scene as soon as no query of another thread uses it. Queries then raise ValueError."""
        self._native.close()

    @property
    def closed(self):
        """Whether the scene has been closed."""
        return self._native.closed

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def __reduce__(self):
        deformed = [(obj, self.vertices(obj)) for obj in self._native.deformed()]
        return _restore, (self.to_bytes(), self.seconds, _native.masks(self._native), deformed, self._placement())

    def __repr__(self):
        if self.closed:
            return "<bth.Scene, closed>"
        facts = self._native.facts()
        return f"<bth.Scene of {facts['instances']} instances, {sum(facts['triangles'])} triangles>"
