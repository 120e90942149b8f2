//! The vertices and links of the tetrahedra of a tet leaf, derived as a traversal derives them.
//!
//! A record does not hold the vertices of its tetrahedron: a traversal derives them from the
//! tetrahedron that it came from. So does this file, from a leaf's
//! first hull face through every tetrahedron. [`super::tet_faces`] then compares every record, hull
//! face and constrained face with the result, so that no traversal, wherever it starts, can derive
//! anything else. Specification: "Records" and the text below the table of "Index check".

use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::object::ObjectView;
use std::borrow::Cow;
use std::ops::Range;

/// The vertices and links of one leaf's tetrahedra. Tetrahedra, vertices and faces are named by
/// their rows in the file.
pub(crate) struct TetAdjacency<'a> {
    pub(super) view: &'a ObjectView<'a>,
    pub(super) tets: Range<u32>,
    vertex_rows: Range<u32>,
    face_rows: Range<u32>,
    /// Per tetrahedron its vertices, ascending; [`UNREACHED`] until it is reached.
    vertices: Vec<[u32; 4]>,
}

const UNREACHED: [u32; 4] = [NONE; 4];

/// What lies across a face of a tetrahedron.
#[derive(Clone, Copy)]
pub(super) struct Neighbour {
    pub(super) tet: u32,
    /// Its vertex that is not of the face.
    pub(super) opposite: u32,
    /// The link that it should have across the face.
    pub(super) back: u32,
}

impl<'a> TetAdjacency<'a> {
    /// Derives the vertices of all tetrahedra of a leaf whose ranges have been checked.
    ///
    /// # Errors
    /// BTH-F125 where the first hull face is invalid, BTH-F126 to BTH-F128 where a link leads to
    /// nothing that fits, BTH-F130 where a tetrahedron is not reached.
    pub(crate) fn derive(view: &'a ObjectView<'a>, leaf: &TetLeaf) -> Result<Self> {
        let count = leaf.tets as usize;
        let mut this = Self {
            view,
            tets: leaf.first_tet..leaf.first_tet + leaf.tets,
            vertex_rows: leaf.first_vertex..leaf.first_vertex + leaf.vertices,
            face_rows: leaf.first_face..leaf.first_face + leaf.faces,
            vertices: vec![UNREACHED; count],
        };
        let hull = &view.hull_faces[leaf.first_hull as usize];
        let vertices = this.hull_vertices(leaf.first_hull)?;
        this.vertices[(hull.tet - leaf.first_tet) as usize] = vertices;
        let mut stack = vec![hull.tet];
        while let Some(tet) = stack.pop() {
            for slot in 0..4 {
                stack.extend(this.cross(tet, slot)?);
            }
        }
        match this.vertices.iter().position(|v| *v == UNREACHED) {
            None => Ok(this),
            Some(i) => {
                let tet = this.tets.start + i as u32;
                let found = format!("none to {tet}");
                Err(this.error(Code::Unreached, tet, "a way to each tetrahedron", found))
            }
        }
    }

    /// Vertices of a tetrahedron, ascending.
    pub(crate) fn vertices(&self, tet: u32) -> [u32; 4] {
        self.vertices[(tet - self.tets.start) as usize]
    }

    /// Links of a tetrahedron.
    pub(crate) fn links(&self, tet: u32) -> [u32; 4] {
        self.view.records[tet as usize].link.map(|l| l.next)
    }

    /// BTH-F128: crosses a face of a reached tetrahedron. Returns the neighbour where it is reached
    /// for the first time; a neighbour that was reached before has to have the same vertices on
    /// this way.
    fn cross(&mut self, tet: u32, slot: usize) -> Result<Option<u32>> {
        let face = others(self.vertices(tet), slot);
        let Some(next) = self.neighbour(tet, slot)? else { return Ok(None) };
        if !self.vertex_rows.contains(&next.opposite) || face.contains(&next.opposite) {
            let found = format!("{} beyond slot {slot}", next.opposite);
            let expected = "another vertex of the leaf beyond the face";
            return Err(self.error(Code::Neighbour, tet, expected, found));
        }
        let (found, known) = (sorted(face, next.opposite), self.vertices(next.tet));
        if known == UNREACHED {
            self.vertices[(next.tet - self.tets.start) as usize] = found;
            return Ok(Some(next.tet));
        }
        if known != found {
            let expected = format!("vertices {known:?} in tetrahedron {}", next.tet);
            return Err(self.error(Code::Neighbour, tet, expected, format!("{found:?} beyond slot {slot}")));
        }
        Ok(None)
    }

    /// What lies across the face of a slot of a reached tetrahedron; `None` outside the hull.
    pub(super) fn neighbour(&self, tet: u32, slot: usize) -> Result<Option<Neighbour>> {
        let link = self.links(tet)[slot];
        if link == NONE {
            return Ok(None);
        }
        if link & FACE_BIT != 0 {
            return self.across_constrained_face(tet, slot, link).map(Some);
        }
        if !self.tets.contains(&link) || link == tet {
            let found = format!("tetrahedron {link}");
            return Err(self.error(Code::Link, tet, "another tetrahedron of the leaf", found));
        }
        let opposite = self.view.records[tet as usize].link[slot].opposite;
        Ok(Some(Neighbour { tet: link, opposite, back: tet }))
    }

    /// BTH-F127 and BTH-F126: the link leads to a constrained face of the leaf that names this
    /// tetrahedron on one side and another one of the leaf on the other.
    fn across_constrained_face(&self, tet: u32, slot: usize, link: u32) -> Result<Neighbour> {
        let row = link & !FACE_BIT;
        if !self.face_rows.contains(&row) {
            return Err(self.error(Code::Link, tet, "a constrained face of the leaf", format!("face {row}")));
        }
        let named = &self.view.tet_faces[row as usize];
        let error = |expected: String, found: String| {
            let at = u64::from(row) * size_of::<TetFace>() as u64;
            Error::within(Code::TetFace, kind::TET_FACES, at, expected, found)
        };
        let vertices = self.vertices(tet);
        let (face, opposite) = (others(vertices, slot), vertices[slot]);
        let side = (0..2).find(|&s| named.tet[s] == tet && named.opposite[s] == opposite);
        let (Some(side), true) = (side, is_same_face(named.vertex, face)) else {
            let expected = format!("face {face:?} with tetrahedron {tet} and its vertex {opposite}");
            return Err(error(expected, format!("{named:?}")));
        };
        let next = named.tet[1 - side];
        if !self.tets.contains(&next) || next == tet {
            return Err(error("another tetrahedron of the leaf behind the face".into(), format!("{next}")));
        }
        Ok(Neighbour { tet: next, opposite: named.opposite[1 - side], back: link })
    }

    /// BTH-F125: the four vertices of a hull face's tetrahedron, ascending, which are distinct and
    /// of the leaf, as the tetrahedron is.
    pub(super) fn hull_vertices(&self, row: u32) -> Result<[u32; 4]> {
        let hull = &self.view.hull_faces[row as usize];
        let vertices = sorted(hull.vertex, hull.opposite);
        let distinct = vertices.windows(2).all(|w| w[0] < w[1]);
        let of_leaf = vertices.iter().all(|v| self.vertex_rows.contains(v)) && self.tets.contains(&hull.tet);
        if distinct && of_leaf {
            return Ok(vertices);
        }
        let at = u64::from(row) * size_of::<HullFace>() as u64;
        let expected = "distinct vertices and a tetrahedron of the leaf";
        Err(Error::within(Code::HullFace, kind::HULL_FACES, at, expected, format!("{hull:?}")))
    }

    /// An error about the record of a tetrahedron.
    pub(super) fn error(
        &self,
        code: Code,
        tet: u32,
        expected: impl Into<Cow<'static, str>>,
        found: impl Into<Cow<'static, str>>,
    ) -> Error {
        Error::within(code, kind::TETS, u64::from(tet) * size_of::<Link32>() as u64, expected, found)
    }
}

/// Three vertices and a fourth, ascending.
fn sorted([a, b, c]: [u32; 3], d: u32) -> [u32; 4] {
    let mut all = [a, b, c, d];
    all.sort_unstable();
    all
}

/// Returns the vertices except the one of a slot, in order.
pub(super) fn others([a, b, c, d]: [u32; 4], slot: usize) -> [u32; 3] {
    match slot {
        0 => [b, c, d],
        1 => [a, c, d],
        2 => [a, b, d],
        _ => [a, b, c],
    }
}

/// Returns true if two faces have the same vertices. The vertices of `b` are distinct.
pub(super) fn is_same_face(a: [u32; 3], b: [u32; 3]) -> bool {
    b.iter().all(|v| a.contains(v))
}
