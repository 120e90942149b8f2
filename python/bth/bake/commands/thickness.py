"""python -m bth thickness: how thick solids are."""

import argparse
from typing import Any

import numpy as np

from ..._command import Usage
from .._colors import WARM_TO_COLD, colors, scale
from .._picture import render, save, with_color_bar
from .._progress import Bar
from .._surface import at_vertices
from .._thickness import REDUCTIONS, thickness
from ._options import Job, add_parser, number, whole
from ._vertices import color_of_vertices, require_surface, write_values


def add_to(commands: Any) -> None:
    parser = add_parser(commands, "thickness", "how thick solids are below their surface, to vertex colours (.ply, .npy)", _run)
    parser.add_argument("--rays", type=whole(1, 1 << 20), default=32, metavar="N", help="rays for each vertex (32)")
    parser.add_argument("--angle", type=number(0, high=89.9), default=60.0, metavar="DEGREES", help="half the opening of the cone (60)")
    parser.add_argument("--reduce", choices=REDUCTIONS, default="median", help="how the lengths become one number (median)")
    parser.add_argument("--seed", type=whole(0), default=0, metavar="N", help="of the directions (0)")
    parser.add_argument("--scale", type=number(above=0), metavar="D", help="upper end of the colours (99th percentile)")


def _run(arguments: argparse.Namespace) -> None:
    if not (arguments.output or arguments.picture):
        raise Usage("thickness: expected -o FILE or --picture FILE.png")
    with Bar(quiet=arguments.quiet) as bar:
        job = Job(arguments, (".ply", ".npy"), bar)
        at = at_vertices(job.scene)
        require_surface(at.mesh)
        values = thickness(
            job.scene, at, rays=arguments.rays, angle=arguments.angle, reduce=arguments.reduce, seed=arguments.seed, threads=job.threads,
            progress=job.progress,
        )
        low, high = scale(values, 0.0, arguments.scale)
        if arguments.output:
            color = colors((values.astype(np.float64) - low) / (high - low), WARM_TO_COLD)
            write_values(arguments.output, at.mesh, "thickness", values, color)
        if arguments.picture:
            color_of = color_of_vertices(at.mesh, values, WARM_TO_COLD, low, high)
            camera = job.camera(at.mesh.vertices)
            picture = render(job.scene, camera, color_of, up=job.up, strength=0.6, threads=job.threads, progress=job.progress)
            title = f"thickness ({arguments.reduce})"
            save(arguments.picture, with_color_bar(picture, title, low, high, WARM_TO_COLD))
    known = values[~np.isnan(values)].astype(np.float64)
    median, least = (float(np.median(known)), float(known.min())) if len(known) else (float("nan"), float("nan"))
    job.finish(
        f"{len(values)} vertices, median {median:.4g}", points=len(values), points_without_thickness=int(np.isnan(values).sum()),
        rays=int(at.usable.sum()) * arguments.rays, median=median, least=least, closed=at.mesh.closed(),
    )
