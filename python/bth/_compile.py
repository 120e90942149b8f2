"""Compilation of models."""

import inspect
import math
import operator
import os

import numpy as np

from . import _meshes, _native, _threads
from ._ray_queries import rays_and_shape
from ._scene import Scene

_PATH = (str, bytes, os.PathLike)
#: Of a name in a compiled file.
_MOST_BYTES = 4096
#: Options that only files of glTF have a use for.
_GLTF = ("flatten", "scene", "animation", "rate", "at_rest", "rigid_parts", "strict")


def compile(
    model, *, output=None, quality=None, structure=None, coordinates=None, max_error=None, polygons=None, positions=None,
    attributes=None, alpha=None, geometry=None, names=None, materials=None,
    lenient_materials=None,
    rays=None, settings=None, flatten=None, scene=None, animation=None, rate=None, at_rest=None, rigid_parts=None,
    strict=None, deformable=None, free_directions=None, cache=None,
    cache_size=None, shared_cache=None, memory=None, threads=None, progress=None,
):
    """Compiles a model and returns its scene.

    model: a path (OBJ, PLY, STL, OFF, glTF, GLB, FBX, 3MF, scene manifest), a pair (vertices, faces), a mesh of trimesh, meshio, pyvista or Open3D,
    or a scene of trimesh.
    output: also writes the compiled file to this path.
    cache: True, False or a folder; by default files go through the cache as those of the program, and arrays do not. cache_size and
    shared_cache are as those of the program; the latter is a folder.
    rays: rays that will be traced through a model, a pair (origins, directions) or with tmin and tmax behind, as those of `Scene.nearest`. The tree is
    built for them more than for rays from everywhere; answers do not depend on it.
    progress: is called with the name of the stage, the units done and the units in all or None; an exception from it cancels.
    It may query scenes, but not change one.
    threads: by default as many as queries use (see `set_threads`); the result does not depend on it.

    All other options are those of `bthc compile`. `structure` is 'bvh' by default, since the package has no worker for tetrahedra.
    polygons ('ears') covers concave polygons of models in files exactly, which fans do not.
    positions ('auto', 'f64', 'f32') keeps positions in double precision: by default where float32 would move a vertex by more than 2^-24 of
    the object's size, always, or never.
    attributes ('normals', 'all'), alpha ('mask', 'blend'), names and materials (True) keep what models in files have of these;
    lenient_materials leaves out images that cannot be read.
    settings: a dictionary of the keys of `bthc compile --set` and their values, such as {"poses": 1}.
    deformable: keeps what `Scene.set_positions` needs. free_directions ('auto', 'distances', 'all') keeps in which directions rays from a
    triangle meet nothing, and up to which distance.
    """
    options = {name: value for name, value in locals().items() if name != "model" and value is not None}
    if isinstance(model, _PATH):
        path = os.fsdecode(model)
        os.stat(path)
        return Scene(_native.compile_path(path, _checked(options)))
    for name in _GLTF:
        if name in options:
            raise ValueError(f"{name}: an option for files, got a {type(model).__name__}")
    if _meshes.is_scene(model):
        if "rays" in options:
            raise ValueError("rays: an option for one model, got a scene")
        *parts, mesh_names, instance_names = _meshes.parts_of_scene(model)
        return compile_scene(*parts, mesh_names=mesh_names, instance_names=instance_names, **options)
    vertices, faces = _meshes.triangles_of(model)
    return Scene(_native.compile_mesh(vertices, faces, _checked(options)))


def compile_scene(meshes, instances=None, transforms=None, *, mesh_names=None, instance_names=None, **options):
    """Compiles a scene of instances of meshes and returns it.

    meshes: a list of pairs (vertices, faces) or of meshes, each as for `compile`.
    instances: for each instance the row of its mesh, (n,) integers; by default each mesh has one, and a single mesh as many as there are
    transforms.
    transforms: for each instance the matrix from its mesh's space to world space, which is applied to columns: (n, 4, 4), (n, 3, 4), or one for all.
    mesh_names, instance_names: a str for each mesh and for each instance, which the scene keeps: see `Scene.object_names`,
    `Scene.instance_names` and `Hits.instance_name`.
    options: those of `compile` that are not about glTF files.

    Instance i of the scene is row i of instances. Meshes without instance are left out and equal ones are stored once, so objects may be fewer than meshes:
    see `Scene.objects_of_instances`.
    """
    for name in options:
        if name not in _OPTIONS:
            raise TypeError(f"compile_scene() got an unexpected keyword argument '{name}'")
    options = {name: value for name, value in options.items() if value is not None}
    if mesh_names is not None:
        options.setdefault("names", True)
    if hasattr(meshes, "vertices") or hasattr(meshes, "points"):
        raise TypeError(f"meshes: expected a list of meshes, got a {type(meshes).__name__}")
    for path in [meshes] if isinstance(meshes, _PATH) else (meshes := list(meshes)):
        if isinstance(path, _PATH):
            hint = "hint: bth.compile takes the path of one model; a scene of several files is a manifest, see docs/scenes.md"
            raise TypeError(f"meshes: expected meshes in memory, got the path {os.fsdecode(path)!r} ({hint})")
    parts = [_meshes.triangles_of(mesh) for mesh in meshes]
    instances, transforms = _meshes.places_of(instances, transforms, len(parts))
    names = _names(mesh_names, len(parts), "mesh_names"), _names(instance_names, len(instances), "instance_names")
    return Scene(_native.compile_scene(parts, instances, transforms, names, _checked(options)))


def _names(names, count, name):
    """Names of `count` things, or None."""
    if names is None:
        return None
    names = list(names)
    if len(names) != count or not all(isinstance(one, str) for one in names):
        raise ValueError(f"{name}: expected {count} str, got {len(names)} of {', '.join(sorted({type(one).__name__ for one in names}))}")
    for one in names:
        if len(one.encode()) > _MOST_BYTES:
            raise ValueError(f"{name}: expected at most {_MOST_BYTES} bytes, got {one[:40]!r}…")
    return names


_OPTIONS = frozenset(inspect.signature(compile).parameters) - {"model", "rays", *_GLTF}


def _checked(options):
    """Options as the native module takes them."""
    progress = options.get("progress")
    if progress is not None and not callable(progress):
        raise TypeError(f"progress: expected a function, got {type(progress).__name__}")
    for name in ("output", "shared_cache", "cache"):
        if name in options and not (name == "cache" and isinstance(options[name], (bool, np.bool_))):
            options[name] = _path(options[name], name)
    if "cache_size" in options and not isinstance(options["cache_size"], str):
        options["cache_size"] = operator.index(options["cache_size"])
        if not 0 <= options["cache_size"] < 2**64:
            raise ValueError(f"cache_size: expected a number of bytes from 0, got {options['cache_size']}")
    # More than there are processors bring nothing, and as many are those that all calls share.
    if 0 < _threads.default() < _native.processors():
        options.setdefault("threads", _threads.default())
    # Numbers of scenes and animations are spelled as in the program.
    for name in ("scene", "animation"):
        if isinstance(options.get(name), int) and not isinstance(options[name], bool):
            options[name] = str(options[name])
    if "rays" in options:
        if not isinstance(options["rays"], (tuple, list)) or not 2 <= len(options["rays"]) <= 4:
            raise TypeError("rays: expected (origins, directions), perhaps with tmin and tmax behind")
        origins, directions, tmin, tmax = (*options["rays"], *(0.0, math.inf)[len(options["rays"]) - 2:])
        options["rays"], _ = rays_and_shape(origins, directions, tmin, tmax)
    return options


def _path(path, name):
    try:
        return os.fsdecode(path)
    except TypeError:
        wanted = "True, False or a folder" if name == "cache" else "a path"
        raise TypeError(f"{name}: expected {wanted}, got {type(path).__name__}") from None
