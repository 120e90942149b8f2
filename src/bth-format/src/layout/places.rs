//! Where a triangle lies in the leaves. Specification: "Places of triangles".

use super::{Child, NONE};

/// The place of a triangle: a triangle leaf and a slot in it.
///
/// Its code, a row of `TRIANGLE_PLACES`, has bit 31 set for raw leaves. Bits 4 to 30 are the index
/// in the child code of the leaf, bits 0 to 3 are the slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrianglePlace {
    /// The leaf, [`Child::Indexed`] or [`Child::Raw`].
    pub leaf: Child,
    /// Slot of the triangle in the leaf.
    pub slot: u32,
}

impl TrianglePlace {
    /// Leaf indices are below this.
    pub const INDEX_LIMIT: u32 = (1 << 27) - 1;
    /// Bit of a code that is set for raw leaves.
    pub const RAW: u32 = 1 << 31;

    /// The code; [`NONE`] if the index of the leaf is too large, or if `leaf` is not a triangle
    /// leaf.
    pub fn code(self) -> u32 {
        match self.leaf {
            Child::Indexed(index) if index < Self::INDEX_LIMIT => index << 4 | self.slot,
            Child::Raw(index) if index < Self::INDEX_LIMIT => Self::RAW | index << 4 | self.slot,
            _ => NONE,
        }
    }

    /// The place of a code; `None` for [`NONE`] and other codes beyond the limit.
    #[inline(always)]
    pub const fn from_code(code: u32) -> Option<Self> {
        let (index, slot) = (code >> 4 & Self::INDEX_LIMIT, code & 15);
        if index == Self::INDEX_LIMIT {
            return None;
        }
        let leaf = if code & Self::RAW == 0 { Child::Indexed(index) } else { Child::Raw(index) };
        Some(TrianglePlace { leaf, slot })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_encoded() {
        const LAST: u32 = TrianglePlace::INDEX_LIMIT - 1;
        for leaf in [Child::Indexed(0), Child::Raw(0), Child::Indexed(77), Child::Raw(LAST)] {
            let place = TrianglePlace { leaf, slot: 9 };
            assert_eq!(TrianglePlace::from_code(place.code()), Some(place));
        }
        for leaf in [Child::Indexed(LAST + 1), Child::Node(0), Child::Tets(1)] {
            assert_eq!(TrianglePlace { leaf, slot: 0 }.code(), NONE);
        }
        assert_eq!(TrianglePlace::from_code(NONE), None);
    }
}
