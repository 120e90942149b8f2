from numpy.typing import ArrayLike

from .rtcore_scene import EmbreeScene

class TriangleMesh:
    mesh: int
    def __init__(self, scene: EmbreeScene, vertices: ArrayLike, indices: ArrayLike | None = None) -> None: ...

class ElementMesh(TriangleMesh):
    def __init__(self, scene: EmbreeScene, vertices: ArrayLike, indices: ArrayLike) -> None: ...
