"""Open3D's `t.geometry.RaycastingScene` on arrays of numpy. Rays are (..., 6): origin and direction."""

import numpy as np

from . import _arrays
from ._assembly import Assembly

_INVALID = 0xFFFFFFFF


class RaycastingScene:
    """A scene of triangle meshes, which is compiled by the first query."""

    INVALID_ID = _INVALID

    def __init__(self, nthreads=0):
        self._threads = nthreads or None
        self._assembly = Assembly()

    def add_triangles(self, vertex_positions=None, triangle_indices=None, *, mesh=None):
        """Adds vertices (n, 3) and triangles (m, 3), or a mesh; returns its geometry's index."""
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
        return {
            "t_hit": hits.t, "geometry_ids": geometry, "primitive_ids": primitive,
            "primitive_uvs": np.stack([hits.u, hits.v], axis=-1), "primitive_normals": hits.normal.astype(np.float32),
        }

    def test_occlusions(self, rays, tnear=0.0, tfar=float("inf"), nthreads=0):
        """Whether rays hit anything between tnear and tfar."""
        origins, directions, threads = self._rays(rays, nthreads)
        return self._assembly.scene()[0].any(origins, directions, tmin=tnear, tmax=tfar, threads=threads)

    def count_intersections(self, rays, nthreads=0):
        """Number of triangles that rays hit."""
        origins, directions, threads = self._rays(rays, nthreads)
        return self._assembly.scene()[0].count(origins, directions, threads=threads).astype(np.int32)

    def list_intersections(self, rays, nthreads=0):
        """All hits: ray_splits (offsets), ray_ids, t_hit, geometry_ids, primitive_ids, primitive_uvs."""
        origins, directions, threads = self._rays(rays, nthreads)
        found = self._assembly.scene()[0].all_hits(origins, directions, threads=threads)
        geometry, primitive = self._ids(found.triangle)
        return {
            "ray_splits": found.offsets, "ray_ids": found.ray, "t_hit": found.t, "geometry_ids": geometry,
            "primitive_ids": primitive, "primitive_uvs": np.stack([found.u, found.v], axis=-1),
        }

    def compute_closest_points(self, query_points, nthreads=0):
        """Closest points: points, geometry_ids, primitive_ids, primitive_uvs, primitive_normals."""
        scene = self._assembly.scene()[0]
        closest = scene.closest(query_points, threads=nthreads or self._threads)
        geometry, primitive = self._ids(closest.triangle)
        return {
            "points": closest.point, "geometry_ids": geometry, "primitive_ids": primitive,
            "primitive_uvs": np.stack([closest.u, closest.v], axis=-1),
            "primitive_normals": scene.normals(closest.instance, closest.triangle).astype(np.float32),
        }

    def compute_distance(self, query_points, nthreads=0):
        return self._assembly.scene()[0].closest(query_points, threads=nthreads or self._threads).distance

    def compute_signed_distance(self, query_points, nthreads=0, nsamples=1):
        """nsamples: one ray decides exactly; more would not change the answer."""
        _odd(nsamples)
        return self._assembly.scene()[0].signed_distance(query_points, threads=nthreads or self._threads)

    def compute_occupancy(self, query_points, nthreads=0, nsamples=1):
        """1 for points inside, else 0."""
        _odd(nsamples)
        return self._assembly.scene()[0].contains(query_points, threads=nthreads or self._threads).astype(np.float32)

    @staticmethod
    def create_rays_pinhole(*args, **named):
        """Rays (height, width, 6) of a pinhole camera; z is 1 in the camera's space.

        create_rays_pinhole(intrinsic_matrix, extrinsic_matrix, width_px, height_px): by its matrices.
        create_rays_pinhole(fov_deg, center, eye, up, width_px, height_px): by where it is and looks; rows go along `up`.
        """
        return (_rays_by_view if len(args) + len(named) > 4 else _rays_by_matrices)(*args, **named)


def _rays_by_view(fov_deg, center, eye, up, width_px, height_px):
    eye, center, up = (np.asarray(a, np.float64) for a in (eye, center, up))
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
    intrinsic, extrinsic = np.asarray(intrinsic_matrix, np.float64), np.asarray(extrinsic_matrix, np.float64)
    y, x = np.meshgrid(np.arange(height_px) + 0.5, np.arange(width_px) + 0.5, indexing="ij")
    pixels = np.stack([x, y, np.ones_like(x)], axis=-1)
    directions = pixels @ np.linalg.inv(intrinsic).T @ extrinsic[:3, :3]
    origins = np.broadcast_to(-extrinsic[:3, :3].T @ extrinsic[:3, 3], directions.shape)
    return np.concatenate([origins, directions], axis=-1).astype(np.float32)


def _odd(nsamples):
    if int(nsamples) < 1 or int(nsamples) % 2 == 0:
        raise ValueError(f"nsamples: expected an odd number, got {nsamples}")
