"""Geometry (format-spec/README.md, "Verifying"): F201 to F211, with exact arithmetic."""

import math
import struct
from fractions import Fraction

import bth_container as c
import bth_free
import bth_leaves
from bth_container import NONE
from bth_indices import TETS, child
from bth_leaves import NODE
from bth_tets import FACE_BIT


def bits(points):
    """Points as bytes of f32, so that comparing tells 0 from -0."""
    return [struct.pack("<3f", *p) for p in points]


def side(a, b, c_, d):
    """Sign of the volume: 1 where d lies on the side of the triangle that (b-a)x(c-a) points to."""
    (a, b, c_, d), _ = bth_free.in_integers((a, b, c_, d))
    u, v, w = ([p[k] - a[k] for k in range(3)] for p in (b, c_, d))
    volume = sum((u[i] * v[j] - u[j] * v[i]) * w[k] for i, j, k in ((1, 2, 0), (2, 0, 1), (0, 1, 2)))
    return (volume > 0) - (volume < 0)


def is_zero_area(points):
    """Whether a triangle has exactly zero area."""
    a, b, c_ = ([Fraction(x) for x in p] for p in points)
    u, v = ([p[k] - a[k] for k in range(3)] for p in (b, c_))
    return all(u[i] * v[j] == u[j] * v[i] for i, j in ((0, 1), (1, 2), (2, 0)))


def nearest_f32(x):
    """The f32 nearest to a fraction, of two equally near ones the even one."""
    unit = Fraction(2) ** max(math.frexp(float(x))[1] - 24, -149)
    return float(round(x / unit) * unit)


def contains(box, points):
    """Whether a box, as (lower, upper), contains all points."""
    lower, upper = box
    return all(lower[k] <= p[k] <= upper[k] for p in points for k in range(3))


def check_geometry(view, tets):
    """Checks an object whose indices have been checked; `tets` are the derived ones of each leaf."""
    placed = _tree(view)
    for leaf, found in zip(view.tet_leaves, tets):
        _tet_leaf(view, leaf, found)
    _displacement(view)
    _rounding(view)
    # By their number, since the file may claim any number of triangles that it does not hold.
    if view.triangles - len(placed) != view.dropped:
        raise view.invalid(
            "F203", f"{view.triangles - len(placed)} triangles in no leaf, {view.dropped} dropped", c.OBJECT, 36
        )
    for t in (t for t in range(view.triangles) if t not in placed):
        if view.source and not is_zero_area(_exact(view, t)):
            raise view.invalid("F207", f"triangle {t} has an area but no leaf", c.TRIANGLES, 12 * t)
    bth_free.check_met(view, placed, side)


def _source(view, t):
    """Corners of a triangle of the source, on the grid if there is one."""
    return [bth_leaves.nearest(view.grid, view.positions[v]) for v in view.source[t]]


def _exact(view, t):
    """Corners of a triangle of the source before they were rounded."""
    return [view.exact[v] for v in view.source[t]] if view.exact else _source(view, t)


def _rounding(view):
    """F211."""
    for row, (p, exact) in enumerate(zip(view.positions, view.exact)):
        expected = [nearest_f32(Fraction(x) - Fraction(a)) for x, a in zip(exact, view.anchor[0])]
        if bits([expected]) != bits([p]):
            raise view.invalid("F211", f"{p}, not {expected}", c.POSITIONS, 12 * row)


def _displacement(view):
    """F208."""
    for row, p in enumerate(view.positions if view.grid else ()):
        square = sum((Fraction(a) - Fraction(b)) ** 2 for a, b in zip(p, bth_leaves.nearest(view.grid, p)))
        if square > Fraction(view.grid.displacement) ** 2:
            raise view.invalid("F208", f"{p} is {float(square) ** 0.5} from the grid", c.POSITIONS, 12 * row)


def _room(point):
    """The ends of the least box with the room around a point that widened boxes have."""
    margin = max(abs(Fraction(x)) for x in point) / 2**20
    return [Fraction(x) - margin for x in point], [Fraction(x) + margin for x in point]


def _tree(view):
    """F201 to F204 and F207; returns the corners of the triangles that are in a triangle leaf of the tree or are a constrained face."""
    placed = {}

    def triangle(t, corners, number, section, at):
        if view.source:
            source = _source(view, t)
            if bits(source) != bits(corners):
                raise view.invalid(number, f"triangle {t} is {source} in the source, {corners} here", section, at)
            if not view.leaf_vertices and is_zero_area(_exact(view, t)):
                raise view.invalid("F207", f"triangle {t} has no area", section, at)

    def place(t, corners, section, at):
        if t in placed:
            raise view.invalid("F203", f"triangle {t} again", section, at)
        placed[t] = corners

    # A reference, and the boxes around it.
    object_box = (view.lower, view.upper)
    stack = [(view.root, [object_box])]
    # Boxes around the triangles of each leaf, and those triangles' points.
    found = []
    while stack:
        code, boxes = stack.pop()
        if code == NONE:
            continue
        kind, index = child(code)
        points = []
        if kind == NODE:
            lower, upper, codes = view.node(index)
            stack.extend((codes[i], [*boxes, (lower[i], upper[i])]) for i in range(16))
        elif kind == TETS:
            leaf = view.tet_leaves[index]
            for row in range(leaf.first_face, leaf.first_face + leaf.faces):
                face = view.tet_faces[row]
                corners = [view.tet_vertices[v][:3] for v in face.vertex]
                place(face.triangle, corners, c.TET_FACES, 32 * row)
                triangle(face.triangle, corners, "F202", c.TET_FACES, 32 * row)
                points += corners
        else:
            for row, corners in bth_leaves.triangles(view, kind, index):
                t = view.triangle_ids[row]
                place(t, corners, c.TRIANGLE_IDS, 4 * row)
                triangle(t, corners, "F201", c.LINES, 32 * bth_leaves.halves(view, kind, index).start)
                points += corners
        found.append((boxes, points))
    for boxes, points in found:
        room = [end for point in points for end in _room(point)] if view.widened_boxes else points
        if not all(contains(box, points if box is object_box else room) for box in boxes):
            raise view.invalid("F204", "triangles outside a box above", c.LINES)
    return placed


def _tet_leaf(view, leaf, found):
    """F205 and F206; `found` has the derived vertices and links by tetrahedron."""
    def point(v):
        return view.tet_vertices[v][:3]

    for v in range(leaf.first_vertex, leaf.first_vertex + leaf.vertices):
        if not contains((leaf.lower, leaf.upper), [point(v)]):
            raise view.invalid("F205", f"vertex {point(v)} outside its box", c.TET_VERTICES, 16 * v)
    for tet, (four, links) in found.items():
        for slot, link in enumerate(links):
            face = [point(v) for v in four[:slot] + four[slot + 1 :]]
            here = side(*face, point(four[slot]))
            if here == 0:
                raise view.invalid("F206", f"tetrahedron {tet} without volume", c.TETS, view.stride * tet)
            if link & FACE_BIT == 0:
                other = next(v for v in found[link][0] if v not in four)
                if side(*face, point(other)) != -here:
                    raise view.invalid("F206", f"{tet} and {link} on the same side", c.TETS, view.stride * tet)
    for row in range(leaf.first_face, leaf.first_face + leaf.faces):
        face = view.tet_faces[row]
        if [side(*map(point, face.vertex), point(v)) for v in face.opposite] != [1, -1]:
            raise view.invalid("F206", f"{face} the wrong way round", c.TET_FACES, 32 * row)
    for row in range(leaf.first_hull, leaf.first_hull + leaf.hulls):
        hull = view.hull_faces[row]
        if side(*map(point, hull.vertex), point(hull.opposite)) != 1:
            raise view.invalid("F206", f"{hull} points outwards", c.HULL_FACES, 20 * row)
