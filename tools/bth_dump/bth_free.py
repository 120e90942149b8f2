"""Free directions (format-spec/README.md, "Free directions"): F168 to F171 and F209."""

from fractions import Fraction

import bth_container as c
import bth_leaves
from bth_container import NONE
from bth_leaves import INDEXED, RAW

ROW = 24
BORDERS = (-1.0, -0.41421356797218323, 0.0, 0.41421356797218323, 1.0)
# Triangles from which rays are sent.
STARTS = 64


def check(view):
    """F168, F170 and F171."""
    rows, reach = view.free, view.free_reach
    if len(rows) not in (0, view.triangles):
        raise view.invalid("F168", f"{len(rows)} rows", c.FREE_DIRECTIONS)
    if len(reach) != (1 if rows else 0):
        raise view.invalid("F168", f"{len(reach)} rows", c.FREE_REACH)
    for distance, *reserved in reach:
        if any(reserved) or not (distance == 0 or 2.0**-50 <= distance <= 2.0**50):
            raise view.invalid("F171", f"reach {distance}, {reserved}", c.FREE_REACH)
    for triangle, (_, classes) in enumerate(rows):
        if any(byte >= 243 for byte in classes) or classes[19] >= 3:
            raise view.invalid("F170", classes.hex(), c.FREE_DIRECTIONS, ROW * triangle + 4)


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
    for triangle, (place, classes) in enumerate(view.free):
        if any(classes) if place == NONE else triangle not in found:
            raise view.invalid("F169", f"place {place:#x}", c.FREE_DIRECTIONS, ROW * triangle)


def bin_of(direction):
    """The bin of a direction of Fractions."""
    size = [abs(x) for x in direction]
    axis = size.index(max(size))
    row, column = (
        sum(direction[k % 3] >= Fraction(border) * size[axis] for border in BORDERS[1:4]) for k in (axis + 2, axis + 1)
    )
    return (2 * axis + (direction[axis] < 0)) * 16 + 4 * row + column


def class_of(classes, number):
    """The class of a bin: a digit to base 3."""
    return classes[number // 5] // 3 ** (number % 5) % 3


def check_met(view, side):
    """F209, for rays from corners of some triangles to the middles of all others; `side` is the sign of a volume."""
    corners = {}
    for triangle, (place, _) in enumerate(view.free):
        if place != NONE:
            kind = RAW if place >> 31 else INDEXED
            of_leaf = [points for _, points in bth_leaves.triangles(view, kind, place >> 4 & (1 << 27) - 1)]
            corners[triangle] = of_leaf[place & 15]
    reach = Fraction(view.free_reach[0][0]) if view.free else 0
    for start in range(0, len(view.free), max(1, -(-len(view.free) // STARTS))):
        for other, target in corners.items() if start in corners else ():
            if other != start and any(_is_met(view, start, p, target, reach, side) for p in corners[start]):
                raise view.invalid("F209", f"triangle {start} meets {other}", c.FREE_DIRECTIONS, ROW * start)


def _is_met(view, start, origin, target, reach, side):
    """Whether the ray from a point through the middle of a triangle meets it in a direction that is called free."""
    middle = [sum(Fraction(p[k]) for p in target) / 3 for k in range(3)]
    direction = [m - Fraction(x) for m, x in zip(middle, origin)]
    if not any(direction):
        return False
    found = class_of(view.free[start][1], bin_of(direction))
    if found == 0 or found == 1 and sum(x * x for x in direction) > reach * reach:
        return False
    # The middle is met, unless the ray lies in the plane.
    return side(*target, origin) != 0
