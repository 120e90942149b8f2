"""python -m bth ao: ambient occlusion."""

import argparse
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._command import Usage
from .._arithmetic import Floats
from .._colors import GRAY, colors, quantized
from .._occlusion import SIDES, ambient_occlusion
from .._picture import Seen, render, save, with_color_bar
from .._progress import Bar
from .._surface import SurfacePoints, at_vertices
from .._texels import Texels, at_texels, texture_coordinates
from ._options import Job, add_parser, number, size, whole
from ._vertices import color_of_vertices, require_surface, write_values


#: Dark enough that open surfaces, which are white, stand out.
_DARK = np.array([0.30, 0.33, 0.37]), np.array([0.42, 0.44, 0.47])


def add_to(commands: Any) -> None:
    parser = add_parser(commands, "ao", "ambient occlusion to vertex colours (.ply, .npy) or to a texture (.png)", _run)
    parser.add_argument("--rays", type=whole(1, 1 << 20), default=64, metavar="N", help="rays for each point (64)")
    parser.add_argument(
        "--distance", type=number(above=0, infinite=True), default=np.inf, metavar="D", help="how far occluders count, in world units (inf)"
    )
    parser.add_argument("--side", choices=list(SIDES), default="front", help="of the triangles (front)")
    parser.add_argument("--seed", type=whole(0), default=0, metavar="N", help="of the directions (0)")
    texture = parser.add_argument_group("texture")
    texture.add_argument("--texture", type=size, default=(1024, 1024), metavar="WxH", help="size of the texture (1024x1024)")
    texture.add_argument("--border", type=whole(0, 4096), default=4, metavar="N", help="texels to continue the colours by (4)")
    texture.add_argument("--v-up", choices=["yes", "no"], help="whether v is 0 at the bottom; by default for all but glTF")


def _run(arguments: argparse.Namespace) -> None:
    if not (arguments.output or arguments.picture):
        raise Usage("ao: expected -o FILE or --picture FILE.png")
    as_texture = (arguments.output or "").lower().endswith(".png")
    with Bar(quiet=arguments.quiet) as bar:
        job = Job(arguments, (".ply", ".npy", ".png"), bar, attributes="all" if as_texture else None)
        summary = _bake_texture(job) if as_texture else _bake_vertices(job)
    job.finish(f"{summary['points']} points, {summary['mean']:.3f} open on average", **summary)


def _occlusion(job: Job, at: SurfacePoints) -> NDArray[np.float32]:
    options = job.arguments
    return ambient_occlusion(
        job.scene, at, rays=options.rays, distance=options.distance, side=options.side, seed=options.seed, threads=job.threads,
        progress=job.progress,
    )


def _bake_vertices(job: Job) -> dict[str, Any]:
    at = at_vertices(job.scene)
    require_surface(at.mesh)
    values = _occlusion(job, at)
    if job.arguments.output:
        write_values(job.arguments.output, at.mesh, "openness", values, colors(values, GRAY))
    _draw(job, at, color_of_vertices(at.mesh, values, GRAY))
    return _summary(job, values)


def _bake_texture(job: Job) -> dict[str, Any]:
    options = job.arguments
    width, height = options.texture
    v_up = options.v_up == "yes" if options.v_up else not options.model.lower().endswith((".gltf", ".glb"))
    texels = at_texels(job.scene, width, height, v_up=v_up)
    require_surface(texels.points.mesh)
    texture = texels.texture(_occlusion(job, texels.points), options.border)
    save(options.output, quantized(np.nan_to_num(texture, nan=1.0)))
    _draw(job, texels.points, _color_of_texture(job, texels, texture, v_up))
    values = texture[texels.rows, texels.columns]
    return {**_summary(job, values), "texels_shared": texels.shared}


def _color_of_texture(job: Job, texels: Texels, texture: NDArray[np.float32], v_up: bool):
    """A function of the renderer that looks the nearest texels up."""
    mesh, corners = texels.points.mesh, texture_coordinates(job.scene)
    assert corners is not None, "texels have been placed by them"
    height, width = texture.shape

    def color(seen: Seen) -> Floats:
        # Corners are in the order of the mesh's faces, as are the values of vertices that `interpolated` takes.
        flat = corners.reshape(-1, 2)
        u, v = _by_corner(mesh, flat, seen).T
        column = np.floor((u - np.floor(u)) * width).astype(np.int64) % width
        row = np.floor(((1.0 - v if v_up else v) % 1.0) * height).astype(np.int64) % height
        return colors(texture[row, column], GRAY)

    return color


def _by_corner(mesh: Any, values: Floats, seen: Seen) -> Floats:
    """Values (3 m, k) of corners, interpolated at hits."""
    corners = type(mesh)(mesh.vertices, np.arange(len(values)).reshape(-1, 3), mesh.instance, mesh.triangle, mesh._first, mesh.mirrored)
    return corners.interpolated(values, seen.instance, seen.triangle, seen.u, seen.v)


def _draw(job: Job, at: SurfacePoints, color: Any) -> None:
    if job.arguments.picture:
        camera = job.camera(at.mesh.vertices)
        picture = render(
            job.scene, camera, color, up=job.up, strength=0.25, background=_DARK, threads=job.threads, progress=job.progress
        )
        save(job.arguments.picture, with_color_bar(picture, "share of the sky that is open", 0.0, 1.0, GRAY))


def _summary(job: Job, values: NDArray[np.float32]) -> dict[str, Any]:
    known = values[~np.isnan(values)].astype(np.float64)
    return {
        "points": len(values), "points_without_normal": int(np.isnan(values).sum()), "rays": len(known) * job.arguments.rays,
        "mean": float(known.mean()) if len(known) else 0.0, "least": float(known.min(initial=1.0)),
    }
