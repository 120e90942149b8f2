//! The stable codes of errors, one for each numbered invariant of the specification, with the words
//! of the invariant and a hint.

macro_rules! codes {
    ($($name:ident $text:literal $rule:literal)*) => {
        /// What was violated: `BTH-F` and a number for the invariants of the specification, `BTH-O`
        /// for opening, `BTH-S` for scenes that cannot be traced. Codes never change their meaning;
        /// new ones may be added.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[non_exhaustive]
        pub enum Code {
            $(#[doc = $rule] $name,)*
        }
        impl Code {
            /// All codes, in order.
            pub const ALL: &'static [Code] = &[$(Code::$name),*];

            /// The stable code, such as `BTH-F012`.
            pub const fn as_str(self) -> &'static str {
                match self { $(Code::$name => concat!("BTH-", $text),)* }
            }
            /// The invariant, in the words of the specification.
            pub const fn rule(self) -> &'static str {
                match self { $(Code::$name => $rule,)* }
            }
        }
    };
}

codes! {
    Read "O001" "The file can be read."
    Host "O002" "The machine is little-endian."
    NoSuchObject "O003" "The object that the caller named exists."

    HeaderSize "F001" "The file holds a whole header of 128 bytes."
    Identifier "F002" "The file starts with the 16 bytes of the identifier."
    Version "F003" "Both versions have major 1, and the minimum reader version is at most the writer's and at most the reader's."
    HeaderHash "F004" "The header hash is that of the first 112 bytes."
    Length "F005" "The file length in the header is that of the file."
    Reserved "F006" "Reserved fields of the header and the section table are zero."
    Features "F007" "The reader knows every required feature bit and record of tetrahedra, and no section is of kind 27, which older files have."
    Table "F008" "The section table starts at 128, has at most 2^22 entries and lies within the file."
    TableHash "F009" "The table hash is that of the section table."
    Order "F010" "Section entries ascend strictly by (object, kind)."
    Alignment "F011" "Alignments are 64 and offsets are multiples of it."
    Bounds "F012" "Sections lie behind the section table and within the file, first the ones of kind OBJECT, then all others, both in the order of the table, and do not overlap."
    Count "F013" "A section's length is its stride times its count."
    Stride "F014" "A section of a known kind has the stride of that kind."
    UnknownKind "F015" "A section of an unknown kind does not have flag bit 0."
    Flags "F016" "Flag bits of a section other than bit 0 are zero."
    Objects "F017" "Objects are numbered from 0 without gaps, each with one OBJECT row; sections of the whole file have object 2^32-1."
    ContentId "F018" "The content id is that of the section table."
    Tail "F019" "The file ends where its last section does, rounded up to 64 bytes."
    Gap "F020" "Bytes between the table, the sections and the end of the file are zero."
    SectionHash "F021" "A section's hash is that of its bytes."
    Limit "F022" "Triangles and tetrahedra of an object number at most 2^30, lines at most 2^29."

    Record "F101" "The record is 1 where there is a TETS section, or 0 with neither tetrahedra nor tet leaves."
    Counts "F102" "TRIANGLE_FACES, TRIANGLE_PLACES, TRIANGLES and CORNERS are empty or have as many rows as the object has triangles; no more triangles are dropped than there are."
    ObjectBounds "F103" "Object bounds are finite with lower <= upper; without a root they are zero."
    Coordinates "F104" "Coordinates of triangle leaves are f32, with zeros in the fields of the grid, or have 16 or 21 bits on a grid whose points are all f32, with a displacement that is finite and not negative; the header's features announce the grids and widened boxes of objects."
    ChildCode "F105" "Child codes are NONE or of an assigned kind; a tet leaf has no subtree."
    ChildRange "F106" "The block or row that a child code leads to lies within its section."
    ChildOrder "F107" "Nodes and triangle leaves lie behind the node that refers to them."
    Overlap "F108" "Blocks do not overlap, and one child code leads to each."
    Unclaimed "F109" "Every line belongs to a block; on a grid the first half of every line does, and a second half that does not is zero."
    Depth "F110" "No path from the root has more nodes than the object's depth, which is at most 96."
    Slots "F111" "The used slots of a node come first, and there is at least one; empty slots hold the empty box."
    ChildBounds "F112" "Child boxes are finite with lower <= upper."
    LeafCounts "F113" "A triangle leaf has 1 to 16 triangles, an indexed one 1 to 16 vertices."
    Corner "F114" "Corners of an indexed leaf are below its number of vertices."
    LeafIds "F115" "A leaf's rows lie within TRIANGLE_IDS."
    TriangleId "F116" "Rows of TRIANGLE_IDS are below the number of triangles."
    LeafVertices "F117" "Vertices of leaves are finite."
    LeafUnused "F118" "Unused slots of leaves are filled as specified and reserved fields are zero."
    TetBox "F120" "The box of a tet leaf is finite with lower < upper, and its flags are zero."
    TetRanges "F121" "The ranges of successive tet leaves follow each other, lie within their sections and together cover them."
    TetCounts "F122" "A tet leaf has at least one tetrahedron, four vertices, one constrained face and four hull faces."
    TetReferences "F123" "Every tet leaf is the child of exactly one node, or the root."
    TetVertices "F124" "Vertices of tetrahedra are finite, and their reserved fields are zero."
    HullFace "F125" "A hull face names four distinct vertices of its leaf and the tetrahedron that has exactly these, which has no neighbour across the face; every face without a neighbour is named once."
    TetFace "F126" "A constrained face names three distinct vertices of its leaf and the tetrahedron and fourth vertex on either side; both refer to it, and no other tetrahedron does."
    Link "F127" "A link is NONE, another tetrahedron of the same leaf or a constrained face of the same leaf."
    Neighbour "F128" "Neighbours share three vertices and refer to each other."
    TetRecord "F129" "The opposite vertex of a link is the vertex of the neighbour off the shared face."
    Unreached "F130" "Every tetrahedron of a leaf is reached from its first hull face."
    TriangleFaces "F131" "TRIANGLE_FACES is empty without tet leaves; else it maps each triangle that is a constrained face to that face, and others to NONE."
    SourceRows "F140" "Rows of TRIANGLES and CORNERS lie within the sections that they refer to; normals and texture coordinates have equally many rows where the object has both."
    Positions "F141" "Positions are finite."
    GroupRuns "F142" "GROUP_RUNS is empty without GROUPS or without triangles; else its first triangles start at 0, ascend strictly and are below the number of triangles, and its groups are rows of GROUPS."
    Group "F143" "A group's material is NONE or a row of MATERIALS; reserved fields of groups and materials are zero."
    Label "F144" "Names of groups and materials lie within LABELS, before its first byte that is not UTF-8, are UTF-8 and have at most 4,096 bytes."
    OpacityRows "F145" "OPACITY has as many rows as the object has triangles, or none, and OPACITY_MICRO is empty then."
    Opacity "F146" "A row of OPACITY is a state, or a level from 1 to 8 and the first of its words, which lie within OPACITY_MICRO."
    MicroOpacity "F147" "States in OPACITY_MICRO are from 0 to 2; bits behind the last state of a triangle of level 1 are zero."
    ObjectName "F148" "OBJECT_NAMES has a row for each object or none; names lie within OBJECT_LABELS, before its first byte that is not UTF-8, are UTF-8 and have at most 4,096 bytes."
    MaterialParameters "F149" "MATERIAL_PARAMETERS has as many rows as MATERIALS or none; colors, alpha cutoff, alpha mode and flags are in the ranges of the table of MaterialParameters; textures are NONE or rows of TEXTURES; reserved fields are zero."
    Scene "F150" "Scene sections come with SCENE, which has one row: a finite rate above 0, a first frame not after the last, both within 2^24 of 0, a camera below the number of cameras or NONE, and reserved fields of zero."
    Node "F151" "A node's parent is NONE or a lesser row, NONE for a group; its flags are known, and its reserved fields are zero."
    NodeTransform "F152" "A node's transform is finite; one that is no matrix has a quaternion that is not zero and ends with two zeros."
    Name "F153" "Names lie within NAMES, before its first byte that is not UTF-8, are UTF-8 and have at most 4,096 bytes."
    Instance "F154" "Instances refer to nodes, and to objects or groups of nodes of the file; their flags are known; each has the number of its first instance."
    Track "F155" "Tracks ascend strictly by (node, property); their nodes, properties and interpolations exist; visibility changes in steps; nodes with a matrix have no other tracks than of visibility and of weights; reserved fields are zero."
    TrackRanges "F156" "A track has at least one key; the ranges of successive tracks follow each other, lie within TIMES and VALUES and together cover them."
    TrackKeys "F157" "Times of a track are finite and ascend strictly; values are finite, quaternions are not zero, and visibility is 0 or 1."
    Camera "F158" "A camera's node and projection exist; its size, aspect, near and far are finite and in the ranges of the table of Camera; its reserved fields are zero."
    Light "F159" "A light's node and kind exist; its color, intensity, range and angles are finite and in the ranges of the table of Light; its reserved fields are zero."
    Texture "F160" "Wrap modes, filter and set of texture coordinates of a texture are known, its transform is finite, and its reserved fields are zero."
    Colors "F161" "COLOR_CORNERS has as many rows as the object has triangles, or none, and its rows lie within COLORS."
    Images "F162" "IMAGES ascend strictly by name; the ranges of successive images follow each other, are not empty and together cover IMAGE_BYTES; the image of each texture is the name of one of them."

    Deformable "F163" "LEAF_VERTICES is empty, or the object has POSITIONS and TRIANGLES, coordinates of f32, WideNodes whose boxes are not widened, no tet leaf, and drops no triangle."
    BlockOrder "F164" "In a deformable object LINES holds the nodes in depth-first order, then the leaves in depth-first order."
    LeafRows "F165" "In a deformable object LEAF_VERTICES has one row for each indexed leaf and three for each raw leaf."
    LeafVertexRows "F166" "Elements of LEAF_VERTICES are rows of POSITIONS; those of unused slots repeat that of slot 0."
    LeafTriangles "F167" "In a deformable object the corners of a leaf's triangle have the rows of POSITIONS that TRIANGLES gives."
    FreeRows "F168" "FREE_DIRECTIONS has as many rows as the object has triangles, or none, and so has FREE_DISTANCES; at most one of them has any, in a deformable object none. FREE_LEVELS has one row beside them, else none."
    TrianglePlace "F169" "A row of TRIANGLE_PLACES is NONE, or names a slot of a triangle leaf that holds the row's triangle."
    FreeBins "F170" "Bits 121 to 125 and 127 of the bins of a row of FREE_DIRECTIONS are zero."
    FreeLevels "F171" "The distances of FREE_LEVELS are zeros, or ascending and from 2^-50 to 2^50; its reserved field is zero."
    FreeUnplaced "F172" "A row of FREE_DIRECTIONS or FREE_DISTANCES whose triangle has no place is zero."
    Deformation "F173" "DEFORMATION has one row or none; it comes with TRIANGLES, has at most 2 sets of influences and 2^16 joints, none of one only without the other, and a reserved field of zero; without it JOINTS, JOINT_WEIGHTS, MORPHS, MORPH_ROWS and MORPH_DELTAS are empty."
    InfluenceRows "F174" "JOINTS and JOINT_WEIGHTS have as many rows for each position as DEFORMATION has sets of influences."
    Influences "F175" "Joints are below the number of joints in DEFORMATION; the weights of a position are finite, not negative, and not all zero."
    MorphRows "F176" "MORPHS has a row for each target, or two; reserved fields are zero."
    MorphRanges "F177" "The ranges of successive morphs follow each other, lie within MORPH_DELTAS and MORPH_ROWS and together cover them; a dense morph has a delta for each row of POSITIONS or NORMALS."
    MorphOrder "F178" "Rows of a sparse morph ascend strictly and are rows of POSITIONS or NORMALS."
    MorphDeltas "F179" "Deltas of morphs are finite."
    Deformer "F180" "Deformers ascend strictly by node; their nodes exist, their objects have DEFORMATION, no two have the same object, and reserved fields are zero."
    DeformerSkin "F181" "The skin of a deformer is NONE or exists; its object has joints then, and no more than the skin."
    MorphWeights "F182" "A deformer has a weight for each target of its object; the ranges of successive deformers follow each other, lie within MORPH_WEIGHTS and together cover it; weights are finite."
    Skin "F183" "A skin has at least one joint; the ranges of successive skins follow each other, lie within SKIN_JOINTS and together cover it; reserved fields are zero."
    SkinJoint "F184" "The node of a skin's joint exists, its matrix is finite, and its reserved fields are zero."
    WeightTrack "F185" "A track of weights belongs to the node of a deformer that has weights."
    DeformerObject "F186" "The object of a deformer has LEAF_VERTICES, or nothing that can be hit; it has no SEQUENCE_TIMES."
    PlaceMissing "F187" "With TRIANGLE_PLACES, each triangle in a triangle leaf has a place, unless the index of the leaf is 2^27 - 1 or more."
    NodeGroups "F188" "Instances in groups of nodes come in the order of the groups, before those in the world. They are of groups before their own. Written out there are fewer than 2^32 - 1, with at most 16 on the way to each. No camera, light or deformer is in a group, and no instance there is of an object with a skin."

    SequenceRows "F190" "SEQUENCE_POSITIONS has a row for each time of SEQUENCE_TIMES and each row of POSITIONS; an object with times is deformable."
    SequenceTimes "F191" "Times of SEQUENCE_TIMES are finite and ascend strictly."
    SequencePositions "F192" "Positions of SEQUENCE_POSITIONS are finite; those of the first time are POSITIONS, bit for bit."
    ExactRows "F193" "EXACT_POSITIONS has as many rows as POSITIONS, or none; ANCHOR has one row if there are any, else none. An object that has them has TRIANGLES and coordinates of f32, and neither LEAF_VERTICES nor tet leaves nor free directions or distances."
    ExactNumbers "F194" "Numbers of EXACT_POSITIONS and ANCHOR are 0 or numbers that f32 neither rounds to 0 nor to an infinity: from 2^-149 to the largest finite f32 in absolute value."
    SecondCorners "F220" "SECOND_CORNERS has as many rows as the object has triangles, or none, and its rows lie within SECOND_UVS."
    SecondUvs "F221" "Coordinates of SECOND_UVS are finite."
    GlossParameters "F222" "GLOSS_PARAMETERS has as many rows as MATERIALS or none; its numbers are in the ranges of the table of GlossParameters; textures are NONE or rows of TEXTURES; reserved fields are zero."

    LeafSource "F201" "A triangle of a leaf has the corners of its source triangle, bit for bit; on a grid the points nearest to them."
    FaceSource "F202" "A constrained face has the corners of its source triangle, bit for bit; on a grid the points nearest to them."
    Coverage "F203" "Every triangle that is not dropped lies in exactly one triangle leaf or constrained face; as many are dropped as the object says."
    Containment "F204" "The object's bounds and each child box contain the triangles below; widened child boxes contain each corner with the room around it."
    TetContainment "F205" "The box of a tet leaf contains its vertices."
    Orientation "F206" "Tetrahedra have volume, neighbours lie on either side of their common face, hull faces point inwards and constrained faces to their first tetrahedron."
    ZeroArea "F207" "Exactly the triangles of zero area are dropped, decided by EXACT_POSITIONS where there are some; of a deformable object none is."
    Displacement "F208" "No vertex of a triangle is farther from that of the source than the displacement of the object."
    FreeMet "F209" "Rays that start on a triangle, in a direction of a free bin or its margin, meet no point of a triangle beyond; none within the distance of a level, in a direction of its sector."
    FreeAxes "F210" "A triangle with a row of FREE_DIRECTIONS or FREE_DISTANCES that is not zero has axes: edges from 2^-20 to 2^20 long at its first corner, and a sine of at least 1/128 between them."
    ExactRounding "F211" "A row of POSITIONS next to EXACT_POSITIONS is the f32 nearest to their difference from ANCHOR, with 0 for -0."
    Trees "F212" "TREES has no rows, or one for each group of nodes and maybe one for the world, or with required feature bit 5 one for each of the first groups, which do not move; its rows have the ranges of the groups and together cover TREE_LINES; each visible row of a group, and no other, is in one slot of its tree."
    TreeBoxes "F213" "A box of TREE_LINES contains what its child leads to, with the room that rays need; so do the numbers of a row of TREES."

    Singular "S001" "The transform of an instance that is seen can be inverted."
    NotFinite "S002" "The transform and the world box of an instance that is seen are finite."
    NoSuchInstance "S003" "The instance or subscene that the caller named exists."
    PlacedByFile "S004" "An instance of a subscene is moved and removed only with the subscene."
    TooManyInstances "S005" "A scene has at most 2^30 instances."
    NotDeformable "S006" "An object that is given new positions was compiled for them."
    NewPositions "S007" "New positions are finite, and as many as the object has vertices."
    Start "S008" "A ray starts at a point of a triangle with area, on an instance that is visible."
}

impl Code {
    pub(crate) fn hint(self) -> &'static str {
        match self {
            Code::Read => "check the path and its permissions",
            Code::Host => "big-endian machines are not supported",
            Code::NoSuchObject => "objects are numbered from 0",
            Code::HeaderSize | Code::Identifier => {
                "this is not a BTH file (`bthc compile` makes one of a model), or a transfer changed or cut it"
            }
            Code::Version | Code::Features | Code::UnknownKind => {
                "a newer version of this library can read the file"
            }
            Code::Length | Code::Tail => "the file was cut or appended to; copy or compile it again",
            Code::HeaderHash | Code::TableHash | Code::SectionHash | Code::Gap | Code::ContentId => {
                "the file was damaged; copy or compile it again"
            }
            Code::Singular => {
                "hide the instance, or scale its node by 0; else keep the scales of one transform within 2^24 of each other"
            }
            Code::NotFinite => "keep translations and scales within the range of 32-bit numbers",
            Code::Start => "take instance, triangle, u and v from a hit of this scene",
            Code::NoSuchInstance => "use ids that the scene builder returned and that were not removed since",
            Code::PlacedByFile => {
                "move, hide or remove the subscene, or add the object as an instance of its own"
            }
            Code::TooManyInstances => {
                "remove instances that are not seen, or join objects that move together"
            }
            Code::NotDeformable => "compile the model with --deformable",
            Code::NewPositions => {
                "give one position for each vertex of the source, in its order, and a share from 0 to 1"
            }
            _ => "the program that wrote the file has a defect; compile it again with bthc",
        }
    }
}

impl std::fmt::Display for Code {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.as_str())
    }
}
