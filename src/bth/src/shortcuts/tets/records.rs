//! One interface to the two records of tetrahedra, for one tetrahedron and for sixteen.
//!
//! A record is read only after a walk has entered its tetrahedron through a face, so the three
//! vertices of the face and the link behind it are known. The record yields the fourth vertex and
//! the links behind the other faces.
//!
//! `Tet16` has 16 bytes: the exclusive or of the four vertices, and three words that combine the
//! four links. It is from A. Aman, S. Demirci and U. Güdükbay, "Compact tetrahedralization-based
//! acceleration structures for ray tracing", 2021 (arXiv 2103.02309). `Link32` has 32 bytes. Each
//! of its links stores the fourth vertex of the tetrahedron that it leads to.

use crate::simd::Simd;
use bth_format::layout::{Link, NONE, Tet16};
use bth_format::object::Records;
use zerocopy::{FromBytes, IntoBytes};

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

/// The tetrahedra of sixteen walks, one in each lane, and the faces through which they were
/// entered. The fields are the same as in [`Entered`].
#[derive(Clone, Copy)]
pub(crate) struct EnteredLanes<S: Simd> {
    pub(crate) tet: S::U,
    pub(crate) face: [S::U; 3],
    /// The `opposite` of the link that was followed, where the fourth vertex is not yet known.
    pub(crate) apex: S::U,
    pub(crate) behind: S::U,
    /// 1 in every lane. It is a variable, because the compiler replaces the masked addition of a
    /// constant by slower code.
    pub(crate) one: S::U,
}

impl<S: Simd> EnteredLanes<S> {
    /// Like [`Entered::rank`], for a vertex in each lane.
    #[inline(always)]
    fn rank(&self, s: S, vertex: S::U) -> S::U {
        let mut rank = s.splat_u(0);
        for v in [self.apex, self.face[0], self.face[1], self.face[2]] {
            rank = s.add_where(rank, s.lt_u(v, vertex), self.one);
        }
        rank
    }
}

/// The fourth vertex in each lane. `xor` holds the index of the word that stores the exclusive or
/// of all four vertices.
#[inline(always)]
fn fourth_vertices<S: Simd>(s: S, words: &[u32], m: S::M, entered: &EnteredLanes<S>, xor: S::U) -> S::U {
    let [a, b, c] = entered.face;
    s.xor_u(s.xor_u(s.gather_u(m, words, xor), a), s.xor_u(b, c))
}

/// The words of [`Records`], for gathers in sixteen lanes. The record is tested at every step, so
/// that one kernel serves both; the branch is well predicted.
#[derive(Clone, Copy, Debug)]
pub(crate) enum LaneRecords<'a> {
    Link32(&'a [[u32; 2]]),
    Tet16(&'a [u32]),
}

/// Records as a slice of words, or of pairs of words.
fn words<T: FromBytes + zerocopy::Immutable>(
    records: &(impl IntoBytes + zerocopy::Immutable + ?Sized),
) -> &[T] {
    <[T]>::ref_from_bytes(records.as_bytes()).ok().expect("records are a whole number of words")
}

impl<'a> LaneRecords<'a> {
    /// None if there are no records.
    pub(crate) fn new(records: Records<'a>) -> Option<Self> {
        Some(match records {
            Records::None => return None,
            Records::Link32(records) => LaneRecords::Link32(words(records)),
            Records::Tet16(records) => LaneRecords::Tet16(words(records)),
        })
    }

    /// Returns true if the record needs [`EnteredLanes::behind`].
    #[inline(always)]
    pub(crate) fn needs_behind(&self) -> bool {
        matches!(self, LaneRecords::Tet16(_))
    }

    /// Like [`ReadRecords::apex`], in the lanes of the mask. Other lanes are undefined.
    #[inline(always)]
    pub(crate) fn apex<S: Simd>(&self, s: S, m: S::M, entered: &EnteredLanes<S>) -> S::U {
        match self {
            LaneRecords::Link32(_) => entered.apex,
            LaneRecords::Tet16(words) => fourth_vertices(s, words, m, entered, s.shl_u::<2>(entered.tet)),
        }
    }

    /// `next` and `opposite` of [`ReadRecords::link`], in the lanes of the mask. Other lanes are
    /// undefined.
    #[inline(always)]
    pub(crate) fn link<S: Simd>(
        &self,
        s: S,
        m: S::M,
        entered: &EnteredLanes<S>,
        vertex: S::U,
    ) -> (S::U, S::U) {
        match self {
            LaneRecords::Link32(pairs) => {
                s.gather_pair(m, pairs, s.add_u(s.shl_u::<2>(entered.tet), entered.rank(s, vertex)))
            }
            LaneRecords::Tet16(words) => (decode_links(s, words, m, entered, vertex), s.splat_u(NONE)),
        }
    }
}

/// Like [`decode_link`], in each lane.
#[inline(always)]
fn decode_links<S: Simd>(s: S, words: &[u32], m: S::M, entered: &EnteredLanes<S>, vertex: S::U) -> S::U {
    let first = s.add_u(s.shl_u::<2>(entered.tet), s.splat_u(1));
    // The first round turns the link behind the entered face into the fourth link, the second round
    // the fourth into the requested one.
    let mut link = entered.behind;
    for v in [entered.apex, vertex] {
        let rank = entered.rank(s, v);
        let stored = s.and(m, s.lt_u(rank, s.splat_u(3)));
        link = s.xor_u(link, s.gather_u(stored, words, s.add_u(first, rank)));
    }
    link
}
