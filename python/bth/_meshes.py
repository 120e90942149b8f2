"""Meshes of other packages, by what they look like."""

import numpy as np


def triangles_of(mesh):
    """Vertices (n, 3) float32 and faces (m, 3) uint32, contiguous, of a pair of arrays or of a mesh of trimesh, meshio or pyvista."""
    vertices, faces = _parts(mesh)
    vertices = np.asarray(vertices)
    if vertices.dtype.kind not in "fiu":
        raise TypeError(f"vertices: expected numbers, got an array of {vertices.dtype}")
    if vertices.size == 0 and vertices.ndim <= 2:
        vertices = vertices.reshape(0, 3)
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise ValueError(f"vertices: expected the shape (n, 3), got {vertices.shape}")
    faces = np.asarray(faces)
    if faces.size == 0 and faces.ndim <= 2:
        faces = np.zeros((0, 3), np.uint32)
    if faces.dtype.kind not in "iu":
        raise TypeError(f"faces: expected integers, got an array of {faces.dtype}")
    if faces.ndim != 2 or faces.shape[1] not in (3, 4):
        raise ValueError(f"faces: expected the shape (m, 3), got {faces.shape}")
    if faces.size and (faces.min() < 0 or faces.max() >= len(vertices)):
        worst = faces.min() if faces.min() < 0 else faces.max()
        raise ValueError(f"faces: expected indices from 0 to {len(vertices) - 1}, got {worst}")
    if faces.shape[1] == 4:
        faces = faces[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    with np.errstate(over="ignore"):
        vertices = np.require(vertices, np.float32, "CA")
    return vertices, np.require(faces, np.uint32, "CA")


def _parts(mesh):
    if isinstance(mesh, (tuple, list)):
        if len(mesh) != 2:
            raise ValueError(f"expected a pair (vertices, faces), got {len(mesh)} things")
        return mesh
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):  # trimesh
        return mesh.vertices, mesh.faces
    if hasattr(mesh, "points") and hasattr(mesh, "cells_dict"):  # meshio
        return mesh.points, _meshio_faces(mesh.cells_dict)
    if hasattr(mesh, "points") and hasattr(mesh, "regular_faces") or hasattr(mesh, "extract_surface"):  # pyvista
        surface = mesh if hasattr(mesh, "is_all_triangles") else mesh.extract_surface()
        return surface.points, _pyvista_faces(surface)
    if hasattr(mesh, "vertices") and hasattr(mesh, "triangles"):  # Open3D
        return np.asarray(mesh.vertices), np.asarray(mesh.triangles)
    raise TypeError(
        f"expected a path, a pair (vertices, faces) or a mesh of trimesh, meshio, pyvista or Open3D, got {type(mesh).__name__}"
    )


def _meshio_faces(cells):
    parts = [np.asarray(cells[kind]) for kind in ("triangle",) if kind in cells]
    parts += [np.asarray(cells["quad"])[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)] if "quad" in cells else []
    return np.concatenate(parts) if parts else np.zeros((0, 3), np.uint32)


def _pyvista_faces(surface):
    """VTK's list of faces: for each its number of corners, then these."""
    faces = np.asarray(surface.faces)
    if faces.size % 4 == 0 and np.all(faces[::4] == 3):
        return faces.reshape(-1, 4)[:, 1:]
    return np.asarray(surface.triangulate().faces).reshape(-1, 4)[:, 1:]
