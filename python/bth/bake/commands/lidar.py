"""python -m bth lidar: what a spinning laser scanner measures."""

import argparse
from typing import Any

import numpy as np

from ..._command import Usage
from .._arithmetic import Floats
from .._colors import VIRIDIS, colors, quantized, scale
from .._lidar import LidarScan, lidar, poses_along
from .._picture import draw_points, save, with_color_bar
from .._ply import coordinates, write_ply
from .._progress import Bar
from ._options import Job, add_parser, number, numbers, whole

_DARK, _PATH = np.array([0.07, 0.08, 0.10]), np.array([0.95, 0.25, 0.20])


def add_to(commands: Any) -> None:
    parser = add_parser(commands, "lidar", "a scan with a spinning laser scanner, to a point cloud (.ply)", _run)
    parser.add_argument(
        "--at", type=numbers(3), action="append", required=True, metavar="X,Y,Z",
        help="where the scanner stands; given several times, the path on which it moves",
    )
    parser.add_argument("--revolutions", type=whole(1, 1 << 20), default=1, metavar="N", help="along the path, or at the one place (1)")
    parser.add_argument("--beams", type=whole(1, 4096), default=32, metavar="N", help="beams above each other (32)")
    parser.add_argument("--elevation", type=numbers(2), default=np.array([-25.0, 15.0]), metavar="LOW,HIGH", help="degrees of the beams (-25,15)")
    parser.add_argument("--columns", type=whole(1, 1 << 20), default=1024, metavar="N", help="directions of a revolution (1024)")
    parser.add_argument("--range", type=numbers(2), metavar="NEAR,FAR", help="of the scanner, in world units (no limit)")
    parser.add_argument("--noise", type=number(0), default=0.0, metavar="D", help="standard deviation of the ranges, in world units (0)")
    parser.add_argument("--seed", type=whole(0), default=0, metavar="N", help="of the noise (0)")
    parser.add_argument("--color", choices=["height", "range"], default="height", help="what the colours show (height)")


def _run(arguments: argparse.Namespace) -> None:
    if not (arguments.output or arguments.picture):
        raise Usage("lidar: expected -o FILE.ply or --picture FILE.png")
    near, far = arguments.range if arguments.range is not None else (0.0, np.inf)
    with Bar(quiet=arguments.quiet) as bar:
        job = Job(arguments, (".ply",), bar)
        scan = lidar(
            job.scene, _poses(job), elevations=np.linspace(arguments.elevation[0], arguments.elevation[1], arguments.beams), columns=arguments.columns,
            nearest=near, farthest=far, noise=arguments.noise, seed=arguments.seed, threads=job.threads, progress=job.progress,
        )
        points = scan.point[scan.hit]
        shown = points @ job.up if arguments.color == "height" else scan.range[scan.hit].astype(np.float64)
        low, high = scale(shown)
        color = quantized(colors((shown - low) / (high - low), VIRIDIS))
        if arguments.output:
            _write(arguments.output, scan, color)
        if arguments.picture:
            _draw(job, scan, points, color, (low, high))
    measured = scan.range[scan.hit]
    ends = [float(measured.min()), float(measured.max())] if len(measured) else [float("nan")] * 2
    job.finish(
        f"{len(points)} points of {scan.hit.size} rays", points=len(points), rays=scan.hit.size, revolutions=len(scan.origin),
        beams=arguments.beams, columns=arguments.columns, range=ends,
    )


def _poses(job: Job) -> Floats:
    """Transforms of all columns: along the path, or turning in one place with the x axis of the world ahead."""
    options, path = job.arguments, np.array(job.arguments.at)
    if len(path) > 1:
        return poses_along(path, options.revolutions, options.columns, job.up)
    ahead = np.array([1.0, 0.0, 0.0])
    pose = np.eye(4)
    pose[:3, :3] = np.stack([ahead, np.cross(job.up, ahead), job.up], axis=-1)
    pose[:3, 3] = path[0]
    return np.broadcast_to(pose, (options.revolutions, 4, 4))


def _write(path: str, scan: LidarScan, color: Any) -> None:
    hit = scan.hit
    revolution, column, beam = np.nonzero(hit)
    x, y, z = coordinates(scan.point[hit])
    red, green, blue = color.T
    columns = {
        "x": x, "y": y, "z": z, "red": red, "green": green, "blue": blue, "range": scan.range[hit],
        "instance": scan.instance[hit], "triangle": scan.triangle[hit],
        "revolution": revolution.astype(np.uint32), "column": column.astype(np.uint32), "beam": beam.astype(np.uint32),
    }
    write_ply(path, columns, comment="scanned by bth")


def _draw(job: Job, scan: LidarScan, points: Floats, color: Any, ends: tuple[float, float]) -> None:
    """The points alone, as the scanner knows nothing else, and its way."""
    way = scan.origin.reshape(-1, 3)
    camera = job.camera(np.concatenate([points, way]))
    width, height = camera.size
    picture = np.tile(quantized(_DARK), (height, width, 1))
    draw_points(picture, camera, points, color, 0.9)
    draw_points(picture, camera, way, np.tile(quantized(_PATH), (len(way), 1)), 2.0)
    title = "height" if job.arguments.color == "height" else "range"
    save(job.arguments.picture, with_color_bar(picture, title, *ends, VIRIDIS))
