"""Exact ray tracing of triangle meshes, compiled ahead.

    import bth
    scene = bth.compile("bunny.ply")              # or bth.compile((vertices, faces)), or a trimesh.Trimesh
    hits = scene.nearest(origins, directions)     # arrays of any leading shape, three numbers last
    hits.t, hits.triangle, hits.hit

See docs/python.md.
"""

from ._compile import compile, compile_scene
from ._hits import NONE, AllHits, Closest, Hits, Opacity, Overlaps, SurfacePoints
from ._materials import Material, Texture
from ._native import Candidate, Error, __version__, isa
from ._scene import Scene, load, open
from ._threads import set_threads

__all__ = [
    "AllHits", "Candidate", "Closest", "Error", "Hits", "Material", "NONE", "Opacity", "Overlaps", "Scene", "SurfacePoints", "Texture",
    "__version__", "compile", "compile_scene", "isa", "load", "open", "set_threads",
]
