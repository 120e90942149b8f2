"""python -m bth sdf: signed distances on a grid."""

import argparse
from typing import Any

import numpy as np

from ..._command import Usage
from .._colors import INSIDE_TO_OUTSIDE, colors, quantized
from .._files import write_whole
from .._picture import save, with_color_bar
from .._progress import Bar
from .._surface import world_mesh
from .._volume import MOST_VALUES, Volume, sdf
from ._options import Job, add_parser, number, numbers, whole
from ._vertices import require_surface

_AXES = "xyz"


def add_to(commands: Any) -> None:
    parser = add_parser(commands, "sdf", "signed distances, negative inside, on a grid (.npz, .npy); its picture is a slice", _run)
    parser.add_argument("--resolution", type=whole(2, MOST_VALUES), default=64, metavar="N", help="points along the longest side (64)")
    parser.add_argument("--margin", type=number(0), default=0.1, metavar="SHARE", help="around the model, as a share of its longest side (0.1)")
    parser.add_argument("--box", type=numbers(6), metavar="X0,Y0,Z0,X1,Y1,Z1", help="in place of the model's box")
    parser.add_argument("--slice", type=_slice, default=("z", None), metavar="AXIS[=PLACE]", help="of the picture: z, or such as y=0.5 (z)")


def _slice(text: str) -> tuple[str, float | None]:
    axis, _, place = text.partition("=")
    try:
        value = float(place) if place else None
    except ValueError:
        value = np.nan
    if axis not in tuple(_AXES) or (value is not None and not np.isfinite(value)):
        raise argparse.ArgumentTypeError(f"expected an axis, and perhaps a place along it, such as z or y=0.5, found {text!r}")
    return axis, value


def _run(arguments: argparse.Namespace) -> None:
    if not (arguments.output or arguments.picture):
        raise Usage("sdf: expected -o FILE.npz or --picture FILE.png")
    with Bar(quiet=arguments.quiet) as bar:
        job = Job(arguments, (".npz", ".npy"), bar)
        mesh = world_mesh(job.scene)
        require_surface(mesh)
        box = None if arguments.box is None else arguments.box.reshape(2, 3)
        volume = sdf(job.scene, arguments.resolution, margin=arguments.margin, box=box, threads=job.threads, progress=job.progress)
        if arguments.output:
            _write(arguments.output, volume)
        if arguments.picture:
            _draw(job, volume)
    shape, distance = volume.distance.shape, volume.distance
    job.finish(
        f"{'x'.join(map(str, shape))} points, {volume.spacing:.4g} apart, from {distance.min():.4g} to {distance.max():.4g}", shape=shape,
        origin=volume.origin, spacing=volume.spacing, least=distance.min(), greatest=distance.max(),
        points_inside=int((distance < 0).sum()), closed=mesh.closed(),
    )


def _write(path: str, volume: Volume) -> None:
    """.npz holds `distance`, `origin` and `spacing`; .npy the distances alone."""
    if path.lower().endswith(".npy"):
        write_whole(path, lambda file: np.save(file, volume.distance, allow_pickle=False))
    else:
        write_whole(path, lambda file: np.savez(file, distance=volume.distance, origin=volume.origin, spacing=volume.spacing))


def _draw(job: Job, volume: Volume) -> None:
    """A slice through the middle of the volume or at the place wanted.

    The distances of the picture are asked for each pixel, so that it is sharp whatever the resolution of the volume. Thin lines are
    a twelfth of the greatest distance apart, the thick one is the surface.
    """
    axis, place = job.arguments.slice
    normal = _AXES.index(axis)
    low, high = volume.origin, volume.origin + volume.spacing * (np.array(volume.distance.shape) - 1)
    place = 0.5 * (low[normal] + high[normal]) if place is None else place
    if not low[normal] <= place <= high[normal]:
        raise Usage(f"--slice: the volume is from {low[normal]:g} to {high[normal]:g} along {axis}, and does not hold {place:g}")
    # The axes of the picture: upwards is the vertical one where the slice holds it.
    across, upwards = (k for k in range(3) if k != normal)
    if upwards != (vertical := _AXES.index(job.arguments.up)) and across == vertical:
        across, upwards = upwards, across
    width, height = job.arguments.size
    pixel = max((high[across] - low[across]) / width, (high[upwards] - low[upwards]) / height)
    middle = 0.5 * (low + high)
    points = np.empty((height, width, 3))
    points[..., normal] = place
    points[..., across] = middle[across] + pixel * (np.arange(width) + 0.5 - width / 2)
    points[..., upwards] = middle[upwards] - pixel * (np.arange(height)[:, None] + 0.5 - height / 2)
    distance = job.scene.signed_distance(points, threads=job.threads).astype(np.float64)
    save(job.arguments.picture, _colored(distance, pixel, f"signed distance, {axis} = {place:.4g}"))


def _colored(distance: Any, pixel: float, title: str) -> Any:
    largest = float(np.abs(distance).max()) or 1.0
    color = colors(distance / (2 * largest) + 0.5, INSIDE_TO_OUTSIDE)
    step = largest / 12
    # A distance changes by at most the length of a pixel from one pixel to the next, so lines of constant width are bands of distance.
    between = np.abs(distance / step - np.round(distance / step)) * step
    line = np.clip(1.0 - between / pixel, 0.0, 1.0) * 0.28
    surface = np.clip(1.8 - np.abs(distance) / pixel, 0.0, 1.0)
    color = color * (1.0 - np.maximum(line, surface))[..., None]
    return with_color_bar(quantized(color), title, -largest, largest, INSIDE_TO_OUTSIDE)
