from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

_Wrap = Literal["repeat", "mirror", "clamp"]

@dataclass(frozen=True)
class Gloss:
    metallic: float
    roughness: float
    metallic_roughness_texture: int | None
    normal_texture: int | None
    normal_scale: float
    occlusion_texture: int | None
    occlusion_strength: float

@dataclass(frozen=True)
class Material:
    name: str
    base_color: tuple[float, float, float, float]
    base_color_texture: int | None
    emissive: tuple[float, float, float]
    emissive_texture: int | None
    alpha: Literal["opaque", "mask", "blend"]
    alpha_cutoff: float
    double_sided: bool
    unlit: bool
    gloss: Gloss | None

@dataclass(frozen=True, eq=False)
class Texture:
    image: int
    data: bytes
    wrap: tuple[_Wrap, _Wrap]
    nearest: bool
    uv_set: int
    transform: NDArray[np.float32]
    def coordinates(self, texcoord: ArrayLike) -> NDArray[np.float64]: ...

def material(row: Any) -> Material | None: ...
def texture(row: Any) -> Texture: ...
