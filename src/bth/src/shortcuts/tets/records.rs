//! One interface to the two records of tetrahedra.
//!
//! A record is read only after a walk has entered its tetrahedron through a face, so the three
//! vertices of the face and the link behind it are known. The record yields the fourth vertex and
//! the links behind the other faces.
//!
//! `Tet16` has 16 bytes: the exclusive or of the four vertices, and three words that combine the
//! four links. It is from A. Aman, S. Demirci and U. Güdükbay, "Compact tetrahedralization-based
//! acceleration structures for ray tracing", 2021 (arXiv 2103.02309). `Link32` has 32 bytes. Each
//! of its links stores the fourth vertex of the tetrahedron that it leads to.

use bth_format::layout::{Link, NONE, Tet16};
use bth_format::object::Records;

/// The face through which a walk entered a tetrahedron, and the fourth vertex of the tetrahedron.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entered {
    /// Vertices of the entered face.
    pub(crate) face: [u32; 3],
    /// The fourth vertex.
    pub(crate) apex: u32,
    /// The link behind the entered face, as the record of the tetrahedron stores it: it leads to
    /// the previous tetrahedron, or to the constrained face between the two.
    pub(crate) behind: u32,
}

impl Entered {
    /// Number of the tetrahedron's vertices with an index below `vertex`: 0 to 3 for its own
    /// vertices.
    #[inline(always)]
    fn rank(&self, vertex: u32) -> usize {
        let below = |v: u32| (v < vertex) as usize;
        below(self.face[0]) + below(self.face[1]) + below(self.face[2]) + below(self.apex)
    }
}

/// The fourth vertex of a tetrahedron, from the exclusive or of all four vertices and the vertices
/// of a face.
#[inline(always)]
fn fourth_vertex(xor: u32, face: [u32; 3]) -> u32 {
    xor ^ face[0] ^ face[1] ^ face[2]
}

/// The link of a [`Tet16`] behind the face opposite to `vertex`. Each of the three words is the
/// exclusive or of a link and the fourth link, so `entered.behind` yields the fourth link, and that
/// yields any other.
#[inline(always)]
fn decode_link(record: &Tet16, entered: &Entered, vertex: u32) -> u32 {
    let stored = |rank: usize| record.next.get(rank).copied().unwrap_or(0);
    let fourth_link = entered.behind ^ stored(entered.rank(entered.apex));
    fourth_link ^ stored(entered.rank(vertex))
}

/// Reads records of an object's tetrahedra. Links are stored in ascending order of the opposite
/// vertex.
pub(crate) trait ReadRecords {
    /// The vertex of a tetrahedron that is not on `face`. `opposite` is from the link that was
    /// followed to the tetrahedron.
    fn apex(&self, tet: u32, face: [u32; 3], opposite: u32) -> u32;
    /// The link behind the face opposite to `vertex`. Its `opposite` is `NONE` in records whose
    /// [`Self::apex`] does not need it.
    fn link(&self, tet: u32, entered: &Entered, vertex: u32) -> Link;
}

impl ReadRecords for Records<'_> {
    #[inline(always)]
    fn apex(&self, tet: u32, face: [u32; 3], opposite: u32) -> u32 {
        match self {
            Records::Link32(_) => opposite,
            Records::Tet16(records) => fourth_vertex(records[tet as usize].xor, face),
            Records::None => NONE,
        }
    }

    #[inline(always)]
    fn link(&self, tet: u32, entered: &Entered, vertex: u32) -> Link {
        match self {
            Records::Link32(records) => records[tet as usize].link[entered.rank(vertex) & 3],
            Records::Tet16(records) => {
                Link { next: decode_link(&records[tet as usize], entered, vertex), opposite: NONE }
            }
            Records::None => Link { next: NONE, opposite: NONE },
        }
    }
}
