//! The tetrahedron records of an object. Specification: "Records".

use crate::layout::{Link32, Tet16};

/// The rows of `TETS`, in the one kind of record that the object has.
#[derive(Clone, Copy, Debug)]
pub enum Records<'a> {
    /// The object has no tet leaves.
    None,
    /// Links with the vertex beyond each.
    Link32(&'a [Link32]),
    /// 16 bytes: the exclusive or of the vertices, three links combined with the fourth.
    Tet16(&'a [Tet16]),
}

impl Records<'_> {
    /// Number of tetrahedra.
    pub fn len(&self) -> usize {
        match self {
            Records::None => 0,
            Records::Link32(r) => r.len(),
            Records::Tet16(r) => r.len(),
        }
    }
    /// Returns true if there are no tetrahedra.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
