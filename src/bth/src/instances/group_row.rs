//! Rows of groups: instances of objects or of groups, in a group or in the world.

use crate::nodes::affine::Affine;
use bth_format::layout::NONE;

/// Bit of the object of a row that shows a group; the other bits are its number.
const GROUP: u32 = 1 << 30;

/// The object of a row that shows a group.
pub(crate) fn object_of_group(group: u32) -> u32 {
    GROUP | group
}

/// Returns true for the object of a row that shows one: neither a group nor nothing.
pub(super) fn is_object(object: u32) -> bool {
    object < GROUP
}

/// The group that a row with this object shows.
pub(super) fn group_in(object: u32) -> Option<usize> {
    (object != NONE && object & GROUP != 0).then_some((object & !GROUP) as usize)
}

/// A row: an instance of an object or of a group, in the world or in a group.
#[derive(Clone, Copy, Debug)]
pub(super) struct GroupRow {
    /// The transform to the space of the group in which it is.
    pub(super) to_outer: Affine,
    /// The object or the group that it shows; `NONE` for a row that was removed.
    pub(super) object: u32,
    /// The number of its first instance among the instances of its group.
    pub(super) first: u32,
    /// False if it hides what it shows.
    pub(super) visible: bool,
    /// True if it has to be placed again.
    pub(super) moved: bool,
    /// True if it was visible when it was placed last.
    pub(super) was_visible: bool,
}

impl GroupRow {
    /// A row in a tree of the file.
    pub(super) fn stored(to_outer: Affine, object: u32, first: u32, visible: bool) -> GroupRow {
        GroupRow { to_outer, object, first, visible, moved: false, was_visible: visible }
    }
}
