"""Free directions and distances (format-spec/README.md, "Free directions"): F168, F170 to F172, F209 and F210."""

import math
from fractions import Fraction

import bth_container as c
from bth_container import NONE

SIDE, BINS = 11, 121
BACK = 1 << 126
# For each column of bins that of its sector, and the same for rows.
SECTOR_OF = (None, 0, 0, 1, 1, 1, 2, 2, 3, 3, None)
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
    """F168 and F170 to F172."""
    directions, distances, levels = view.free, view.free_distances, view.free_levels
    rows = 0 if view.leaf_vertices else view.triangles
    if len(directions) not in (0, rows):
        raise view.invalid("F168", f"{len(directions)} rows", c.FREE_DIRECTIONS)
    if len(distances) not in (0, 0 if directions else rows):
        raise view.invalid("F168", f"{len(distances)} rows", c.FREE_DISTANCES)
    if len(levels) != (1 if directions or distances else 0):
        raise view.invalid("F168", f"{len(levels)} rows", c.FREE_LEVELS)
    for *of, reserved in levels:
        is_ascending = 2.0**-50 <= of[0] < of[1] < of[2] <= 2.0**50
        if reserved or not (is_ascending or of == [0, 0, 0]):
            raise view.invalid("F171", f"levels {of}, {reserved}", c.FREE_LEVELS)
    for triangle, row in enumerate(directions):
        if _bits(row) & ~((1 << BINS) - 1 | BACK):
            raise view.invalid("F170", f"{_bits(row):#034x}", c.FREE_DIRECTIONS, 20 * triangle + 4)
    for triangle, known in enumerate(_known(view)):
        if _is_known(known) and not (view.places and view.places[triangle] != NONE):
            raise _invalid(view, "F172", f"{known} without a place", triangle)


def _bits(row):
    """The 128 bits of the bins of a row of FREE_DIRECTIONS."""
    return sum(word << 32 * k for k, word in enumerate(row[1:]))


def _known(view):
    """For each triangle the sectors of its front and its back, and the bits of its bins."""
    for row in view.free:
        bits = _bits(row)
        yield (0, row[0]) if bits & BACK else (row[0], 0), bits
    for front, back in view.free_distances:
        yield (front, back), 0


def _is_known(known):
    """Whether anything is known of a triangle."""
    sectors, bins = known
    return any(sectors) or bins


def _invalid(view, code, found, triangle):
    """An error in the row of a triangle."""
    kind, row = (c.FREE_DIRECTIONS, 20) if view.free else (c.FREE_DISTANCES, 8)
    return view.invalid(code, found, kind, row * triangle)


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
    known = list(_known(view))
    if not known:
        return
    points, scale = in_integers([p for triangle in corners.values() for p in triangle])
    integers = {triangle: points[3 * k : 3 * k + 3] for k, triangle in enumerate(corners)}
    starts = {}
    for triangle, of_triangle in enumerate(known):
        if _is_known(of_triangle):
            starts[triangle] = axes(integers[triangle], scale)
            if starts[triangle] is None:
                raise _invalid(view, "F210", f"{corners[triangle]}", triangle)
    # Squares of three times a direction of integers; of no level, and of the others.
    squares = [Fraction(0)] + [(3 * scale * Fraction(distance)) ** 2 for distance in view.free_levels[0][:3]]
    for start in range(0, len(known), max(1, -(-len(known) // STARTS))):
        if start not in starts:
            continue
        quick = [[x / scale**power for x in axis] for axis, power in zip(starts[start], (1, 3, 2))]
        of_start = starts[start], quick, known[start], squares
        origins = list(zip(corners[start], integers[start]))
        for other, target in corners.items():
            if other != start and any(_is_met(of_start, p, (target, integers[other]), side) for p in origins):
                raise _invalid(view, "F209", f"triangle {start} meets {other}", start)


def _level(found, sectors):
    """The level of a bin and the side that it is on."""
    row, column = SECTOR_OF[found[0] // SIDE], SECTOR_OF[found[0] % SIDE]
    if row is None or column is None:
        return 0
    bits = sectors[found[1]] >> 4 * row + column
    return bits & 1 | (bits >> 16 & 1) << 1


def _squared_distance(found, known, squares):
    """The squared distance within which nothing is met in a bin, and on the side that it is on; infinite where it is free."""
    sectors, bins = known
    is_free = bins >> found[0] & 1 and found[1] == bool(bins & BACK)
    return math.inf if is_free else squares[_level(found, sectors)]


def _is_met(known, origin, target, side):
    """Whether the ray from a point through the middle of a triangle meets it though its direction is called free, or free as far as that.

    Point and triangle are given as they are and in integers.
    """
    axes_, quick, of_start, squares = known
    (start, exact_start), (corners, (a, b, last)) = origin, target
    near = [(corners[0][k] + corners[1][k] + corners[2][k]) / 3 - start[k] for k in range(3)]
    found = quick_bin(quick, near)
    if found is None or found is not ... and not _squared_distance(found, of_start, squares):
        return False
    direction = [a[k] + b[k] + last[k] - 3 * exact_start[k] for k in range(3)]
    found = bin_of(axes_, direction) if any(direction) else None
    if found is None or _dot(direction, direction) >= _squared_distance(found, of_start, squares):
        return False
    # The middle is met, unless the ray lies in the plane.
    return side(*corners, start) != 0
