//! Section kinds. Specification: "Kinds". Kinds 1 to 31, 35 to 38, 41 to 47 and 64 to 71 belong to
//! an object, the others to the whole file.

use super::*;

/// The table of kinds: name, number, and the type of an element.
macro_rules! kinds {
    ($($(#[$doc:meta])* $name:ident = $number:literal: $row:ty;)*) => {
        $($(#[$doc])* pub const $name: u32 = $number;)*

        /// Name of a kind, as in the specification; `unknown` for others.
        pub fn name(kind: u32) -> &'static str {
            match kind {
                $($name => stringify!($name),)*
                _ => "unknown",
            }
        }

        /// Bytes of an element of a section; `None` for unknown kinds.
        pub fn stride(kind: u32) -> Option<usize> {
            match kind {
                $($name => Some(size_of::<$row>()),)*
                _ => None,
            }
        }
    };
}

kinds! {
    /// One [`super::Object`].
    OBJECT = 1: Object;
    /// [`super::CacheLine`]s that hold the nodes and triangle leaves.
    LINES = 2: CacheLine;
    /// `u32` per triangle, in the order of the leaves: its id in the source.
    TRIANGLE_IDS = 3: u32;
    /// [`super::TetLeaf`]s.
    TET_LEAVES = 4: TetLeaf;
    /// [`super::Link32`] records.
    TETS = 5: Link32;
    /// [`super::TetVertex`] positions.
    TET_VERTICES = 6: TetVertex;
    /// [`super::TetFace`]s, one per constrained face.
    TET_FACES = 7: TetFace;
    /// [`super::HullFace`]s.
    HULL_FACES = 8: HullFace;
    /// `u32` per source triangle: its row in `TET_FACES`, or `NONE`.
    TRIANGLE_FACES = 9: u32;
    /// `[u32; 16]` per indexed leaf and three of them per raw leaf, in the order of the leaves:
    /// rows of `POSITIONS`. Objects that have it can be given new positions ("Deformable objects").
    LEAF_VERTICES = 10: [u32; WIDTH];
    /// `u32` per source triangle: its [`super::TrianglePlace`], or `NONE`.
    TRIANGLE_PLACES = 11: u32;
    /// [`super::FreeDirections`] per source triangle: what rays that start on it cannot hit.
    FREE_DIRECTIONS = 12: FreeDirections;
    /// One [`super::FreeLevels`], if there are free directions or distances.
    FREE_LEVELS = 13: FreeLevels;
    /// [`super::FreeDistances`] per source triangle, instead of free directions.
    FREE_DISTANCES = 14: FreeDistances;
    /// One `[f64; 3]`, if there are `EXACT_POSITIONS`: the origin of object space in the source's.
    ANCHOR = 15: [f64; 3];
    /// `[f32; 3]`: positions of the source, object space; distinct ones but in deformable objects
    /// and next to `EXACT_POSITIONS`.
    POSITIONS = 16: [f32; 3];
    /// `[u32; 3]` per source triangle: rows of `POSITIONS`.
    TRIANGLES = 17: [u32; 3];
    /// `[u32; 3]` per source triangle: rows of `NORMALS` and `UVS`.
    CORNERS = 18: [u32; 3];
    /// `[f32; 3]`: shading normals as in the source, of any length.
    NORMALS = 19: [f32; 3];
    /// `[f32; 2]`: texture coordinates as in the source.
    UVS = 20: [f32; 2];
    /// [`super::Group`]s: the groups of the object's triangles.
    GROUPS = 21: Group;
    /// [`super::GroupRun`]s: which triangles belong to which group.
    GROUP_RUNS = 22: GroupRun;
    /// [`super::Material`]s that groups refer to.
    MATERIALS = 23: Material;
    /// UTF-8 bytes of the names of groups and materials.
    LABELS = 24: u8;
    /// `f64` seconds of the frames of a sequence.
    SEQUENCE_TIMES = 25: f64;
    /// `[f32; 3]`: the positions of a sequence, by frame, then by row of `POSITIONS`.
    SEQUENCE_POSITIONS = 26: [f32; 3];
    /// `u32` per source triangle: a [`super::TriangleOpacity`].
    OPACITY = 28: u32;
    /// `u32`: states of micro-triangles, two bits each.
    OPACITY_MICRO = 29: u32;
    /// `[f64; 3]`, row by row for `POSITIONS`: the same positions in the source's space, exactly.
    EXACT_POSITIONS = 30: [f64; 3];
    /// UTF-8 JSON: how the file came about. Not part of the content id.
    PROVENANCE = 32: u8;
    /// [`super::ObjectName`]s, one per object of the file.
    OBJECT_NAMES = 33: ObjectName;
    /// UTF-8 bytes of the names of objects.
    OBJECT_LABELS = 34: u8;
    /// [`super::MaterialParameters`], one per row of `MATERIALS`. This section and the three that
    /// follow belong to an object.
    MATERIAL_PARAMETERS = 35: MaterialParameters;
    /// [`super::Texture`]s that material parameters refer to.
    TEXTURES = 36: Texture;
    /// `[u32; 3]` per source triangle: rows of `COLORS`.
    COLOR_CORNERS = 37: [u32; 3];
    /// `[u16; 4]`: vertex colours, linear red, green, blue and alpha; 65,535 means 1.
    COLORS = 38: [u16; 4];
    /// [`super::Image`]s of textures, ascending by name. This section and the next one belong to
    /// the whole file.
    IMAGES = 39: Image;
    /// Bytes of the image files.
    IMAGE_BYTES = 40: u8;
    /// One [`super::Deformation`]. This section and the five that follow belong to an object.
    DEFORMATION = 41: Deformation;
    /// `[u16; 4]`: joints that move a position, of the skin of the object's deformer.
    JOINTS = 42: [u16; 4];
    /// `[f32; 4]`: weights of the joints.
    JOINT_WEIGHTS = 43: [f32; 4];
    /// [`super::Morph`]s: of each target what it adds to positions, then what it adds to normals.
    MORPHS = 44: Morph;
    /// `u32`: rows of `POSITIONS` or `NORMALS` that sparse morphs change.
    MORPH_ROWS = 45: u32;
    /// `[f32; 3]`: what morphs add at a weight of 1.
    MORPH_DELTAS = 46: [f32; 3];
    /// One [`super::Scene`]. This section and the following ones belong to the whole file.
    SCENE = 48: Scene;
    /// [`super::Node`]s, parents before children.
    NODES = 49: Node;
    /// [`super::Instance`]s.
    INSTANCES = 50: Instance;
    /// [`super::Track`]s, ascending by node and property.
    TRACKS = 51: Track;
    /// `f64` seconds: times of the keys of all tracks.
    TIMES = 52: f64;
    /// `f64`: values of the keys of all tracks.
    VALUES = 53: f64;
    /// [`super::Camera`]s.
    CAMERAS = 54: Camera;
    /// [`super::Light`]s.
    LIGHTS = 55: Light;
    /// UTF-8 bytes of the names of nodes, cameras and lights.
    NAMES = 56: u8;
    /// [`super::Deformer`]s, ascending by node.
    DEFORMERS = 57: Deformer;
    /// [`super::Skin`]s.
    SKINS = 58: Skin;
    /// [`super::SkinJoint`]s of all skins.
    SKIN_JOINTS = 59: SkinJoint;
    /// `f64`: weights of the morph targets of all deformers, where no track gives others.
    MORPH_WEIGHTS = 60: f64;
    /// [`super::Tree`]s over the rows of groups that do not move, and of the world if it does not.
    TREES = 61: Tree;
    /// [`super::CacheLine`]s of the nodes of these trees.
    TREE_LINES = 62: CacheLine;
    /// `[u32; 3]` per source triangle: rows of `SECOND_UVS`.
    SECOND_CORNERS = 68: [u32; 3];
    /// `[f32; 2]`: a second set of texture coordinates.
    SECOND_UVS = 69: [f32; 2];
    /// [`super::GlossParameters`], row by row for `MATERIALS`.
    GLOSS_PARAMETERS = 70: GlossParameters;
}

/// Kind of trees for ranges of time in older files, which are refused (BTH-F007).
pub(crate) const FORMER_SEGMENTS: u32 = 27;

/// Returns true if sections of this kind are part of the scene. Trees only repeat what is in it.
pub const fn is_scene(kind: u32) -> bool {
    SCENE <= kind && kind <= MORPH_WEIGHTS
}
/// Returns true if sections of this kind belong to the whole file.
pub const fn is_of_file(kind: u32) -> bool {
    (PROVENANCE <= kind && kind <= OBJECT_LABELS)
        || kind == IMAGES
        || kind == IMAGE_BYTES
        || (SCENE <= kind && kind <= TREE_LINES)
}
/// Returns true if sections of this kind say how an object's vertices move by themselves.
pub const fn is_sequence(kind: u32) -> bool {
    kind == SEQUENCE_TIMES || kind == SEQUENCE_POSITIONS
}
/// Returns true if tracing reads sections of this kind of an object.
pub const fn is_traced(kind: u32) -> bool {
    is_required(kind) && kind != LEAF_VERTICES && !is_sequence(kind) && !is_of_file(kind)
        || kind == TRIANGLE_PLACES
        || kind == FREE_DIRECTIONS
        || kind == FREE_LEVELS
        || kind == FREE_DISTANCES
}
/// Returns true if sections of this kind carry [`super::SECTION_REQUIRED`]: a reader that does not
/// know the kind must refuse the file.
pub const fn is_required(kind: u32) -> bool {
    (OBJECT <= kind && kind <= LEAF_VERTICES)
        || kind == OPACITY
        || kind == OPACITY_MICRO
        || kind == ANCHOR
        || kind == EXACT_POSITIONS
        || is_sequence(kind)
        || is_scene(kind)
}
