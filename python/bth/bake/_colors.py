"""Colour maps: numbers from 0 to 1 become colours (sRGB, from 0 to 1)."""

import numpy as np
from numpy.typing import NDArray

from ._arithmetic import Floats

#: Viridis (Smith and van der Walt 2015) at nine stops: dark violet over green to yellow, brighter all the way.
VIRIDIS = np.array([
    [0.267, 0.005, 0.329], [0.279, 0.175, 0.483], [0.230, 0.322, 0.546], [0.173, 0.449, 0.558], [0.128, 0.567, 0.551],
    [0.158, 0.684, 0.502], [0.369, 0.789, 0.383], [0.678, 0.864, 0.190], [0.993, 0.906, 0.144],
])
#: From thin, dark red, over orange and pale yellow to thick, blue.
WARM_TO_COLD = np.array([[0.55, 0.02, 0.13], [0.84, 0.19, 0.15], [0.96, 0.51, 0.28], [0.99, 0.82, 0.51], [0.95, 0.95, 0.80],
                         [0.67, 0.85, 0.86], [0.40, 0.65, 0.80], [0.20, 0.40, 0.65]])
#: From far inside, blue, over white at the surface to far outside, orange.
INSIDE_TO_OUTSIDE = np.array([[0.02, 0.19, 0.42], [0.16, 0.44, 0.70], [0.55, 0.76, 0.88], [0.97, 0.97, 0.97],
                              [0.99, 0.80, 0.60], [0.90, 0.52, 0.25], [0.62, 0.26, 0.06]])
GRAY = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]])
#: What has no number.
NOTHING = np.array([0.85, 0.20, 0.75])


def colors(values: NDArray[np.floating], stops: Floats) -> Floats:
    """Colours (..., 3) of values (...), clamped to 0 to 1; NOTHING for NaN."""
    values = np.asarray(values, np.float64)
    at = np.clip(np.nan_to_num(values), 0.0, 1.0) * (len(stops) - 1)
    low = np.minimum(at.astype(np.int64), len(stops) - 2)
    mixed = stops[low] + (stops[low + 1] - stops[low]) * (at - low)[..., None]
    return np.where(np.isnan(values)[..., None], NOTHING, mixed)


def quantized(color: Floats) -> NDArray[np.uint8]:
    """Colours from 0 to 1 as bytes."""
    return np.floor(np.clip(color, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)


def to_linear(color: Floats) -> Floats:
    """sRGB to linear."""
    return np.where(color <= 0.04045, color / 12.92, ((np.maximum(color, 0.0) + 0.055) / 1.055) ** 2.4)


def to_srgb(color: Floats) -> Floats:
    """Linear to sRGB."""
    return np.where(color <= 0.0031308, color * 12.92, 1.055 * np.maximum(color, 0.0031308) ** (1 / 2.4) - 0.055)


def scale(values: NDArray[np.floating], low: float | None = None, high: float | None = None) -> tuple[float, float]:
    """The range of a colour map: what is not given is the 1st or 99th percentile of the values, so that single ones do not hide the rest."""
    known = np.asarray(values, np.float64)
    known = known[np.isfinite(known)]
    ends = np.percentile(known, [1, 99]) if len(known) else np.array([0.0, 1.0])
    low, high = float(ends[0]) if low is None else low, float(ends[1]) if high is None else high
    return (low, high) if high > low else (low, low + (abs(low) or 1.0))
