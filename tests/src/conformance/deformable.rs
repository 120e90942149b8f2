//! An object that can be given new positions.

use super::invalid::{broken, field};
use super::valid::{bounds, file, indexed, lines, node, raw, tets_of};
use super::{Case, Seal};
use bth_compile::write::{FileBuilder, ObjectParts, Source, object, scene};
use bth_format::layout::*;
use std::mem::offset_of;
use zerocopy::IntoBytes;

/// Vertices of a strip of squares, then one twice and one that no triangle uses.
const POSITIONS: [[f32; 3]; 10] = [
    [0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [2.0, 0.0, 0.0],
    [2.0, 1.0, 0.0],
    [3.0, 0.0, 0.0],
    [3.0, 1.0, 0.0],
    [3.0, 0.0, 0.0],
    [9.0, 9.0, 9.0],
];

/// Two triangles a square, and two without area: one along an edge, one with a doubled corner.
const TRIANGLES: [[u32; 3]; 8] =
    [[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5], [4, 6, 5], [5, 6, 7], [0, 2, 4], [6, 8, 7]];

/// Triangles of the leaves: an indexed and a raw one below an inner node, an indexed one below the
/// root.
const LEAVES: [&[u32]; 3] = [&[0, 1, 6], &[3, 2], &[4, 5, 7]];

/// Lines of the leaves, behind the root and an inner node.
const LINES: [u32; 3] = [14, 18, 28];

/// The place of each triangle.
fn places() -> Vec<u32> {
    let mut places = vec![NONE; TRIANGLES.len()];
    let leaves = [Child::Indexed(LINES[0]), Child::Raw(LINES[1]), Child::Indexed(LINES[2])];
    for (leaf, ids) in leaves.into_iter().zip(LEAVES) {
        for (slot, id) in (0..).zip(ids) {
            places[*id as usize] = TrianglePlace { leaf, slot }.code();
        }
    }
    places
}

fn corners(ids: &[u32]) -> Vec<[[f32; 3]; 3]> {
    ids.iter().map(|id| TRIANGLES[*id as usize].map(|row| POSITIONS[row as usize])).collect()
}

/// Rows of LEAF_VERTICES: of the first and the last leaf by vertex in order of first use, of the
/// raw leaf by corner.
fn leaf_vertices() -> Vec<[u32; WIDTH]> {
    let row = |used: &[u32]| std::array::from_fn(|i| *used.get(i).unwrap_or(&used[0]));
    // Vertices 6 and 8 have one position, but are two vertices.
    vec![row(&[0, 2, 1, 3, 4]), row(&[3, 2]), row(&[4, 4]), row(&[5, 3]), row(&[4, 6, 5, 7, 8])]
}

pub(super) fn deformable() -> Vec<u8> {
    with_parts(file)
}

/// The object with the places of its triangles.
pub(super) fn with_places() -> Vec<u8> {
    with_parts(|parts| file(&ObjectParts { places: &places(), ..*parts }))
}

/// Makes something of the parts of the object.
fn with_parts<T>(make: impl FnOnce(&ObjectParts<'_>) -> T) -> T {
    let of = |leaf: usize| bounds(corners(LEAVES[leaf]).as_flattened());
    let inner = [corners(LEAVES[0]), corners(LEAVES[1])].concat();
    let root = node(&[(Child::Node(7), bounds(inner.as_flattened())), (Child::Indexed(LINES[2]), of(2))]);
    let second = node(&[(Child::Indexed(LINES[0]), of(0)), (Child::Raw(LINES[1]), of(1))]);
    let mut last = indexed(&corners(LEAVES[2]), 5);
    // The doubled vertex has a separate slot: triangles 4 and 5 use vertices 4 to 7, triangle 7 has
    // 6, 8 and 7.
    last.corner = [[0; WIDTH]; 3];
    for (t, vertices) in [[0, 1, 2], [2, 1, 3], [1, 4, 3]].into_iter().enumerate() {
        (0..3).for_each(|k| last.corner[k][t] = vertices[k]);
    }
    let slots = leaf_vertices()[4].map(|row| POSITIONS[row as usize]);
    (last.vertices, last.vertex) = (5, [0, 1, 2].map(|axis| slots.map(|p| p[axis])));
    let mut all = lines(root.as_bytes());
    all.extend(lines(second.as_bytes()));
    all.extend(lines(indexed(&corners(LEAVES[0]), 0).as_bytes()));
    all.extend(lines(raw(&corners(LEAVES[1]), 3).as_bytes()));
    all.extend(lines(last.as_bytes()));
    make(&ObjectParts {
        bounds: Some(bounds(&POSITIONS[..9])),
        root: Child::Node(0).code(),
        triangles: 8,
        lines: &all,
        triangle_ids: &LEAVES.concat(),
        leaf_vertices: &leaf_vertices(),
        places: &places(),
        source: Some(Source { positions: &POSITIONS, triangles: &TRIANGLES, ..Source::default() }),
        ..ObjectParts::default()
    })
}

/// The object with frames, and an instance of it.
pub(super) fn sequence() -> Vec<u8> {
    let moved = POSITIONS.map(|[x, y, z]| [x, y + 0.25 * x, z - 1.5]);
    let frames = [POSITIONS, moved, POSITIONS].concat();
    with_parts(|parts| {
        let mut builder = FileBuilder::new();
        let moving = ObjectParts { sequence_times: &[0.0, 0.5, 1.5], sequence_positions: &frames, ..*parts };
        object(&mut builder, 0, &moving).unwrap();
        object(&mut builder, 1, parts).unwrap();
        let still = super::scenes::still();
        scene(&mut builder, &still).unwrap();
        builder.finish()
    })
}

/// Faults of sequences.
pub(super) fn invalid_sequences() -> Vec<Case> {
    let base = "sequence";
    let bits = |x: f32| x.to_bits();
    let high = |x: f64| (x.to_bits() >> 32) as u32;
    let case = |name, kind, at: usize, value| field(name, base, kind, at, value);
    vec![
        broken("F190-rows", base, Seal::Sections, |e| {
            let (at, start) = (e.entry_at(0, kind::SEQUENCE_TIMES), e.section_at(kind::SEQUENCE_TIMES));
            e.put(at + offset_of!(SectionEntry, length), &16u64.to_le_bytes());
            e.put(at + offset_of!(SectionEntry, count), &2u64.to_le_bytes());
            e.put(start + 16, &[0; 8]);
        }),
        case("F191-not-ascending", kind::SEQUENCE_TIMES, 12, high(2.0)),
        case("F191-infinite", kind::SEQUENCE_TIMES, 20, high(f64::INFINITY)),
        case("F192-infinite", kind::SEQUENCE_POSITIONS, 12 * 25, bits(f32::NAN)),
        case("F192-other-first-frame", kind::SEQUENCE_POSITIONS, 12 * 9, bits(9.5)),
    ]
}

/// Faults of it.
pub(super) fn invalid() -> Vec<Case> {
    let base = "deformable";
    let element = |name, row: usize, slot: usize, value| {
        field(name, base, kind::LEAF_VERTICES, 64 * row + 4 * slot, value)
    };
    let child = offset_of!(WideNode, child);
    vec![
        Case::new("F163-tets", tets_of(false, &[[0; WIDTH]])),
        field("F163-dropped", base, kind::OBJECT, offset_of!(Object, dropped), 1),
        broken("F163-widened-boxes", base, Seal::Sections, |e| {
            e.put(offset_of!(Header, required_features), &FEATURE_WIDENED_BOXES.to_le_bytes());
            e.put_u32(kind::OBJECT, offset_of!(Object, coordinates), WIDENED_BOXES);
        }),
        broken("F164-slots-exchanged", base, Seal::Sections, |e| {
            // The same boxes and children in the other order: the leaves lie no longer in
            // depth-first order.
            for at in (0..6).map(|row| 448 + 64 * row).chain([448 + child]) {
                let [a, b] = [0, 4].map(|slot| e.get_u32(kind::LINES, at + slot));
                e.put_u32(kind::LINES, at, b).put_u32(kind::LINES, at + 4, a);
            }
        }),
        broken("F165-rows", base, Seal::Sections, |e| {
            let (at, start) = (e.entry_at(0, kind::LEAF_VERTICES), e.section_at(kind::LEAF_VERTICES));
            e.put(at + offset_of!(SectionEntry, length), &256u64.to_le_bytes());
            e.put(at + offset_of!(SectionEntry, count), &4u64.to_le_bytes());
            e.put(start + 256, &[0; 64]);
        }),
        element("F166-position", 0, 1, 10),
        element("F166-unused", 0, 15, 2),
        element("F166-raw-unused", 2, 2, 5),
        element("F167-other-vertex", 4, 4, 6),
        element("F167-other-corner", 1, 1, 5),
    ]
}
