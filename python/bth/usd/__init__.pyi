from dataclasses import dataclass
from os import PathLike
from typing import Any

from .._scene import Scene

__all__ = ["Converted", "compile", "convert"]

@dataclass(frozen=True)
class Converted:
    manifest: str
    dropped: dict[str, int]

def convert(stage: Any, folder: str | PathLike[str], *, subdivision: int = 0) -> Converted: ...
def compile(
    stage: Any, output: str | PathLike[str] | None = None, *, subdivision: int = 0, materials: bool = True, **options: Any
) -> Scene: ...
