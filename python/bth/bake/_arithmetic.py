"""Functions made of operations that IEEE 754 defines to the last bit, so that bakes are the same on every machine.

numpy's own trigonometric functions may differ in the last bit between its versions, systems and instruction sets.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def dot(a: Floats, b: Floats) -> Floats:
    """Scalar products of vectors (..., 3), added from left to right."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def unit(vectors: Floats) -> Floats:
    """Vectors (..., 3) of length 1; zeros stay zeros. Nothing overflows or underflows, however long they are."""
    largest = np.abs(vectors).max(axis=-1, keepdims=True, initial=0.0)
    scaled = vectors / np.where(largest > 0, largest, 1.0)
    length = np.sqrt(dot(scaled, scaled))[..., None]
    return scaled / np.where(length > 0, length, 1.0)


def turn(share: Floats) -> tuple[Floats, Floats]:
    """Cosine and sine of shares of a full turn from 0 to 1, to within 1e-15."""
    quarter = np.floor(4.0 * share + 0.5)
    angle = (share - 0.25 * quarter) * (2.0 * np.pi)
    square = angle * angle
    # Taylor's series up to the 17th power: the angle is at most pi / 4.
    sine, cosine = np.ones_like(angle), np.ones_like(angle)
    for power in range(7, -1, -1):
        sine = 1.0 - square / ((2 * power + 2) * (2 * power + 3)) * sine
        cosine = 1.0 - square / ((2 * power + 1) * (2 * power + 2)) * cosine
    sine = sine * angle
    quarter = quarter.astype(np.int64) % 4
    x = np.choose(quarter, (cosine, -sine, -cosine, sine))
    y = np.choose(quarter, (sine, cosine, -sine, -cosine))
    return x, y


def arctangent(x: Floats) -> Floats:
    """The arctangent of numbers from 0 to infinity, in radians, to within 1e-15."""
    inverted = x > 1.0
    with np.errstate(divide="ignore"):
        x = np.where(inverted, 1.0 / np.where(x > 0, x, 1.0), x)
    # Halving the angle twice leaves at most tan(pi / 16), where few terms of the series are enough.
    for _ in range(2):
        x = x / (1.0 + np.sqrt(1.0 + x * x))
    square, series = x * x, np.zeros_like(x)
    for k in range(12, -1, -1):
        series = 1.0 / (2 * k + 1) - square * series
    angle = 4.0 * x * series
    return np.where(inverted, 0.5 * np.pi - angle, angle)


def angle_between(a: Floats, b: Floats) -> Floats:
    """Angles in radians between unit vectors (..., 3): twice the arctangent of |a - b| / |a + b|."""
    below, above = a - b, a + b
    numerator, denominator = np.sqrt(dot(below, below)), np.sqrt(dot(above, above))
    with np.errstate(divide="ignore", invalid="ignore"):
        return 2.0 * arctangent(np.where(denominator > 0, numerator / np.where(denominator > 0, denominator, 1.0), np.inf))
