//! Section kinds. Specification: "Kinds". Kinds 1 to 31, 35 to 38, 41 to 47 and 64 to 71 belong to an object, the others to
//! the whole file.

/// One [`super::Object`].
pub const OBJECT: u32 = 1;
/// [`super::CacheLine`]s that hold the nodes and triangle leaves.
pub const LINES: u32 = 2;
/// `u32` per triangle, in the order of the leaves: its id in the source.
pub const TRIANGLE_IDS: u32 = 3;
/// [`super::TetLeaf`]s.
pub const TET_LEAVES: u32 = 4;
/// [`super::Link32`], [`super::Tet32`], [`super::Tet20`] or [`super::Tet16`] records.
pub const TETS: u32 = 5;
/// [`super::TetVertex`] positions.
pub const TET_VERTICES: u32 = 6;
/// [`super::TetFace`]s, one per constrained face.
pub const TET_FACES: u32 = 7;
/// [`super::HullFace`]s.
pub const HULL_FACES: u32 = 8;
/// `u32` per source triangle: its row in `TET_FACES`, or `NONE`.
pub const TRIANGLE_FACES: u32 = 9;
/// `[u32; 16]` per indexed leaf and three of them per raw leaf, in the order of the leaves: rows of `POSITIONS`. Objects that
/// have it can be given new positions ("Deformable objects").
pub const LEAF_VERTICES: u32 = 10;
/// [`super::FreeDirections`] per source triangle: what rays that start on it cannot meet.
pub const FREE_DIRECTIONS: u32 = 12;
/// One [`super::FreeReach`], if there are free directions.
pub const FREE_REACH: u32 = 13;
/// `[f32; 3]`: positions of the source, object space; distinct ones but in deformable objects.
pub const POSITIONS: u32 = 16;
/// `[u32; 3]` per source triangle: rows of `POSITIONS`.
pub const TRIANGLES: u32 = 17;
/// `[u32; 3]` per source triangle: rows of `NORMALS` and `UVS`.
pub const CORNERS: u32 = 18;
/// `[f32; 3]`: shading normals as in the source, of any length.
pub const NORMALS: u32 = 19;
/// `[f32; 2]`: texture coordinates as in the source.
pub const UVS: u32 = 20;
/// [`super::Group`]s: the groups of the object's triangles.
pub const GROUPS: u32 = 21;
/// [`super::GroupRun`]s: which triangles belong to which group.
pub const GROUP_RUNS: u32 = 22;
/// [`super::Material`]s that groups refer to.
pub const MATERIALS: u32 = 23;
/// UTF-8 bytes of the names of groups and materials.
pub const LABELS: u32 = 24;
/// `f64` seconds of the frames of a sequence.
pub const SEQUENCE_TIMES: u32 = 25;
/// `[f32; 3]`: the positions of a sequence, by frame, then by row of `POSITIONS`.
pub const SEQUENCE_POSITIONS: u32 = 26;
/// [`super::Segment`]s: hierarchies of the object for ranges of time.
pub const SEGMENTS: u32 = 27;
/// `u32` per source triangle: a [`super::TriangleOpacity`].
pub const OPACITY: u32 = 28;
/// `u32`: states of micro-triangles, two bits each.
pub const OPACITY_MICRO: u32 = 29;
/// UTF-8 JSON: how the file came about. Not part of the content id.
pub const PROVENANCE: u32 = 32;
/// [`super::ObjectName`]s, one per object of the file.
pub const OBJECT_NAMES: u32 = 33;
/// UTF-8 bytes of the names of objects.
pub const OBJECT_LABELS: u32 = 34;
/// [`super::MaterialParameters`], one per row of `MATERIALS`. This section and the three that follow belong to an object.
pub const MATERIAL_PARAMETERS: u32 = 35;
/// [`super::Texture`]s that material parameters refer to.
pub const TEXTURES: u32 = 36;
/// `[u32; 3]` per source triangle: rows of `COLORS`.
pub const COLOR_CORNERS: u32 = 37;
/// `[u16; 4]`: vertex colours, linear red, green, blue and alpha; 65,535 stands for 1.
pub const COLORS: u32 = 38;
/// [`super::Image`]s of textures, ascending by name. This section and the next one belong to the whole file.
pub const IMAGES: u32 = 39;
/// Bytes of the image files.
pub const IMAGE_BYTES: u32 = 40;
/// One [`super::Deformation`]. This section and the five that follow belong to an object.
pub const DEFORMATION: u32 = 41;
/// `[u16; 4]`: joints that move a position, of the skin of the object's deformer.
pub const JOINTS: u32 = 42;
/// `[f32; 4]`: weights of the joints.
pub const JOINT_WEIGHTS: u32 = 43;
/// [`super::Morph`]s: of each target what it adds to positions, then what it adds to normals.
pub const MORPHS: u32 = 44;
/// `u32`: rows of `POSITIONS` or `NORMALS` that sparse morphs change.
pub const MORPH_ROWS: u32 = 45;
/// `[f32; 3]`: what morphs add at a weight of 1.
pub const MORPH_DELTAS: u32 = 46;
/// One [`super::Scene`]. This section and the following ones belong to the whole file.
pub const SCENE: u32 = 48;
/// [`super::Node`]s, parents before children.
pub const NODES: u32 = 49;
/// [`super::Instance`]s.
pub const INSTANCES: u32 = 50;
/// [`super::Track`]s, ascending by node and property.
pub const TRACKS: u32 = 51;
/// `f64` seconds: times of the keys of all tracks.
pub const TIMES: u32 = 52;
/// `f64`: values of the keys of all tracks.
pub const VALUES: u32 = 53;
/// [`super::Camera`]s.
pub const CAMERAS: u32 = 54;
/// [`super::Light`]s.
pub const LIGHTS: u32 = 55;
/// UTF-8 bytes of the names of nodes, cameras and lights.
pub const NAMES: u32 = 56;
/// [`super::Deformer`]s, ascending by node.
pub const DEFORMERS: u32 = 57;
/// [`super::Skin`]s.
pub const SKINS: u32 = 58;
/// [`super::SkinJoint`]s of all skins.
pub const SKIN_JOINTS: u32 = 59;
/// `f64`: weights of the morph targets of all deformers, where no track gives others.
pub const MORPH_WEIGHTS: u32 = 60;
/// `[u32; 3]` per source triangle: rows of `SECOND_UVS`.
pub const SECOND_CORNERS: u32 = 68;
/// `[f32; 2]`: a second set of texture coordinates.
pub const SECOND_UVS: u32 = 69;

/// Whether sections of this kind are part of the scene.
pub const fn is_scene(kind: u32) -> bool {
    SCENE <= kind && kind <= MORPH_WEIGHTS
}
/// Whether sections of this kind belong to the whole file.
pub const fn is_of_file(kind: u32) -> bool {
    (PROVENANCE <= kind && kind <= OBJECT_LABELS) || kind == IMAGES || kind == IMAGE_BYTES || is_scene(kind)
}
/// Whether sections of this kind say how an object's vertices move by themselves.
pub const fn is_sequence(kind: u32) -> bool {
    SEQUENCE_TIMES <= kind && kind <= SEGMENTS
}
/// Whether tracing reads sections of this kind of an object.
pub const fn is_traced(kind: u32) -> bool {
    is_required(kind) && kind != LEAF_VERTICES && !is_sequence(kind) && !is_of_file(kind)
        || kind == FREE_DIRECTIONS
        || kind == FREE_REACH
}
/// Whether sections of this kind carry [`super::SECTION_REQUIRED`]: a reader that does not know the kind must refuse the file.
pub const fn is_required(kind: u32) -> bool {
    (OBJECT <= kind && kind <= LEAF_VERTICES)
        || kind == OPACITY
        || kind == OPACITY_MICRO
        || is_sequence(kind)
        || is_scene(kind)
}
