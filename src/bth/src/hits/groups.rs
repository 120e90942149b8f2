//! Groups of an object's triangles, which have masks.

use bth_format::object::ObjectView;

/// The group of a triangle: an index below [`group_count`]. Without groups in the file all triangles are in group 0.
pub(super) fn group_of(_object: &ObjectView<'_>, _triangle: u32) -> u32 {
    0
}

/// Number of groups of an object.
pub(super) fn group_count(_object: &ObjectView<'_>) -> u32 {
    1
}
