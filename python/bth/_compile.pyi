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
    polygons: Literal["fans", "ears"] | None = None,
    attributes: Literal["none", "normals", "all"] | None = None, alpha: Literal["none", "mask", "blend"] | None = None,
    tets: Literal["link32", "tet32", "tet20", "tet16"] | None = None, subtrees: Literal["keep", "prune"] | None = None,
    compact: bool | None = None, geometry: bool | None = None, names: bool | None = None, materials: bool | None = None,
    lenient_materials: bool | None = None,
    estimator: Literal["face-count", "average-depth"] | None = None, select: Literal["best", "paper"] | None = None,
    optimize_for: Literal["camera", "secondary", "balanced"] | None = None, profile: str | PathLike[str] | None = None,
    max_bytes_per_triangle: float | None = None, budget: float | None = None, probe: Literal["steps", "off"] | None = None,
    min_tet_triangles: int | None = None, c_tet: float | None = None, for_scene: bool | None = None,
    rays: tuple[ArrayLike, ...] | list[ArrayLike] | None = None,
    tet_deadline: int | None = None, tet_memory: int | None = None, flatten: bool | None = None,
    scene: str | int | None = None, animation: str | int | None = None, rate: float | None = None, at_rest: bool | None = None,
    rigid_parts: bool | None = None, strict: bool | None = None,
    deformable: bool | None = None, poses: int | None = None, segments: int | None = None,
    free_directions: Literal["none", "auto", "distances", "all"] | None = None, free_reach: float | None = None,
    cache: bool | str | PathLike[str] | None = None, cache_size: int | str | None = None,
    shared_cache: str | PathLike[str] | None = None, memory: int | None = None, threads: int | None = None,
    progress: Callable[[str, int, int | None], object] | None = None,
) -> Scene: ...
def compile_scene(
    meshes: Iterable[Any], instances: ArrayLike | None = None, transforms: ArrayLike | None = None, *,
    output: str | bytes | PathLike[str] | PathLike[bytes] | None = None, quality: Literal["fast", "balanced", "best"] | None = None,
    structure: Literal["bth", "bvh", "tets"] | None = None, coordinates: Literal["f32", "21", "16", 21, 16] | None = None,
    max_error: float | str | None = None,
    polygons: Literal["fans", "ears"] | None = None,
    attributes: Literal["none", "normals", "all"] | None = None, alpha: Literal["none", "mask", "blend"] | None = None,
    tets: Literal["link32", "tet32", "tet20", "tet16"] | None = None, subtrees: Literal["keep", "prune"] | None = None,
    compact: bool | None = None, geometry: bool | None = None, names: bool | None = None, materials: bool | None = None,
    lenient_materials: bool | None = None,
    estimator: Literal["face-count", "average-depth"] | None = None, select: Literal["best", "paper"] | None = None,
    optimize_for: Literal["camera", "secondary", "balanced"] | None = None, profile: str | PathLike[str] | None = None,
    max_bytes_per_triangle: float | None = None, budget: float | None = None, probe: Literal["steps", "off"] | None = None,
    min_tet_triangles: int | None = None, c_tet: float | None = None, for_scene: bool | None = None,
    tet_deadline: int | None = None, tet_memory: int | None = None,
    deformable: bool | None = None, poses: int | None = None, segments: int | None = None,
    free_directions: Literal["none", "auto", "distances", "all"] | None = None, free_reach: float | None = None,
    cache: bool | str | PathLike[str] | None = None, cache_size: int | str | None = None,
    shared_cache: str | PathLike[str] | None = None, memory: int | None = None, threads: int | None = None,
    progress: Callable[[str, int, int | None], object] | None = None,
) -> Scene: ...
