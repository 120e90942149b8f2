from typing import Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .rtcore import EmbreeDevice

class EmbreeScene:
    device: EmbreeDevice | None
    def __init__(self, device: EmbreeDevice | None = None, robust: bool = True) -> None: ...
    @overload
    def run(
        self, vec_origins: ArrayLike, vec_directions: ArrayLike, dists: ArrayLike | None = None,
        query: Literal["INTERSECT", "OCCLUDED"] = "INTERSECT", output: None = None,
    ) -> NDArray[np.int32]: ...
    @overload
    def run(
        self, vec_origins: ArrayLike, vec_directions: ArrayLike, dists: ArrayLike | None = None,
        *, query: Literal["DISTANCE"], output: None = None,
    ) -> NDArray[np.floating]: ...
    @overload
    def run(
        self, vec_origins: ArrayLike, vec_directions: ArrayLike, dists: ArrayLike | None = None,
        query: Literal["INTERSECT", "OCCLUDED", "DISTANCE"] = "INTERSECT", *, output: Literal[True, 1],
    ) -> dict[str, NDArray[Any]]: ...
