"""A drop-in for `trimesh.ray.ray_pyembree`: `mesh.ray = bth.trimesh.RayMeshIntersector(mesh)`, or for all meshes `bth.trimesh.install()`."""

import sys
import types

import numpy as np

try:
    import trimesh
    from trimesh import caching, util
except ImportError:
    raise ImportError("bth.trimesh needs trimesh (hint: pip install trimesh)") from None

from . import _arrays
from ._assembly import passages
from ._compile import compile

class RayMeshIntersector:
    """Ray queries of a mesh, with the methods of trimesh's own. Answers are exact for the rays and the vertices as they are."""

    def __init__(self, geometry, scale_to_box=True):
        """scale_to_box: scales the mesh to a size of about 1, by a power of two, which rounds nothing."""
        self.mesh = geometry
        self._scale_to_box = scale_to_box
        self._cache = caching.Cache(id_function=self.mesh.__hash__)

    @property
    def _scale(self):
        return np.ldexp(1.0, -np.frexp(self.mesh.scale)[1]) if self._scale_to_box else 1.0

    @caching.cache_decorator
    def _scene(self):
        scale = float(self._scale)
        vertices = np.asarray(self.mesh.vertices, np.float64) * scale
        return compile((vertices, np.asarray(self.mesh.faces)), quality="fast", positions="f64"), scale

    def _rays(self, ray_origins, ray_directions):
        origins = np.array(_arrays.plain(ray_origins, "ray_origins"), dtype=np.float64)
        directions = np.array(_arrays.plain(ray_directions, "ray_directions"), dtype=np.float64)
        if origins.shape != directions.shape:
            raise ValueError("Ray origin and direction don't match!")
        # By a power of two, which changes no other bit: float32 ends at 3e38, while `scale_to_box` takes meshes, and so directions, of any size.
        _, exponents = np.frexp(np.abs(directions).max(axis=-1, initial=0, keepdims=True))
        directions = np.ldexp(directions, -exponents)
        scene, scale = self._scene
        return scene, origins * scale, directions, origins

    def intersects_id(self, ray_origins, ray_directions, multiple_hits=True, max_hits=100, return_locations=False):
        """Triangles that rays hit, and the rays: those of one ray in order. Of several triangles that a ray meets in one point of an edge or a vertex, and from one side, the first counts."""
        scene, scaled, directions, origins = self._rays(ray_origins, ray_directions)
        if multiple_hits:
            found = scene.all_hits(scaled, directions)
            triangles, rays = found.triangle.astype(np.int64), found.ray
            keep = passages(found, lambda rows: np.einsum("ij,ij->i", self.mesh.face_normals[triangles[rows]], directions[rays[rows]]) > 0)
            triangles, rays, t = triangles[keep], rays[keep], found.t[keep]
            rank = np.arange(len(rays)) - np.searchsorted(rays, rays)
            triangles, rays, t = (a[rank < max_hits] for a in (triangles, rays, t))
        else:
            hits = scene.nearest(scaled, directions)
            rays = np.nonzero(hits.hit)[0]
            triangles, t = hits.triangle[rays].astype(np.int64), hits.t[rays]
        if not return_locations:
            return triangles, rays
        return triangles, rays, origins[rays] + (t / self._scene[1])[:, None] * directions[rays]

    def intersects_location(self, ray_origins, ray_directions, multiple_hits=True):
        """Points where rays hit, the rays and the triangles."""
        triangles, rays, locations = self.intersects_id(
            ray_origins, ray_directions, multiple_hits=multiple_hits, return_locations=True
        )
        return locations, rays, triangles

    def intersects_first(self, ray_origins, ray_directions):
        """The first triangle that each ray hits, or -1."""
        scene, scaled, directions, _ = self._rays(ray_origins, ray_directions)
        return scene.nearest(scaled, directions).triangle.view(np.int32).astype(np.int64)

    def intersects_any(self, ray_origins, ray_directions):
        """Whether each ray hits."""
        scene, scaled, directions, _ = self._rays(ray_origins, ray_directions)
        return scene.any(scaled, directions)

    def contains_points(self, points):
        """Whether points are inside of the mesh; exact, also for points whose rays would meet edges and vertices."""
        points = np.asanyarray(points, dtype=np.float64)
        if not util.is_shape(points, (-1, 3)):
            raise ValueError("points must be (n,3)")
        scene, scale = self._scene
        return scene.contains(points * scale)

    def __getstate__(self):
        state = self.__dict__.copy()
        state.pop("_cache", None)
        return state

    def __setstate__(self, state):
        self.__dict__.update(state)
        self._cache = caching.Cache(id_function=self.mesh.__hash__)

    def __copy__(self, *_):
        return RayMeshIntersector(geometry=self.mesh, scale_to_box=self._scale_to_box)

    def __deepcopy__(self, *_):
        return self.__copy__()


def install():
    """Makes this the intersector of all meshes that trimesh creates from now on, in the place of embreex."""
    name = "trimesh.ray.ray_pyembree"
    module = types.ModuleType(name, __doc__)
    module.RayMeshIntersector = RayMeshIntersector
    sys.modules[name] = module
    trimesh.ray.ray_pyembree = module
    trimesh.ray.has_embree = True
