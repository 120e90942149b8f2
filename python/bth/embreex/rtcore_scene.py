"""Scenes of meshes, which are compiled by the first query."""

import numpy as np

from .. import _arrays
from .._assembly import Assembly

# What embreex takes for no limit.
_FAR = 1e37


class EmbreeScene:
    def __init__(self, device=None, robust=True):
        """robust: every query is."""
        self.device = device
        self._assembly = Assembly()

    def run(self, vec_origins, vec_directions, dists=None, query="INTERSECT", output=None):
        """As in embreex: indices of triangles or -1, distances, or with `output` a dictionary of arrays."""
        if query not in ("INTERSECT", "OCCLUDED", "DISTANCE"):
            raise ValueError(f"Embree ray query type {query} not recognized.\nAccepted types are (INTERSECT,OCCLUDED,DISTANCE)")
        origins, directions = _arrays.plain(vec_origins, "vec_origins"), _arrays.plain(vec_directions, "vec_directions")
        for name, array in (("vec_origins", origins), ("vec_directions", directions)):
            if array.ndim != 2 or array.shape[1] != 3:
                raise ValueError(f"{name}: expected the shape (n, 3), got {array.shape}")
        far = _FAR if dists is None else _arrays.numbers(dists, "dists", (len(origins),))
        scene, first_face = self._assembly.scene()
        if query == "OCCLUDED" and not output:
            return np.where(scene.any(origins, directions, tmax=far), 0, -1).astype(np.int32)
        hits = scene.nearest(origins, directions, tmax=far)
        if query == "DISTANCE" and not output:
            return np.where(hits.hit, hits.t, far)
        geometry = np.searchsorted(first_face, hits.triangle, side="right") - 1
        primitive = np.where(hits.hit, hits.triangle - first_face[np.minimum(geometry, len(first_face) - 1)], -1).astype(np.int32)
        if not output:
            return primitive
        return {
            "u": hits.u, "v": hits.v, "Ng": self._normals(hits), "tfar": np.where(hits.hit, hits.t, far),
            "primID": primitive, "geomID": np.where(hits.hit, geometry, -1).astype(np.int32),
        }

    def _normals(self, hits):
        """Cross products of the edges, not normalized, as those of Embree; zeros for a miss."""
        scene, _ = self._assembly.scene()
        normals = np.zeros((len(hits), 3), np.float32)
        a, b, c = np.moveaxis(scene.triangle_positions(hits.instance[hits.hit], hits.triangle[hits.hit]), 1, 0)
        normals[hits.hit] = np.cross(b - a, c - a)
        return normals
