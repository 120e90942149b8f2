//! The tetrahedra of a tet leaf of which it is certain that they fill its box, for objects whose vertices move.

use super::tet_leaf;
use crate::exact::side;
use crate::layout::*;
use crate::object::ObjectView;
use std::cmp::Ordering;

/// The vertices of the tetrahedra of a tet leaf, from its first tetrahedron on: rows of TET_VERTICES, in such an order that each fourth
/// vertex lies on the side of the plane through the first three to which [`side`] says `Greater`. `None` unless all of this holds, which
/// the index check does not cover:
///
/// - the leaf is as BTH-F205 and BTH-F206 demand;
/// - the constrained faces have the corners of their source triangles, bit for bit (BTH-F202);
/// - the hull faces are the sides of the leaf's box, two triangles each.
///
/// Then every point of the box that is on no face lies in exactly one tetrahedron. Proof: the number of tetrahedra that a point lies in
/// changes along a generic path only where the path crosses a face. A face within is common to exactly two tetrahedra, which lie on
/// either side of it, so the number stays there. A hull face has one, on its inner side. All vertices lie in the box, so the number is 0
/// outside; on a way into the box a path crosses exactly one hull face, as these cover the sides of the box once; so it is 1 inside.
///
/// The proof needs nothing of the vertices but that all tetrahedra have the orientations that they have here, and that the corners of the
/// box are those of a box around all others. So it holds for other positions, too, for which that is so.
pub fn filling_tets(view: &ObjectView, row: u32) -> Option<Vec<[u32; 4]>> {
    let leaf = view.tet_leaves.get(row as usize)?;
    let first = leaf.first_face as usize;
    let faces = view.tet_faces.get(first..first + leaf.faces as usize)?;
    let position = |vertex: u32| view.tet_vertices[vertex as usize].position;
    let is_of_source = |face: &TetFace| {
        let source =
            view.triangles.get(face.triangle as usize).map(|t| t.map(|v| view.positions[v as usize]));
        let bits = |corners: [[f32; 3]; 3]| corners.map(|p| p.map(f32::to_bits));
        source.is_some_and(|source| bits(source) == bits(face.vertex.map(position)))
    };
    if !hull_is_box(view, leaf) || !faces.iter().all(is_of_source) {
        return None;
    }
    let adjacency = tet_leaf::check(view, row as usize, leaf).ok()?;
    let positive = |tet: u32| {
        let [a, b, c, d] = adjacency.vertices(tet);
        match side(position(a), position(b), position(c), position(d)) {
            Ordering::Greater => [a, b, c, d],
            _ => [a, c, b, d],
        }
    };
    Some((leaf.first_tet..leaf.first_tet + leaf.tets).map(positive).collect())
}

/// Whether the hull faces of a leaf are two triangles on each side of its box, which meet along a diagonal.
fn hull_is_box(view: &ObjectView, leaf: &TetLeaf) -> bool {
    let hull = &view.hull_faces[leaf.first_hull as usize..][..leaf.hulls as usize];
    // The number of a corner has bit k where it is at the upper end of axis k.
    let corner = |vertex: u32| {
        let position = view.tet_vertices[vertex as usize].position;
        (0..3).try_fold(0u32, |corner, k| match position[k] {
            x if x.to_bits() == leaf.lower[k].to_bits() => Some(corner),
            x if x.to_bits() == leaf.upper[k].to_bits() => Some(corner | 1 << k),
            _ => None,
        })
    };
    // For each side of the box, by axis and end, the corner that each triangle there omits.
    let mut omitted: [Vec<u32>; 6] = Default::default();
    for face in hull {
        let [Some(a), Some(b), Some(c)] = face.vertex.map(corner) else { return false };
        let (all, any) = (a & b & c, a | b | c);
        let Some(axis) = (0..3).find(|k| all >> k & 1 == any >> k & 1) else { return false };
        if a == b || b == c || c == a {
            return false;
        }
        // Around a side, the corner that three others omit is their exclusive or.
        omitted[2 * axis + (all >> axis & 1) as usize].push(a ^ b ^ c);
    }
    omitted.iter().enumerate().all(|(side, omitted)| {
        let others = 0b111 & !(1 << (side / 2));
        matches!(omitted[..], [a, b] if a ^ b == others)
    })
}
