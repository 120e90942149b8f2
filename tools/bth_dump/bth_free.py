"""Free directions (format-spec/README.md, "Free directions"): F168 to F171 and F209."""

import math
from fractions import Fraction

import bth_container as c
import bth_leaves
from bth_container import NONE
from bth_leaves import INDEXED, RAW

ROW = 20
SIDE, BINS = 11, 121
BACK, NEARBY = 1 << 126, 1 << 127
# Squares of the slopes at which columns meet, and of the greatest slope.
BORDERS = tuple(
    Fraction(x)
    for x in (0.020672197824104982, 0.20856091329926152, 0.750830798121458, 2.4212305216220913, 11.598705569133076)
)
STEEPEST = 256
QUICK_BORDERS = tuple(map(float, BORDERS)) + (float(STEEPEST),)
# Triangles from which rays are sent.
STARTS = 64


def check(view):
    """F168, F170 and F171."""
    rows, reach = view.free, view.free_reach
    if len(rows) not in (0, 0 if view.leaf_vertices else view.triangles):
        raise view.invalid("F168", f"{len(rows)} rows", c.FREE_DIRECTIONS)
    if len(reach) != (1 if rows else 0):
        raise view.invalid("F168", f"{len(reach)} rows", c.FREE_REACH)
    for distance, *reserved in reach:
        if any(reserved) or not (distance == 0 or 2.0**-50 <= distance <= 2.0**50):
            raise view.invalid("F171", f"reach {distance}, {reserved}", c.FREE_REACH)
    for triangle, row in enumerate(rows):
        if bits(row) & ~((1 << BINS) - 1 | BACK | NEARBY):
            raise view.invalid("F170", f"{bits(row):#034x}", c.FREE_DIRECTIONS, ROW * triangle + 4)


def bits(row):
    """The 128 bits of a row."""
    return sum(word << 32 * k for k, word in enumerate(row[1:]))


def _code(kind, index, slot):
    """The number of a place; NONE if the index is too large."""
    return NONE if index >= (1 << 27) - 1 else (kind == RAW) << 31 | index << 4 | slot


def placed(view, kind, index):
    """Triangles of a leaf that lie where their rows say."""
    if view.free:
        found = bth_leaves.leaf(view, kind, index)
        for slot in range(found.triangles):
            triangle, place = view.triangle_ids[found.first + slot], _code(kind, index, slot)
            if place != NONE and triangle < len(view.free) and view.free[triangle][0] == place:
                yield triangle


def check_places(view, found):
    """F169; `found` holds the triangles that lie where their rows say."""
    for triangle, row in enumerate(view.free):
        if bits(row) if row[0] == NONE else triangle not in found:
            raise view.invalid("F169", f"place {row[0]:#x}", c.FREE_DIRECTIONS, ROW * triangle)


def _minus(p, q):
    return [x - y for x, y in zip(p, q)]


def _dot(p, q):
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


def _cross(p, q):
    return [p[(k + 1) % 3] * q[(k + 2) % 3] - p[(k + 2) % 3] * q[(k + 1) % 3] for k in range(3)]


def in_integers(points):
    """Points times a power of two, so that all coordinates are integers; and that power."""
    scale = max((x.as_integer_ratio()[1] for p in points for x in p), default=1)
    return [[int(x * scale) for x in p] for p in points], scale


def axes(corners, scale):
    """The axes of a triangle with integer corners, exactly but for their lengths; None if it has none."""
    a, b, last = corners
    first, second = _minus(b, a), _minus(last, a)
    normal, edges = _cross(first, second), [_dot(e, e) for e in (first, second)]
    if not all(scale**2 <= e << 40 and e <= scale**2 << 40 for e in edges):
        return None
    if _dot(normal, normal) * (1 << 14) < edges[0] * edges[1]:
        return None
    return first, _cross(normal, first), normal


def bin_of(axes_, direction):
    """The bin of a direction of integers and whether it points to the back; None if it is too steep."""
    x, y, z = (_dot(direction, axis) for axis in axes_)
    if z == 0:
        return None
    # The square of a slope is (part^2 / axis^2) / (z^2 / normal^2).
    normal = _dot(axes_[2], axes_[2])
    columns = []
    for part, axis in ((x, axes_[0]), (y, axes_[1])):
        over, under = part * part * normal, _dot(axis, axis) * z * z
        if over > STEEPEST * under:
            return None
        beyond = sum(over * border.denominator > border.numerator * under for border in BORDERS)
        columns.append(SIDE // 2 - beyond if part < 0 else SIDE // 2 + beyond)
    return SIDE * columns[1] + columns[0], z < 0


def quick_bin(axes_, direction):
    """As `bin_of`, in floating point; `Ellipsis` where that does not decide.

    Normals are at least 2^-7 of the product of their edges (`axes`), so that products in f64 are off by less than 1e-10 of the
    lengths. What is within 1e-6 of a border is left to exact arithmetic.
    """
    parts = [_dot(direction, axis) / math.sqrt(_dot(axis, axis)) for axis in axes_]
    length = math.sqrt(_dot(direction, direction))
    if not abs(parts[2]) > 1e-6 * length:
        return ...
    columns = []
    for part in parts[:2]:
        square = (part / parts[2]) ** 2
        if any(abs(square - border) <= 1e-6 * border for border in QUICK_BORDERS) or abs(part) <= 1e-6 * length:
            return ...
        if square > STEEPEST:
            return None
        beyond = sum(square > border for border in QUICK_BORDERS[:-1])
        columns.append(SIDE // 2 - beyond if part < 0 else SIDE // 2 + beyond)
    return SIDE * columns[1] + columns[0], parts[2] < 0


def check_met(view, corners, side):
    """F210; F209 for rays from corners of some triangles to the middles of all others.

    `corners` are those of all triangles in leaves, `side` is the sign of a volume.
    """
    if not view.free:
        return
    points, scale = in_integers([p for triangle in corners.values() for p in triangle])
    integers = {triangle: points[3 * k : 3 * k + 3] for k, triangle in enumerate(corners)}
    starts = {}
    for triangle, row in enumerate(view.free):
        if row[0] != NONE:
            starts[triangle] = axes(integers[triangle], scale)
            if starts[triangle] is None:
                raise view.invalid("F210", f"{corners[triangle]}", c.FREE_DIRECTIONS, ROW * triangle)
    # Of three times a direction of integers.
    reach = 3 * scale * Fraction(view.free_reach[0][0])
    for start in range(0, len(view.free), max(1, -(-len(view.free) // STARTS))):
        if start not in starts:
            continue
        quick = [[x / scale**power for x in axis] for axis, power in zip(starts[start], (1, 3, 2))]
        known = starts[start], quick, bits(view.free[start]), reach * reach
        origins = list(zip(corners[start], integers[start]))
        for other, target in corners.items():
            if other != start and any(_is_met(known, p, (target, integers[other]), side) for p in origins):
                raise view.invalid("F209", f"triangle {start} meets {other}", c.FREE_DIRECTIONS, ROW * start)


def _is_free(found, free):
    """Whether a bin, and the side that it is on, is called free."""
    return bool(free >> found[0] & 1) and found[1] == bool(free & BACK)


def _is_met(known, origin, target, side):
    """Whether the ray from a point through the middle of a triangle meets it in a direction that is called free.

    Point and triangle are given as they are and in integers.
    """
    axes_, quick, free, reach_squared = known
    (start, exact_start), (corners, (a, b, last)) = origin, target
    near = [(corners[0][k] + corners[1][k] + corners[2][k]) / 3 - start[k] for k in range(3)]
    found = quick_bin(quick, near)
    if found is None or found is not ... and not _is_free(found, free):
        return False
    direction = [a[k] + b[k] + last[k] - 3 * exact_start[k] for k in range(3)]
    found = bin_of(axes_, direction) if any(direction) else None
    if found is None or not _is_free(found, free):
        return False
    if free & NEARBY and _dot(direction, direction) > reach_squared:
        return False
    # The middle is met, unless the ray lies in the plane.
    return side(*corners, start) != 0
