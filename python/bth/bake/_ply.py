"""Writes PLY files: meshes and point clouds with any properties."""

from __future__ import annotations

import os

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _arrays
from ._files import write_whole

_TYPES = {"f4": "float", "f8": "double", "u1": "uchar", "i4": "int", "u4": "uint"}


def coordinates(points: NDArray[np.float64]) -> NDArray[np.floating]:
    """The columns x, y and z (3, n) of points (n, 3): float32, or float64 where float32 would move a point by more than 2^-24 of their size."""
    return (points if _arrays.moved_by_rounding(points) is not None else points.astype(np.float32)).T


def write_ply(
    path: str | os.PathLike[str], columns: dict[str, ArrayLike], faces: NDArray[np.integer] | None = None, comment: str = "",
) -> None:
    """Writes vertices, and triangles if there are any, to a binary little-endian PLY file, which appears whole or not at all.

    columns: properties of the vertices by name, such as x, y, z, red, green, blue; each (n,) of float32, float64, uint8, int32 or uint32.
    faces: (m, 3) rows of the vertices.
    Raises OSError, and ValueError for other shapes and types.
    """
    arrays = {name: np.asarray(column) for name, column in columns.items()}
    kinds = {name: array.dtype.str[1:] for name, array in arrays.items()}
    for name, array in arrays.items():
        if array.ndim != 1 or len(array) != len(next(iter(arrays.values()))) or kinds[name] not in _TYPES:
            raise ValueError(f"{name}: expected a column as long as the others, of float, uchar, int or uint, got {array.dtype} {array.shape}")
    vertices = np.empty(len(next(iter(arrays.values()))), [(name, "<" + kind) for name, kind in kinds.items()])
    for name, array in arrays.items():
        vertices[name] = array
    header = ["ply", "format binary_little_endian 1.0"]
    header += [f"comment {comment}"] if comment else []
    header += [f"element vertex {len(vertices)}"] + [f"property {_TYPES[kind]} {name}" for name, kind in kinds.items()]
    rows = None
    if faces is not None:
        rows = np.empty(len(faces), [("count", "u1"), ("corners", "<i4", 3)])
        rows["count"], rows["corners"] = 3, faces
        header += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    text = "\n".join([*header, "end_header", ""]).encode()

    def write(file):
        file.write(text)
        file.write(vertices.tobytes())
        if rows is not None:
            file.write(rows.tobytes())

    write_whole(path, write)
