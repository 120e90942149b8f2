//! The scene: instances of objects and how they move. Its sections belong to the whole file.
//! Specification: "Scenes".

use super::assert_layout::assert_layout;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// The frames and the default camera of the scene.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Scene {
    /// Frames per second: frame f shows the scene at f / rate seconds.
    pub rate: f64,
    /// First frame, at most 2^24 in absolute value.
    pub first_frame: i32,
    /// Last frame, at most 2^24 in absolute value.
    pub last_frame: i32,
    /// Row of `CAMERAS` that is used when the viewer names none, or [`super::NONE`].
    pub camera: u32,
    /// Zero.
    pub reserved: [u32; 11],
}

/// A transform of the scene's hierarchy. It is no node of a BVH: see [`super::WideNode`].
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Node {
    /// From the node's space to its parent's, before tracks: translation (3), quaternion x, y, z, w
    /// (4), scale (3) and two zeros; with [`NODE_MATRIX`] three rows of four, applied to columns
    /// (x, y, z, 1).
    pub transform: [f64; 12],
    /// Row of the parent, less than its own; [`super::NONE`] where the parent is the world.
    pub parent: u32,
    /// [`NODE_HIDDEN`], [`NODE_MATRIX`], [`NODE_GROUP`].
    pub flags: u32,
    /// First byte of its name in `NAMES`.
    pub name: u32,
    /// Bytes of its name.
    pub name_length: u32,
    /// Zero.
    pub reserved: [u32; 4],
}

/// Flag of [`Node`]: it and all nodes below it are hidden, unless a visibility track of the node
/// shows it.
pub const NODE_HIDDEN: u32 = 1;
/// Flag of [`Node`]: the transform is a matrix.
pub const NODE_MATRIX: u32 = 2;
/// Flag of [`Node`]: the node and all below it are a group. It has no parent, and shows in the
/// world only where instances of the group are.
pub const NODE_GROUP: u32 = 4;

/// An object or a group placed at a node. Where there are no groups, hits name instances by their
/// rows.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Instance {
    /// Row of `NODES`.
    pub node: u32,
    /// Object of the file, or with [`INSTANCE_OF_GROUP`] the row of a node with [`NODE_GROUP`].
    pub object: u32,
    /// [`INSTANCE_OF_GROUP`].
    pub flags: u32,
    /// Number of its first instance among the instances of its group, or of the world, once groups
    /// are written out.
    pub first: u32,
}

/// Flag of [`Instance`]: it is an instance of a group.
pub const INSTANCE_OF_GROUP: u32 = 1;

impl Instance {
    /// The node of the group that it shows; `None` for an instance of an object.
    pub fn group(&self) -> Option<u32> {
        (self.flags & INSTANCE_OF_GROUP != 0).then_some(self.object)
    }
}

/// A tree over the rows of a group of nodes, or of the world. Specification: "Trees".
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Tree {
    /// Bound of the absolute coordinates that points of the group have on the way from their
    /// objects.
    pub magnitude: f64,
    /// Bound of the condition numbers of products of transforms in the group.
    pub condition: f64,
    /// Row of `TREE_LINES` of its root.
    pub first_line: u32,
    /// Number of its lines.
    pub lines: u32,
    /// Max number of nodes on a path from the root.
    pub depth: u32,
    /// The first row of `INSTANCES` of the group.
    pub first_row: u32,
    /// Number of rows of the group.
    pub rows: u32,
    /// Number of its visible rows, which the tree holds.
    pub visible: u32,
    /// Number of its instances once groups are written out.
    pub instances: u32,
    /// Max absolute coordinate of the boxes of its visible rows.
    pub extent: f32,
    /// Max of what the boxes of its visible rows grow by, for each unit of distance of a ray's
    /// origin.
    pub origin_slack: f32,
    /// The row of `NODES` behind the last node of the group.
    pub end_node: u32,
    /// Zero.
    pub reserved: [u32; 2],
}

/// Keyframes of one property of one node.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Track {
    /// Row of `NODES`.
    pub node: u32,
    /// A [`Property`].
    pub property: u32,
    /// An [`Interpolation`].
    pub interpolation: u32,
    /// Number of keys.
    pub keys: u32,
    /// Row of `TIMES` of the first key. In this section and in `VALUES`, the ranges of successive
    /// tracks follow each other.
    pub first_time: u32,
    /// Row of `VALUES` of the first key, which has [`Property::width`] times
    /// [`Interpolation::values_per_key`] rows. For weights the node's deformer gives the width.
    pub first_value: u32,
    /// Zero.
    pub reserved: [u32; 2],
}

/// The property of a node that a track animates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u32)]
pub enum Property {
    /// Three numbers, in the parent's space.
    Translation = 0,
    /// A quaternion x, y, z, w.
    Rotation = 1,
    /// Three factors.
    Scale = 2,
    /// One number: 0 hides, 1 shows.
    Visible = 3,
    /// The weights of the morph targets of the node's deformer.
    Weights = 4,
}

impl Property {
    /// All of them, in order of their codes.
    pub const ALL: [Property; 5] =
        [Self::Translation, Self::Rotation, Self::Scale, Self::Visible, Self::Weights];

    /// The property with this code.
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|p| *p as u32 == code)
    }
    /// Numbers of a value; `None` for weights, where the deformer of the node decides.
    pub const fn width(self) -> Option<usize> {
        match self {
            Self::Translation | Self::Scale => Some(3),
            Self::Rotation => Some(4),
            Self::Visible => Some(1),
            Self::Weights => None,
        }
    }
}

/// How a track's value is found between two keys. Specification: "Scenes".
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u32)]
pub enum Interpolation {
    /// The value of the key before.
    Step = 0,
    /// Linear; rotations along the great circle (slerp).
    Linear = 1,
    /// Cubic Hermite splines, with in-tangent, value and out-tangent per key.
    Cubic = 2,
}

impl Interpolation {
    /// All of them, in order of their codes.
    pub const ALL: [Interpolation; 3] = [Self::Step, Self::Linear, Self::Cubic];

    /// The interpolation with this code.
    pub fn from_code(code: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|i| *i as u32 == code)
    }
    /// Values per key: tangents count.
    pub const fn values_per_key(self) -> usize {
        match self {
            Self::Step | Self::Linear => 1,
            Self::Cubic => 3,
        }
    }
}

/// A camera: it looks along the negative z axis of its node, whose y axis points up.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Camera {
    /// Row of `NODES`.
    pub node: u32,
    /// 0 perspective, 1 orthographic.
    pub projection: u32,
    /// First byte of its name in `NAMES`.
    pub name: u32,
    /// Bytes of its name.
    pub name_length: u32,
    /// Vertical field of view in degrees, or the height of the picture in the node's units.
    pub size: f64,
    /// Width over height of the picture that it was made for; 0 where it is not known.
    pub aspect: f64,
    /// Distance of the near plane, in the node's units.
    pub near: f64,
    /// Distance of the far plane, in the node's units; 0 for none.
    pub far: f64,
    /// Zero.
    pub reserved: [u32; 4],
}

/// A light: it shines along the negative z axis of its node, where it has a direction.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub struct Light {
    /// Row of `NODES`.
    pub node: u32,
    /// 0 directional, 1 point, 2 spot.
    pub kind: u32,
    /// First byte of its name in `NAMES`.
    pub name: u32,
    /// Bytes of its name.
    pub name_length: u32,
    /// Linear red, green and blue.
    pub color: [f64; 3],
    /// Lux for directional lights, candela for others.
    pub intensity: f64,
    /// Distance beyond which it does not shine; 0 for no limit.
    pub range: f64,
    /// Of a spot: degrees from the axis at which it begins to fade; of others 0.
    pub inner: f64,
    /// Of a spot: degrees from the axis at which it ends; of others 0.
    pub outer: f64,
    /// Zero.
    pub reserved: [u32; 2],
}

assert_layout! {
    Scene 64 { first_frame 8, last_frame 12, camera 16, reserved 20 }
    Node 128 { parent 96, flags 100, name 104, name_length 108, reserved 112 }
    Instance 16 { object 4, flags 8, first 12 }
    Tree 64 { condition 8, first_line 16, lines 20, depth 24, first_row 28, rows 32, visible 36, instances 40,
        extent 44, origin_slack 48, end_node 52, reserved 56 }
    Track 32 { property 4, interpolation 8, keys 12, first_time 16, first_value 20, reserved 24 }
    Camera 64 { projection 4, name 8, name_length 12, size 16, aspect 24, near 32, far 40, reserved 48 }
    Light 80 { kind 4, name 8, name_length 12, color 16, intensity 40, range 48, inner 56, outer 64, reserved 72 }
}
