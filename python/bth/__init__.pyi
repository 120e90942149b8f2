from . import bake as bake, embreex as embreex, open3d as open3d, trimesh as trimesh, usd as usd
from ._compile import compile as compile, compile_scene as compile_scene
from ._hits import (
    NONE as NONE, AllHits as AllHits, Closest as Closest, Hits as Hits, Opacity as Opacity, Overlaps as Overlaps,
    SurfacePoints as SurfacePoints,
)
from ._materials import Gloss as Gloss, Material as Material, Texture as Texture
from ._native import Candidate as Candidate, Error as Error, __version__ as __version__, isa as isa
from ._open_meshes import OpenMeshWarning as OpenMeshWarning
from ._scene import Scene as Scene, load as load, open as open
from ._threads import set_threads as set_threads

__all__ = [
    "AllHits", "Candidate", "Closest", "Error", "Gloss", "Hits", "Material", "NONE", "Opacity", "OpenMeshWarning", "Overlaps", "Scene",
    "SurfacePoints", "Texture", "__version__", "compile", "compile_scene", "isa", "load", "open", "set_threads",
]
