from collections.abc import Callable
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._hits import AllHits, Closest, Hits
from ._native import Candidate

_Cull: TypeAlias = Literal["back", "front"] | None
_Filter: TypeAlias = Callable[[Candidate], bool | np.bool_] | None
_Start: TypeAlias = Hits | AllHits | Closest | tuple[ArrayLike, ArrayLike, ArrayLike]

def mask_bits(mask: int) -> int: ...
def rays_and_shape(
    origins: ArrayLike | None, directions: ArrayLike, tmin: ArrayLike, tmax: ArrayLike, start: _Start | None = None,
) -> tuple[tuple[object, object, object, object, object], tuple[int, ...]]: ...

class RayQueries:
    def nearest(
        self, origins: ArrayLike | None, directions: ArrayLike, tmin: ArrayLike = 0.0, tmax: ArrayLike = ..., *,
        start: _Start | None = None, mask: int = 0xFFFFFFFF, cull: _Cull = None, filter: _Filter = None, threads: int | None = None,
    ) -> Hits: ...
    def any(
        self, origins: ArrayLike | None, directions: ArrayLike, tmin: ArrayLike = 0.0, tmax: ArrayLike = ..., *,
        start: _Start | None = None, mask: int = 0xFFFFFFFF, cull: _Cull = None, filter: _Filter = None, threads: int | None = None,
    ) -> NDArray[np.bool_]: ...
    def all_hits(
        self, origins: ArrayLike | None, directions: ArrayLike, tmin: ArrayLike = 0.0, tmax: ArrayLike = ..., *,
        start: _Start | None = None, most: int | None = None, mask: int = 0xFFFFFFFF, cull: _Cull = None,
        filter: _Filter = None, threads: int | None = None,
    ) -> AllHits: ...
    def count(
        self, origins: ArrayLike | None, directions: ArrayLike, tmin: ArrayLike = 0.0, tmax: ArrayLike = ..., *,
        start: _Start | None = None, mask: int = 0xFFFFFFFF, cull: _Cull = None, filter: _Filter = None, threads: int | None = None,
    ) -> NDArray[np.int64]: ...
    def crossings(
        self, origins: ArrayLike | None, directions: ArrayLike, tmin: ArrayLike = 0.0, tmax: ArrayLike = ..., *,
        start: _Start | None = None, threads: int | None = None,
    ) -> tuple[NDArray[np.uint32], NDArray[np.int32]]: ...
    def check_start(self, start: _Start) -> None: ...
