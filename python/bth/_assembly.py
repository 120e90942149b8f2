"""Scenes of the drop-ins: meshes that are added one by one and compiled together by the first query."""

import numpy as np

from . import _meshes
from ._compile import compile


#: t in float64 is within 2^-40, so those of hits in one point are within twice that.
_SAME = 2.0**-39


def passages(found, facing, surface=0):
    """The rows of hits (AllHits of rays in float64) that count, if a ray passes each surface in a point once for each side.

    Of several triangles of a surface that a ray hits in one point of an edge or a vertex, and from one side, the first counts.
    facing: a function that says of rows of hits whether the triangle faces away from the ray. surface: the surface of each hit.
    """
    # Hits in one point follow one another, those from both sides in any order.
    again = (np.diff(found.ray, prepend=-1) == 0) & (np.diff(found.t, prepend=-1) <= _SAME * found.t)
    point = np.cumsum(~again)
    shared = again | np.append(again[1:], False)
    side = np.zeros(len(point), np.int64)
    side[shared] = facing(np.nonzero(shared)[0])
    _, first = np.unique(np.stack([point, np.broadcast_to(surface, point.shape), side]), axis=1, return_index=True)
    return np.sort(first)


class Assembly:
    """Meshes in one scene, in the order in which they were added."""

    def __init__(self):
        self._parts = []
        self._compiled = None

    def add(self, mesh):
        """Adds a mesh, as `bth.compile` takes it; returns its index."""
        self._parts.append(_meshes.triangles_of(mesh))
        self._compiled = None
        return len(self._parts) - 1

    def scene(self):
        """The scene, the first triangle of each mesh, and the end of the last's."""
        if self._compiled is None:
            first_vertex = np.cumsum([0] + [len(v) for v, _ in self._parts])
            first_face = np.cumsum([0] + [len(f) for _, f in self._parts])
            vertices = np.concatenate([np.zeros((0, 3), np.float32)] + [v for v, _ in self._parts])
            faces = [f + np.uint32(first) for (_, f), first in zip(self._parts, first_vertex)]
            faces = np.concatenate([np.zeros((0, 3), np.uint32)] + faces)
            self._compiled = compile((vertices, faces), quality="fast", positions="f64"), first_face
        return self._compiled
