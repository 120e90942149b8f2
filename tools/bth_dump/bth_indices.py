"""The index check (format-spec/README.md, "Index check"): F101 to F147, F163 to F172 and F187."""

import math
import struct

import bth_container as c
import bth_free
import bth_leaves
import bth_places
from bth_container import NONE
from bth_leaves import INDEXED, NODE, RAW
from bth_tets import derive

MAX_DEPTH = 96
TETS = "tets"
F32_MAX = struct.unpack("<f", struct.pack("<I", 0x7F7FFFFF))[0]


def child(code):
    """Kind and index of a child code; None where there is none."""
    kind = {0: NODE, 4: INDEXED, 5: RAW, 6: TETS}.get(code >> 29)
    return None if kind is None else (kind, code & (1 << 29) - 1)


def is_box(lower, upper):
    """Whether a box is finite with lower <= upper."""
    return all(map(math.isfinite, (*lower, *upper))) and all(a <= b for a, b in zip(lower, upper))


def check_indices(view):
    """Checks an object; returns the derived tetrahedra of each tet leaf."""
    _header(view)
    _sources(view)
    _opacity(view)
    _exact(view)
    bth_free.check(view)
    _tet_ranges(view)
    _triangle_faces(view)
    _tree(view)
    _deformable(view)
    return [derive(view, leaf) for leaf in view.tet_leaves]


def _header(view):
    """F102, F103, F110 and F022 of the OBJECT row; ObjectView checks F101 and F104."""
    def need(condition, number, message, at):
        if not condition:
            raise view.invalid(number, message, c.OBJECT, at)

    tables = (
        ("TRIANGLE_FACES", view.triangle_faces),
        ("TRIANGLE_PLACES", view.places),
        ("TRIANGLES", view.source),
        ("CORNERS", view.corners),
    )
    for name, rows in tables:
        need(len(rows) in (0, view.triangles), "F102", f"{len(rows)} rows of {name}", 32)
    need(view.triangles <= 1 << 30, "F022", f"{view.triangles} triangles", 32)
    need(view.dropped <= view.triangles, "F102", f"{view.dropped} dropped", 36)
    need(view.depth <= MAX_DEPTH, "F110", f"depth {view.depth}", 40)
    good = view.bounds_are_zero if view.root == NONE else is_box(view.lower, view.upper)
    need(good, "F103", f"bounds {view.lower} to {view.upper}", 0)


def _sources(view):
    """F140 and F141."""
    attributes = max(len(view.normals), len(view.uvs))
    for kind, table, rows in (
        (c.TRIANGLES, view.source, len(view.positions)),
        (c.CORNERS, view.corners, attributes),
    ):
        for i, row in enumerate(table):
            if max(row) >= rows:
                raise view.invalid("F140", f"row {max(row)} of {rows}", kind, 12 * i)
    if view.normals and view.uvs and len(view.normals) != len(view.uvs):
        raise view.invalid("F140", "normals and texture coordinates differ in number", c.UVS)
    for i, position in enumerate(view.positions):
        if not all(map(math.isfinite, position)):
            raise view.invalid("F141", f"position {position}", c.POSITIONS, 12 * i)


def _exact(view):
    """F193 and F194."""
    if len(view.anchor) != bool(view.exact):
        raise view.invalid("F193", f"{len(view.anchor)} anchors", c.EXACT_POSITIONS)
    other = view.grid or view.leaf_vertices or view.tet_leaves or view.free or view.free_distances
    rows = len(view.exact) == len(view.positions) and len(view.source) == view.triangles
    if view.exact and (other or not rows):
        raise view.invalid("F193", f"{len(view.exact)} rows, or sections that do not go with them", c.EXACT_POSITIONS)
    for kind, points in ((c.ANCHOR, view.anchor), (c.EXACT_POSITIONS, view.exact)):
        for i, point in enumerate(points):
            if not all(x == 0 or 2**-149 <= abs(x) <= (2 - 2**-23) * 2.0**127 for x in point):
                raise view.invalid("F194", f"{point}", kind, 24 * i)


def _opacity(view):
    """F145 to F147."""
    rows, words = view.opacity, view.opacity_micro
    if len(rows) not in (0, view.triangles):
        raise view.invalid("F145", f"{len(rows)} rows", c.OPACITY)
    if words and not rows:
        raise view.invalid("F145", f"{len(words)} words without OPACITY", c.OPACITY_MICRO)
    for triangle, row in enumerate(rows):
        level, payload = row % 16, row // 16
        good = payload <= 2 if level == 0 else level <= 8 and payload + -(-(4**level) // 16) <= len(words)
        if not good:
            raise view.invalid("F146", f"row {row:#x}", c.OPACITY, 4 * triangle)
        if level == 1 and words[payload] >> 8:
            raise view.invalid("F147", f"word {words[payload]:#x} of level 1", c.OPACITY_MICRO, 4 * payload)
    for at, word in enumerate(words):
        if any(word >> 2 * k & 3 == 3 for k in range(16)):
            raise view.invalid("F147", f"word {word:#x}", c.OPACITY_MICRO, 4 * at)


def _tet_ranges(view):
    """F120 to F122 and F124."""
    rows = [len(view.tets), len(view.tet_vertices), len(view.tet_faces), len(view.hull_faces)]
    end = [0] * 4
    for i, leaf in enumerate(view.tet_leaves):

        def need(condition, number, message, at):
            if not condition:
                raise view.invalid(number, message, c.TET_LEAVES, 64 * i + at)

        flat = any(a >= b for a, b in zip(leaf.lower, leaf.upper))
        need(is_box(leaf.lower, leaf.upper) and not flat, "F120", f"{leaf.lower} to {leaf.upper}", 0)
        need(leaf.flags == 0, "F120", f"flags {leaf.flags}", 60)
        ranges = (
            (leaf.first_tet, leaf.tets, 1),
            (leaf.first_vertex, leaf.vertices, 4),
            (leaf.first_face, leaf.faces, 1),
            (leaf.first_hull, leaf.hulls, 4),
        )
        for k, (first, count, least) in enumerate(ranges):
            need(first == end[k] and first + count <= rows[k], "F121", f"{count} rows from {first}", 24 + 8 * k)
            need(count >= least, "F122", f"{count} rows", 28 + 8 * k)
            end[k] = first + count
    if end != rows:
        raise view.invalid("F121", f"rows up to {end} of {rows}", c.TET_LEAVES)
    for i, (x, y, z, reserved) in enumerate(view.tet_vertices):
        if reserved or not all(map(math.isfinite, (x, y, z))):
            raise view.invalid("F124", f"vertex {x} {y} {z}, {reserved}", c.TET_VERTICES, 16 * i)


def _triangle_faces(view):
    """F131: TRIANGLE_FACES and the triangles of TET_FACES are inverse to each other."""
    faces = view.triangle_faces
    if len(faces) != (view.triangles if view.tet_leaves else 0):
        raise view.invalid("F131", f"{len(faces)} rows", c.TRIANGLE_FACES)
    expected = {face.triangle: row for row, face in enumerate(view.tet_faces)}
    if len(expected) != len(view.tet_faces) or any(t >= len(faces) for t in expected):
        raise view.invalid("F131", "a constrained face without a triangle of its own", c.TET_FACES)
    for triangle, face in enumerate(faces):
        if face != expected.get(triangle, NONE):
            raise view.invalid("F131", f"triangle {triangle} leads to face {face}", c.TRIANGLE_FACES, 4 * triangle)


def _tree(view):
    """F105 to F118 and F123."""
    halves = len(view.lines) // 32
    claimed, referenced, placed = set(), set(), set()
    # Code, nodes above, first half line of the parent, section and byte of the reference.
    stack = [(view.root, 0, -1, c.OBJECT, 24)]
    while stack:
        code, depth, parent, section, at = stack.pop()
        if code == NONE:
            continue
        found = child(code)
        if found is None:
            raise view.invalid("F105", f"child code {code:#x}", section, at)
        kind, index = found
        if kind == TETS:
            if index >= len(view.tet_leaves):
                raise view.invalid("F106", f"tet leaf {index}", section, at)
            if index in referenced:
                raise view.invalid("F123", f"tet leaf {index} again", section, at)
            referenced.add(index)
            if view.tet_leaves[index].subtree != NONE:
                raise view.invalid("F105", f"tet leaf {index} with a BVH", c.TET_LEAVES, 64 * index + 56)
            continue
        block = bth_leaves.halves(view, kind, index)
        if block.stop > halves:
            raise view.invalid("F106", f"{kind} at half line {block.start} of {halves}", section, at)
        if block.start <= parent:
            raise view.invalid("F107", f"half line {block.start} below half line {parent}", section, at)
        if not claimed.isdisjoint(block):
            raise view.invalid("F108", f"{kind} at half line {block.start}", section, at)
        claimed.update(block)
        if kind == NODE:
            if depth + 1 > min(view.depth, MAX_DEPTH):
                raise view.invalid("F110", f"{depth + 1} nodes on a path", section, at)
            codes = _slots(view, index)
            for slot in reversed(range(16)):
                at = 64 * index + 384 + 4 * slot
                stack.append((codes[slot], depth + 1, block.start, c.LINES, at))
        else:
            bth_leaves.check(view, kind, index)
            placed.update(bth_places.check_leaf(view, kind, index))
    for half in range(halves):
        spare = view.grid and half % 2 and not any(view.lines[32 * half : 32 * half + 32])
        if half not in claimed and not spare:
            raise view.invalid("F109", f"half line {half} is no block's", c.LINES, 32 * half)
    if len(referenced) != len(view.tet_leaves):
        raise view.invalid("F123", "a tet leaf without a reference", c.TET_LEAVES)
    bth_places.check(view, placed)
    for row, triangle in enumerate(view.triangle_ids):
        if triangle >= view.triangles:
            raise view.invalid("F116", f"id {triangle}", c.TRIANGLE_IDS, 4 * row)


def _slots(view, line):
    """F111 and F112 of a node; returns its child codes."""
    lower, upper, codes = view.node(line)
    used = codes.index(NONE) if NONE in codes else 16
    if used == 0:
        raise view.invalid("F111", "no children", c.LINES, 64 * line + 384)
    for i in range(16):
        if i < used:
            if not is_box(lower[i], upper[i]):
                raise view.invalid("F112", f"box {lower[i]} to {upper[i]}", c.LINES, 64 * line + 4 * i)
        elif codes[i] != NONE or lower[i] != (F32_MAX,) * 3 or upper[i] != (-F32_MAX,) * 3:
            raise view.invalid("F111", f"slot {i} is neither used nor empty", c.LINES, 64 * line + 4 * i)
    return codes


def _deformable(view):
    """F163 to F167."""
    rows = view.leaf_vertices
    if not rows:
        return
    is_f32 = not (view.grid or view.widened_boxes)
    if not view.positions or not view.source or not is_f32 or view.tet_leaves or view.dropped:
        raise view.invalid("F163", "LEAF_VERTICES in an object that cannot be deformable", c.LEAF_VERTICES)
    nodes, leaves = _depth_first(view)
    next_line = 0
    for kind, line in nodes + leaves:
        if line != next_line:
            raise view.invalid("F164", f"{kind} at line {line}, not {next_line}", c.LINES, 64 * line)
        next_line += {NODE: 7, INDEXED: 4, RAW: 10}[kind]
    if len(rows) != sum(1 if kind == INDEXED else 3 for kind, _ in leaves):
        raise view.invalid("F165", f"{len(rows)} rows", c.LEAF_VERTICES)
    row = 0
    for kind, line in leaves:
        found = bth_leaves.leaf(view, kind, line)
        slots = rows[row : row + 1] if kind == INDEXED else rows[row : row + 3]
        for k, elements in enumerate(slots):
            unused = elements[found.vertices :]
            if max(elements) >= len(view.positions) or any(e != elements[0] for e in unused):
                raise view.invalid("F166", f"rows {elements}", c.LEAF_VERTICES, 64 * (row + k))
        row += len(slots)
        for t in range(found.triangles):
            if kind == INDEXED:
                corners = tuple(slots[0][found.corners[16 * k + t]] for k in range(3))
            else:
                corners = tuple(slots[k][t] for k in range(3))
            triangle = view.triangle_ids[found.first + t]
            if corners != view.source[triangle]:
                raise view.invalid("F167", f"triangle {triangle} of positions {corners}", c.LINES, 64 * line)


def _depth_first(view):
    """The nodes and the leaves of a tree, depth first."""
    nodes, leaves, stack = [], [], [view.root]
    while stack:
        found = child(stack.pop())
        if found is None:
            continue
        (nodes if found[0] == NODE else leaves).append(found)
        if found[0] == NODE:
            stack.extend(code for code in reversed(view.node(found[1])[2]) if code != NONE)
    return nodes, leaves
