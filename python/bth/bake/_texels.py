"""Texels of a texture as points on a surface."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .. import _arrays
from .._compile import compile
from .._scene import Scene
from ._arithmetic import Floats
from ._errors import coded, lacks_texture_coordinates
from ._surface import FacesAround, SurfacePoints, visible_instances, world_mesh

#: Most copies of one triangle that repeats over the texture.
_MOST_TILES = 64


@dataclass(frozen=True)
class Texels:
    """The texels of a texture that a surface covers.

    points: where they are on the surface, in the order of `rows` and `columns`.
    rows, columns: (n,) int64, from the upper left texel of the picture.
    shape: (height, width) of the texture.
    shared: number of texels whose middle lies within several triangles; the one of the least number has it.
    """

    points: SurfacePoints
    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    shape: tuple[int, int]
    shared: int

    def texture(self, values: NDArray[np.float32], border: int = 4) -> NDArray[np.float32]:
        """Values of the points as a texture (height, width), NaN where there is none.

        border: texels around the covered ones that get the mean of their neighbours, so that lookups between texels at the edge of a chart
        meet no foreign values.
        """
        texture = np.full(self.shape, np.nan, np.float32)
        texture[self.rows, self.columns] = values
        return dilated(texture, border)


def dilated(texture: NDArray[np.float32], times: int) -> NDArray[np.float32]:
    """The texture with NaN next to other values replaced by the mean of the eight neighbours that are none, `times` times."""
    for _ in range(times):
        known = ~np.isnan(texture)
        if known.all() or not known.any():
            break
        padded, total = np.pad(np.where(known, texture, 0), 1), np.zeros(texture.shape, np.float32)
        count, present = np.zeros(texture.shape, np.float32), np.pad(known, 1)
        height, width = texture.shape
        for y in range(3):
            for x in range(3):
                total += padded[y : y + height, x : x + width]
                count += present[y : y + height, x : x + width]
        texture = np.where(known | (count == 0), texture, total / np.maximum(count, 1))
    return texture


def texture_coordinates(scene: Scene) -> Floats | None:
    """Texture coordinates (m, 3, 2) of the corners of the faces of `world_mesh(scene)`; None where an object has none."""
    parts: list[Floats] = [np.zeros((0, 3, 2))]
    for _, obj, transform in visible_instances(scene):
        corners = scene.texture_coordinates(obj)
        if corners is None:
            return None
        mirrored = np.linalg.det(transform[:3, :3]) < 0
        parts.append((corners[:, [0, 2, 1]] if mirrored else corners).astype(np.float64))
    return np.concatenate(parts)


def at_texels(scene: Scene, width: int, height: int, uv: Floats | None = None, *, v_up: bool = True) -> Texels:
    """The texels whose middles lie in the texture coordinates of a triangle, as points of the scene's surfaces.

    uv: (m, 3, 2), texture coordinates of the corners of each face of `world_mesh(scene)`; by default those that the scene keeps (compiled
    with attributes='all'). Coordinates beyond 0 and 1 repeat. Raises bth.Error without.
    v_up: whether v is 0 at the bottom of the picture, as in OBJ, or at its top, as in glTF.

    The library finds the texels itself: the triangles are laid flat into the plane of the texture, and a ray goes through the middle of
    each texel. So neighbouring triangles leave no texel between them out.
    """
    if width < 1 or height < 1:
        raise ValueError(f"texture: expected a size of at least 1x1, got {width}x{height}")
    mesh = world_mesh(scene)
    uv = texture_coordinates(scene) if uv is None else np.asarray(_arrays.plain(uv, "uv"), np.float64)
    if uv is None:
        raise lacks_texture_coordinates()
    if uv.shape != (len(mesh.faces), 3, 2):
        raise ValueError(f"uv: expected the shape {(len(mesh.faces), 3, 2)}, got {uv.shape}")
    flat, face_of = _tiled(uv)
    y, x = np.mgrid[0:height, 0:width]
    v = (height - 0.5 - y if v_up else y + 0.5) / height
    # Rays start in the plane itself, where t is 0 without rounding for all triangles: hits are then in the order of their numbers.
    middles = np.stack([(x + 0.5) / width, v, np.zeros_like(v)], axis=-1)
    atlas = compile((np.pad(flat, ((0, 0), (0, 0), (0, 1))).reshape(-1, 3), np.arange(len(flat) * 3).reshape(-1, 3)), quality="fast")
    found = atlas.all_hits(middles, [0.0, 0.0, -1.0], most=2)
    counts = np.diff(found.offsets)
    rows, columns = np.nonzero((counts > 0).reshape(height, width))
    nearest = found.offsets[:-1][counts > 0]
    faces, u, v = face_of[found.triangle[nearest]], found.u[nearest].astype(np.float64), found.v[nearest].astype(np.float64)
    shared = _overlaps(found, counts)
    if shared:
        message = f"{shared} of {len(rows)} texels lie within several triangles, and the triangle of the lowest index has them"
        hint = "hint: a bake needs texture coordinates that use each texel once, as a lightmap's"
        warnings.warn(f"{message} ({hint})", UserWarning, stacklevel=2)
    return Texels(_points(scene, mesh, faces, u, v), rows, columns, (height, width), shared)


def _overlaps(found, counts) -> int:
    """Texels within two triangles, of which those on an edge are none."""
    first = found.offsets[:-1][counts > 1]
    inside = np.ones(len(first), bool)
    for at in (first, first + 1):
        inside &= (found.u[at] > 0) & (found.v[at] > 0) & (found.u[at] + found.v[at] < 1)
    return int(inside.sum())


def _tiled(uv: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Triangles moved into the unit square, once for each tile that their box meets; and the face of each."""
    if not np.isfinite(uv).all():
        raise ValueError("uv: expected finite numbers")
    low, high = np.floor(uv.min(axis=1)), np.ceil(uv.max(axis=1)) - 1
    counts = np.maximum(high - low + 1, 1)
    tiles = counts[:, 0] * counts[:, 1]
    if (tiles > _MOST_TILES).any():
        face = int(np.argmax(tiles))
        message = f"the texture coordinates of face {face} repeat the texture {int(tiles[face])} times, and at most {_MOST_TILES} are possible"
        raise coded("BTH-P001", f"{message} (hint: a bake needs texture coordinates that use each texel once)")
    face_of = np.repeat(np.arange(len(uv)), tiles.astype(np.int64))
    rank = np.arange(len(face_of)) - np.repeat(np.cumsum(tiles) - tiles, tiles.astype(np.int64))
    across = counts[face_of, 0]
    shift = low[face_of] + np.stack([rank % across, rank // across], axis=-1)
    return uv[face_of] - shift[:, None, :], face_of


def _points(scene: Scene, mesh, faces, u: Floats, v: Floats) -> SurfacePoints:
    a, b, c = (mesh.vertices[mesh.faces[faces, k]] for k in range(3))
    position = a + u[:, None] * (b - a) + v[:, None] * (c - a)
    instance, triangle = mesh.instance[faces], mesh.triangle[faces]
    mirrored = mesh.mirrored[instance]
    second, third = np.where(mirrored, v, u).astype(np.float32), np.where(mirrored, u, v).astype(np.float32)
    normals = scene.normals(instance, triangle)
    around = FacesAround.of(np.ones(len(faces), np.int64), instance, triangle, second, third, normals)
    return SurfacePoints(position, normals, instance, triangle, second, third, np.full(len(faces), -1), mesh, around)
