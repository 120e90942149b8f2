"""Bakers: what surfaces, terrains and rooms are like, computed by rays.

    import bth, bth.bake
    scene = bth.compile("bunny.ply")
    openness = bth.bake.ambient_occlusion(scene)          # one number for each vertex of bth.bake.world_mesh(scene)

All of them are on top of the queries of `bth.Scene`, and all but the pictures need numpy only. Results depend neither on threads nor
on the order of work. `python -m bth ao|thickness|sight|lidar|sdf` are the same as commands. See docs/bakers.md.
"""

from ._lidar import LidarScan, lidar, poses_along
from ._occlusion import ambient_occlusion
from ._ply import write_ply
from ._sight import above_ground, line_of_sight, viewshed
from ._surface import SurfacePoints, WorldMesh, at_vertices, world_mesh
from ._texels import Texels, at_texels
from ._thickness import thickness
from ._volume import Volume, sdf

__all__ = [
    "LidarScan", "SurfacePoints", "Texels", "Volume", "WorldMesh", "above_ground", "ambient_occlusion", "at_texels", "at_vertices", "lidar",
    "line_of_sight", "poses_along", "sdf", "thickness", "viewshed", "world_mesh", "write_ply",
]
