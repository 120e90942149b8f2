"""Vertices and links of tetrahedra, derived as a traversal does (format-spec/README.md, "Index check"): F125 to F130."""

import bth_container as c
from bth_container import NONE

FACE_BIT = 1 << 31


def derive(view, leaf):
    """Vertices and links of each tetrahedron of a leaf, by row of TETS, all of them checked."""
    tets = range(leaf.first_tet, leaf.first_tet + leaf.tets)
    vertices = range(leaf.first_vertex, leaf.first_vertex + leaf.vertices)
    faces = range(leaf.first_face, leaf.first_face + leaf.faces)
    hulls = range(leaf.first_hull, leaf.first_hull + leaf.hulls)

    def bad(number, message, row, kind=c.TETS, stride=view.stride):
        return view.invalid(number, message, kind, stride * row)

    def hull_vertices(row):
        hull = view.hull_faces[row]
        four = tuple(sorted((*hull.vertex, hull.opposite)))
        if len(set(four)) < 4 or any(v not in vertices for v in four) or hull.tet not in tets:
            raise bad("F125", f"hull face {hull}", row, c.HULL_FACES, 20)
        return four

    def links_of(tet):
        return view.tets[tet][0::2]

    def beyond(tet, slot):
        """Row, fourth vertex and way back of the tetrahedron beyond a slot's face; None outside."""
        four, links = found[tet]
        link, face = links[slot], four[:slot] + four[slot + 1 :]
        if link == NONE:
            return None
        if link & FACE_BIT:
            row = link ^ FACE_BIT
            if row not in faces:
                raise bad("F127", f"constrained face {row}", tet)
            named = view.tet_faces[row]
            sides = list(zip(named.tet, named.opposite))
            if (tet, four[slot]) not in sides or set(named.vertex) != set(face):
                raise bad("F126", f"{named} behind tetrahedron {tet}", row, c.TET_FACES, 32)
            other, fourth = sides[1 - sides.index((tet, four[slot]))]
            if other not in tets or other == tet:
                raise bad("F126", f"tetrahedron {other}", row, c.TET_FACES, 32)
            back = link
        else:
            if link not in tets or link == tet:
                raise bad("F127", f"tetrahedron {link} behind {tet}", tet)
            other, back = link, tet
            fourth = view.tets[tet][2 * slot + 1]
        if fourth not in vertices or fourth in face:
            raise bad("F128", f"vertex {fourth} beyond tetrahedron {tet}", tet)
        return other, fourth, back, tuple(sorted((*face, fourth)))

    # Tetrahedron: vertices and links.
    found = {}
    start = view.hull_faces[hulls[0]]
    four = hull_vertices(hulls[0])
    found[start.tet] = four, links_of(start.tet)
    queue = [start.tet]
    while queue:
        tet = queue.pop()
        for slot in range(4):
            step = beyond(tet, slot)
            if step is None:
                continue
            other, _, _, four = step
            if other not in found:
                found[other] = four, links_of(other)
                queue.append(other)
            elif found[other][0] != four:
                raise bad("F128", f"{four} beyond tetrahedron {tet}, but {found[other][0]}", tet)
    for tet in tets:
        if tet not in found:
            raise bad("F130", f"nothing leads to tetrahedron {tet}", tet)

    _check_hull(view, hulls, hull_vertices, found, bad)
    _check_faces(view, faces, found, bad)
    for tet in tets:
        four, links = found[tet]
        for slot in range(4):
            step = beyond(tet, slot)
            if step is not None:
                other, fourth, back, _ = step
                if found[other][1][found[other][0].index(fourth)] != back:
                    raise bad("F128", f"tetrahedron {other} does not refer to {tet}", other)
            if view.tets[tet][2 * slot + 1] != (NONE if step is None else step[1]):
                raise bad("F129", f"opposite vertex of slot {slot}", tet)
    return found


def _check_hull(view, hulls, hull_vertices, found, bad):
    """F125: every face without a neighbour has one hull face, and every hull face is one."""
    named = set()
    for row in hulls:
        hull, four = view.hull_faces[row], hull_vertices(row)
        key = (hull.tet, four.index(hull.opposite))
        right = found[hull.tet][0] == four and found[hull.tet][1][key[1]] == NONE
        if not right or key in named:
            raise bad("F125", f"hull face {hull}", row, c.HULL_FACES, 20)
        named.add(key)
    for tet, (_, links) in found.items():
        for slot, link in enumerate(links):
            if link == NONE and (tet, slot) not in named:
                raise bad("F125", f"no hull face for tetrahedron {tet}, slot {slot}", tet)


def _check_faces(view, faces, found, bad):
    """F126: both tetrahedra of a constrained face refer to it."""
    for row in faces:
        face = view.tet_faces[row]
        for tet, opposite in zip(face.tet, face.opposite):
            four, links = found.get(tet, ((), ()))
            right = set(four) == {*face.vertex, opposite} and links[four.index(opposite)] == FACE_BIT | row
            if not right or face.tet[0] == face.tet[1]:
                raise bad("F126", f"{face}", row, c.TET_FACES, 32)
