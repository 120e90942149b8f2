//! Section kinds. Specification: "Kinds". Kinds 1 to 31, 35 to 38, 41 to 47 and 64 to 71 belong to
//! an object, the others to the whole file.

macro_rules! kinds {
    ($($(#[$doc:meta])* $name:ident = $number:literal;)*) => {
        $($(#[$doc])* pub const $name: u32 = $number;)*

        /// Name of a kind, as in the specification; `unknown` for others.
        pub fn name(kind: u32) -> &'static str {
            match kind {
                $($name => stringify!($name),)*
                _ => "unknown",
            }
        }
    };
}

kinds! {
    /// One [`super::Object`].
    OBJECT = 1;
    /// [`super::CacheLine`]s that hold the nodes and triangle leaves.
    LINES = 2;
    /// `u32` per triangle, in the order of the leaves: its id in the source.
    TRIANGLE_IDS = 3;
    /// [`super::TetLeaf`]s.
    TET_LEAVES = 4;
    /// [`super::Link32`] or [`super::Tet16`] records.
    TETS = 5;
    /// [`super::TetVertex`] positions.
    TET_VERTICES = 6;
    /// [`super::TetFace`]s, one per constrained face.
    TET_FACES = 7;
    /// [`super::HullFace`]s.
    HULL_FACES = 8;
    /// `u32` per source triangle: its row in `TET_FACES`, or `NONE`.
    TRIANGLE_FACES = 9;
    /// `[u32; 16]` per indexed leaf and three of them per raw leaf, in the order of the leaves:
    /// rows of `POSITIONS`. Objects that have it can be given new positions ("Deformable objects").
    LEAF_VERTICES = 10;
    /// `u32` per source triangle: its [`super::TrianglePlace`], or `NONE`.
    TRIANGLE_PLACES = 11;
    /// [`super::FreeDirections`] per source triangle: what rays that start on it cannot hit.
    FREE_DIRECTIONS = 12;
    /// One [`super::FreeLevels`], if there are free directions or distances.
    FREE_LEVELS = 13;
    /// [`super::FreeDistances`] per source triangle, instead of free directions.
    FREE_DISTANCES = 14;
    /// `[f32; 3]`: positions of the source, object space; distinct ones but in deformable objects.
    POSITIONS = 16;
    /// `[u32; 3]` per source triangle: rows of `POSITIONS`.
    TRIANGLES = 17;
    /// `[u32; 3]` per source triangle: rows of `NORMALS` and `UVS`.
    CORNERS = 18;
    /// `[f32; 3]`: shading normals as in the source, of any length.
    NORMALS = 19;
    /// `[f32; 2]`: texture coordinates as in the source.
    UVS = 20;
    /// [`super::Group`]s: the groups of the object's triangles.
    GROUPS = 21;
    /// [`super::GroupRun`]s: which triangles belong to which group.
    GROUP_RUNS = 22;
    /// [`super::Material`]s that groups refer to.
    MATERIALS = 23;
    /// UTF-8 bytes of the names of groups and materials.
    LABELS = 24;
    /// `f64` seconds of the frames of a sequence.
    SEQUENCE_TIMES = 25;
    /// `[f32; 3]`: the positions of a sequence, by frame, then by row of `POSITIONS`.
    SEQUENCE_POSITIONS = 26;
    /// `u32` per source triangle: a [`super::TriangleOpacity`].
    OPACITY = 28;
    /// `u32`: states of micro-triangles, two bits each.
    OPACITY_MICRO = 29;
    /// UTF-8 JSON: how the file came about. Not part of the content id.
    PROVENANCE = 32;
    /// [`super::ObjectName`]s, one per object of the file.
    OBJECT_NAMES = 33;
    /// UTF-8 bytes of the names of objects.
    OBJECT_LABELS = 34;
    /// [`super::MaterialParameters`], one per row of `MATERIALS`. This section and the three that
    /// follow belong to an object.
    MATERIAL_PARAMETERS = 35;
    /// [`super::Texture`]s that material parameters refer to.
    TEXTURES = 36;
    /// `[u32; 3]` per source triangle: rows of `COLORS`.
    COLOR_CORNERS = 37;
    /// `[u16; 4]`: vertex colours, linear red, green, blue and alpha; 65,535 means 1.
    COLORS = 38;
    /// [`super::Image`]s of textures, ascending by name. This section and the next one belong to
    /// the whole file.
    IMAGES = 39;
    /// Bytes of the image files.
    IMAGE_BYTES = 40;
    /// One [`super::Deformation`]. This section and the five that follow belong to an object.
    DEFORMATION = 41;
    /// `[u16; 4]`: joints that move a position, of the skin of the object's deformer.
    JOINTS = 42;
    /// `[f32; 4]`: weights of the joints.
    JOINT_WEIGHTS = 43;
    /// [`super::Morph`]s: of each target what it adds to positions, then what it adds to normals.
    MORPHS = 44;
    /// `u32`: rows of `POSITIONS` or `NORMALS` that sparse morphs change.
    MORPH_ROWS = 45;
    /// `[f32; 3]`: what morphs add at a weight of 1.
    MORPH_DELTAS = 46;
    /// One [`super::Scene`]. This section and the following ones belong to the whole file.
    SCENE = 48;
    /// [`super::Node`]s, parents before children.
    NODES = 49;
    /// [`super::Instance`]s.
    INSTANCES = 50;
    /// [`super::Track`]s, ascending by node and property.
    TRACKS = 51;
    /// `f64` seconds: times of the keys of all tracks.
    TIMES = 52;
    /// `f64`: values of the keys of all tracks.
    VALUES = 53;
    /// [`super::Camera`]s.
    CAMERAS = 54;
    /// [`super::Light`]s.
    LIGHTS = 55;
    /// UTF-8 bytes of the names of nodes, cameras and lights.
    NAMES = 56;
    /// [`super::Deformer`]s, ascending by node.
    DEFORMERS = 57;
    /// [`super::Skin`]s.
    SKINS = 58;
    /// [`super::SkinJoint`]s of all skins.
    SKIN_JOINTS = 59;
    /// `f64`: weights of the morph targets of all deformers, where no track gives others.
    MORPH_WEIGHTS = 60;
    /// `[u32; 3]` per source triangle: rows of `SECOND_UVS`.
    SECOND_CORNERS = 68;
    /// `[f32; 2]`: a second set of texture coordinates.
    SECOND_UVS = 69;
}

/// Kind of trees for ranges of time in older files, which are refused (BTH-F007).
pub(crate) const FORMER_SEGMENTS: u32 = 27;

/// Returns true if sections of this kind are part of the scene.
pub const fn is_scene(kind: u32) -> bool {
    SCENE <= kind && kind <= MORPH_WEIGHTS
}
/// Returns true if sections of this kind belong to the whole file.
pub const fn is_of_file(kind: u32) -> bool {
    (PROVENANCE <= kind && kind <= OBJECT_LABELS) || kind == IMAGES || kind == IMAGE_BYTES || is_scene(kind)
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
        || is_sequence(kind)
        || is_scene(kind)
}
