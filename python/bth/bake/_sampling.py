"""Directions of rays: a low-discrepancy sequence in the unit square, shifted for each point by a hash of its number, and maps to directions.

The sequence depends on the seed and on the numbers of point and ray only, so neither threads nor the order of work change it.
"""

import numpy as np
from numpy.typing import NDArray

from ._arithmetic import Floats, turn

#: The R2 sequence of Roberts ("The unreasonable effectiveness of quasirandom sequences", 2018).
_STEP = (0.7548776662466928, 0.5698402909980533)


def mix(x: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """A bijection of 64 bits that scatters them: the finalizer of SplitMix64 (Steele, Lea and Flood 2014)."""
    with np.errstate(over="ignore"):
        x = x + np.uint64(0x9E3779B97F4A7C15)
        x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        return x ^ (x >> np.uint64(31))


def hashed(seed: int, numbers: NDArray[np.int64]) -> NDArray[np.uint64]:
    """64 bits for each number."""
    return mix(np.asarray(numbers).astype(np.uint64) ^ mix(np.full(1, seed % (1 << 64), np.uint64)))


def uniform(seed: int, numbers: NDArray[np.int64]) -> Floats:
    """For each number one from 0 to 1, both excluded."""
    return ((hashed(seed, numbers) >> np.uint64(12)).astype(np.float64) + 0.5) * 2.0**-52


def squares(seed: int, points: NDArray[np.int64], rays: int) -> tuple[Floats, Floats]:
    """For each point `rays` points of the unit square, each coordinate (points, rays), in [0, 1).

    Each point's sequence is shifted by its own offset (Cranley and Patterson 1976), which keeps its discrepancy and makes the errors of
    neighbouring points independent.
    """
    bits = hashed(seed, points)
    shifts = (bits >> np.uint64(32)).astype(np.float64) * 2.0**-32, (bits & np.uint64(0xFFFFFFFF)).astype(np.float64) * 2.0**-32
    index = np.arange(rays, dtype=np.float64)
    x, y = ((shift[:, None] + step * index) for shift, step in zip(shifts, _STEP))
    return x - np.floor(x), y - np.floor(y)


def around(axes: Floats, cosine: Floats, share: Floats) -> Floats:
    """Unit directions (n, rays, 3) at angles with this cosine to unit axes (n, 3), turned about them by a share of a full turn.

    The basis is that of Duff and others ("Building an orthonormal basis, revisited", JCGT 2017).
    """
    x, y, z = (axes[:, k, None] for k in range(3))
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    tangent = (1.0 + sign * x * x * a, sign * b, -sign * x)
    bitangent = (b, sign + y * y * a, -y)
    c, s = turn(share)
    sine = np.sqrt(np.maximum(0.0, 1.0 - cosine * cosine))
    right, up = sine * c, sine * s
    return np.stack([right * t + up * p + cosine * n for t, p, n in zip(tangent, bitangent, (x, y, z))], axis=-1)


def hemisphere(normals: Floats, seed: int, points: NDArray[np.int64], rays: int) -> Floats:
    """Unit directions (n, rays, 3) around unit normals, with a density proportional to the cosine of the angle to them."""
    u, v = squares(seed, points, rays)
    return around(normals, np.sqrt(1.0 - u), v)


def cone(axes: Floats, half_angle_cosine: float, seed: int, points: NDArray[np.int64], rays: int) -> tuple[Floats, Floats]:
    """Unit directions (n, rays, 3) evenly within cones around unit axes, and the cosines (n, rays) of their angles to these."""
    u, v = squares(seed, points, rays)
    cosine = 1.0 - u * (1.0 - half_angle_cosine)
    return around(axes, cosine, v), cosine
