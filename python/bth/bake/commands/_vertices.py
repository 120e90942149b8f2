"""Results with one number for each vertex: as files and as pictures."""

import numpy as np
from numpy.typing import NDArray

from .._arithmetic import Floats
from .._colors import colors, quantized
from .._errors import lacks_surface
from .._files import write_whole
from .._picture import Seen
from .._ply import coordinates, write_ply
from .._surface import WorldMesh


def write_values(path: str, mesh: WorldMesh, name: str, values: NDArray[np.float32], color: Floats) -> None:
    """Writes values of vertices: .npy the numbers, .ply the mesh in world space with colours and the numbers as a property."""
    if path.lower().endswith(".npy"):
        write_whole(path, lambda file: np.save(file, values, allow_pickle=False))
        return
    x, y, z = coordinates(mesh.vertices)
    red, green, blue = quantized(color).T
    columns = {"x": x, "y": y, "z": z, "red": red, "green": green, "blue": blue, name: values}
    write_ply(path, columns, mesh.faces, "baked by bth")


def color_of_vertices(mesh: WorldMesh, values: NDArray[np.floating], stops: Floats, low: float = 0.0, high: float = 1.0):
    """A function of the renderer that interpolates values of vertices and maps them from low to high to colours."""
    scaled = (np.asarray(values, np.float64) - low) / (high - low)

    def color(seen: Seen) -> Floats:
        return colors(mesh.interpolated(scaled, seen.instance, seen.triangle, seen.u, seen.v), stops)

    return color


def require_surface(mesh: WorldMesh) -> None:
    """Raises bth.Error where there is nothing to bake."""
    if len(mesh.faces) == 0:
        raise lacks_surface()
