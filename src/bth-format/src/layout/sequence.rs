//! Objects whose vertices move by themselves. Specification: "Sequences".

use super::assert_layout::assert_layout;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// A hierarchy of an object that applies from a time on.
#[derive(Clone, Copy, Debug, PartialEq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Segment {
    /// Seconds from which it applies, up to the next segment's; the first one applies before, too.
    pub first: f64,
    /// Object whose hierarchy it is, as a distance from the object that has the segments: 0 for that object itself.
    pub object: u32,
    /// Zero.
    pub reserved: u32,
}

assert_layout! {
    Segment 16 { object 8, reserved 12 }
}
