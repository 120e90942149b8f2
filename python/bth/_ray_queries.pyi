from collections.abc import Callable
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._hits import AllHits, Closest, Hits
from ._native import Candidate

_Cull: TypeAlias = Literal["back", "front"] | None
_Filter: TypeAlias = Callable[[Candidate], bool | np.bool_] | None
_Start: TypeAlias = Hits | Closest | tuple[ArrayLike, ArrayLike] | None

def mask_bits(mask: int) -> int: ...
def rays_and_shape(
    origins: ArrayLike, directions: ArrayLike, tmin: ArrayLike, tmax: ArrayLike,
) -> tuple[tuple[object, object, object, object], tuple[int, ...]]: ...

class RayQueries:
    def nearest(
        self, origins: ArrayLike, directions: ArrayLike, tmin: ArrayLike = 0.0, tmax: ArrayLike = ..., start: _Start = None, *,
        mask: int = 0xFFFFFFFF, cull: _Cull = None, filter: _Filter = None, threads: int | None = None,
    ) -> Hits: ...
    def any(
        self, origins: ArrayLike, directions: ArrayLike, tmin: ArrayLike = 0.0, tmax: ArrayLike = ..., start: _Start = None, *,
        mask: int = 0xFFFFFFFF, cull: _Cull = None, filter: _Filter = None, threads: int | None = None,
    ) -> NDArray[np.bool_]: ...
    def all_hits(
        self, origins: ArrayLike, directions: ArrayLike, tmin: ArrayLike = 0.0, tmax: ArrayLike = ..., *,
        most: int | None = None, mask: int = 0xFFFFFFFF, cull: _Cull = None, filter: _Filter = None, threads: int | None = None,
    ) -> AllHits: ...
    def count(
        self, origins: ArrayLike, directions: ArrayLike, tmin: ArrayLike = 0.0, tmax: ArrayLike = ..., *,
        mask: int = 0xFFFFFFFF, cull: _Cull = None, filter: _Filter = None, threads: int | None = None,
    ) -> NDArray[np.int64]: ...
    def crossings(
        self, origins: ArrayLike, directions: ArrayLike, tmin: ArrayLike = 0.0, tmax: ArrayLike = ..., *,
        threads: int | None = None,
    ) -> tuple[NDArray[np.uint32], NDArray[np.int32]]: ...
