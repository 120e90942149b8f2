//! What lies behind the faces of tetrahedra.
//!
//! The compact records hold neither all vertices nor, in Tet16, all links of a tetrahedron: a walk
//! derives them from where it came. So the check walks too: from a leaf's first hull face through
//! every tetrahedron, deriving the four vertices of each. Then every record, hull face and
//! constrained face is held against them, so that no walk, wherever it starts, can derive others.

use super::Bits;
use crate::error::{Code, Error, Result};
use crate::layout::*;
use crate::object::{ObjectView, Records};
use std::ops::Range;

pub(super) fn check(view: &ObjectView) -> Result<()> {
    view.tet_leaves.iter().try_for_each(|leaf| {
        let tets = Derived::flood(view, leaf)?;
        tets.check_hull(leaf)?;
        tets.check_faces(leaf)?;
        tets.check_links()
    })
}

/// The vertices and links of a leaf's tetrahedra.
pub(crate) struct Derived<'a> {
    view: &'a ObjectView<'a>,
    rows: Range<u32>,
    vertex_rows: Range<u32>,
    face_rows: Range<u32>,
    /// Per tetrahedron its vertices, ascending; `UNKNOWN` until it is reached.
    vertices: Vec<[u32; 4]>,
    /// Per tetrahedron the fourth link, which Tet16 lacks.
    last: Vec<u32>,
}

const UNKNOWN: [u32; 4] = [NONE; 4];

impl<'a> Derived<'a> {
    /// Derives the vertices of all tetrahedra of a leaf whose ranges have been checked.
    pub(crate) fn flood(view: &'a ObjectView<'a>, leaf: &TetLeaf) -> Result<Self> {
        let count = leaf.tets as usize;
        let mut this = Self {
            view,
            rows: leaf.first_tet..leaf.first_tet + leaf.tets,
            vertex_rows: leaf.first_vertex..leaf.first_vertex + leaf.vertices,
            face_rows: leaf.first_face..leaf.first_face + leaf.faces,
            vertices: vec![UNKNOWN; count],
            last: if matches!(view.records, Records::Tet16(_)) { vec![NONE; count] } else { Vec::new() },
        };
        let hull = &view.hull_faces[leaf.first_hull as usize];
        let at = leaf.first_hull as usize * size_of::<HullFace>();
        let vertices = this.hull_vertices(hull, at)?;
        this.reach(hull.tet, vertices, hull.opposite, NONE);
        let mut stack = vec![hull.tet];
        while let Some(tet) = stack.pop() {
            let vertices = this.vertices(tet);
            for (slot, &opposite) in vertices.iter().enumerate() {
                let face = others(vertices, slot);
                let Some((next, fourth, entry)) = this.beyond(tet, slot, face, opposite)? else { continue };
                if !this.vertex_rows.contains(&fourth) || face.contains(&fourth) {
                    let expected = "another vertex of the leaf beyond the face";
                    return Err(this.fail(
                        Code::Neighbour,
                        tet,
                        expected,
                        format!("{fourth} beyond slot {slot}"),
                    ));
                }
                let found = sorted(face, fourth);
                if this.vertices(next) == UNKNOWN {
                    this.reach(next, found, fourth, entry);
                    stack.push(next);
                } else if this.vertices(next) != found {
                    let expected = format!("vertices {:?} in tetrahedron {next}", this.vertices(next));
                    return Err(this.fail(
                        Code::Neighbour,
                        tet,
                        expected,
                        format!("{found:?} beyond slot {slot}"),
                    ));
                }
            }
        }
        if let Some(i) = this.vertices.iter().position(|v| *v == UNKNOWN) {
            let tet = this.rows.start + i as u32;
            return Err(this.fail(
                Code::Unreached,
                tet,
                "a way to each tetrahedron",
                format!("none to {tet}"),
            ));
        }
        Ok(this)
    }

    /// Vertices of a tetrahedron (a row of TETS), ascending.
    pub(crate) fn vertices(&self, tet: u32) -> [u32; 4] {
        self.vertices[(tet - self.rows.start) as usize]
    }

    /// Links of a tetrahedron whose vertices are known.
    pub(crate) fn links(&self, tet: u32) -> [u32; 4] {
        let row = tet as usize;
        match self.view.records {
            Records::None => [NONE; 4],
            Records::Link32(r) => r[row].link.map(|l| l.next),
            Records::Tet32(r) => r[row].next,
            Records::Tet20(r) => r[row].next,
            Records::Tet16(r) => {
                let last = self.last[(tet - self.rows.start) as usize];
                let [a, b, c] = r[row].next.map(|n| n ^ last);
                [a, b, c, last]
            }
        }
    }

    /// Records that a tetrahedron with these vertices was entered through the face opposite to `fourth`,
    /// behind which lies `entry`.
    fn reach(&mut self, tet: u32, vertices: [u32; 4], fourth: u32, entry: u32) {
        let i = (tet - self.rows.start) as usize;
        self.vertices[i] = vertices;
        if let Records::Tet16(r) = self.view.records {
            let slot =
                vertices.iter().position(|v| *v == fourth).expect("the fourth vertex is one of the four");
            let xored = r[tet as usize].next;
            self.last[i] = if slot == 3 { entry } else { xored[slot] ^ entry };
        }
    }

    /// The tetrahedron beyond a face of another, its vertex that is not of the face, and what it should
    /// have behind the face; `None` outside the hull.
    fn beyond(
        &self,
        tet: u32,
        slot: usize,
        face: [u32; 3],
        opposite: u32,
    ) -> Result<Option<(u32, u32, u32)>> {
        let link = self.links(tet)[slot];
        if link == NONE {
            return Ok(None);
        }
        if link & FACE_BIT != 0 {
            let row = link & !FACE_BIT;
            if !self.face_rows.contains(&row) {
                return Err(self.fail(
                    Code::Link,
                    tet,
                    "a constrained face of the leaf",
                    format!("face {row}"),
                ));
            }
            let side = &self.view.tet_faces[row as usize];
            let at = row as usize * size_of::<TetFace>();
            let here = (0..2).find(|&s| side.tet[s] == tet && side.opposite[s] == opposite);
            let (Some(here), true) = (here, same(side.vertex, face)) else {
                let expected = format!("face {face:?} with tetrahedron {tet} and its vertex {opposite}");
                return Err(Error::within(
                    Code::TetFace,
                    kind::TET_FACES,
                    at as u64,
                    expected,
                    format!("{side:?}"),
                ));
            };
            let next = side.tet[1 - here];
            if !self.rows.contains(&next) || next == tet {
                let expected = "another tetrahedron of the leaf behind the face";
                return Err(Error::within(
                    Code::TetFace,
                    kind::TET_FACES,
                    at as u64,
                    expected,
                    next.to_string(),
                ));
            }
            return Ok(Some((next, side.opposite[1 - here], link)));
        }
        if !self.rows.contains(&link) || link == tet {
            return Err(self.fail(
                Code::Link,
                tet,
                "another tetrahedron of the leaf",
                format!("tetrahedron {link}"),
            ));
        }
        let row = link as usize;
        let shared = face[0] ^ face[1] ^ face[2];
        let fourth = match self.view.records {
            Records::None => NONE,
            Records::Link32(r) => r[tet as usize].link[slot].opposite,
            Records::Tet32(r) => r[row].xor ^ shared,
            Records::Tet20(r) => r[row].xor ^ shared,
            Records::Tet16(r) => r[row].xor ^ shared,
        };
        Ok(Some((link, fourth, tet)))
    }

    /// The four vertices of a hull face's tetrahedron, ascending, if the face is possible.
    fn hull_vertices(&self, hull: &HullFace, at: usize) -> Result<[u32; 4]> {
        let vertices = sorted(hull.vertex, hull.opposite);
        let distinct = vertices.windows(2).all(|w| w[0] < w[1]);
        if !distinct
            || !vertices.iter().all(|v| self.vertex_rows.contains(v))
            || !self.rows.contains(&hull.tet)
        {
            let expected = "distinct vertices and a tetrahedron of the leaf";
            return Err(Error::within(
                Code::HullFace,
                kind::HULL_FACES,
                at as u64,
                expected,
                format!("{hull:?}"),
            ));
        }
        Ok(vertices)
    }

    /// Every face without a neighbour has one hull face, and every hull face is one.
    fn check_hull(&self, leaf: &TetLeaf) -> Result<()> {
        let mut named = Bits::new(4 * self.vertices.len());
        for row in leaf.first_hull..leaf.first_hull + leaf.hulls {
            let hull = &self.view.hull_faces[row as usize];
            let at = row as usize * size_of::<HullFace>();
            let vertices = self.hull_vertices(hull, at)?;
            let slot = vertices.iter().position(|v| *v == hull.opposite).expect("one of the four");
            let right = self.vertices(hull.tet) == vertices && self.links(hull.tet)[slot] == NONE;
            if !right || named.set(4 * (hull.tet - self.rows.start) as usize + slot) {
                let expected = format!("a face of {:?} without a neighbour, once", self.vertices(hull.tet));
                return Err(Error::within(
                    Code::HullFace,
                    kind::HULL_FACES,
                    at as u64,
                    expected,
                    format!("{hull:?}"),
                ));
            }
        }
        for tet in self.rows.clone() {
            for (slot, link) in self.links(tet).into_iter().enumerate() {
                if link == NONE && !named.get(4 * (tet - self.rows.start) as usize + slot) {
                    let found = format!("none for slot {slot} of tetrahedron {tet}");
                    return Err(self.fail(
                        Code::HullFace,
                        tet,
                        "a hull face where there is no neighbour",
                        found,
                    ));
                }
            }
        }
        Ok(())
    }

    /// Both tetrahedra of a constrained face refer to it. (That no other does was seen on the way: a link
    /// to a face is followed only from a tetrahedron that the face names.)
    fn check_faces(&self, leaf: &TetLeaf) -> Result<()> {
        for row in leaf.first_face..leaf.first_face + leaf.faces {
            let face = &self.view.tet_faces[row as usize];
            let refers = |s: usize| {
                self.rows.contains(&face.tet[s]) && {
                    let vertices = self.vertices(face.tet[s]);
                    let slot = vertices.iter().position(|v| *v == face.opposite[s]);
                    slot.is_some_and(|slot| {
                        self.links(face.tet[s])[slot] == FACE_BIT | row
                            && same(face.vertex, others(vertices, slot))
                    })
                }
            };
            if !refers(0) || !refers(1) || face.tet[0] == face.tet[1] {
                let at = (row as usize * size_of::<TetFace>()) as u64;
                let expected = "two tetrahedra with this face that refer to it";
                return Err(Error::within(Code::TetFace, kind::TET_FACES, at, expected, format!("{face:?}")));
            }
        }
        Ok(())
    }

    /// Links between tetrahedra go both ways, and records say the vertices that were derived.
    fn check_links(&self) -> Result<()> {
        for tet in self.rows.clone() {
            let vertices = self.vertices(tet);
            let links = self.links(tet);
            for slot in 0..4 {
                let beyond = self.beyond(tet, slot, others(vertices, slot), vertices[slot])?;
                if let Some((next, fourth, back)) = beyond {
                    let there = self.vertices(next).iter().position(|v| *v == fourth);
                    let found = there.map(|s| self.links(next)[s]);
                    if found != Some(back) {
                        let expected = format!("tetrahedron {next} to refer to {tet}");
                        return Err(self.fail(Code::Neighbour, next, expected, format!("{found:?}")));
                    }
                }
                if let Records::Link32(r) = self.view.records {
                    let opposite = r[tet as usize].link[slot].opposite;
                    let expected = beyond.map_or(NONE, |(_, fourth, _)| fourth);
                    if opposite != expected {
                        let expected = format!("opposite vertex {expected} beyond slot {slot}");
                        return Err(self.fail(
                            Code::TetRecord,
                            tet,
                            expected,
                            format!("{opposite}, link {}", links[slot]),
                        ));
                    }
                }
            }
            let xor = vertices.iter().fold(0, |x, v| x ^ v);
            let right = match self.view.records {
                Records::None | Records::Link32(_) => true,
                Records::Tet32(r) => {
                    r[tet as usize].xor == xor && r[tet as usize].vertex[..] == vertices[..3]
                }
                Records::Tet20(r) => r[tet as usize].xor == xor,
                Records::Tet16(r) => r[tet as usize].xor == xor,
            };
            if !right {
                let expected = format!("the vertices {vertices:?} and their exclusive or {xor}");
                return Err(self.fail(Code::TetRecord, tet, expected, "others"));
            }
        }
        Ok(())
    }

    fn fail(&self, code: Code, tet: u32, expected: impl Into<String>, found: impl Into<String>) -> Error {
        let stride = RecordKind::from_code(self.view.header.record).map_or(0, RecordKind::stride);
        Error::within(code, kind::TETS, tet as u64 * stride as u64, expected, found)
    }
}

/// Three vertices and a fourth, ascending.
fn sorted([a, b, c]: [u32; 3], d: u32) -> [u32; 4] {
    let mut all = [a, b, c, d];
    all.sort_unstable();
    all
}

/// The vertices other than that of a slot.
fn others(vertices: [u32; 4], slot: usize) -> [u32; 3] {
    let mut rest = [0; 3];
    let mut n = 0;
    for (i, v) in vertices.into_iter().enumerate() {
        if i != slot {
            rest[n] = v;
            n += 1;
        }
    }
    rest
}

/// Whether two faces have the same vertices; those of `b` are distinct.
fn same(a: [u32; 3], b: [u32; 3]) -> bool {
    b.iter().all(|v| a.contains(v))
}
