"""What the commands share: options, opening the model, the camera of the picture, and the summary."""

import argparse
import json
import math
import os
import time
from collections.abc import Callable
from typing import Any, Literal

import numpy as np

from ... import _compile, _native, _scene
from ..._command import Usage
from .._arithmetic import Floats
from .._camera import UP, Camera
from .._picture import pillow
from .._progress import Bar


def number(low: float = -math.inf, *, above: float = -math.inf, high: float = math.inf, infinite: bool = False) -> Callable[[str], float]:
    """A parser of numbers from `low`, or above `above`, to `high`."""

    def parse(text: str) -> float:
        value = float(text)
        if not (low <= value <= high and value > above) or (math.isinf(value) and not infinite):
            raise argparse.ArgumentTypeError(f"expected a number {_range(low, above, high)}, found {text}")
        return value

    parse.__name__ = "number"
    return parse


def whole(low: int, high: int = (1 << 31) - 1) -> Callable[[str], int]:
    """A parser of whole numbers."""

    def parse(text: str) -> int:
        value = int(text)
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"expected a whole number from {low} to {high}, found {text}")
        return value

    parse.__name__ = "whole number"
    return parse


def _range(low: float, above: float, high: float) -> str:
    start = f"above {above:g}" if above > -math.inf else f"from {low:g}" if low > -math.inf else ""
    return (start + (f" to {high:g}" if high < math.inf else "")) or "that is finite"


def numbers(*counts: int) -> Callable[[str], Floats]:
    """A parser of so many numbers with commas between them."""

    def parse(text: str) -> Floats:
        try:
            values = np.array([float(part) for part in text.split(",")])
        except ValueError:
            values = np.zeros(0)
        if len(values) not in counts or not np.isfinite(values).all():
            raise argparse.ArgumentTypeError(f"expected {' or '.join(map(str, counts))} numbers with commas between them, found {text!r}")
        return values

    return parse


def size(text: str) -> tuple[int, int]:
    """A parser of WIDTHxHEIGHT, or of one number for both."""
    parts = text.lower().split("x")
    if len(parts) not in (1, 2) or not all(part.isdecimal() and 1 <= int(part) <= 16384 for part in parts):
        raise argparse.ArgumentTypeError(f"expected a size such as 640x480, with sides from 1 to 16384, found {text!r}")
    return int(parts[0]), int(parts[-1])


def add_parser(commands: Any, name: str, text: str, run: Callable[[argparse.Namespace], None]) -> argparse.ArgumentParser:
    """A command with the options that all have."""
    parser = commands.add_parser(name, help=text, description=text[0].upper() + text[1:] + ". See docs/bakers.md.")
    parser.set_defaults(run=run, command=name)
    parser.add_argument("model", metavar="MODEL", help="a compiled file (.bth), or a model or a scene that is compiled first")
    parser.add_argument("-o", "--output", metavar="FILE", help="where the result goes; it appears whole or not at all")
    parser.add_argument("--frame", type=int, metavar="N", help="frame of an animated scene")
    parser.add_argument("--threads", type=whole(0, 4096), default=0, metavar="N", help="0 for one per processor; nothing else depends on it")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("-q", "--quiet", action="store_true", help="print nothing but errors")
    picture = parser.add_argument_group("picture")
    picture.add_argument("--picture", metavar="FILE.png", help="draw the result")
    picture.add_argument("--size", type=size, default=(640, 480), metavar="WxH", help="of the picture, without its legend (640x480)")
    picture.add_argument("--yaw", type=number(), default=35.0, metavar="DEGREES", help="around the model, from its front (35)")
    picture.add_argument("--pitch", type=number(-90, high=90), default=25.0, metavar="DEGREES", help="above the horizon (25)")
    picture.add_argument("--zoom", type=number(above=0), default=1.0, metavar="FACTOR", help="magnification (1)")
    picture.add_argument("--camera", type=numbers(6), metavar="EX,EY,EZ,TX,TY,TZ", help="eye and target, in place of yaw and pitch")
    picture.add_argument("--inside", action="store_true", help="from a place inside of the model, for rooms")
    picture.add_argument("--fov", type=number(above=0, high=170), metavar="DEGREES", help="vertical field of view")
    picture.add_argument("--up", choices=["y", "z"], default="y", help="the axis of the model that points up (y)")
    return parser


class Job:
    """One call of a command: its options, its scene, and the time it takes."""

    def __init__(self, arguments: argparse.Namespace, endings: tuple[str, ...], bar: Bar, *, attributes: Literal["none", "normals", "all"] | None = None):
        """Checks outputs before anything is computed, and opens the model. endings: of the output, such as .ply."""
        self.arguments, self.bar, self._since = arguments, bar, time.monotonic()
        self.up = UP[arguments.up]
        self.threads = arguments.threads or None
        self.progress = bar if bar.shown else None
        _check_output(arguments.output, endings)
        _check_output(arguments.picture, (".png",))
        self._refuse_inputs()
        if any((path or "").lower().endswith(".png") for path in (arguments.output, arguments.picture)):
            pillow()
        self.scene = self._open(arguments.model, attributes)
        if arguments.frame is not None:
            frames = self.scene.frames
            if frames is None or not frames[0] <= arguments.frame <= frames[1]:
                has = "none" if frames is None else f"{frames[0]} to {frames[1]}"
                raise Usage(f"--frame: the scene has no frame {arguments.frame}; its frames are {has}")
            self.scene.set_frame(arguments.frame)

    def _refuse_inputs(self) -> None:
        """Fails if an output would replace a file that is read, or the other output, whatever the paths are spelled like."""
        options = self.arguments
        outputs = {path: os.path.realpath(path) for path in (options.output, options.picture) if path is not None and os.path.isfile(path)}
        for read in _native.source_files(options.model) if outputs else ():
            for output, real in outputs.items():
                if real == os.path.realpath(read):
                    raise Usage(f"{output} would replace {os.fspath(read)}, which is read (hint: name another output)")
        if options.output is not None and options.picture is not None:
            if os.path.realpath(options.output) == os.path.realpath(options.picture):
                raise Usage(f"{options.picture} would be both the result and the picture (hint: name another file with --picture)")

    def _open(self, model: str, attributes: Literal["none", "normals", "all"] | None) -> _scene.Scene:
        if model.lower().endswith(".bth"):
            return _scene.open(model)
        return _compile.compile(model, attributes=attributes, threads=self.threads, progress=self.progress)

    def camera(self, points: Floats, field: float = 32.0) -> Camera:
        """The camera that the options name, by default one that frames points in world space."""
        options = self.arguments
        field = options.fov or field
        if options.inside and options.camera is not None:
            raise Usage("--inside: expected either this or --camera, got both")
        if options.inside:
            return Camera.inside(self.scene, options.up, options.size, options.fov or 60.0, options.zoom)
        if options.camera is None:
            return Camera.around(points, options.yaw, options.pitch, options.up, options.size, field, options.zoom)
        eye, target = options.camera[:3], options.camera[3:]
        if (eye == target).all():
            raise Usage("--camera: eye and target are the same point")
        return Camera.looking(eye, target - eye, self.up, options.size, field / options.zoom)

    def finish(self, text: str, **summary: Any) -> None:
        """Prints what has been done: with --json one object, with --quiet nothing."""
        options = self.arguments
        self.bar.__exit__()
        if options.json:
            head = {"command": options.command, "model": options.model, "output": options.output, "picture": options.picture}
            seconds = round(time.monotonic() - self._since, 3)
            print(json.dumps({**head, **{key: _plain(value) for key, value in summary.items()}, "seconds": seconds}, indent=2))
        elif not options.quiet:
            print(": ".join(filter(None, [options.output or options.picture, text])))


def _check_output(path: str | None, endings: tuple[str, ...]) -> None:
    if path is None:
        return
    if not path.lower().endswith(endings):
        raise Usage(f"{path}: expected a name that ends with {' or '.join(endings)}")
    folder = os.path.dirname(os.path.realpath(path))
    if not os.path.isdir(folder):
        raise FileNotFoundError(f"{path}: there is no folder {folder}")
    if os.path.isdir(path):
        raise IsADirectoryError(f"{path}: this is a folder")


def _plain(value: Any) -> Any:
    """The value as JSON has it: numbers that are not finite are null."""
    if isinstance(value, np.ndarray):
        return [_plain(element) for element in value.tolist()]
    if isinstance(value, (list, tuple)):
        return [_plain(element) for element in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
