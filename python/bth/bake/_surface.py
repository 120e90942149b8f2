"""Meshes of scenes in world space, and points on surfaces where rays start."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._hits import NONE
from .._scene import Scene
from ._arithmetic import Floats, angle_between, dot, unit
from ._errors import lacks_geometry

#: Weight of the other two corners of a face in a start next to a corner: all weights are exact.
_NEXT = np.float32(2.0**-24)


@dataclass(frozen=True)
class WorldMesh:
    """The visible instances of a scene at its time, as one mesh in world space.

    vertices: (n, 3) float64. Those of an instance follow one another.
    faces: (m, 3) int64, rows of `vertices`, counter-clockwise from the front; those of mirrored instances are turned round.
    instance, triangle: (m,) uint32, what each face is in hits.
    mirrored: for each instance whether its faces were turned round.
    """

    vertices: Floats
    faces: NDArray[np.int64]
    instance: NDArray[np.uint32]
    triangle: NDArray[np.uint32]
    _first: NDArray[np.int64]
    mirrored: NDArray[np.bool_]

    def rows(self, instance: NDArray[np.uint32], triangle: NDArray[np.uint32]) -> NDArray[np.int64]:
        """The faces that are these triangles of these instances; the last for `bth.NONE`."""
        none = triangle == NONE
        first = self._first[np.where(none, 0, instance)]
        return np.where(none, -1, first + np.where(none, 0, triangle))

    def interpolated(self, values: Floats, instance: NDArray[np.uint32], triangle: NDArray[np.uint32], u: NDArray[np.floating], v: NDArray[np.floating]) -> Floats:
        """Values of vertices, (n,) or (n, k), interpolated at hits."""
        faces = self.faces[self.rows(instance, triangle)]
        # In faces that were turned round, the second vertex of the triangle is the third.
        mirrored = self.mirrored[np.where(triangle == NONE, 0, instance)]
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
class FacesAround:
    """The faces around points: the rows first[i] to first[i + 1] are around point i.

    instance, triangle, u, v: where rays start on the face. Their last row is no face.
    normal: (m, 3), unit.
    """

    first: NDArray[np.int64]
    instance: NDArray[np.uint32]
    triangle: NDArray[np.uint32]
    u: NDArray[np.float32]
    v: NDArray[np.float32]
    normal: Floats

    @staticmethod
    def of(counts: NDArray[np.int64], instance, triangle, u, v, normal) -> FacesAround:
        """Adds the last row, given the number of faces around each point."""
        first = np.append([0], np.cumsum(counts))
        instance, triangle = (np.append(rows, np.uint32(NONE)) for rows in (instance, triangle))
        u, v = (np.append(weights, np.float32(0)) for weights in (u, v))
        return FacesAround(first, instance, triangle, u, v, normal)


#: Points at which rays start, as queries take them: instances, triangles and weights.
Start = tuple[NDArray[np.uint32], NDArray[np.uint32], NDArray[np.float32]]


@dataclass(frozen=True)
class SurfacePoints:
    """Points on the surfaces of a scene, from which rays start.

    position: (n, 3) float64, world space.
    normal: (n, 3) float64, unit; zeros where all triangles at the point are without area. No rays
    start there.
    instance, triangle: (n,) uint32, a triangle at the point. u, v: (n,) float32, its weights there.
    vertex: (n,) int64, the vertex of `mesh` that the point is, or -1.
    mesh: the scene's mesh.
    around: the faces around the points.
    """

    position: Floats
    normal: Floats
    instance: NDArray[np.uint32]
    triangle: NDArray[np.uint32]
    u: NDArray[np.float32]
    v: NDArray[np.float32]
    vertex: NDArray[np.int64]
    mesh: WorldMesh
    around: FacesAround

    def __len__(self) -> int:
        return len(self.position)

    def starts(self, points: NDArray[np.int64]) -> Start:
        """The points of some rows, exactly, as `start=` of queries takes them."""
        return self.instance[points], self.triangle[points], np.stack([self.u[points], self.v[points]], axis=-1)

    def leaving(
        self, points: NDArray[np.int64], directions: NDArray[np.floating], side: int = 1
    ) -> tuple[Start, NDArray[np.bool_]]:
        """Where rays leave surfaces to a side, the front (1) or the back (-1), and which of them do.

        points: (n,) rows. directions: (n, rays, 3). Returns what `start=` of queries takes,
        (n, rays), and bool (n, rays). The other rays have no start, and miss.

        A ray from a vertex starts on one of the faces around, 2^-24 of the edges away from the
        vertex: on the face from which it rises most. So faces at a concave vertex hide what is
        behind them, and faces at a convex vertex hide nothing.
        """
        around, shape = self.around, directions.shape[:-1]
        first, counts = around.first[points], np.diff(around.first)[points]
        rows, highest = np.full(shape, -1), np.full(shape, -1.0)
        for k in range(int(counts.max(initial=0))):
            has = np.nonzero(counts > k)[0]
            row = first[has] + k
            rise = side * dot(np.asarray(directions[has], np.float64), around.normal[row][:, None])
            higher = (rise >= 0) & (rise > highest[has])
            rows[has] = np.where(higher, row[:, None], rows[has])
            highest[has] = np.where(higher, rise, highest[has])
        uv = np.stack([around.u[rows], around.v[rows]], axis=-1)
        return (around.instance[rows], around.triangle[rows], uv), rows >= 0

    @property
    def usable(self) -> NDArray[np.bool_]:
        """Where there is a normal."""
        return np.asarray(self.normal.any(axis=1))


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
    # Corners of faces with area, by their vertices.
    solid = np.nonzero(face_normals.any(axis=1))[0]
    order = np.argsort(faces[solid].reshape(-1), kind="stable")
    face = solid[order // 3]
    counts = np.bincount(faces[solid].reshape(-1), minlength=count)
    normals[counts == 0] = 0.0
    instance, triangle = mesh.instance[face], mesh.triangle[face]
    # Corners of faces that were turned round are others of their triangles.
    corner_of = np.where(mesh.mirrored[instance], np.array([0, 2, 1])[order % 3], order % 3)
    u, v = (np.where(corner_of == k, 1 - 2 * _NEXT, _NEXT).astype(np.float32) for k in (1, 2))
    around = FacesAround.of(counts, instance, triangle, u, v, face_normals[face])
    row = np.where(counts > 0, around.first[:-1], -1)
    u, v = (np.append(corner_of == k, False)[row].astype(np.float32) for k in (1, 2))
    instance, triangle = around.instance[row], around.triangle[row]
    return SurfacePoints(mesh.vertices, normals, instance, triangle, u, v, np.arange(count), mesh, around)
