//! Groups of triangles, their materials, and the names of objects. Specification: "Groups and
//! names".

use super::assert_layout::assert_layout;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// A group of an object's triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Group {
    /// First byte of its name in `LABELS`.
    pub name: u32,
    /// Bytes of its name.
    pub name_length: u32,
    /// Row of `MATERIALS`, or [`super::NONE`].
    pub material: u32,
    /// Zero.
    pub reserved: u32,
}

/// Successive triangles of one group: those from `first` to the one before the next run's, or to
/// the last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct GroupRun {
    /// Id of its first triangle.
    pub first: u32,
    /// Row of `GROUPS`.
    pub group: u32,
}

/// A material of the source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Material {
    /// First byte of its name in `LABELS`.
    pub name: u32,
    /// Bytes of its name.
    pub name_length: u32,
    /// Zero.
    pub reserved: [u32; 2],
}

/// The name of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct ObjectName {
    /// First byte of its name in `OBJECT_LABELS`.
    pub name: u32,
    /// Bytes of its name.
    pub name_length: u32,
}

assert_layout! {
    Group 16 { name_length 4, material 8, reserved 12 }
    GroupRun 8 { group 4 }
    Material 16 { name_length 4, reserved 8 }
    ObjectName 8 { name_length 4 }
}
