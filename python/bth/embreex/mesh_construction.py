"""Meshes of a scene."""

import numpy as np

from .. import _arrays

# Faces of elements, outwards, as rows of the element's corners.
_TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
_HEXAHEDRON = np.array([
    [0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4],
    [1, 2, 6], [1, 6, 5], [0, 7, 3], [0, 4, 7], [3, 6, 2], [3, 7, 6],
])


class TriangleMesh:
    """Triangles: vertices (n, 3) with indices (m, 3), or corners (m, 3, 3) without."""

    def __init__(self, scene, vertices, indices=None):
        vertices = _arrays.plain(vertices, "vertices")
        if indices is None:
            if vertices.ndim != 3 or vertices.shape[1:] != (3, 3):
                raise ValueError(f"vertices: expected the shape (m, 3, 3) without indices, got {vertices.shape}")
            vertices, indices = vertices.reshape(-1, 3), np.arange(3 * len(vertices)).reshape(-1, 3)
        self.mesh = scene._assembly.add((vertices, _arrays.plain(indices, "indices")))


class ElementMesh(TriangleMesh):
    """The faces of tetrahedra (m, 4) or hexahedra (m, 8)."""

    def __init__(self, scene, vertices, indices):
        indices = _arrays.plain(indices, "indices")
        faces = {4: _TETRAHEDRON, 8: _HEXAHEDRON}.get(indices.shape[1] if indices.ndim == 2 else 0)
        if faces is None:
            raise NotImplementedError("elements have 4 or 8 corners")
        super().__init__(scene, vertices, indices[:, faces].reshape(-1, 3))
