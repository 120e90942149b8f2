//! The four record formats of tetrahedra behind one interface, for one tetrahedron and for sixteen.
//!
//! A record is always read after the walk has entered through a face, so the face's three vertices and the link behind it are known.
//! The record yields the fourth vertex and the links behind the other faces. `Tet32`, `Tet20` and `Tet16` are the formats of Aman,
//! Demirci and Güdükbay ("Compact tetrahedralization-based acceleration structures for ray tracing", 2021), named by their bytes;
//! `Link32` stores for each face a link and the vertex beyond.

use crate::simd::Simd;
use bth_format::layout::{Link, Link32, NONE, Tet16, Tet20, Tet32};
use bth_format::object::Records;
use zerocopy::{FromBytes, IntoBytes};

/// How a walk entered a tetrahedron.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entered {
    /// Vertices of the entered face.
    pub(crate) face: [u32; 3],
    /// The fourth vertex.
    pub(crate) apex: u32,
    /// The link behind the entered face, as the record stores it: the tetrahedron or face from which the walk came.
    pub(crate) behind: u32,
}

impl Entered {
    /// Rank of a vertex among the four in ascending order.
    #[inline(always)]
    fn rank(&self, vertex: u32) -> usize {
        let below = |v: u32| (v < vertex) as usize;
        below(self.face[0]) + below(self.face[1]) + below(self.face[2]) + below(self.apex)
    }
}

/// A record format.
pub(crate) trait Record: Copy {
    /// The vertex that is not on `face`. `carried` is the `opposite` of the link that was followed.
    fn apex(&self, face: [u32; 3], carried: u32) -> u32;
    /// The link behind the face opposite to `vertex`. Its `opposite` is `NONE` in formats whose [`Self::apex`] does not need it.
    fn link(&self, at: &Entered, vertex: u32) -> Link;
}

impl Record for Link32 {
    #[inline(always)]
    fn apex(&self, _face: [u32; 3], carried: u32) -> u32 {
        carried
    }
    #[inline(always)]
    fn link(&self, at: &Entered, vertex: u32) -> Link {
        self.link[at.rank(vertex) & 3]
    }
}

/// The fourth vertex from the exclusive or of all four.
#[inline(always)]
fn fourth(xor: u32, face: [u32; 3]) -> u32 {
    xor ^ face[0] ^ face[1] ^ face[2]
}

impl Record for Tet32 {
    #[inline(always)]
    fn apex(&self, face: [u32; 3], _carried: u32) -> u32 {
        fourth(self.xor, face)
    }
    #[inline(always)]
    fn link(&self, at: &Entered, vertex: u32) -> Link {
        Link { next: self.next[at.rank(vertex) & 3], opposite: NONE }
    }
}

impl Record for Tet20 {
    #[inline(always)]
    fn apex(&self, face: [u32; 3], _carried: u32) -> u32 {
        fourth(self.xor, face)
    }
    #[inline(always)]
    fn link(&self, at: &Entered, vertex: u32) -> Link {
        Link { next: self.next[at.rank(vertex) & 3], opposite: NONE }
    }
}

impl Record for Tet16 {
    #[inline(always)]
    fn apex(&self, face: [u32; 3], _carried: u32) -> u32 {
        fourth(self.xor, face)
    }
    /// Each of the three stored words is the exclusive or of a link and the fourth link, so one known link yields the others.
    #[inline(always)]
    fn link(&self, at: &Entered, vertex: u32) -> Link {
        let combined = |rank: usize| self.next.get(rank).copied().unwrap_or(0);
        let last = at.behind ^ combined(at.rank(at.apex));
        Link { next: last ^ combined(at.rank(vertex)), opposite: NONE }
    }
}

/// Reads tetrahedra of an object in its record format.
pub(crate) trait ReadRecords {
    /// [`Record::apex`] of a tetrahedron.
    fn apex(&self, tet: u32, face: [u32; 3], carried: u32) -> u32;
    /// [`Record::link`] of a tetrahedron.
    fn link(&self, tet: u32, at: &Entered, vertex: u32) -> Link;
}

impl ReadRecords for Records<'_> {
    #[inline(always)]
    fn apex(&self, tet: u32, face: [u32; 3], carried: u32) -> u32 {
        match self {
            Records::Link32(_) => carried,
            Records::Tet32(records) => records[tet as usize].apex(face, carried),
            Records::Tet20(records) => records[tet as usize].apex(face, carried),
            Records::Tet16(records) => records[tet as usize].apex(face, carried),
            Records::None => NONE,
        }
    }

    #[inline(always)]
    fn link(&self, tet: u32, at: &Entered, vertex: u32) -> Link {
        match self {
            Records::Link32(records) => records[tet as usize].link(at, vertex),
            Records::Tet32(records) => records[tet as usize].link(at, vertex),
            Records::Tet20(records) => records[tet as usize].link(at, vertex),
            Records::Tet16(records) => records[tet as usize].link(at, vertex),
            Records::None => Link { next: NONE, opposite: NONE },
        }
    }
}

/// How sixteen walks entered their tetrahedra, one in each lane; see [`Entered`].
#[derive(Clone, Copy)]
pub(crate) struct EnteredLanes<S: Simd> {
    pub(crate) tet: S::U,
    pub(crate) face: [S::U; 3],
    pub(crate) apex: S::U,
    pub(crate) behind: S::U,
    /// 1 in every lane. It is a variable, because for a constant the compiler replaces the masked addition by slower code.
    pub(crate) one: S::U,
}

impl<S: Simd> EnteredLanes<S> {
    /// Rank of a vertex among the four in ascending order.
    #[inline(always)]
    fn rank(&self, s: S, vertex: S::U) -> S::U {
        let mut rank = s.splat_u(0);
        for v in [self.apex, self.face[0], self.face[1], self.face[2]] {
            rank = s.add_where(rank, s.lt_u(v, vertex), self.one);
        }
        rank
    }
}

/// The fourth vertices. `xor` holds the indices of the words that store the exclusive or of all four.
#[inline(always)]
fn fourth_lanes<S: Simd>(s: S, words: &[u32], m: S::M, at: &EnteredLanes<S>, xor: S::U) -> S::U {
    let [a, b, c] = at.face;
    s.xor_u(s.xor_u(s.gather_u(m, words, xor), a), s.xor_u(b, c))
}

/// [`Records`] as words, for gathers of sixteen lanes. The format is tested at every step: the branch is well predicted, and one
/// kernel serves all formats.
#[derive(Clone, Copy, Debug)]
pub(crate) enum LaneRecords<'a> {
    Link32(&'a [[u32; 2]]),
    Tet32(&'a [u32]),
    Tet20(&'a [u32]),
    Tet16(&'a [u32]),
}

/// Records as a slice of words.
fn words<T: FromBytes + zerocopy::Immutable>(
    records: &(impl IntoBytes + zerocopy::Immutable + ?Sized),
) -> &[T] {
    <[T]>::ref_from_bytes(records.as_bytes()).expect("records are a whole number of words")
}

impl<'a> LaneRecords<'a> {
    /// None if there are no records.
    pub(crate) fn new(records: Records<'a>) -> Option<Self> {
        Some(match records {
            Records::None => return None,
            Records::Link32(records) => LaneRecords::Link32(words(records)),
            Records::Tet32(records) => LaneRecords::Tet32(words(records)),
            Records::Tet20(records) => LaneRecords::Tet20(words(records)),
            Records::Tet16(records) => LaneRecords::Tet16(words(records)),
        })
    }

    /// Whether the format needs [`EnteredLanes::behind`].
    #[inline(always)]
    pub(crate) fn needs_behind(&self) -> bool {
        matches!(self, LaneRecords::Tet16(_))
    }

    /// See [`Record::apex`].
    #[inline(always)]
    pub(crate) fn apex<S: Simd>(&self, s: S, m: S::M, at: &EnteredLanes<S>) -> S::U {
        match self {
            LaneRecords::Link32(_) => at.apex,
            LaneRecords::Tet32(words) => {
                fourth_lanes(s, words, m, at, s.add_u(s.shl_u::<3>(at.tet), s.splat_u(3)))
            }
            LaneRecords::Tet20(words) => fourth_lanes(s, words, m, at, s.add_u(s.shl_u::<2>(at.tet), at.tet)),
            LaneRecords::Tet16(words) => fourth_lanes(s, words, m, at, s.shl_u::<2>(at.tet)),
        }
    }

    /// `next` and `opposite` of [`Record::link`]; those of lanes that are not in the mask are undefined.
    #[inline(always)]
    pub(crate) fn link<S: Simd>(&self, s: S, m: S::M, at: &EnteredLanes<S>, vertex: S::U) -> (S::U, S::U) {
        let (words, first) = match self {
            LaneRecords::Link32(pairs) => {
                return s.gather_pair(m, pairs, s.add_u(s.shl_u::<2>(at.tet), at.rank(s, vertex)));
            }
            LaneRecords::Tet16(words) => return (link_of_tet16(s, words, m, at, vertex), s.splat_u(NONE)),
            LaneRecords::Tet32(words) => (words, s.add_u(s.shl_u::<3>(at.tet), s.splat_u(4))),
            LaneRecords::Tet20(words) => {
                (words, s.add_u(s.add_u(s.shl_u::<2>(at.tet), at.tet), s.splat_u(1)))
            }
        };
        (s.gather_u(m, words, s.add_u(first, at.rank(s, vertex))), s.splat_u(NONE))
    }
}

/// [`Record::link`] of [`Tet16`].
#[inline(always)]
fn link_of_tet16<S: Simd>(s: S, words: &[u32], m: S::M, at: &EnteredLanes<S>, vertex: S::U) -> S::U {
    let first = s.add_u(s.shl_u::<2>(at.tet), s.splat_u(1));
    // The link behind the entered face yields the fourth link, and that the requested one.
    let mut link = at.behind;
    for v in [at.apex, vertex] {
        let rank = at.rank(s, v);
        let stored = s.and(m, s.lt_u(rank, s.splat_u(3)));
        link = s.xor_u(link, s.gather_u(stored, words, s.add_u(first, rank)));
    }
    link
}
