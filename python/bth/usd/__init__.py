"""Scenes of Universal Scene Description (usd, usda, usdc, usdz), read by Pixar's library: `pip install bth-rays[usd]`.

    scene = bth.usd.compile("kitchen.usd", subdivision=2)
    made = bth.usd.convert("kitchen.usd", "folder")       # folder/kitchen.manifest, for bthc and bth-play
    made.manifest, made.dropped
"""

import os
import re
import tempfile
import warnings
from dataclasses import dataclass

try:
    from pxr import Tf, Usd
except ImportError:
    raise ImportError("bth.usd needs the library of USD (hint: pip install usd-core)") from None

from .. import _compile
from ._scene import convert as _convert

__all__ = ["Converted", "compile", "convert"]


@dataclass(frozen=True)
class Converted:
    """What `convert` has written.

    manifest: the path of the scene manifest.
    dropped: what the scene does not have, or not as the stage has it: how often, by what it is.
    """

    manifest: str
    dropped: dict


def convert(stage, folder, *, subdivision=0):
    """Writes a stage as a scene manifest, with a glTF file of its meshes and materials, into a folder.

    stage: a path, or a pxr.Usd.Stage. subdivision: levels of Catmull-Clark subdivision; 0 shows control cages.

    Meshes, also as skins, blend shapes and time samples move them, simple shapes, transforms and
    visibility over time, point instancers and instances (as groups), cameras, lights and preview
    materials with their textures are kept. What is not kept is counted in `dropped`.
    """
    levels = int(subdivision)
    if not 0 <= levels <= 6:
        raise ValueError(f"subdivision: expected levels from 0 to 6, got {subdivision}")
    name = "stage"
    if not isinstance(stage, Usd.Stage):
        path = os.fsdecode(stage)
        # USD says of a file that is not there that it has an unknown format.
        os.stat(path)
        name = os.path.splitext(os.path.basename(path))[0] or name
        try:
            stage = Usd.Stage.Open(path)
        except Tf.ErrorException as error:
            raise ValueError(f"{path}: USD cannot open it: {_said(error)}") from None
    os.makedirs(folder, exist_ok=True)
    return Converted(*_convert(stage, os.fspath(folder), name, levels))


def _said(error):
    """What the library says, best with a line of the file."""
    found = [" ".join(str(part.commentary).split()) for part in error.args if hasattr(part, "commentary")] or [str(error)]
    return next((text for text in found if re.search(r":\d+:", text)), found[0])


def compile(stage, output=None, *, subdivision=0, materials=True, **options):
    """Compiles a stage and returns its scene. What it drops is a UserWarning.

    The options are those of `bth.compile`; stage and subdivision are as for `convert`.
    """
    with tempfile.TemporaryDirectory(prefix="bth-usd-") as folder:
        made = convert(stage, folder, subdivision=subdivision)
        for what, count in made.dropped.items():
            warnings.warn(f"{count} × {what}", UserWarning, stacklevel=2)
        return _compile.compile(made.manifest, output=output, materials=materials, **options)
