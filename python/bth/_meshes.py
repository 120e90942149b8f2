"""Meshes of other packages, by what they look like."""

import numpy as np

from . import _arrays


def triangles_of(mesh):
    """Vertices (n, 3) float32 or float64 and faces (m, 3) uint32, contiguous, of a pair of arrays or of a mesh of trimesh, meshio or pyvista.

    They are copies: the compiler reads them while other threads run, and drop-ins compile them when they are first traced. Whatever
    becomes of the caller's arrays then must not change the result.
    """
    vertices, faces = _parts(mesh)
    vertices = _arrays.plain(vertices, "vertices")
    if vertices.dtype.kind not in "fiu":
        raise TypeError(f"vertices: expected numbers, got an array of {vertices.dtype}")
    if vertices.size == 0 and vertices.ndim <= 2:
        vertices = vertices.reshape(0, 3)
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise ValueError(f"vertices: expected the shape (n, 3), got {vertices.shape}")
    faces = _arrays.plain(faces, "faces")
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
    return _positions(vertices), np.array(faces, np.uint32, order="C")


def _positions(vertices):
    """A copy in float32 if that holds all numbers, else in float64."""
    with np.errstate(over="ignore"):
        rounded = np.array(vertices, np.float32, order="C")
    if vertices.dtype == np.float32 or np.array_equal(rounded, vertices):
        return rounded
    return np.array(vertices, np.float64, order="C")


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
        surface = mesh if hasattr(mesh, "is_all_triangles") else _pyvista_surface(mesh)
        return surface.points, _pyvista_faces(surface)
    if hasattr(mesh, "vertices") and hasattr(mesh, "triangles"):  # Open3D
        return np.asarray(mesh.vertices), np.asarray(mesh.triangles)
    if hasattr(mesh, "vertex") and hasattr(mesh, "triangle"):  # Open3D's of tensors, which its RaycastingScene takes
        return _tensor(mesh.vertex, "positions"), _tensor(mesh.triangle, "indices")
    raise TypeError(
        f"expected a path, a pair (vertices, faces) or a mesh of trimesh, meshio, pyvista or Open3D, got {type(mesh).__name__}"
    )


def _tensor(attributes, name):
    """An attribute of a mesh of tensors, from wherever it is; a mesh without vertices or triangles lacks it."""
    return attributes[name].cpu().numpy() if name in attributes else np.zeros((0, 3), np.uint32)


def _meshio_faces(cells):
    """Triangles, then quadrilaterals as two triangles each. Lines, points and the insides of solids are no surface."""
    curved = [kind for kind in cells if kind.startswith(("triangle", "quad", "polygon")) and kind not in ("triangle", "quad")]
    parts = [np.asarray(cells["triangle"])] if "triangle" in cells else []
    parts += [np.asarray(cells["quad"])[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)] if "quad" in cells else []
    if curved or not parts and any(kind not in ("line", "vertex") for kind in cells):
        found = ", ".join(cells)
        raise ValueError(f"cells: expected triangles and quadrilaterals, got {found}: take the surface of solids, and straight faces")
    return np.concatenate(parts) if parts else np.zeros((0, 3), np.uint32)


def is_scene(model):
    """Whether this is a scene of trimesh."""
    return hasattr(model, "geometry") and hasattr(getattr(model, "graph", None), "nodes_geometry")


def parts_of_scene(scene):
    """Meshes, for each instance its mesh and its transform, and names of meshes and instances, of a scene of trimesh."""
    meshes = list(scene.geometry.values())
    row = {name: row for row, name in enumerate(scene.geometry)}
    nodes = list(scene.graph.nodes_geometry)
    placed = [scene.graph[node] for node in nodes]
    instances = np.array([row[name] for _, name in placed], np.int64)
    transforms = np.array([matrix for matrix, _ in placed], np.float64).reshape(-1, 4, 4)
    return meshes, instances, transforms, [str(name) for name in row], [str(node) for node in nodes]


def places_of(instances, transforms, meshes):
    """Rows of meshes (n,) uint32 and matrices (n, 3, 4) float64, contiguous, of instances of so many meshes."""
    if instances is None:
        count = len(transforms) if np.ndim(transforms) == 3 else meshes
        if count != meshes and meshes != 1:
            raise ValueError(f"transforms: got {count} for {meshes} meshes (hint: instances= says of which mesh each one is an instance)")
        instances = np.zeros(count, np.uint32) if meshes == 1 else np.arange(meshes)
    instances = _arrays.plain(instances, "instances")
    if instances.size == 0 and instances.ndim <= 1:
        instances = np.zeros(0, np.uint32)
    if instances.dtype.kind not in "iu":
        raise TypeError(f"instances: expected integers, got an array of {instances.dtype}")
    if instances.ndim != 1:
        raise ValueError(f"instances: expected the shape (n,), got {instances.shape}")
    if instances.size and (instances.min() < 0 or instances.max() >= meshes):
        worst = instances.min() if instances.min() < 0 else instances.max()
        raise ValueError(f"instances: expected rows from 0 to {meshes - 1}, got {worst}")
    transforms = np.eye(4) if transforms is None else transforms
    return np.require(instances, np.uint32, "CA"), matrices_of(transforms, len(instances), "transforms")


def matrices_of(matrices, count, name):
    """Matrices (count, 3, 4) float64, contiguous, of (n, 4, 4), (n, 3, 4) or one for all."""
    matrices = _arrays.plain(matrices, name)
    if matrices.dtype.kind not in "fiu":
        raise TypeError(f"{name}: expected numbers, got an array of {matrices.dtype}")
    if matrices.shape[-2:] not in ((3, 4), (4, 4)):
        raise ValueError(f"{name}: expected the shape (n, 4, 4) or (n, 3, 4), got {matrices.shape}")
    if matrices.shape[-2] == 4 and not (matrices[..., 3, :] == [0, 0, 0, 1]).all():
        raise ValueError(f"{name}: expected 0, 0, 0, 1 in the last rows: the matrices are applied to columns")
    try:
        matrices = np.broadcast_to(matrices[..., :3, :], (count, 3, 4))
    except ValueError:
        raise ValueError(f"{name}: expected one or {count}, one for each instance, got the shape {matrices.shape}") from None
    return np.require(matrices, np.float64, "CA")


def _pyvista_surface(mesh):
    try:
        return mesh.extract_surface(algorithm="dataset_surface")
    except TypeError:  # Before pyvista 0.47 there was only this.
        return mesh.extract_surface()


def _pyvista_faces(surface):
    """VTK's list of faces: for each its number of corners, then these."""
    faces = np.asarray(surface.faces)
    if faces.size % 4 == 0 and np.all(faces[::4] == 3):
        return faces.reshape(-1, 4)[:, 1:]
    return np.asarray(surface.triangulate().faces).reshape(-1, 4)[:, 1:]
