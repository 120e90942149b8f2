//! Places of triangles in leaves: BTH-F169 and BTH-F187.

use super::bit_set::BitSet;
use crate::error::{Code, Error, Result};
use crate::layout::{Child, NONE, TrianglePlace, kind};
use crate::object::ObjectView;

/// Triangles that lie where TRIANGLE_PLACES says.
pub(super) struct Placed(BitSet);

impl Placed {
    /// No triangle of an object.
    pub(super) fn new(view: &ObjectView) -> Self {
        Self(BitSet::new(view.places.len()))
    }

    /// BTH-F187: the triangles of a leaf have places. Adds those whose place is in this leaf. The
    /// leaf has been checked, but not the ids of its triangles.
    pub(super) fn add_leaf(&mut self, view: &ObjectView, leaf: Child) -> Result<()> {
        if view.places.is_empty() {
            return Ok(());
        }
        let (first, triangles) = match leaf {
            Child::Indexed(index) => {
                let mut unpacked = None;
                let leaf = view.indexed(index, &mut unpacked);
                (leaf.first, leaf.triangles)
            }
            Child::Raw(index) => {
                let mut unpacked = None;
                let leaf = view.raw(index, &mut unpacked);
                (leaf.first, leaf.triangles)
            }
            Child::Node(_) | Child::Tets(_) => return Ok(()),
        };
        for slot in 0..triangles {
            let triangle = view.triangle_ids[(first + slot) as usize] as usize;
            let place = TrianglePlace { leaf, slot }.code();
            // A leaf beyond the limit has no places; ids are checked later.
            let (true, Some(&found)) = (place != NONE, view.places.get(triangle)) else { continue };
            if found == place {
                self.0.insert(triangle);
            } else if found == NONE {
                let expected = format!("{place:#010x}, or another leaf that holds the triangle");
                return Err(wrong(Code::PlaceMissing, triangle, expected, found));
            }
        }
        Ok(())
    }

    /// BTH-F169: triangles have no place, or lie there. All leaves have been added.
    pub(super) fn check(&self, view: &ObjectView) -> Result<()> {
        let mut places = view.places.iter().enumerate();
        match places.find(|(triangle, place)| **place != NONE && !self.0.contains(*triangle)) {
            None => Ok(()),
            Some((triangle, &place)) => {
                let expected = format!("a leaf and a slot that hold triangle {triangle}, or NONE");
                Err(wrong(Code::TrianglePlace, triangle, expected, place))
            }
        }
    }
}

fn wrong(code: Code, triangle: usize, expected: String, found: u32) -> Error {
    let at = (size_of::<u32>() * triangle) as u64;
    Error::within(code, kind::TRIANGLE_PLACES, at, expected, format!("{found:#010x}"))
}
