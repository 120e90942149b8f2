"""Pinhole cameras."""

import math
from dataclasses import dataclass

import numpy as np

from .._scene import Scene
from ._arithmetic import Floats, dot, unit

#: Sine of the angle between two unit vectors below which their rounding decides its direction.
STRAIGHT = 1e-9
#: Share of the width or height of the picture that a model fills.
_FILLED = 0.9
#: Shares of a low-discrepancy sequence in three dimensions (R3).
_STEPS = np.array([0.8191725133961645, 0.6710436067037893, 0.5497004779019703])
UP = {"x": np.array([1.0, 0.0, 0.0]), "y": np.array([0.0, 1.0, 0.0]), "z": np.array([0.0, 0.0, 1.0])}


@dataclass(frozen=True)
class Camera:
    """A pinhole camera in world space.

    eye: (3,). right, up, forward: an orthonormal basis, the last along the view.
    half: (2,), half the width and height of the picture at distance 1.
    size: (width, height) in pixels.
    """

    eye: Floats
    right: Floats
    up: Floats
    forward: Floats
    half: Floats
    size: tuple[int, int]

    @staticmethod
    def looking(eye: Floats, forward: Floats, up: Floats, size: tuple[int, int], field: float) -> "Camera":
        """A camera that looks along `forward` with `up` upright in the picture. field: the vertical field of view in degrees."""
        forward = unit(forward)
        side = np.cross(forward, up)
        # Straight up or down every perpendicular direction can be `right`.
        if np.sqrt(dot(side, side)) < STRAIGHT:
            side = np.cross(forward, np.eye(3)[int(np.argmin(np.abs(forward)))])
        right = unit(side)
        half = math.tan(math.radians(field) / 2)
        return Camera(eye, right, np.cross(right, forward), forward, np.array([half * size[0] / size[1], half]), size)

    @staticmethod
    def around(
        points: Floats, yaw: float, pitch: float, up: str, size: tuple[int, int], field: float = 32.0, zoom: float = 1.0
    ) -> "Camera":
        """A camera outside of points (n, 3), placed so that they fill the picture.

        yaw, pitch: degrees around the points, from their front, and above the horizon. up: 'y' (front at +z) or 'z' (front at -y).
        """
        front = UP["z"] if up == "y" else -UP["y"]
        around, above = math.radians(yaw), math.radians(pitch)
        towards = (UP["x"] * math.sin(around) + front * math.cos(around)) * math.cos(above) + UP[up] * math.sin(above)
        center = 0.5 * (points.min(axis=0) + points.max(axis=0))
        camera = Camera.looking(center, -towards, UP[up], size, field)
        relative = points - center
        x, y, z = (dot(relative, axis) for axis in (camera.right, camera.up, camera.forward))
        # With the eye at (a, b, -d) a point is in the picture when |x - a| <= (z + d) t; the extremes of x -+ z t give a and the least d.
        tangents = camera.half * _FILLED
        high = np.array([(p - t * z).max() for p, t in zip((x, y), tangents)])
        low = np.array([(-p - t * z).max() for p, t in zip((x, y), tangents)])
        distance, shift = float(((high + low) / (2 * tangents)).max()), (high - low) / 2
        eye = center + camera.right * shift[0] + camera.up * shift[1] - camera.forward * distance
        return Camera(eye, camera.right, camera.up, camera.forward, camera.half / zoom, size)

    @staticmethod
    def inside(scene: Scene, up: str, size: tuple[int, int], field: float = 60.0, zoom: float = 1.0) -> "Camera":
        """A camera inside of a room: where most directions end at a surface, far from the nearest, with a view of the deepest corner."""
        low, high = (np.zeros(3), np.zeros(3)) if scene.bounds is None else scene.bounds.astype(np.float64)
        # Evenly spread, in height between a quarter and six tenths, as the eyes of who stands in a room.
        shares = (np.arange(1, 257)[:, None] * _STEPS) % 1.0 * 0.8 + 0.1
        shares[:, np.argmax(UP[up])] = 0.25 + 0.35 * (shares[:, np.argmax(UP[up])] - 0.1) / 0.8
        eyes = low + shares * (high - low)
        heights, turns = (np.arange(64) + 0.5) / 32 - 1, np.arange(64) * math.pi * (3 - math.sqrt(5))
        around = np.sqrt(1 - heights**2)
        directions = np.stack([around * np.cos(turns), around * np.sin(turns), heights], axis=-1)
        enclosed = scene.any(eyes[:, None], directions).mean(axis=1)
        best = int(np.lexsort((scene.closest(eyes).distance, np.round(enclosed * 8)))[-1])
        # Slightly down, all around.
        level, turns = np.tile(-0.15 * UP[up], (64, 1)), np.arange(64) * math.tau / 64
        level[:, np.nonzero(UP[up] == 0)[0]] = np.stack([np.cos(turns), np.sin(turns)], axis=-1)
        t = scene.nearest(eyes[best], level).t
        forward = level[int(np.argmax(np.where(np.isfinite(t), t, 0)))]
        camera = Camera.looking(eyes[best], forward, UP[up], size, field)
        return Camera(camera.eye, camera.right, camera.up, camera.forward, camera.half / zoom, size)

    def directions(self, x: Floats, y: Floats) -> Floats:
        """Directions (..., 3) through places of the picture in pixels, from its upper left corner."""
        across = (2 * x / self.size[0] - 1) * self.half[0]
        upwards = (1 - 2 * y / self.size[1]) * self.half[1]
        return self.forward + across[..., None] * self.right + upwards[..., None] * self.up

    def project(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """Places of points (..., 3) in the picture, in pixels from its upper left corner, and distances along the view; NaN behind."""
        relative = points - self.eye
        depth = dot(relative, self.forward)
        depth = np.where(depth > 0, depth, np.nan)
        x = (dot(relative, self.right) / depth / self.half[0] + 1) * self.size[0] / 2
        y = (1 - dot(relative, self.up) / depth / self.half[1]) * self.size[1] / 2
        return x, y, depth
