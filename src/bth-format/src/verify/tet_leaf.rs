//! The box and the orientations of a tet leaf.

use super::aabb::Aabb;
use crate::check::TetAdjacency;
use crate::error::{Code, Error, Result};
use crate::exact::side;
use crate::layout::*;
use crate::object::ObjectView;
use std::cmp::Ordering;

/// Checks BTH-F205 and BTH-F206 of the tet leaf of a row, whose indices have been checked. Returns
/// the vertices of its tetrahedra.
pub(super) fn check<'a>(view: &'a ObjectView<'a>, row: usize, leaf: &TetLeaf) -> Result<TetAdjacency<'a>> {
    check_box(view, row, leaf)?;
    let adjacency = TetAdjacency::derive(view, leaf)?;
    check_tetrahedra(view, leaf, &adjacency)?;
    check_constrained_faces(view, leaf)?;
    check_hull_faces(view, leaf)?;
    Ok(adjacency)
}

fn point(view: &ObjectView, vertex: u32) -> [f32; 3] {
    view.tet_vertices[vertex as usize].position
}

fn orientation(section: u32, at: u64, expected: &'static str, found: String) -> Result<()> {
    Err(Error::within(Code::Orientation, section, at, expected, found))
}

/// BTH-F205: the box contains the vertices.
fn check_box(view: &ObjectView, row: usize, leaf: &TetLeaf) -> Result<()> {
    let bounds = Aabb { lower: leaf.lower, upper: leaf.upper };
    for v in leaf.first_vertex..leaf.first_vertex + leaf.vertices {
        let p = point(view, v);
        if !bounds.contains(&Aabb { lower: p, upper: p }) {
            let at = u64::from(v) * size_of::<TetVertex>() as u64;
            let (lower, upper) = (leaf.lower, leaf.upper);
            let expected = format!("a vertex in the box of tet leaf {row}, {lower:?} to {upper:?}");
            let found = format!("{p:?}");
            return Err(Error::within(Code::TetContainment, kind::TET_VERTICES, at, expected, found));
        }
    }
    Ok(())
}

/// BTH-F206: tetrahedra have volume, and neighbours lie on either side of their common face.
fn check_tetrahedra(view: &ObjectView, leaf: &TetLeaf, adjacency: &TetAdjacency<'_>) -> Result<()> {
    let rows = leaf.first_tet..leaf.first_tet + leaf.tets;
    let stride = size_of::<Link32>() as u64;
    // One exact sign per tetrahedron, of its vertices in ascending order. On which side of a face
    // the opposite vertex lies follows from the parity of moving that vertex to the end.
    let signs: Vec<Ordering> = rows
        .clone()
        .map(|tet| {
            let [a, b, c, d] = adjacency.vertices(tet).map(|v| point(view, v));
            side(a, b, c, d)
        })
        .collect();
    let opposite_side = |tet: u32, slot: usize| {
        let sign = signs[(tet - leaf.first_tet) as usize];
        if slot % 2 == 1 { sign } else { sign.reverse() }
    };
    for (tet, sign) in rows.zip(&signs) {
        let at = u64::from(tet) * stride;
        if *sign == Ordering::Equal {
            let found = format!("{:?}", adjacency.vertices(tet));
            return orientation(kind::TETS, at, "a tetrahedron with volume", found);
        }
        for (slot, link) in adjacency.links(tet).into_iter().enumerate() {
            if link & FACE_BIT != 0 {
                continue;
            }
            let back = adjacency.links(link).iter().position(|l| *l == tet);
            if back.is_none_or(|back| opposite_side(tet, slot) == opposite_side(link, back)) {
                let found = format!("tetrahedra {tet} and {link} on the same side of their face");
                return orientation(kind::TETS, at, "neighbours on either side of their face", found);
            }
        }
    }
    Ok(())
}

/// BTH-F206: the first tetrahedron of a constrained face lies where its normal points to, the
/// second behind.
fn check_constrained_faces(view: &ObjectView, leaf: &TetLeaf) -> Result<()> {
    for row in leaf.first_face..leaf.first_face + leaf.faces {
        let face = &view.tet_faces[row as usize];
        let [a, b, c] = face.vertex.map(|v| point(view, v));
        let sides = face.opposite.map(|v| side(a, b, c, point(view, v)));
        if sides != [Ordering::Greater, Ordering::Less] {
            let at = u64::from(row) * size_of::<TetFace>() as u64;
            let expected = "the first tetrahedron in front, the second behind";
            return orientation(kind::TET_FACES, at, expected, format!("{sides:?}"));
        }
    }
    Ok(())
}

/// BTH-F206: hull faces point inwards.
fn check_hull_faces(view: &ObjectView, leaf: &TetLeaf) -> Result<()> {
    for row in leaf.first_hull..leaf.first_hull + leaf.hulls {
        let hull = &view.hull_faces[row as usize];
        let [a, b, c] = hull.vertex.map(|v| point(view, v));
        if side(a, b, c, point(view, hull.opposite)) != Ordering::Greater {
            let at = u64::from(row) * size_of::<HullFace>() as u64;
            let found = format!("{:?}", hull.vertex);
            return orientation(kind::HULL_FACES, at, "a hull face that points inwards", found);
        }
    }
    Ok(())
}
