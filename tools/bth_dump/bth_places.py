"""Places of triangles in leaves (format-spec/README.md, "Places of triangles"): F169 and F187."""

import bth_container as c
import bth_leaves
from bth_container import NONE
from bth_leaves import RAW

# Leaves with this index or a greater one have no places.
INDEX_LIMIT = (1 << 27) - 1


def _code(kind, index, slot):
    """The number of a place; NONE if the index is too large."""
    return NONE if index >= INDEX_LIMIT else (kind == RAW) << 31 | index << 4 | slot


def check_leaf(view, kind, index):
    """F187 of a leaf. Yields its triangles that lie where TRIANGLE_PLACES says."""
    if not view.places:
        return
    found = bth_leaves.leaf(view, kind, index)
    for slot in range(found.triangles):
        triangle, place = view.triangle_ids[found.first + slot], _code(kind, index, slot)
        if place == NONE or triangle >= len(view.places):
            continue
        if view.places[triangle] == place:
            yield triangle
        elif view.places[triangle] == NONE:
            raise view.invalid("F187", f"no place, but {place:#x}", c.TRIANGLE_PLACES, 4 * triangle)


def check(view, placed):
    """F169; `placed` holds the triangles that lie where TRIANGLE_PLACES says."""
    for triangle, place in enumerate(view.places):
        if place != NONE and triangle not in placed:
            raise view.invalid("F169", f"place {place:#x}", c.TRIANGLE_PLACES, 4 * triangle)
