"""Exact ray tracing of triangle meshes, compiled ahead.

    import bth
    scene = bth.compile("bunny.ply")              # or bth.compile((vertices, faces)), or a trimesh.Trimesh
    hits = scene.nearest(origins, directions)     # arrays of any leading shape, three numbers last
    hits.t, hits.triangle, hits.hit

See docs/python.md.
"""

import importlib.util

from ._compile import compile, compile_scene
from ._hits import NONE, AllHits, Closest, Hits, Opacity, Overlaps, SurfacePoints
from ._materials import Gloss, Material, Texture
from ._native import Candidate, Error, __version__, isa
from ._open_meshes import OpenMeshWarning
from ._scene import Scene, load, open
from ._threads import set_threads

__all__ = [
    "AllHits", "Candidate", "Closest", "Error", "Gloss", "Hits", "Material", "NONE", "Opacity", "OpenMeshWarning", "Overlaps", "Scene",
    "SurfacePoints", "Texture", "__version__", "compile", "compile_scene", "isa", "load", "open", "set_threads",
]

#: Modules that are imported when they are first used.
_MODULES = ("bake", "embreex", "open3d", "trimesh", "usd")


def __getattr__(name):
    if name in _MODULES:
        return importlib.import_module(f".{name}", __name__)
    raise AttributeError(f"module 'bth' has no attribute {name!r}")


def __dir__():
    needed = {"trimesh": "trimesh", "usd": "pxr"}
    there = (name for name in _MODULES if name not in needed or importlib.util.find_spec(needed[name]))
    return sorted({*globals(), *there})
