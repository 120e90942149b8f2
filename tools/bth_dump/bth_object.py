"""The sections of an object as Python values (format-spec/README.md, "Objects")."""

import math
import struct
from collections import namedtuple

import bth_container as c
from bth_container import Invalid, kind_name

LINK32 = 1
# Records of older files, of 32, 20 and 16 bytes.
OLD_RECORDS = (2, 3, 4)

TetLeaf = namedtuple(
    "TetLeaf", "lower upper first_tet tets first_vertex vertices first_face faces first_hull hulls subtree flags"
)
TetFace = namedtuple("TetFace", "vertex triangle tet opposite")
HullFace = namedtuple("HullFace", "vertex tet opposite")
Grid = namedtuple("Grid", "bits origin step displacement")


def _is_exact(origin, step, bits):
    """Whether all points of an axis of a grid are f32."""
    if not math.isfinite(origin) or origin / step % 1:
        return False
    first, last = origin / step, origin / step + (1 << bits) - 1
    return abs(first) <= 1 << 24 and last <= 1 << 24 and last * step <= (2 - 2**-23) * 2.0**127


class ObjectView:
    """An object. Coordinates are Python floats, which hold every f32 exactly."""

    def __init__(self, container, index):
        self.container, self.index = container, index
        raw = self.bytes(c.OBJECT)
        self.lower, self.upper = struct.unpack_from("<3f", raw), struct.unpack_from("<3f", raw, 12)
        self.bounds_are_zero = not any(raw[:24])
        self.root, self.record_code, self.triangles, self.dropped, self.depth = struct.unpack_from("<5I", raw, 24)
        self.lines = self.bytes(c.LINES)
        self.grid = self._grid(raw)
        self.triangle_ids = self.rows(c.TRIANGLE_IDS, "<I", scalar=True)
        self.triangle_faces = self.rows(c.TRIANGLE_FACES, "<I", scalar=True)
        self.tet_leaves = [TetLeaf(r[:3], r[3:6], *r[6:]) for r in self.rows(c.TET_LEAVES, "<6f10I")]
        self.tet_vertices = self.rows(c.TET_VERTICES, "<3fI")
        self.tet_faces = [TetFace(r[:3], r[3], r[4:6], r[6:]) for r in self.rows(c.TET_FACES, "<8I")]
        self.hull_faces = [HullFace(r[:3], r[3], r[4]) for r in self.rows(c.HULL_FACES, "<5I")]
        self.leaf_vertices = self.rows(c.LEAF_VERTICES, "<16I")
        self.positions = self.rows(c.POSITIONS, "<3f")
        self.anchor = self.rows(c.ANCHOR, "<3d")
        self.exact = self.rows(c.EXACT_POSITIONS, "<3d")
        self.source = self.rows(c.TRIANGLES, "<3I")
        self.corners = self.rows(c.CORNERS, "<3I")
        self.normals = self.rows(c.NORMALS, "<3f")
        self.uvs = self.rows(c.UVS, "<2f")
        self.places = self.rows(c.TRIANGLE_PLACES, "<I", scalar=True)
        self.free = self.rows(c.FREE_DIRECTIONS, "<5I")
        self.free_levels = self.rows(c.FREE_LEVELS, "<3fI")
        self.free_distances = self.rows(c.FREE_DISTANCES, "<2I")
        self.opacity = self.rows(c.OPACITY, "<I", scalar=True)
        self.opacity_micro = self.rows(c.OPACITY_MICRO, "<I", scalar=True)
        self._read_tets()

    def _grid(self, raw):
        """F104: the grid of the leaves' coordinates; None for f32."""
        bits, *exponents = struct.unpack_from("<4B", raw, 44)
        origin, displacement = struct.unpack_from("<3f", raw, 48), struct.unpack_from("<f", raw, 60)[0]
        self.widened_boxes = bits >> 6 & 1 == 1
        bits &= ~(1 << 6)
        if not bits and not any(raw[45:48]):
            grid, wrong = None, any(raw[48:64])
        else:
            wrong = bits not in (16, 21) or not all(1 <= e <= 254 for e in exponents)
            wrong = wrong or not 0 <= displacement < math.inf
            wrong = wrong or not self.container.header.required_features & c.FEATURE_GRID
            grid = Grid(bits, origin, tuple(math.ldexp(1.0, e - 127) for e in exponents), displacement)
            wrong = wrong or not all(_is_exact(o, s, bits) for o, s in zip(grid.origin, grid.step))
        wrong = wrong or self.widened_boxes and not self.container.header.required_features & c.FEATURE_WIDENED_BOXES
        if wrong:
            raise self.invalid("F104", f"coordinates {raw[44:64].hex()}", c.OBJECT, 44)
        return grid

    def _read_tets(self):
        """F101: the rows of TETS, as the object says."""
        entry = self.container.by_key.get((self.index, c.TETS))
        if self.record_code == 0:
            good = (entry is None or entry.count == 0) and not self.tet_leaves
        else:
            good = self.record_code == LINK32 and entry is not None
        if not good:
            number = "F007" if self.record_code in OLD_RECORDS else "F101"
            raise self.invalid(number, f"record {self.record_code} with {len(self.tet_leaves)} tet leaves", c.OBJECT, 28)
        self.stride = 32
        self.tets = self.rows(c.TETS, "<8I")

    def bytes(self, kind):
        return self.container.section(self.index, kind)

    def rows(self, kind, form, scalar=False):
        rows = struct.iter_unpack(form, self.bytes(kind))
        return [r[0] for r in rows] if scalar else list(rows)

    def invalid(self, number, message, kind, at=0):
        """The error for a byte of a section."""
        entry = self.container.by_key.get((self.index, kind))
        return Invalid(number, message, kind_name(kind), (entry.offset if entry else 0) + at)

    def node(self, line):
        """Lower ends and upper ends of the children's boxes, and the children's codes."""
        raw = struct.unpack_from("<96f16I", self.lines, 64 * line)
        lower = list(zip(raw[0:16], raw[32:48], raw[64:80]))
        upper = list(zip(raw[16:32], raw[48:64], raw[80:96]))
        return lower, upper, raw[96:]
