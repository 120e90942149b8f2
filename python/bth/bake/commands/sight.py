"""python -m bth sight: what is seen from points."""

import argparse
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._command import Usage
from .._arithmetic import Floats
from .._colors import quantized
from .._picture import Seen, draw_line, draw_points, render, save, with_keys
from .._progress import Bar
from .._sight import above_ground, line_of_sight, viewshed
from .._surface import SurfacePoints, at_vertices
from ._options import Job, add_parser, number, numbers
from ._vertices import require_surface, write_values

_SEEN, _UNSEEN = np.array([0.98, 0.80, 0.36]), np.array([0.33, 0.38, 0.47])
_OBSERVER, _BLOCKED = np.array([0.80, 0.08, 0.10]), np.array([0.10, 0.12, 0.15])


def add_to(commands: Any) -> None:
    parser = add_parser(commands, "sight", "what is seen from observers: which vertices (.ply, .npy), or which points", _run)
    parser.add_argument(
        "--from", dest="observers", type=numbers(2, 3), action="append", required=True, metavar="X,Y[,Z]",
        help="an observer; with two numbers, the horizontal ones, it stands on the ground. May be given several times",
    )
    parser.add_argument("--to", type=numbers(2, 3), action="append", metavar="X,Y[,Z]", help="a target, in place of all vertices; likewise")
    parser.add_argument("--height", type=number(0), default=1.7, metavar="D", help="of observers above the ground, in world units (1.7)")
    parser.add_argument("--target-height", type=number(0), default=0.0, metavar="D", help="of targets above the ground (0)")


def _run(arguments: argparse.Namespace) -> None:
    if arguments.output and arguments.to:
        raise Usage("sight: -o writes what is seen of all vertices, so it does not go with --to")
    if not (arguments.output or arguments.picture or arguments.to):
        raise Usage("sight: expected -o FILE, --picture FILE.png or --to X,Y,Z")
    with Bar(quiet=arguments.quiet) as bar:
        job = Job(arguments, (".ply", ".npy"), bar)
        at = at_vertices(job.scene)
        require_surface(at.mesh)
        observers = _placed(job, "--from", arguments.observers, arguments.height)
        if arguments.to:
            targets = _placed(job, "--to", arguments.to, arguments.target_height)
            seen = line_of_sight(job.scene, observers[:, None], targets, threads=job.threads)
            text, summary = _lines(observers, targets, seen)
            _draw_lines(job, at, observers, targets, seen)
        else:
            seen = viewshed(
                job.scene, observers, at, height=arguments.target_height, up=job.up, threads=job.threads, progress=job.progress
            )
            text, summary = _bake(job, at, observers, seen)
    job.finish(text, **summary)


def _placed(job: Job, option: str, points: list[Floats], height: float) -> Floats:
    """Points (n, 3) in world space; those of two numbers stand at a height above the ground."""
    placed = np.array([point if len(point) == 3 else _with_up(point, job.arguments.up) for point in points])
    standing = np.array([len(point) == 2 for point in points])
    placed[standing] = above_ground(job.scene, placed[standing], height, job.up)
    lost = np.isnan(placed).any(axis=1)
    if lost.any():
        raise Usage(f"{option}: there is no ground at {','.join(f'{x:g}' for x in points[int(np.argmax(lost))])}")
    return placed


def _with_up(point: Floats, up: str) -> Floats:
    """Two horizontal numbers as a point: x and z where y is up, else x and y."""
    return np.array([point[0], 0.0, point[1]] if up == "y" else [point[0], point[1], 0.0])


def _lines(observers: Floats, targets: Floats, seen: NDArray[np.bool_]) -> tuple[str, dict[str, Any]]:
    rows = [f"observer {i} target {j}: {'seen' if seen[i, j] else 'hidden'}" for i in range(len(observers)) for j in range(len(targets))]
    return "\n".join([f"{seen.sum()} of {seen.size} lines of sight are free", *rows]), {
        "observers": observers, "targets": targets, "seen": seen, "rays": seen.size,
    }


def _bake(job: Job, at: SurfacePoints, observers: Floats, seen: NDArray[np.bool_]) -> tuple[str, dict[str, Any]]:
    count = seen.sum(axis=0)
    share = (count / len(observers)).astype(np.float32)
    if job.arguments.output:
        color = _UNSEEN + (_SEEN - _UNSEEN) * share.astype(np.float64)[:, None]
        write_values(job.arguments.output, at.mesh, "seen", share, color)
    if job.arguments.picture:
        def color_of(hits: Seen) -> Floats:
            weight = at.mesh.interpolated(share.astype(np.float64), hits.instance, hits.triangle, hits.u, hits.v)
            return _UNSEEN + (_SEEN - _UNSEEN) * weight[:, None]

        seen_keys = [("seen", _SEEN)] if len(observers) == 1 else [("seen by all", _SEEN), ("by some", 0.5 * (_SEEN + _UNSEEN))]
        _draw(job, at, color_of, observers, [*seen_keys, ("hidden", _UNSEEN), ("observer", _OBSERVER)])
    by_any = float((count > 0).mean())
    return f"{len(share)} vertices, {100 * by_any:.1f} % seen by {len(observers)} observer{'s' * (len(observers) > 1)}", {
        "observers": observers, "points": len(share), "points_seen": int((count > 0).sum()),
        "points_seen_by_each": seen.sum(axis=1), "rays": seen.size,
    }


def _draw_lines(job: Job, at: SurfacePoints, observers: Floats, targets: Floats, seen: NDArray[np.bool_]) -> None:
    if not job.arguments.picture:
        return
    ends = [(observer, target, seen[i, j]) for i, observer in enumerate(observers) for j, target in enumerate(targets)]
    keys = [("seen", _SEEN), ("hidden", _BLOCKED), ("observer", _OBSERVER)]
    _draw(job, at, lambda hits: np.broadcast_to([0.62, 0.64, 0.62], (len(hits.u), 3)), observers, keys, ends)


def _draw(job: Job, at: SurfacePoints, color: Any, observers: Floats, keys: Any, lines: Any = ()) -> None:
    """The scene, lines of sight, and dots for observers and ends of lines."""
    camera = job.camera(np.concatenate([at.mesh.vertices, observers]))
    picture = render(job.scene, camera, color, up=job.up, strength=0.8, threads=job.threads, progress=job.progress)
    for start, end, free in lines:
        draw_line(picture, camera, start, end, quantized(_SEEN if free else _BLOCKED))
    white, red = quantized(np.ones(3)), quantized(_OBSERVER)
    for points, ink in ((np.array([end for _, end, _ in lines]), quantized(_BLOCKED)), (observers, red)):
        if len(points):
            draw_points(picture, camera, points, np.tile(white, (len(points), 1)), 5.5)
            draw_points(picture, camera, points, np.tile(ink, (len(points), 1)), 4.0)
    save(job.arguments.picture, with_keys(picture, keys))
