//! Groups of an object's triangles, which have masks.

use bth_format::object::ObjectView;

/// The group of a triangle: an index below [`group_count`]. Without groups in the file all triangles are in group 0.
#[inline]
pub(super) fn group_of(object: &ObjectView<'_>, triangle: u32) -> u32 {
    object.group_of(triangle)
}

/// Number of groups of an object.
pub(super) fn group_count(object: &ObjectView<'_>) -> u32 {
    object.group_count()
}
