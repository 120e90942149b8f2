"""Scenes of the drop-ins: meshes that are added one by one and compiled together by the first query."""

import numpy as np

from . import _meshes
from ._compile import compile


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
