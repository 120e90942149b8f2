"""Triangle leaves (format-spec/README.md, "Objects"), of f32 or on a grid."""

import math
import struct
from collections import namedtuple

import bth_container as c

NODE, INDEXED, RAW = "node", "indexed", "raw"
# Half lines of a block, by bits of a coordinate; 32 for f32.
HALVES = {
    32: {NODE: 14, INDEXED: 8, RAW: 20},
    21: {NODE: 14, INDEXED: 5, RAW: 13},
    16: {NODE: 14, INDEXED: 4, RAW: 10},
}

# Rows of 16 coordinates (three of an indexed leaf, nine of a raw one), corners of all 16 slots (indexed leaves), the rest.
Leaf = namedtuple("Leaf", "rows corners first triangles vertices unused")


def halves(view, kind, index):
    """Half lines of a block."""
    first = index if view.grid and kind != NODE else 2 * index
    return range(first, first + HALVES[view.grid.bits if view.grid else 32][kind])


def leaf(view, kind, index):
    """A leaf, with coordinates that are f32."""
    at = 32 * halves(view, kind, index).start
    return (_on_grid if view.grid else _plain)(view, kind, at)


def _plain(view, kind, at):
    rows = 3 if kind == INDEXED else 9
    values = [struct.unpack_from("<16f", view.lines, at + 64 * row) for row in range(rows)]
    at += 64 * rows
    if kind == INDEXED:
        corners = list(view.lines[at : at + 48])
        return Leaf(values, corners, *struct.unpack_from("<4I", view.lines, at + 48))
    first, triangles, *unused = struct.unpack_from("<16I", view.lines, at)
    return Leaf(values, None, first, triangles, triangles, any(unused))


def _on_grid(view, kind, at):
    rows, grid, spare = 3 if kind == INDEXED else 9, view.grid, False
    steps = [struct.unpack_from("<16H", view.lines, at + 32 * row) for row in range(rows)]
    at += 32 * rows
    if grid.bits == 21:
        high = [struct.unpack_from("<16H", view.lines, at + 32 * corner) for corner in range(rows // 3)]
        at += 32 * rows // 3
        spare = any(h >> 15 for row in high for h in row)
        steps = [
            [low | (h >> 5 * (row % 3) & 31) << 16 for low, h in zip(steps[row], high[row // 3])]
            for row in range(rows)
        ]
    values = [[grid.origin[row % 3] + k * grid.step[row % 3] for k in steps[row]] for row in range(rows)]
    if kind == INDEXED:
        packed = [view.lines[at + 8 * k : at + 8 * k + 8] for k in range(3)]
        corners = [b >> shift & 15 for row in packed for shift in (0, 4) for b in row]
        first, triangles, vertices, unused = struct.unpack_from("<IBBH", view.lines, at + 24)
        return Leaf(values, corners, first, triangles, vertices, unused or spare)
    first, triangles, *unused = struct.unpack_from("<8I", view.lines, at)
    return Leaf(values, None, first, triangles, triangles, any(unused) or spare)


def nearest(grid, point):
    """The point of a grid nearest to a point."""
    if grid is None:
        return point
    found = []
    for x, origin, step in zip(point, grid.origin, grid.step):
        # Quotients by powers of two are exact, and Python rounds ties to even.
        k = round(x / step) - round(origin / step)
        found.append(origin + min(max(k, 0), (1 << grid.bits) - 1) * step)
    return tuple(found)


def check(view, kind, index):
    """F113 to F118."""
    at, found = 32 * halves(view, kind, index).start, leaf(view, kind, index)

    def need(condition, number, message):
        if not condition:
            raise view.invalid(number, message, c.LINES, at)

    need(1 <= found.triangles <= 16, "F113", f"{found.triangles} triangles")
    need(1 <= found.vertices <= 16, "F113", f"{found.vertices} vertices")
    rows = len(view.triangle_ids)
    need(found.first + found.triangles <= rows, "F115", f"{found.triangles} rows from {found.first}")
    for k, corner in enumerate(found.corners or ()):
        need(k % 16 >= found.triangles or corner < found.vertices, "F114", f"corner {corner}")
        need(k % 16 < found.triangles or corner == 0, "F118", f"unused corner {corner}")
    for row in found.rows:
        bits = [struct.pack("<f", x) for x in row]
        need(all(map(math.isfinite, row[: found.vertices])), "F117", f"coordinates {row}")
        need(all(b == bits[0] for b in bits[found.vertices :]), "F118", "an unused coordinate differs from slot 0")
    need(not found.unused, "F118", "a reserved field is not zero")


def triangles(view, kind, index):
    """Rows of TRIANGLE_IDS and corners of a leaf's triangles."""
    found = leaf(view, kind, index)
    for t in range(found.triangles):
        if kind == INDEXED:
            corners = [found.corners[16 * k + t] for k in range(3)]
            yield found.first + t, [tuple(row[v] for row in found.rows) for v in corners]
        else:
            yield found.first + t, [tuple(found.rows[3 * k + a][t] for a in range(3)) for k in range(3)]
