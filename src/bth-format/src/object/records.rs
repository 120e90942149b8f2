//! The tetrahedron records of an object. Specification: "Records".

use crate::layout::{Link32, Tet16, Tet20, Tet32};

/// The rows of `TETS`, in the one kind of record that the object has.
#[derive(Clone, Copy, Debug)]
pub enum Records<'a> {
    /// The object has no tet leaves.
    None,
    /// Links with the vertex beyond each.
    Link32(&'a [Link32]),
    /// 32 bytes: three vertices, their exclusive or with the fourth, links.
    Tet32(&'a [Tet32]),
    /// 20 bytes: the exclusive or of the vertices, links.
    Tet20(&'a [Tet20]),
    /// 16 bytes: the exclusive or of the vertices, three links combined with the fourth.
    Tet16(&'a [Tet16]),
}

impl Records<'_> {
    /// Number of tetrahedra.
    pub fn len(&self) -> usize {
        match self {
            Records::None => 0,
            Records::Link32(r) => r.len(),
            Records::Tet32(r) => r.len(),
            Records::Tet20(r) => r.len(),
            Records::Tet16(r) => r.len(),
        }
    }
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
