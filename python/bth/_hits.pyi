from collections.abc import Iterable
from enum import IntEnum
from typing import Any, Final

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ._scene import Scene

NONE: Final = 0xFFFFFFFF
FIELDS: dict[str, tuple[type[np.generic], tuple[int, ...], float]]

class Opacity(IntEnum):
    OPAQUE = 0
    TRANSPARENT = 1
    UNKNOWN = 2

class SurfacePoints:
    position: NDArray[np.float64]
    object_position: NDArray[np.float64]
    geometric_normal: NDArray[np.float64]
    object_geometric_normal: NDArray[np.float64]
    shading_normal: NDArray[np.float64]
    object_shading_normal: NDArray[np.float64]
    texcoord: NDArray[np.float32]
    second_texcoord: NDArray[np.float32]
    vertex_color: NDArray[np.float32]
    object: NDArray[np.uint32]
    group: NDArray[np.uint32]
    material: NDArray[np.uint32]
    opacity: NDArray[np.uint8]
    def __init__(self, fields: dict[str, NDArray[Any]]) -> None: ...
    def __len__(self) -> int: ...

class _OnTriangles:
    def surface(self) -> SurfacePoints: ...
    @property
    def normal(self) -> NDArray[np.float64]: ...
    @property
    def shading_normal(self) -> NDArray[np.float64]: ...
    @property
    def texcoord(self) -> NDArray[np.float32]: ...
    @property
    def second_texcoord(self) -> NDArray[np.float32]: ...
    @property
    def vertex_color(self) -> NDArray[np.float32]: ...
    @property
    def object(self) -> NDArray[np.uint32]: ...
    @property
    def group(self) -> NDArray[np.uint32]: ...
    @property
    def material(self) -> NDArray[np.uint32]: ...
    @property
    def opacity(self) -> NDArray[np.uint8]: ...
    @property
    def object_name(self) -> NDArray[np.object_]: ...
    @property
    def instance_name(self) -> NDArray[np.object_]: ...
    @property
    def group_name(self) -> NDArray[np.object_]: ...
    @property
    def material_name(self) -> NDArray[np.object_]: ...

class Hits(_OnTriangles):
    t: NDArray[np.floating]
    u: NDArray[np.float32]
    v: NDArray[np.float32]
    instance: NDArray[np.uint32]
    triangle: NDArray[np.uint32]
    def __init__(self, columns: Iterable[NDArray[Any]], scene: Scene, rays: tuple[NDArray[Any] | None, NDArray[Any]]) -> None: ...
    @property
    def hit(self) -> NDArray[np.bool_]: ...
    @property
    def position(self) -> NDArray[np.float64]: ...
    def __len__(self) -> int: ...

class AllHits(_OnTriangles):
    offsets: NDArray[np.int64]
    t: NDArray[np.floating]
    u: NDArray[np.float32]
    v: NDArray[np.float32]
    instance: NDArray[np.uint32]
    triangle: NDArray[np.uint32]
    def __init__(self, offsets: NDArray[np.int64], columns: Iterable[NDArray[Any]], scene: Scene) -> None: ...
    @property
    def ray(self) -> NDArray[np.int64]: ...
    def __len__(self) -> int: ...

class Overlaps:
    offsets: NDArray[np.int64]
    instance: NDArray[np.uint32]
    triangle: NDArray[np.uint32]
    def __init__(self, offsets: NDArray[np.int64], instance: NDArray[np.uint32], triangle: NDArray[np.uint32]) -> None: ...
    @property
    def region(self) -> NDArray[np.int64]: ...
    def __len__(self) -> int: ...

class Closest(_OnTriangles):
    distance: NDArray[np.floating]
    point: NDArray[np.floating]
    u: NDArray[np.float32]
    v: NDArray[np.float32]
    instance: NDArray[np.uint32]
    triangle: NDArray[np.uint32]
    feature: NDArray[np.uint8]
    def __init__(
        self, columns: Iterable[NDArray[Any]], point: NDArray[np.floating], feature: NDArray[np.uint8], scene: Scene,
    ) -> None: ...
    @property
    def found(self) -> NDArray[np.bool_]: ...
    def __len__(self) -> int: ...

def hit_columns(count: int, kind: DTypeLike) -> tuple[NDArray[Any], ...]: ...
def offsets_of(counts: NDArray[np.uint64]) -> NDArray[np.int64]: ...
