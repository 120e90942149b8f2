//! The four tetrahedron records behind one interface, so that one walk serves all.
//!
//! Records are reached through a face: its three vertices are known, and what lies behind it.
//! The rest follows: the fourth vertex, and what lies behind the other faces.

use crate::layout::{Link, Link32, NONE, Tet16, Tet20, Tet32};

/// A tetrahedron as entered through a face.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entered {
    /// Vertices of the face.
    pub(crate) face: [u32; 3],
    /// The fourth vertex.
    pub(crate) apex: u32,
    /// The link behind the face, as the record stores it (where the walk came from).
    pub(crate) behind: u32,
}

impl Entered {
    /// Place of a vertex among the four in ascending order.
    #[inline(always)]
    fn rank(&self, vertex: u32) -> usize {
        let below = |v: u32| (v < vertex) as usize;
        below(self.face[0]) + below(self.face[1]) + below(self.face[2]) + below(self.apex)
    }
}

pub(crate) trait Record: Copy {
    /// The vertex that is not of the face; `carried` is what the link hither said.
    fn apex(&self, face: [u32; 3], carried: u32) -> u32;
    /// The link behind the face opposite to `vertex`; its `opposite` may be `NONE`, then [`Self::apex`] finds it.
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
    /// Each stored link is combined with the fourth; the one behind us unlocks them.
    #[inline(always)]
    fn link(&self, at: &Entered, vertex: u32) -> Link {
        let combined = |rank: usize| self.next.get(rank).copied().unwrap_or(0);
        let last = at.behind ^ combined(at.rank(at.apex));
        Link { next: last ^ combined(at.rank(vertex)), opposite: NONE }
    }
}
