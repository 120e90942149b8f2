//! A scene as a manifest describes it. References to nodes and objects are indices into the vectors
//! of [`Manifest`].

use crate::joint_set::JointSet;
use crate::nodes::Nodes;

/// Version of the manifest format that this crate reads and writes.
pub const VERSION: i64 = 1;

/// A scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Manifest {
    /// The range of frames and their rate.
    pub frames: Frames,
    /// Row of `cameras` that is used by default.
    pub camera: Option<usize>,
    /// Geometries, each in its own space.
    pub objects: Vec<Object>,
    /// The hierarchy, in any order; no node is its own ancestor.
    pub nodes: Nodes,
    /// Cameras.
    pub cameras: Vec<Camera>,
    /// Lights.
    pub lights: Vec<Light>,
    /// Skins of deformers.
    pub skins: Vec<Skin>,
    /// What deforms objects; no two of the same node or of the same object.
    pub deformers: Vec<Deformer>,
    /// Animated properties; no two of the same node and property.
    pub tracks: Vec<Track>,
}

/// Frame `f` shows the scene at `f / rate` seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frames {
    /// First frame.
    pub first: i32,
    /// Last frame, not before the first.
    pub last: i32,
    /// Frames per second, finite and positive.
    pub rate: f64,
}

impl Default for Frames {
    fn default() -> Self {
        Self { first: 0, last: 0, rate: 24.0 }
    }
}

/// A geometry in its own space.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// Unique among objects.
    pub name: String,
    /// Where it comes from.
    pub source: Source,
    /// How all of its surface looks; `None` for what the source says.
    pub material: Option<Material>,
}

impl Object {
    /// An object that looks as its source says.
    pub fn new(name: impl Into<String>, source: Source) -> Self {
        Self { name: name.into(), source, material: None }
    }
}

/// How a surface looks, as a material of glTF 2.0 without textures. Colours are linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Base colour: red, green and blue, from 0 to 1.
    pub color: [f64; 3],
    /// Radiance that it emits: red, green and blue, from 0 to [`Self::MAX_EMISSION`].
    pub emission: [f64; 3],
    /// From 0 to 1.
    pub metallic: f64,
    /// From 0 (smooth) to 1.
    pub roughness: f64,
}

impl Material {
    /// Largest component of a radiance, which f32 holds with much room above.
    pub const MAX_EMISSION: f64 = 1e6;
}

impl Default for Material {
    fn default() -> Self {
        Self { color: [1.0; 3], emission: [0.0; 3], metallic: 0.0, roughness: 1.0 }
    }
}

/// Where a geometry comes from. Paths are relative to the manifest's folder and stay within it;
/// their separator is `/`.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// A model that is to be compiled.
    Model {
        /// OBJ, glTF, GLB, PLY, STL or OFF file.
        path: String,
        /// Of a glTF file one mesh, by number, in its own space; without it the whole file.
        mesh: Option<u32>,
    },
    /// A compiled file.
    Compiled {
        /// BTH file.
        path: String,
        /// Object of that file; `None` for the whole file: its scene, or its only object.
        object: Option<u32>,
    },
    /// Models of equal topology, one for each frame.
    Sequence {
        /// The models.
        frames: SequenceFrames,
        /// When they are shown.
        timing: SequenceTiming,
    },
    /// A model whose vertices are moved by a vertex cache.
    Cached {
        /// OBJ, glTF, GLB, PLY, STL or OFF file.
        path: String,
        /// Number of the mesh in a glTF file; `None` for the other formats.
        mesh: Option<u32>,
        /// PC2 or MDD file.
        cache: String,
        /// When its frames are shown.
        timing: SequenceTiming,
    },
    /// A mesh that is to be compiled so that a deformer can move its vertices.
    Deforming {
        /// glTF or GLB file.
        path: String,
        /// Number of the mesh.
        mesh: u32,
        /// Joints whose rigid parts ([`Source::RigidPart`]) are skipped.
        without: JointSet,
    },
    /// The part of a mesh that one joint moves rigidly: all its connected components whose vertices
    /// follow this joint alone and no morph target. Triangles are connected where they have a
    /// corner of equal position.
    RigidPart {
        /// glTF or GLB file.
        path: String,
        /// Number of the mesh.
        mesh: u32,
        /// Number of the joint, below [`JointSet::LIMIT`].
        joint: u32,
    },
    /// The mesh of a node at rest: with its default morph weights and with its joints where the
    /// nodes place them.
    AtRest {
        /// glTF or GLB file.
        path: String,
        /// Number of the node. A mesh with a skin is in world space, another one in the space of
        /// its node.
        node: u32,
    },
}

/// The models of a sequence: OBJ, PLY, STL or OFF files.
#[derive(Clone, Debug, PartialEq)]
pub enum SequenceFrames {
    /// All files whose names have a number in the place of the one run of `#`, by number.
    Numbered(String),
    /// These files, at least one.
    Listed(Vec<String>),
}

/// When the frames of a sequence or of a vertex cache are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SequenceTiming {
    /// Frames a second, above 0; `None` for the rate of the scene's frames, or where the file
    /// states the times.
    pub rate: Option<f64>,
    /// Seconds at which the first frame of a sequence, or frame 0 of a vertex cache, is shown.
    pub start: f64,
}

impl Source {
    /// The file, relative to the manifest's folder. Of a sequence its pattern or its first file, of
    /// a model with a vertex cache the model.
    pub fn path(&self) -> &str {
        match self {
            Source::Model { path, .. }
            | Source::Compiled { path, .. }
            | Source::Cached { path, .. }
            | Source::Deforming { path, .. }
            | Source::RigidPart { path, .. }
            | Source::AtRest { path, .. } => path,
            Source::Sequence { frames: SequenceFrames::Numbered(pattern), .. } => pattern,
            Source::Sequence { frames: SequenceFrames::Listed(files), .. } => {
                files.first().map_or("", String::as_str)
            }
        }
    }
}

/// A camera. It looks along the negative z axis of its node, whose y axis points up.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Unique among cameras.
    pub name: String,
    /// Node to which it is attached.
    pub node: usize,
    /// Its projection.
    pub lens: Lens,
    /// Width over height of the picture that it was made for.
    pub aspect: Option<f64>,
    /// Distance of the near plane.
    pub near: Option<f64>,
    /// Distance of the far plane.
    pub far: Option<f64>,
}

/// How a camera projects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// Vertical field of view in degrees, between 0 and 180.
    Perspective(f64),
    /// Height of the picture in units of the node, positive.
    Orthographic(f64),
}

/// A light. Directed ones shine along the negative z axis of their node. Units are as in glTF's
/// KHR_lights_punctual.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Unique among lights.
    pub name: String,
    /// Node to which it is attached.
    pub node: usize,
    /// What kind of light.
    pub kind: LightKind,
    /// Linear red, green and blue, not negative.
    pub color: [f64; 3],
    /// Lux for directional lights, candela for others; not negative.
    pub intensity: f64,
    /// Distance beyond which it does not shine; `None` for no end.
    pub range: Option<f64>,
}

/// What kind of light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// Parallel rays from far away.
    Directional,
    /// From a point into all directions.
    Point,
    /// From a point into a cone.
    Spot {
        /// Angle from the axis at which it begins to fade, degrees, 0 to below `outer`.
        inner: f64,
        /// Angle at which it ends, degrees, up to 90.
        outer: f64,
    },
}

/// The joints that move the vertices of an object (glTF 2.0 specification, §3.7.3).
#[derive(Clone, Debug, PartialEq)]
pub struct Skin {
    /// Unique among skins.
    pub name: String,
    /// The nodes that are its joints, at least one.
    pub joints: Vec<usize>,
    /// For each joint rows of the matrix from the space of the object to the space of the joint,
    /// applied to columns (x, y, z, 1); `None` where all are the identity.
    pub inverse_binds: Option<Vec<[[f64; 4]; 3]>>,
}

/// What deforms an object: a vertex is first moved by the morph targets, then by the joints.
#[derive(Clone, Debug, PartialEq)]
pub struct Deformer {
    /// The node whose tracks of weights apply.
    pub node: usize,
    /// The object that deforms, one of [`Source::Deforming`] or of a compiled file.
    pub object: usize,
    /// Its skin. Instances of the object are then in world space: the transforms of their nodes
    /// have no effect.
    pub skin: Option<usize>,
    /// A weight for each morph target of the object, before tracks.
    pub weights: Vec<f64>,
}

/// Keyframes of one property of one node, with the meanings of glTF. Before the first key and after
/// the last the track has the value of that key.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// The animated node. It has no matrix, unless the property is its visibility or its weights.
    pub node: usize,
    /// The animated property.
    pub property: Property,
    /// How values between keys are computed.
    pub interpolation: Interpolation,
    /// Seconds, strictly ascending, at least one.
    pub times: Vec<f64>,
    /// For each key [`Property::width`] numbers; for weights one number per morph target of the
    /// node's deformer. With [`Interpolation::Cubic`] each key has the in-tangent, the value and
    /// the out-tangent.
    pub values: Vec<f64>,
}

/// A property of a node that a track animates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Property {
    /// Three numbers.
    Translation,
    /// A quaternion x, y, z, w.
    Rotation,
    /// Three numbers.
    Scale,
    /// One number, 0 or 1; always in steps.
    Visible,
    /// The weights of the deformer of the node.
    Weights,
}

impl Property {
    /// All of them, in order.
    pub const ALL: [Property; 5] =
        [Self::Translation, Self::Rotation, Self::Scale, Self::Visible, Self::Weights];

    /// Numbers of a value; `None` for weights, where the deformer of the node decides.
    pub const fn width(self) -> Option<usize> {
        match self {
            Self::Translation | Self::Scale => Some(3),
            Self::Rotation => Some(4),
            Self::Visible => Some(1),
            Self::Weights => None,
        }
    }
    /// The word that manifests use.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Translation => "translation",
            Self::Rotation => "rotation",
            Self::Scale => "scale",
            Self::Visible => "visible",
            Self::Weights => "weights",
        }
    }
}

/// How values between two keys are computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// The value of the key before.
    Step,
    /// Linear; rotations along the great circle, the shorter way.
    Linear,
    /// Hermite splines with tangents per key.
    Cubic,
}

impl Interpolation {
    /// All of them, in order.
    pub const ALL: [Interpolation; 3] = [Self::Step, Self::Linear, Self::Cubic];

    /// Values of a key: 3 with tangents.
    pub const fn values_per_key(self) -> usize {
        match self {
            Self::Step | Self::Linear => 1,
            Self::Cubic => 3,
        }
    }
    /// The word that manifests use.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Step => "step",
            Self::Linear => "linear",
            Self::Cubic => "cubic",
        }
    }
}
