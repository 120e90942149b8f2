"""Pictures: a small renderer on top of `Scene.nearest`, points and lines over it, and legends. Writing them needs Pillow."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .._scene import Scene
from ._arithmetic import Floats, dot, unit
from ._camera import Camera
from ._colors import colors, quantized, to_linear, to_srgb
from ._files import write_whole
from ._progress import Progress, chunks

#: Samples of a pixel along each axis.
_SAMPLES = 3
_TOP, _BOTTOM = np.array([0.62, 0.66, 0.71]), np.array([0.90, 0.91, 0.92])
_INK = (30, 34, 40)


def pillow():
    """The module PIL.Image, or an ImportError that says how to get it."""
    try:
        from PIL import Image
    except ImportError:
        raise ImportError("pictures and textures are written by Pillow (hint: pip install pillow)") from None
    return Image


@dataclass(frozen=True)
class Seen:
    """What rays of the camera hit: (n,) arrays as those of `bth.Hits`, without misses."""

    u: NDArray[np.float32]
    v: NDArray[np.float32]
    instance: NDArray[np.uint32]
    triangle: NDArray[np.uint32]
    normal: Floats


def shaded(base: Floats, normals: Floats, camera: Camera, up: Floats, strength: float) -> Floats:
    """Linear colours of a matte material under a key light from the left of the camera and a fill light, on both of its sides.

    strength: 0 leaves the colours as they are, 1 shades fully.
    """
    facing = np.where(dot(normals, camera.forward)[..., None] > 0, -normals, normals)
    key = unit(-0.5 * camera.forward - 0.6 * camera.right + 0.8 * up)
    fill = unit(-0.6 * camera.forward + 0.8 * camera.right)
    light = 0.38 + 0.62 * np.maximum(0.0, dot(facing, key)) + 0.16 * np.maximum(0.0, dot(facing, fill))
    return base * (1.0 - strength + strength * light[..., None])


def render(
    scene: Scene, camera: Camera, color: Callable[[Seen], Floats], *, up: Floats, strength: float = 1.0,
    background: tuple[Floats, Floats] = (_TOP, _BOTTOM), threads: int | None = None, progress: Progress | None = None,
) -> NDArray[np.uint8]:
    """A picture (height, width, 3) of a scene.

    color: the colours (n, 3), sRGB from 0 to 1, of hits. strength: of the shading. background: colours of its top and bottom.
    """
    width, height = camera.size
    offsets = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    x = (np.arange(width)[:, None] + offsets).reshape(-1)
    picture = np.empty((height, width, 3))
    for part in chunks(height, len(x) * _SAMPLES, "picture", progress):
        y = (np.arange(height)[part, None] + offsets).reshape(-1)
        directions = camera.directions(*np.meshgrid(x, y))
        hits = scene.nearest(camera.eye, directions, threads=threads)
        share = (y / height)[:, None, None]
        linear = np.broadcast_to(to_linear(background[0] * (1 - share) + background[1] * share), directions.shape).copy()
        hit = hits.hit
        if hit.any():
            some = Seen(hits.u[hit], hits.v[hit], hits.instance[hit], hits.triangle[hit], hits.normal[hit])
            linear[hit] = shaded(to_linear(color(some)), some.normal, camera, up, strength)
        rows = len(y) // _SAMPLES
        picture[part] = to_srgb(linear.reshape(rows, _SAMPLES, width, _SAMPLES, 3).mean(axis=(1, 3)))
    return quantized(picture)


def draw_points(picture: NDArray[np.uint8], camera: Camera, points: Floats, color: NDArray[np.uint8], radius: float = 0.8) -> None:
    """Draws points (n, 3) with colours (n, 3) as discs of a radius in pixels, the nearest last."""
    x, y, depth = camera.project(points)
    order = np.argsort(-np.nan_to_num(depth, nan=np.inf), kind="stable")
    order = order[np.isfinite(depth[order])]
    reach, (height, width) = math.ceil(radius), picture.shape[:2]
    for dy in range(-reach, reach + 1):
        for dx in range(-reach, reach + 1):
            column, row = np.floor(x[order]) + dx, np.floor(y[order]) + dy
            near = np.hypot(column + 0.5 - x[order], row + 0.5 - y[order]) <= radius
            inside = near & (column >= 0) & (column < width) & (row >= 0) & (row < height)
            picture[row[inside].astype(np.int64), column[inside].astype(np.int64)] = color[order[inside]]


def save(path: str, picture: NDArray[np.uint8]) -> None:
    """Writes a picture (height, width) or (height, width, 3) as PNG; it appears whole or not at all."""
    image = pillow().fromarray(picture)
    write_whole(path, lambda file: image.save(file, "PNG", optimize=True))


#: Bound of the rounding of a multiple of a step, relative to the step.
ROUNDING = 1e-9


def ticks(low: float, high: float) -> list[float]:
    """About five round numbers from low to high."""
    step = 10.0 ** math.floor(math.log10((high - low) / 4))
    step *= next(m for m in (1, 2, 2.5, 5, 10) if (high - low) / (m * step) <= 5)
    first = math.ceil(low / step - ROUNDING)
    return [(first + i) * step for i in range(int((high - low) / step) + 2) if (first + i) * step <= high + ROUNDING * step]


def with_color_bar(picture: NDArray[np.uint8], title: str, low: float, high: float, stops: Floats) -> NDArray[np.uint8]:
    """The picture with a colour bar, its numbers and a title in a strip below it."""
    from PIL import ImageDraw, ImageFont

    strip, text, font = _strip(picture), 12, ImageFont.load_default(12)
    height, width = picture.shape[:2]
    image = pillow().fromarray(strip)
    draw = ImageDraw.Draw(image)
    draw.text((10, height + 8), title, fill=_INK, font=font)
    left, right = min(20 + int(draw.textlength(title, font=font)), width // 2), width - 24
    bar = colors(np.linspace(0, 1, max(2, right - left)), stops)
    for x, shade in zip(range(left, right), quantized(bar)):
        draw.line([(x, height + 9), (x, height + 9 + text)], fill=tuple(int(c) for c in shade))
    for tick in ticks(low, high):
        x = left + (tick - low) / (high - low) * (right - 1 - left)
        draw.line([(x, height + 21), (x, height + 25)], fill=_INK)
        draw.text((x, height + 26), f"{tick:.4g}", fill=_INK, font=font, anchor="ma")
    return np.asarray(image)


def with_keys(picture: NDArray[np.uint8], keys: Sequence[tuple[str, Sequence[float]]]) -> NDArray[np.uint8]:
    """The picture with a strip below it that names colours (sRGB from 0 to 1)."""
    from PIL import ImageDraw, ImageFont

    image, font = pillow().fromarray(_strip(picture)), ImageFont.load_default(12)
    draw, height, x = ImageDraw.Draw(image), picture.shape[0], 10
    for name, color in keys:
        draw.rectangle([x, height + 15, x + 11, height + 26], fill=tuple(int(c) for c in quantized(np.asarray(color))), outline=_INK)
        draw.text((x + 18, height + 13), name, fill=_INK, font=font)
        x += 40 + int(draw.textlength(name, font=font))
    return np.asarray(image)


def _strip(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The picture with a pale strip of 42 pixels below it."""
    return np.concatenate([picture, np.full((42, picture.shape[1], 3), 245, np.uint8)])


def draw_line(picture: NDArray[np.uint8], camera: Camera, start: Floats, end: Floats, color: NDArray[np.uint8]) -> None:
    """Draws a line of 2 pixels between points in world space; what is behind the camera is left out."""
    steps = np.linspace(0.0, 1.0, 4 * sum(picture.shape[:2]))[:, None]
    points = start + steps * (end - start)
    draw_points(picture, camera, points, np.tile(color, (len(points), 1)), 1.0)
