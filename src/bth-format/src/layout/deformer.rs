//! What moves the vertices of objects: morph targets and joints. Specification: "Deformation".

use super::assert_layout::assert_layout;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// What the deformation sections of an object hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Deformation {
    /// The joints that `JOINTS` may refer to; 0 without joints.
    pub joints: u32,
    /// Rows of `JOINTS` and `JOINT_WEIGHTS` for each position, at most [`MAX_INFLUENCE_SETS`].
    pub influence_sets: u32,
    /// Morph targets.
    pub targets: u32,
    /// Zero.
    pub reserved: u32,
}

/// Max [`Deformation::influence_sets`]: of four joints each.
pub const MAX_INFLUENCE_SETS: u32 = 2;
/// Max [`Deformation::joints`]: a joint has 16 bits.
pub const MAX_JOINTS: u32 = 1 << 16;

/// What a morph target adds to the positions of an object, or to its normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Morph {
    /// Number of its deltas.
    pub deltas: u32,
    /// Row of `MORPH_DELTAS` of the first.
    pub first_delta: u32,
    /// Row of `MORPH_ROWS` of the first, or [`super::NONE`] where it is dense: it has a delta for
    /// every row.
    pub first_row: u32,
    /// Zero.
    pub reserved: u32,
}

/// An object that deforms with the nodes of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Deformer {
    /// Row of `NODES`, whose track of weights applies.
    pub node: u32,
    /// Object of the file.
    pub object: u32,
    /// Row of `SKINS`, or [`super::NONE`]. With one, instances of the object are in world space.
    pub skin: u32,
    /// Number of its morph weights.
    pub weights: u32,
    /// Row of `MORPH_WEIGHTS` of the first.
    pub first_weight: u32,
    /// Zero.
    pub reserved: [u32; 3],
}

/// Joints that move an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Skin {
    /// Row of `SKIN_JOINTS` of the first.
    pub first_joint: u32,
    /// Number of joints.
    pub joints: u32,
    /// Zero.
    pub reserved: [u32; 2],
}

/// A joint of a skin.
#[derive(Clone, Copy, Debug, PartialEq, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct SkinJoint {
    /// From the space of the object to the space of the joint: three rows of four, applied to
    /// columns (x, y, z, 1).
    pub inverse_bind: [f64; 12],
    /// Row of `NODES`.
    pub node: u32,
    /// Zero.
    pub reserved: [u32; 3],
}

assert_layout! {
    Deformation 16 { joints 0, influence_sets 4, targets 8, reserved 12 }
    Morph 16 { deltas 0, first_delta 4, first_row 8, reserved 12 }
    Deformer 32 { node 0, object 4, skin 8, weights 12, first_weight 16, reserved 20 }
    Skin 16 { first_joint 0, joints 4, reserved 8 }
    SkinJoint 112 { inverse_bind 0, node 96, reserved 100 }
}
