//! Hull faces, constrained faces and links of tet leaves, compared with the derived
//! tetrahedra.

use super::adjacency::{Neighbour, TetAdjacency, is_same_face, others};
use super::bit_set::BitSet;
use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::object::ObjectView;

/// Checks the tetrahedra of every tet leaf: BTH-F125 to BTH-F130.
pub(super) fn check(view: &ObjectView) -> Result<()> {
    view.tet_leaves.iter().try_for_each(|leaf| {
        let tets = TetAdjacency::derive(view, leaf)?;
        check_hull_faces(&tets, leaf)?;
        check_constrained_faces(&tets, leaf)?;
        tets.tets.clone().try_for_each(|tet| check_links(&tets, tet))
    })
}

/// BTH-F125: every face without a neighbour has one hull face, and every hull face is one.
fn check_hull_faces(tets: &TetAdjacency, leaf: &TetLeaf) -> Result<()> {
    let face_number = |tet: u32, slot: usize| 4 * (tet - tets.tets.start) as usize + slot;
    let mut named = BitSet::new(4 * tets.tets.len());
    for row in leaf.first_hull..leaf.first_hull + leaf.hulls {
        let hull = &tets.view.hull_faces[row as usize];
        let vertices = tets.hull_vertices(row)?;
        let slot = vertices.iter().position(|v| *v == hull.opposite).expect("it is one of the four vertices");
        let right = tets.vertices(hull.tet) == vertices && tets.links(hull.tet)[slot] == NONE;
        if !right || named.insert(face_number(hull.tet, slot)) {
            let at = u64::from(row) * size_of::<HullFace>() as u64;
            let expected = format!("a face of {:?} without a neighbour, once", tets.vertices(hull.tet));
            return Err(Error::within(Code::HullFace, kind::HULL_FACES, at, expected, format!("{hull:?}")));
        }
    }
    for tet in tets.tets.clone() {
        for (slot, link) in tets.links(tet).into_iter().enumerate() {
            if link == NONE && !named.contains(face_number(tet, slot)) {
                let expected = "a hull face where there is no neighbour";
                let found = format!("none for slot {slot} of tetrahedron {tet}");
                return Err(tets.error(Code::HullFace, tet, expected, found));
            }
        }
    }
    Ok(())
}

/// BTH-F126: both tetrahedra of a constrained face refer to it. That no other one does follows from
/// the derivation, which follows a link to a face only from a tetrahedron that the face names.
fn check_constrained_faces(tets: &TetAdjacency, leaf: &TetLeaf) -> Result<()> {
    for row in leaf.first_face..leaf.first_face + leaf.faces {
        let face = &tets.view.tet_faces[row as usize];
        let refers = |side: usize| {
            let tet = face.tet[side];
            if !tets.tets.contains(&tet) {
                return false;
            }
            let vertices = tets.vertices(tet);
            let slot = vertices.iter().position(|v| *v == face.opposite[side]);
            slot.is_some_and(|slot| {
                tets.links(tet)[slot] == FACE_BIT | row && is_same_face(face.vertex, others(vertices, slot))
            })
        };
        if !refers(0) || !refers(1) || face.tet[0] == face.tet[1] {
            let at = u64::from(row) * size_of::<TetFace>() as u64;
            let expected = "two tetrahedra with this face that refer to it";
            return Err(Error::within(Code::TetFace, kind::TET_FACES, at, expected, format!("{face:?}")));
        }
    }
    Ok(())
}

/// BTH-F128 and BTH-F129: neighbours refer back, and links name the vertices beyond.
fn check_links(tets: &TetAdjacency, tet: u32) -> Result<()> {
    for (slot, link) in tets.links(tet).into_iter().enumerate() {
        let neighbour = tets.neighbour(tet, slot)?;
        if let Some(Neighbour { tet: next, opposite, back }) = neighbour {
            let there = tets.vertices(next).iter().position(|v| *v == opposite);
            let found = there.map(|s| tets.links(next)[s]);
            if found != Some(back) {
                let expected = format!("tetrahedron {next} to refer to {tet}");
                return Err(tets.error(Code::Neighbour, next, expected, format!("{found:?}")));
            }
        }
        let found = tets.view.records[tet as usize].link[slot].opposite;
        let expected = neighbour.map_or(NONE, |n| n.opposite);
        if found != expected {
            let expected = format!("opposite vertex {expected} beyond slot {slot}");
            return Err(tets.error(Code::TetRecord, tet, expected, format!("{found}, link {link}")));
        }
    }
    Ok(())
}
