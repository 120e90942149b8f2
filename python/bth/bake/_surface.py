"""Meshes of scenes in world space, and points on surfaces where rays start."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._hits import NONE
from .._scene import Scene
from ._arithmetic import Floats, angle_between, dot, unit
from ._errors import lacks_geometry

#: Faces that turn from the normal of a vertex by more than the angle of this cosine (89 degrees) do not raise its start any further.
_STEEPEST = 1 / 64


@dataclass(frozen=True)
class WorldMesh:
    """The visible instances of a scene at its time, as one mesh in world space.

    vertices: (n, 3) float64. Those of an instance follow one another.
    faces: (m, 3) int64, rows of `vertices`, counter-clockwise from the front; those of mirrored instances are turned round.
    instance, triangle: (m,) uint32, what each face is in hits.
    """

    vertices: Floats
    faces: NDArray[np.int64]
    instance: NDArray[np.uint32]
    triangle: NDArray[np.uint32]
    _first: NDArray[np.int64]
    _mirrored: NDArray[np.bool_]

    def rows(self, instance: NDArray[np.uint32], triangle: NDArray[np.uint32]) -> NDArray[np.int64]:
        """The faces that are these triangles of these instances; the last for `bth.NONE`."""
        none = triangle == NONE
        first = self._first[np.where(none, 0, instance)]
        return np.where(none, -1, first + np.where(none, 0, triangle))

    def interpolated(self, values: Floats, instance: NDArray[np.uint32], triangle: NDArray[np.uint32], u: NDArray[np.floating], v: NDArray[np.floating]) -> Floats:
        """Values of vertices, (n,) or (n, k), interpolated at hits."""
        faces = self.faces[self.rows(instance, triangle)]
        # In faces that were turned round, the second vertex of the triangle is the third.
        mirrored = self._mirrored[np.where(triangle == NONE, 0, instance)]
        u, v = np.where(mirrored, v, u).astype(np.float64), np.where(mirrored, u, v).astype(np.float64)
        weights = np.stack([1.0 - u - v, u, v], axis=-1)
        corners = values[faces]
        return np.einsum("...c,...ck->...k", weights, corners) if corners.ndim > faces.ndim else np.einsum("...c,...c->...", weights, corners)

    def closed(self) -> bool:
        """Whether each edge of a face is that of another one in the other direction, so that there is an inside.

        Vertices of an instance at one place are one: deformable objects keep those of their source, of STL files three for each triangle.
        """
        return self._closed(self.faces) or self._closed(self._by_place()[self.faces])

    def _closed(self, faces: NDArray[np.int64]) -> bool:
        edges = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        edges = edges[edges[:, 0] != edges[:, 1]]
        there = np.sort(edges[:, 0] * len(self.vertices) + edges[:, 1])
        back = np.sort(edges[:, 1] * len(self.vertices) + edges[:, 0])
        return len(edges) > 0 and bool((there == back).all())

    def _by_place(self) -> NDArray[np.int64]:
        """For each vertex a number that it shares with those at the same place of the same instance alone."""
        instance = np.zeros(len(self.vertices), np.int64)
        instance[self.faces] = self.instance[:, None]
        order = np.lexsort((*self.vertices.T, instance))
        places = np.column_stack([instance, self.vertices])[order]
        numbers = np.empty(len(order), np.int64)
        numbers[order] = np.cumsum(np.append([False], (places[1:] != places[:-1]).any(axis=1))[: len(order)])
        return numbers


def visible_instances(scene: Scene) -> Iterator[tuple[int, int, Floats]]:
    """Index, object and transform of each visible instance."""
    transforms, visible = scene.transforms, scene.visible
    for index, obj in enumerate(scene.objects_of_instances):
        if visible[index]:
            yield index, int(obj), transforms[index]


def geometry(scene: Scene, obj: int) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Vertices and triangles of an object. Raises bth.Error for a file without."""
    try:
        return scene.vertices(obj), scene.triangles(obj)
    except LookupError:
        raise lacks_geometry() from None


def world_mesh(scene: Scene) -> WorldMesh:
    """All visible instances of a scene as one mesh in world space. Raises bth.Error for a file without geometry."""
    count = len(scene.objects_of_instances)
    first, mirrored = np.zeros(max(count, 1), np.int64), np.zeros(max(count, 1), bool)
    vertices: list[Floats] = [np.zeros((0, 3))]
    faces: list[NDArray[np.int64]] = [np.zeros((0, 3), np.int64)]
    instances: list[NDArray[np.uint32]] = [np.zeros(0, np.uint32)]
    triangles: list[NDArray[np.uint32]] = [np.zeros(0, np.uint32)]
    vertex_count = face_count = 0
    for index, obj, transform in visible_instances(scene):
        points, corners = geometry(scene, obj)
        first[index], mirrored[index] = face_count, np.linalg.det(transform[:3, :3]) < 0
        rows = corners.astype(np.int64) + vertex_count
        vertices.append(_transformed(transform, points))
        faces.append(rows[:, [0, 2, 1]] if mirrored[index] else rows)
        instances.append(np.full(len(rows), index, np.uint32))
        triangles.append(np.arange(len(rows), dtype=np.uint32))
        vertex_count, face_count = vertex_count + len(points), face_count + len(rows)
    return WorldMesh(
        np.concatenate(vertices), np.concatenate(faces), np.concatenate(instances), np.concatenate(triangles), first, mirrored
    )


def _transformed(transform: Floats, points: NDArray[np.float32]) -> Floats:
    x, y, z = (points[:, k].astype(np.float64) for k in range(3))
    return np.stack([row[0] * x + row[1] * y + row[2] * z + row[3] for row in transform[:3]], axis=-1)


@dataclass(frozen=True)
class SurfacePoints:
    """Points on the surfaces of a scene, from which rays start.

    position: (n, 3) float64, world space.
    normal: (n, 3) float64, unit; zeros where all triangles at the point are without area. No rays start there.
    lift: (n,) float64, the distance along the normal, in world units, that takes a start off the surface; see `origins`.
    instance, triangle: (n,) uint32, a triangle at the point.
    vertex: (n,) int64, the vertex of `mesh` that the point is, or -1.
    mesh: the scene's mesh.
    """

    position: Floats
    normal: Floats
    lift: Floats
    instance: NDArray[np.uint32]
    triangle: NDArray[np.uint32]
    vertex: NDArray[np.int64]
    mesh: WorldMesh

    def __len__(self) -> int:
        return len(self.position)

    def origins(self, side: int = 1) -> NDArray[np.float32]:
        """Where rays start: just above the surface (side 1) or just below (-1), (n, 3) float32.

        A point of a surface is rounded to float32 and may come to lie on either side of its triangle. Tracing is exact, so no more
        than this rounding has to be overcome. With B the largest coordinate of the scene's box in magnitude, a coordinate is off by at most
        2^-24 B and the point by less than 2^-23 B, so a lift of 2^-22 B is enough. At a vertex the lift is divided by the cosine between its
        normal and the steepest face, so that the start is above all faces there. In instances with a transform rays are rounded
        once more, and the lift is twice the bound that docs/accuracy.md states for them.
        """
        return (self.position + side * self.lift[:, None] * self.normal).astype(np.float32)

    @property
    def usable(self) -> NDArray[np.bool_]:
        """Where there is a normal."""
        return np.asarray(self.normal.any(axis=1))


def lifts(scene: Scene) -> Floats:
    """For each instance the distance in world units that takes points of its surface off it; see `SurfacePoints.origins`."""
    transforms, bounds = scene.transforms, scene.bounds
    largest = 0.0 if bounds is None else float(np.abs(bounds).max())
    out = np.full(len(transforms), 2.0**-22 * largest)
    for index, obj, transform in visible_instances(scene):
        if (transform == np.eye(4)).all():
            continue
        linear, offset = transform[:3, :3], float(np.abs(transform[:3, 3]).max())
        norm = float(np.abs(linear).sum(axis=1).max())
        determinant = np.linalg.det(linear)
        condition = norm * float(np.abs(np.linalg.inv(linear)).sum(axis=1).max()) if determinant != 0 else 0.0
        extent = float(np.abs(geometry(scene, obj)[0]).max(initial=0.0))
        out[index] = 2.0**-20 * (condition * (largest + offset) + norm * extent)
    return out


def at_vertices(scene: Scene) -> SurfacePoints:
    """The vertices of all visible instances, with normals that are the mean of the faces around, weighted by their angles there
    (Thürmer and Wüthrich, "Computing vertex normals from polygonal facets", 1998)."""
    mesh = world_mesh(scene)
    count, faces = len(mesh.vertices), mesh.faces
    face_normals = scene.normals(mesh.instance, mesh.triangle)
    total = np.zeros((count, 3))
    for corner in range(3):
        at = mesh.vertices[faces[:, corner]]
        following = unit(mesh.vertices[faces[:, (corner + 1) % 3]] - at)
        preceding = unit(mesh.vertices[faces[:, (corner + 2) % 3]] - at)
        weighted = face_normals * angle_between(following, preceding)[:, None]
        for axis in range(3):
            total[:, axis] += np.bincount(faces[:, corner], weighted[:, axis], count)
    normals = unit(total)
    steepest = np.ones(count)
    face_of = np.full(count, -1, np.int64)
    solid = np.nonzero(face_normals.any(axis=1))[0]
    for corner in range(3):
        rows = faces[solid, corner]
        np.minimum.at(steepest, rows, dot(normals[rows], face_normals[solid]))
        face_of[rows] = solid
    normals[face_of < 0] = 0.0
    instance, triangle = _of_faces(mesh, face_of)
    lift = np.append(lifts(scene), 0.0)[np.where(face_of < 0, -1, instance.astype(np.int64))]
    return SurfacePoints(mesh.vertices, normals, lift / np.maximum(steepest, _STEEPEST), instance, triangle, np.arange(count), mesh)


def _of_faces(mesh: WorldMesh, faces: NDArray[np.int64]) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """Instances and triangles of faces of the mesh; bth.NONE for -1."""
    return tuple(np.append(rows, np.uint32(NONE))[faces] for rows in (mesh.instance, mesh.triangle))  # type: ignore[return-value]
