"""Compilation of models."""

import os

from . import _meshes, _native
from ._scene import Scene


def compile(
    model, *, output=None, quality=None, structure=None, coordinates=None, max_error=None, boxes=None, attributes=None,
    tets=None, subtrees=None, compact=None, geometry=None, names=None, estimator=None, select=None, optimize_for=None, profile=None,
    max_bytes_per_triangle=None, budget=None, probe=None, min_tet_triangles=None, c_tet=None, for_scene=None,
    tet_deadline=None, tet_memory=None, flatten=None, scene=None, animation=None, rate=None, strict=None,
    cache=None, threads=None, progress=None,
):
    """Compiles a model and returns its scene.

    model: a path (OBJ, PLY, STL, OFF, glTF, GLB, scene manifest), a pair (vertices, faces), or a mesh of trimesh, meshio, pyvista or Open3D.
    output: also writes the compiled file to this path.
    cache: True, False or a folder; by default files go through the cache as those of the program, and arrays do not.
    progress: is called with the name of the stage, the units done and the units in all or None; an exception from it cancels.
    threads: by default one for each processor; the result does not depend on it.

    All other options are those of `bthc compile`. `structure` is 'bvh' by default, since the package has no worker for tetrahedra.
    """
    options = {name: value for name, value in locals().items() if name != "model" and value is not None}
    if output is not None:
        options["output"] = os.fspath(output)
    if progress is not None and not callable(progress):
        raise TypeError(f"progress: expected a function, got {type(progress).__name__}")
    if isinstance(model, (str, os.PathLike)):
        path = os.fspath(model)
        os.stat(path)
        return Scene(_native.compile_path(path, options))
    vertices, faces = _meshes.triangles_of(model)
    return Scene(_native.compile_mesh(vertices, faces, options))
