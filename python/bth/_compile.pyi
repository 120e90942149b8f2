from collections.abc import Callable, Iterable
from os import PathLike
from typing import Any, Literal

from numpy.typing import ArrayLike

from ._scene import Scene

def compile(
    model: Any, *,
    output: str | bytes | PathLike[str] | PathLike[bytes] | None = None, quality: Literal["fast", "balanced", "best"] | None = None,
    structure: Literal["bth", "bvh", "tets"] | None = None, coordinates: Literal["f32", "21", "16", 21, 16] | None = None,
    max_error: float | str | None = None,
    polygons: Literal["fans", "ears"] | None = None, positions: Literal["auto", "f32", "f64"] | None = None,
    attributes: Literal["none", "normals", "all"] | None = None, alpha: Literal["none", "mask", "blend"] | None = None,
    geometry: bool | None = None, names: bool | None = None, materials: bool | None = None,
    lenient_materials: bool | None = None,
    settings: dict[str, object] | None = None,
    rays: tuple[ArrayLike, ...] | list[ArrayLike] | None = None,
    flatten: bool | None = None,
    scene: str | int | None = None, animation: str | int | None = None, rate: float | None = None, at_rest: bool | None = None,
    rigid_parts: bool | None = None, strict: bool | None = None,
    deformable: bool | None = None,
    free_directions: Literal["none", "auto", "distances", "all"] | None = None,
    cache: bool | str | PathLike[str] | None = None, cache_size: int | str | None = None,
    shared_cache: str | PathLike[str] | None = None, memory: int | None = None, threads: int | None = None,
    progress: Callable[[str, int, int | None], object] | None = None,
) -> Scene: ...
def compile_scene(
    meshes: Iterable[Any], instances: ArrayLike | None = None, transforms: ArrayLike | None = None, *,
    mesh_names: Iterable[str] | None = None, instance_names: Iterable[str] | None = None,
    output: str | bytes | PathLike[str] | PathLike[bytes] | None = None, quality: Literal["fast", "balanced", "best"] | None = None,
    structure: Literal["bth", "bvh", "tets"] | None = None, coordinates: Literal["f32", "21", "16", 21, 16] | None = None,
    max_error: float | str | None = None,
    polygons: Literal["fans", "ears"] | None = None, positions: Literal["auto", "f32", "f64"] | None = None,
    attributes: Literal["none", "normals", "all"] | None = None, alpha: Literal["none", "mask", "blend"] | None = None,
    geometry: bool | None = None, names: bool | None = None, materials: bool | None = None,
    lenient_materials: bool | None = None,
    settings: dict[str, object] | None = None,
    deformable: bool | None = None,
    free_directions: Literal["none", "auto", "distances", "all"] | None = None,
    cache: bool | str | PathLike[str] | None = None, cache_size: int | str | None = None,
    shared_cache: str | PathLike[str] | None = None, memory: int | None = None, threads: int | None = None,
    progress: Callable[[str, int, int | None], object] | None = None,
) -> Scene: ...
