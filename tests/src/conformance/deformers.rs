//! A scene whose objects deform: one with a skin of two joints and two morph targets that change
//! normals too, one with a morph target.

use super::scenes::still;
use super::valid::{bounds, indexed, lines};
use super::{Case, Editor, Seal};
use bth_compile::write::{DeformerParts, FileBuilder, ObjectParts, SceneParts, Source, object, scene};
use bth_format::layout::*;
use std::mem::offset_of;
use zerocopy::IntoBytes;

/// Two triangles; the last vertex is at the place of the first, and moves in another way.
const POSITIONS: [[f32; 3]; 5] =
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 0.0]];
const TRIANGLES: [[u32; 3]; 2] = [[0, 1, 2], [2, 3, 4]];
const NORMALS: [[f32; 3]; 2] = [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]];
const CORNERS: [[u32; 3]; 2] = [[0, 1, 0], [0, 0, 1]];

/// Of the first object: five rows for positions, with two sets of influences.
fn skinned() -> bth_import::Deformation {
    let morph = |deltas, first_delta, first_row| Morph { deltas, first_delta, first_row, reserved: 0 };
    bth_import::Deformation {
        counts: Deformation { joints: 3, influence_sets: 2, targets: 2, reserved: 0 },
        joints: (0..10).map(|row| [row % 3, 0, 2, 1]).collect(),
        weights: (0..10).map(|row| [1.0, 0.5 * f32::from(row as u8), 0.25, 0.0]).collect(),
        morphs: vec![morph(2, 0, 0), morph(5, 2, NONE), morph(0, 7, 2), morph(1, 7, 2)],
        morph_rows: vec![1, 3, 1],
        deltas: (0..8).map(|row| [row as f32, 1.0, -0.5]).collect(),
    }
}

/// Of the second object: one target.
fn morphed() -> bth_import::Deformation {
    bth_import::Deformation {
        counts: Deformation { joints: 0, influence_sets: 0, targets: 1, reserved: 0 },
        joints: Vec::new(),
        weights: Vec::new(),
        morphs: vec![Morph { deltas: 1, first_delta: 0, first_row: 0, reserved: 0 }],
        morph_rows: vec![4],
        deltas: vec![[0.0, 0.0, 2.0]],
    }
}

fn scene_parts() -> SceneParts {
    let mut parts = still();
    let node = parts.nodes[0];
    parts.nodes = vec![node, Node { parent: 0, ..node }, Node { flags: NODE_MATRIX, ..node }];
    parts.nodes[2].transform = [1.0, 0.0, 0.0, 0.5, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    parts.instances = [(1, 0, 0), (2, 1, 1)]
        .map(|(node, object, first)| Instance { node, object, flags: 0, first })
        .to_vec();
    let track = |node, property: Property, interpolation: Interpolation, first: [u32; 2]| Track {
        node,
        property: property as u32,
        interpolation: interpolation as u32,
        keys: 2,
        first_time: first[0],
        first_value: first[1],
        reserved: [0; 2],
    };
    parts.tracks = vec![
        track(0, Property::Translation, Interpolation::Linear, [0, 0]),
        track(1, Property::Weights, Interpolation::Cubic, [2, 6]),
        track(2, Property::Weights, Interpolation::Step, [4, 18]),
    ];
    parts.times = vec![0.0, 1.0, 0.0, 2.0, 0.5, 1.5];
    parts.values = (0..20).map(|x| f64::from(x) / 8.0).collect();
    let bind = |x: f64| [1.0, 0.0, 0.0, x, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let joint = |node, x| SkinJoint { inverse_bind: bind(x), node, reserved: [0; 3] };
    let deformer = |node, object, skin, [weights, first_weight]: [u32; 2]| Deformer {
        node,
        object,
        skin,
        weights,
        first_weight,
        reserved: [0; 3],
    };
    parts.deformers = DeformerParts {
        deformers: vec![deformer(1, 0, 1, [2, 0]), deformer(2, 1, NONE, [1, 2])],
        skins: [(0, 1), (1, 3)]
            .map(|(first_joint, joints)| Skin { first_joint, joints, reserved: [0; 2] })
            .to_vec(),
        joints: vec![joint(0, 0.0), joint(0, 1.0), joint(1, -1.0), joint(2, 0.5)],
        weights: vec![0.25, 0.0, 1.0],
    };
    parts
}

/// The valid file.
pub(super) fn deforming() -> Vec<u8> {
    deforming_with(&[])
}

/// The valid file, but for the times of frames of the first object.
fn deforming_with(times: &[f64]) -> Vec<u8> {
    let corners = TRIANGLES.map(|triangle| triangle.map(|row| POSITIONS[row as usize]));
    // A vertex for each row of POSITIONS, the two equal ones apart.
    let mut leaf = indexed(&corners, 0);
    leaf.corner = [[0; WIDTH]; 3];
    for (t, triangle) in TRIANGLES.iter().enumerate() {
        (0..3).for_each(|k| leaf.corner[k][t] = triangle[k] as u8);
    }
    let slots: [u32; WIDTH] = std::array::from_fn(|i| if i < 5 { i as u32 } else { 0 });
    (leaf.vertices, leaf.vertex) = (5, [0, 1, 2].map(|axis| slots.map(|row| POSITIONS[row as usize][axis])));
    let lines = lines(leaf.as_bytes());
    let (skinned, morphed) = (skinned(), morphed());
    let frames = POSITIONS.repeat(times.len());
    let source = Source {
        positions: &POSITIONS,
        triangles: &TRIANGLES,
        corners: &CORNERS,
        normals: &NORMALS,
        ..Source::default()
    };
    let parts = ObjectParts {
        bounds: Some(bounds(&POSITIONS)),
        root: Child::Indexed(0).code(),
        triangles: 2,
        lines: &lines,
        triangle_ids: &[0, 1],
        leaf_vertices: &[slots],
        source: Some(source),
        ..ObjectParts::default()
    };
    let mut builder = FileBuilder::new();
    for (number, deformation) in [&skinned, &morphed].into_iter().enumerate() {
        let (times, frames) = if number == 0 { (times, &frames[..]) } else { (&[][..], &[][..]) };
        let parts = ObjectParts {
            deformation: Some(deformation),
            sequence_times: times,
            sequence_positions: frames,
            ..parts
        };
        object(&mut builder, number as u32, &parts).expect("the parts fit together");
    }
    let scene_parts = scene_parts();
    scene(&mut builder, &scene_parts).expect("each section once");
    builder.finish()
}

/// The valid file with bytes changed at an offset of a section of object 0 or of the whole file.
fn changed(name: &str, object: u32, kind: u32, at: usize, value: &[u8]) -> Case {
    let mut editor = Editor::new(&deforming());
    let entry = editor.entry_at(object, kind) + offset_of!(SectionEntry, offset);
    let start = u64::from_le_bytes(editor.bytes[entry..entry + 8].try_into().unwrap()) as usize;
    editor.put(start + at, value);
    Case::new(name, editor.seal(Seal::Sections))
}

/// The valid file with fewer rows in a section, behind which there are zeros.
fn shortened(name: &str, object: u32, kind: u32, rows: u64) -> Case {
    let mut editor = Editor::new(&deforming());
    let entry = editor.entry_at(object, kind);
    let row = editor.entries()[(entry - 128) / 64];
    let (start, end) =
        ((row.offset + rows * u64::from(row.stride)) as usize, (row.offset + row.length) as usize);
    editor.put(start, &vec![0; end - start]);
    editor.put(entry + offset_of!(SectionEntry, count), &rows.to_le_bytes());
    editor.put(entry + offset_of!(SectionEntry, length), &(rows * u64::from(row.stride)).to_le_bytes());
    Case::new(name, editor.seal(Seal::Sections))
}

/// Files that break one rule each.
pub(super) fn invalid() -> Vec<Case> {
    let mut cases = of_objects();
    cases.extend(of_scene());
    cases
}

fn of_objects() -> Vec<Case> {
    let word = |name, kind, at: usize, value: u32| changed(name, 0, kind, at, &value.to_le_bytes());
    let number = |name, kind, at: usize, value: f32| changed(name, 0, kind, at, &value.to_le_bytes());
    let (counts, row) = (kind::DEFORMATION, size_of::<Morph>());
    vec![
        word("F173-sets", counts, offset_of!(Deformation, influence_sets), 3),
        word("F173-joints-without-sets", counts, offset_of!(Deformation, influence_sets), 0),
        word("F173-too-many-joints", counts, 0, MAX_JOINTS + 1),
        word("F173-reserved", counts, offset_of!(Deformation, reserved), 1),
        shortened("F173-no-row", 0, counts, 0),
        shortened("F174-joints", 0, kind::JOINTS, 9),
        shortened("F174-weights", 0, kind::JOINT_WEIGHTS, 9),
        changed("F175-joint", 0, kind::JOINTS, 8 * 9 + 2, &3u16.to_le_bytes()),
        number("F175-negative", kind::JOINT_WEIGHTS, 16 * 9 + 12, -0.5),
        number("F175-infinite", kind::JOINT_WEIGHTS, 0, f32::INFINITY),
        changed("F175-no-weight", 0, kind::JOINT_WEIGHTS, 32, &[0; 32]),
        shortened("F176-rows", 0, kind::MORPHS, 3),
        word("F176-reserved", kind::MORPHS, offset_of!(Morph, reserved), 1),
        word("F177-hole", kind::MORPHS, row + offset_of!(Morph, first_delta), 3),
        word("F177-dense", kind::MORPHS, row, 4),
        word("F177-rows", kind::MORPHS, 3 * row + offset_of!(Morph, first_row), 1),
        word("F177-beyond-the-end", kind::MORPHS, 3 * row, 2),
        word("F178-order", kind::MORPH_ROWS, 4, 1),
        word("F178-position", kind::MORPH_ROWS, 4, 5),
        word("F178-normal", kind::MORPH_ROWS, 8, 2),
        number("F179-infinite", kind::MORPH_DELTAS, 12 * 7 + 8, f32::NAN),
    ]
}

fn of_scene() -> Vec<Case> {
    let word = |name, kind, at: usize, value: u32| changed(name, NONE, kind, at, &value.to_le_bytes());
    let number = |name, kind, at: usize, value: f64| changed(name, NONE, kind, at, &value.to_le_bytes());
    let (deformer, skin, joint) = (size_of::<Deformer>(), size_of::<Skin>(), size_of::<SkinJoint>());
    vec![
        word("F180-order", kind::DEFORMERS, deformer, 1),
        word("F180-node", kind::DEFORMERS, deformer, 3),
        word("F180-object", kind::DEFORMERS, deformer + offset_of!(Deformer, object), 2),
        word("F180-reserved", kind::DEFORMERS, offset_of!(Deformer, reserved), 1),
        word("F181-no-joints", kind::DEFORMERS, deformer + offset_of!(Deformer, skin), 1),
        word("F181-few-joints", kind::DEFORMERS, offset_of!(Deformer, skin), 0),
        word("F181-skin", kind::DEFORMERS, offset_of!(Deformer, skin), 2),
        word("F182-number", kind::DEFORMERS, deformer + offset_of!(Deformer, weights), 2),
        word("F182-hole", kind::DEFORMERS, deformer + offset_of!(Deformer, first_weight), 1),
        number("F182-infinite", kind::MORPH_WEIGHTS, 16, f64::INFINITY),
        word("F183-no-joints", kind::SKINS, offset_of!(Skin, joints), 0),
        word("F183-hole", kind::SKINS, skin, 2),
        word("F183-beyond-the-end", kind::SKINS, skin + offset_of!(Skin, joints), 4),
        word("F183-reserved", kind::SKINS, offset_of!(Skin, reserved), 1),
        word("F184-node", kind::SKIN_JOINTS, 3 * joint + offset_of!(SkinJoint, node), 3),
        number("F184-infinite", kind::SKIN_JOINTS, joint, f64::NAN),
        word("F184-reserved", kind::SKIN_JOINTS, offset_of!(SkinJoint, reserved), 1),
        word("F185-no-deformer", kind::TRACKS, offset_of!(Track, property), Property::Weights as u32),
        shortened("F186-leaf-vertices", 1, kind::LEAF_VERTICES, 0),
        Case::new("F186-frames", deforming_with(&[0.0, 1.0])),
    ]
}
