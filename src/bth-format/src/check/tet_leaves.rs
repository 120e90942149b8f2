//! Tet leaves, their vertices, and the map from triangles to constrained faces.

use super::nodes::is_box;
use super::rows::{check_all, is_finite};
use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::object::ObjectView;
use std::mem::offset_of;

pub(super) fn check(view: &ObjectView) -> Result<()> {
    ranges(view)?;
    vertices(view)?;
    triangle_faces(view)
}

/// BTH-F120 to BTH-F122: boxes, flags, ranges and counts of the tet leaves.
fn ranges(view: &ObjectView) -> Result<()> {
    let rows = [view.records.len(), view.tet_vertices.len(), view.tet_faces.len(), view.hull_faces.len()];
    let names = ["TETS", "TET_VERTICES", "TET_FACES", "HULL_FACES"];
    let mut end = [0u64; 4];
    for (i, leaf) in view.tet_leaves.iter().enumerate() {
        let start = (i * size_of::<TetLeaf>()) as u64;
        let fail = |code, offset: usize, expected: String, found: String| {
            Err(Error::within(code, kind::TET_LEAVES, start + offset as u64, expected, found))
        };
        if !is_box(leaf.lower, leaf.upper) || (0..3).any(|a| leaf.lower[a] >= leaf.upper[a]) {
            let found = format!("{:?} to {:?}", leaf.lower, leaf.upper);
            return fail(Code::TetBox, 0, "a finite box, lower < upper".into(), found);
        }
        if leaf.flags != 0 {
            let found = format!("{}", leaf.flags);
            return fail(Code::TetBox, offset_of!(TetLeaf, flags), "flags of 0".into(), found);
        }
        let first = [leaf.first_tet, leaf.first_vertex, leaf.first_face, leaf.first_hull];
        let count = [leaf.tets, leaf.vertices, leaf.faces, leaf.hulls];
        let least = [1, 4, 1, 4];
        for k in 0..4 {
            let offset = offset_of!(TetLeaf, first_tet) + 8 * k;
            let last = first[k] as u64 + count[k] as u64;
            if first[k] as u64 != end[k] || last > rows[k] as u64 {
                let expected = format!("rows of {} from {} to {}", names[k], end[k], rows[k]);
                return fail(Code::TetRanges, offset, expected, format!("{} to {last}", first[k]));
            }
            if count[k] < least[k] {
                let expected = format!("at least {} rows of {}", least[k], names[k]);
                return fail(Code::TetCounts, offset + 4, expected, format!("{}", count[k]));
            }
            end[k] = last;
        }
    }
    for k in 0..4 {
        if end[k] != rows[k] as u64 {
            let expected = format!("tet leaves with {} rows of {}", rows[k], names[k]);
            let at = size_of_val(view.tet_leaves) as u64;
            let found = format!("{}", end[k]);
            return Err(Error::within(Code::TetRanges, kind::TET_LEAVES, at, expected, found));
        }
    }
    Ok(())
}

/// BTH-F124: vertices are finite.
fn vertices(view: &ObjectView) -> Result<()> {
    let is_good = |v: &TetVertex| v.reserved == 0 && is_finite(&v.position);
    check_all(Code::TetVertices, kind::TET_VERTICES, view.tet_vertices, is_good, "a finite position and 0")
}

/// BTH-F131: TRIANGLE_FACES and the triangles of TET_FACES are inverse to each other.
fn triangle_faces(view: &ObjectView) -> Result<()> {
    let fail = |section, at: usize, expected: String, found: String| {
        Err(Error::within(Code::TriangleFaces, section, at as u64, expected, found))
    };
    let expected = if view.tet_leaves.is_empty() { 0 } else { view.header.triangles as usize };
    if view.triangle_faces.len() != expected {
        let found = format!("{}", view.triangle_faces.len());
        return fail(kind::TRIANGLE_FACES, 0, format!("{expected} rows"), found);
    }
    for (row, face) in view.tet_faces.iter().enumerate() {
        if view.triangle_faces.get(face.triangle as usize) != Some(&(row as u32)) {
            let at = row * size_of::<TetFace>() + offset_of!(TetFace, triangle);
            let expected = "a triangle that TRIANGLE_FACES maps to this face".into();
            return fail(kind::TET_FACES, at, expected, format!("triangle {}", face.triangle));
        }
    }
    for (triangle, &face) in view.triangle_faces.iter().enumerate() {
        let named = view.tet_faces.get(face as usize).map(|f| f.triangle);
        if face != NONE && named != Some(triangle as u32) {
            let expected = format!("NONE or the face of triangle {triangle}");
            return fail(kind::TRIANGLE_FACES, 4 * triangle, expected, format!("row {face}"));
        }
    }
    Ok(())
}
