"""Open3D's `t.geometry.RaycastingScene`, without Open3D. Rays are (..., 6): origin and direction.

Arguments are arrays or tensors of any package that have `numpy()` or DLPack. Results are tensors of Open3D where an argument is one,
else arrays of numpy that also have the methods of tensors which scripts call.
"""

import numpy as np

from . import _arrays
from ._assembly import Assembly, passages

_INVALID = 0xFFFFFFFF


class Tensor(np.ndarray):
    """An array with methods of Open3D's tensors. Its elements are arrays without axes."""

    def __getitem__(self, key):
        return np.asarray(super().__getitem__(key)).view(Tensor)

    def numpy(self):
        return self.view(np.ndarray)

    def cpu(self):
        return self

    def clone(self):
        return self.copy()

    def isfinite(self):
        return np.isfinite(self)

    def isinf(self):
        return np.isinf(self)

    def isnan(self):
        return np.isnan(self)


def _as(like, result):
    """An array, or a dictionary of arrays, as tensors of the package of `like`."""
    if isinstance(result, dict):
        return {name: _as(like, array) for name, array in result.items()}
    from_numpy = getattr(type(like), "from_numpy", None)
    return result.view(Tensor) if from_numpy is None else from_numpy(np.ascontiguousarray(result)).to(like.device)


class RaycastingScene:
    """A scene of triangle meshes, which is compiled by the first query."""

    INVALID_ID = _INVALID

    def __init__(self, nthreads=0, device=None):
        """device: has no meaning here; tensors of results are where arguments are."""
        self._threads = nthreads or None
        self._assembly = Assembly()

    def add_triangles(self, vertex_positions=None, triangle_indices=None, *, mesh=None):
        """Adds vertices (n, 3) and triangles (m, 3), or a mesh of any package; returns its geometry's index."""
        if (mesh is None) == (vertex_positions is None):
            raise TypeError("expected vertex_positions and triangle_indices, or a mesh")
        mesh = vertex_positions if mesh is None else mesh
        return self._assembly.add(mesh if triangle_indices is None else (mesh, triangle_indices))

    def _rays(self, rays, nthreads):
        rays = _arrays.plain(rays, "rays")
        if rays.ndim == 0 or rays.shape[-1] != 6:
            raise ValueError(f"rays: expected the shape (..., 6), got {rays.shape}")
        return rays[..., :3], rays[..., 3:], nthreads or self._threads

    def _ids(self, triangles):
        """Geometries, and triangles in them, of triangles of the scene; INVALID_ID for none."""
        first = self._assembly.scene()[1]
        geometry = np.searchsorted(first, triangles, side="right") - 1
        none = triangles == _INVALID
        local = triangles - first[np.where(none, 0, geometry)]
        return np.where(none, _INVALID, geometry).astype(np.uint32), np.where(none, _INVALID, local).astype(np.uint32)

    def cast_rays(self, rays, nthreads=0):
        """Nearest hits: t_hit, geometry_ids, primitive_ids, primitive_uvs, primitive_normals."""
        origins, directions, threads = self._rays(rays, nthreads)
        hits = self._assembly.scene()[0].nearest(origins, directions, threads=threads)
        geometry, primitive = self._ids(hits.triangle)
        return _as(rays, {
            "t_hit": hits.t, "geometry_ids": geometry, "primitive_ids": primitive,
            "primitive_uvs": np.stack([hits.u, hits.v], axis=-1), "primitive_normals": hits.normal.astype(np.float32),
        })

    def test_occlusions(self, rays, tnear=0.0, tfar=float("inf"), nthreads=0):
        """Whether rays hit anything between tnear and tfar."""
        origins, directions, threads = self._rays(rays, nthreads)
        return _as(rays, self._assembly.scene()[0].any(origins, directions, tmin=tnear, tmax=tfar, threads=threads))

    def _passages(self, rays, nthreads):
        """All hits, the rows of them that count, and their geometries and triangles."""
        origins, directions, threads = self._rays(rays, nthreads)
        scene = self._assembly.scene()[0]
        found = scene.all_hits(origins.astype(np.float64), directions, threads=threads)
        geometry, primitive = self._ids(found.triangle)

        def facing(rows):
            normals = scene.normals(found.instance[rows], found.triangle[rows])
            return np.einsum("ij,ij->i", normals, directions.reshape(-1, 3)[found.ray[rows]]) > 0

        return found, passages(found, facing, geometry), geometry, primitive, origins

    def count_intersections(self, rays, nthreads=0):
        """How often rays hit surfaces. A point on an edge of several triangles counts once for each side from which it is hit."""
        found, rows, *_, origins = self._passages(rays, nthreads)
        count = np.bincount(found.ray[rows], minlength=len(found.offsets) - 1)
        return _as(rays, count.astype(np.int32).reshape(origins.shape[:-1]))

    def list_intersections(self, rays, nthreads=0):
        """The hits that `count_intersections` counts: ray_splits (offsets), ray_ids, t_hit, geometry_ids, primitive_ids, primitive_uvs."""
        found, rows, geometry, primitive, origins = self._passages(rays, nthreads)
        kind = np.float64 if origins.dtype == np.float64 else np.float32
        return _as(rays, {
            "ray_splits": np.searchsorted(rows, found.offsets), "ray_ids": found.ray[rows], "t_hit": found.t[rows].astype(kind),
            "geometry_ids": geometry[rows], "primitive_ids": primitive[rows],
            "primitive_uvs": np.stack([found.u[rows], found.v[rows]], axis=-1),
        })

    def compute_closest_points(self, query_points, nthreads=0):
        """Closest points: points, geometry_ids, primitive_ids, primitive_uvs, primitive_normals."""
        scene = self._assembly.scene()[0]
        closest = scene.closest(query_points, threads=nthreads or self._threads)
        geometry, primitive = self._ids(closest.triangle)
        return _as(query_points, {
            "points": closest.point, "geometry_ids": geometry, "primitive_ids": primitive,
            "primitive_uvs": np.stack([closest.u, closest.v], axis=-1),
            "primitive_normals": scene.normals(closest.instance, closest.triangle).astype(np.float32),
        })

    def compute_distance(self, query_points, nthreads=0):
        return _as(query_points, self._assembly.scene()[0].closest(query_points, threads=nthreads or self._threads).distance)

    def compute_signed_distance(self, query_points, nthreads=0, nsamples=1):
        """nsamples: one ray decides exactly; more would not change the answer."""
        _odd(nsamples)
        return _as(query_points, self._assembly.scene()[0].signed_distance(query_points, threads=nthreads or self._threads))

    def compute_occupancy(self, query_points, nthreads=0, nsamples=1):
        """1 for points inside, else 0."""
        _odd(nsamples)
        inside = self._assembly.scene()[0].contains(query_points, threads=nthreads or self._threads)
        return _as(query_points, inside.astype(np.float32))

    @staticmethod
    def create_rays_pinhole(*args, **named):
        """Rays (height, width, 6) of a pinhole camera; z is 1 in the camera's space.

        create_rays_pinhole(intrinsic_matrix, extrinsic_matrix, width_px, height_px): by its matrices.
        create_rays_pinhole(fov_deg, center, eye, up, width_px, height_px): by where it is and looks; rows go along `up`.
        """
        rays = (_rays_by_view if len(args) + len(named) > 4 else _rays_by_matrices)(*args, **named)
        return _as(next((a for a in (*args, *named.values()) if hasattr(type(a), "from_numpy")), None), rays)


def _rays_by_view(fov_deg, center, eye, up, width_px, height_px):
    eye, center, up = (np.asarray(_arrays.plain(a, "view"), np.float64) for a in (eye, center, up))
    forward = center - eye
    # As in Open3D, rows of pixels go along `up`, and columns to the left of who looks.
    left = np.cross(up, forward)
    # What rounding leaves of the product of parallel vectors is relative to their lengths.
    if not np.linalg.norm(left) > 2.0**-40 * np.linalg.norm(forward) * np.linalg.norm(up):
        raise ValueError(f"up: expected a direction across the view from eye to center, got {up.tolist()}")
    forward /= np.linalg.norm(forward)
    left /= np.linalg.norm(left)
    rotation = np.stack([left, np.cross(forward, left), forward])
    focal = 0.5 * width_px / np.tan(0.5 * np.deg2rad(fov_deg))
    extrinsic = np.eye(4)
    extrinsic[:3, :3], extrinsic[:3, 3] = rotation, -rotation @ eye
    return _rays_by_matrices([[focal, 0, 0.5 * width_px], [0, focal, 0.5 * height_px], [0, 0, 1]], extrinsic, width_px, height_px)


def _rays_by_matrices(intrinsic_matrix, extrinsic_matrix, width_px, height_px):
    intrinsic = np.asarray(_arrays.plain(intrinsic_matrix, "intrinsic_matrix"), np.float64)
    extrinsic = np.asarray(_arrays.plain(extrinsic_matrix, "extrinsic_matrix"), np.float64)
    y, x = np.meshgrid(np.arange(height_px) + 0.5, np.arange(width_px) + 0.5, indexing="ij")
    pixels = np.stack([x, y, np.ones_like(x)], axis=-1)
    directions = pixels @ np.linalg.inv(intrinsic).T @ extrinsic[:3, :3]
    origins = np.broadcast_to(-extrinsic[:3, :3].T @ extrinsic[:3, 3], directions.shape)
    return np.concatenate([origins, directions], axis=-1).astype(np.float32)


def _odd(nsamples):
    if int(nsamples) < 1 or int(nsamples) % 2 == 0:
        raise ValueError(f"nsamples: expected an odd number, got {nsamples}")
