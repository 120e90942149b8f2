"""Trees over the rows of groups (format-spec/README.md, "Trees"), F212 and F213.

Boxes are compared with half of the room that is demanded, so that roundings do not matter.
"""

import math
import struct
from collections import namedtuple

import bth_container as c
from bth_container import NONE
from bth_object import ObjectView
from bth_scene import HIDDEN, MATRIX, OF_GROUP, groups_of

Tree = namedtuple(
    "Tree",
    "magnitude condition first_line lines depth first_row rows visible instances extent origin_slack end_node reserved",
)
NODE_LINES, WIDTH, LEAF = 7, 16, 1 << 31
MAX_DEPTH, MAX_LEVELS = 96, 64
HALF_ROOM, ROUNDED = 2.0**-22, 1 - 2.0**-40
F32_MAX = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]


def check_trees(view):
    """F212 and F213 of a scene that has been checked."""
    container, need = view.container, view.need
    trees = [Tree(*r[:12], r[12:]) for r in struct.iter_unpack("<2d7I2fI2I", container.section(NONE, c.TREES))]
    lines = container.section(NONE, c.TREE_LINES)
    if not trees:
        need(not lines, "F212", "lines of no tree", c.TREE_LINES)
        return
    world, group_of = groups_of(view)
    node = row = line = 0
    shown, placed = [], Rows(view, group_of)
    for number, tree in enumerate(trees):
        while node < len(view.nodes) and group_of[node] == number:
            node += 1
        own = [x for x in view.instances if group_of[x.node] == number]
        count = sum(placed.counts[group_of[x.object]] if x.flags & OF_GROUP else 1 for x in own)
        placed.counts.append(count)
        ranges = (tree.first_row, tree.rows, tree.instances, tree.end_node, tree.first_line)
        good = ranges == (row, len(own), count, node, line) and tree.lines % NODE_LINES == 0
        need(good and not any(tree.reserved), "F212", f"{tree}", c.TREES)
        row, line = row + tree.rows, line + tree.lines
        need(64 * line <= len(lines), "F212", f"{tree}", c.TREES)
        shown.append(check_tree(view, tree, number == world, lines[64 * tree.first_line : 64 * line], placed))
        placed.shown.append(shown[-1])
    whole = len(trees) == world + 1 or len(trees) == world and row < len(view.instances)
    first = container.header.required_features & c.FEATURE_FIRST_TREES != 0
    good = whole != first and len(trees) <= world + 1 and 64 * line == len(lines)
    need(good, "F212", f"{len(trees)} trees", c.TREES)
    moves = any(t.node < node for t in view.tracks) or view.deformers.deformers
    others = any((i, k) in container.by_key for i in range(container.objects) for k in (c.SEQUENCE_TIMES, c.EXACT_POSITIONS))
    need(not moves and not others, "F212", "trees over what moves", c.TREES)


def check_tree(view, tree, is_world, lines, placed):
    """Checks a tree; returns the boxes in its root and its bounds, None if it is empty."""
    need = view.need
    seen, reached, depth, whole = set(), set(), 0, []
    rest = [(0, 1, None)] if lines else []
    while rest:
        code, level, within = rest.pop()
        depth = max(depth, level)
        good = code % NODE_LINES == 0 and 64 * code < len(lines) and code not in reached and level <= MAX_DEPTH
        need(good, "F212", f"child code {code}", c.TREE_LINES)
        reached.add(code)
        numbers = struct.unpack_from("<96f16I", lines, 64 * code)
        children = numbers[96:]
        used = children.index(NONE) if NONE in children else WIDTH
        boxes = [([numbers[32 * k + s] for k in range(3)], [numbers[32 * k + 16 + s] for k in range(3)]) for s in range(WIDTH)]
        empty = all(x == NONE for x in children[used:]) and all(
            b == ([F32_MAX] * 3, [-F32_MAX] * 3) for b in boxes[used:]
        )
        need(used and empty, "F212", f"slots of node {code}", c.TREE_LINES)
        for child, box in zip(children[:used], boxes):
            if level == 1:
                whole.append(box)
            need(within is None or contains(within, box), "F213", f"node {code}", c.TREE_LINES)
            if child < LEAF:
                need(child > code, "F212", f"child {child} of node {code}", c.TREE_LINES)
                rest.append((child, level + 1, box))
                continue
            row = child - LEAF
            good = tree.first_row <= row < tree.first_row + tree.rows and row not in seen
            image = placed.image(row) if good else None
            need(image is not None, "F212", f"row {row}", c.TREE_LINES)
            seen.add(row)
            need(fits(tree, is_world, image, box), "F213", f"row {row}", c.TREE_LINES)
    good = (len(seen), depth, NODE_LINES * len(reached)) == (tree.visible, tree.depth, tree.lines)
    need(good, "F212", f"{tree}", c.TREES)
    for row in range(tree.first_row, tree.first_row + tree.rows):
        need(row in seen or placed.image(row) is None, "F212", f"row {row}", c.TREES)
    return (whole, tree.magnitude, tree.condition) if whole else None


def fits(tree, is_world, image, box):
    """Whether a box in a tree contains the image of a row with the room that rays need, and the tree's bounds hold."""
    (lower, upper), norm, far, condition, (content, magnitude, inner) = image
    room = HALF_ROOM * (condition * far + norm * max(map(greatest, content)))
    own = ([x - room for x in lower], [x + room for x in upper])
    reach = HALF_ROOM * condition * 4 * tree.extent
    needed = ([x - reach for x in own[0]], [x + reach for x in own[1]])
    bounds = tree.magnitude >= (norm * magnitude + far) * ROUNDED and tree.condition >= condition * inner * ROUNDED
    numbers = tree.extent >= greatest(own) and tree.origin_slack >= HALF_ROOM * condition
    return contains(box, needed) and numbers and (is_world or bounds)


class Rows:
    """The rows of INSTANCES with their transforms; the trees of earlier groups are in `shown`, their instances in `counts`."""

    def __init__(self, view, group_of):
        self.view, self.group_of, self.shown, self.counts = view, group_of, [], []

    def image(self, row):
        """The box of a row's image, norms, and what it shows; None if it is not visible."""
        x = self.view.instances[row]
        if x.flags & OF_GROUP:
            content = self.shown[self.group_of[x.object]]
        else:
            o = ObjectView(self.view.container, x.object)
            self.view.need(o.root != NONE, "F212", f"object {x.object}", c.TREES)
            content = ([(o.lower, o.upper)], greatest((o.lower, o.upper)), 1.0)
        matrix, node, levels = None, x.node, 0
        while node != NONE:
            n = self.view.nodes[node]
            levels += 1
            self.view.need(levels <= MAX_LEVELS, "F212", f"nodes above row {row}", c.TREES)
            own = local(n)
            if n.flags & HIDDEN or own is None:
                return None
            matrix = own if matrix is None else product(own, matrix)
            node = n.parent
        if content is None:
            return None
        return (*placed_box(matrix, content[0]), content)


def placed_box(m, boxes):
    """The box around the images of boxes, and the norm, the translation and the condition number of the transform."""
    lower, upper = [], []
    for r in m:
        ends = [[sorted((r[j] * box[0][j], r[j] * box[1][j])) for j in range(3)] for box in boxes]
        lower.append(r[3] + min(sum(e[0] for e in own) for own in ends))
        upper.append(r[3] + max(sum(e[1] for e in own) for own in ends))

    def minor(i, j):
        a, b, p, q = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
        return m[a][p] * m[b][q] - m[a][q] * m[b][p]

    norm = max(sum(map(abs, r[:3])) for r in m)
    determinant = abs(sum(m[0][j] * minor(0, j) for j in range(3)))
    inverse = max(sum(abs(minor(i, j)) for i in range(3)) for j in range(3))
    condition = norm * inverse / determinant if determinant else math.inf
    return (lower, upper), norm, max(abs(r[3]) for r in m), condition


def local(n):
    """The transform of a node; None if its scale hides it."""
    t = n.transform
    if n.flags & MATRIX:
        return [t[4 * k : 4 * k + 4] for k in range(3)] if any(any(t[4 * k : 4 * k + 3]) for k in range(3)) else None
    if 0 in t[7:10]:
        return None
    x, y, z, w = (q / math.hypot(*t[3:7]) for q in t[3:7])
    rotation = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    return [[*(r * s for r, s in zip(rotation[k], t[7:10])), t[k]] for k in range(3)]


def product(outer, inner):
    """The transform that applies `inner` first."""
    return [[sum(r[i] * inner[i][j] for i in range(3)) + (r[3] if j == 3 else 0) for j in range(4)] for r in outer]


def contains(outer, inner):
    return all(a <= b for a, b in zip(outer[0], inner[0])) and all(a <= b for a, b in zip(inner[1], outer[1]))


def greatest(box):
    return max(abs(x) for end in box for x in end)
