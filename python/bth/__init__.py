"""Exact ray tracing of triangle meshes, compiled ahead.

    import bth
    scene = bth.compile("bunny.ply")              # or bth.compile((vertices, faces)), or a trimesh.Trimesh
    hits = scene.nearest(origins, directions)     # arrays of any leading shape, three numbers last
    hits.t, hits.triangle, hits.hit

See docs/python.md.
"""

from ._compile import compile
from ._native import Error, __version__, isa
from ._scene import NONE, AllHits, Closest, Hits, Scene, load, open
from ._threads import set_threads

__all__ = [
    "AllHits", "Closest", "Error", "Hits", "NONE", "Scene", "__version__", "compile", "isa", "load", "open", "set_threads",
]
