//! Files that break one rule each.

use super::{Case, Editor, Seal, valid};
use bth_format::layout::*;
use std::mem::offset_of;

/// Files that are rejected when they are opened, checked or verified, each with its code.
pub fn invalid() -> Vec<Case> {
    let mut cases = container();
    cases.extend(tree());
    cases.extend(opacity());
    cases.extend(places());
    cases.extend(free_directions());
    cases.extend(tets());
    cases.extend(geometry());
    cases.extend(super::deformable::invalid());
    cases.extend(super::deformers::invalid());
    cases.extend(super::deformable::invalid_sequences());
    cases.extend(super::exact::invalid());
    cases.extend(groups());
    cases.extend(super::materials::invalid());
    cases.extend(super::scenes::invalid());
    cases.extend(super::trees::invalid());
    cases.sort_by(|a, b| a.name.cmp(&b.name));
    cases
}

/// A case made by changing a valid file and recomputing the hashes that `seal` names.
pub(super) fn broken(name: &str, base: &str, seal: Seal, change: impl FnOnce(&mut Editor)) -> Case {
    let base = valid().into_iter().find(|c| c.name == base).expect("a valid file of that name");
    let mut editor = Editor::new(&base.bytes);
    change(&mut editor);
    Case::new(name, editor.seal(seal))
}

/// Changes a 32-bit field of a section of object 0.
pub(super) fn field(name: &str, base: &str, kind: u32, at: usize, value: u32) -> Case {
    broken(name, base, Seal::Sections, |e| {
        e.put_u32(kind, at, value);
    })
}

/// Faults of groups and names.
fn groups() -> Vec<Case> {
    let case = |name: &str, kind, at: usize, value| field(name, "groups", kind, at, value);
    let run = size_of::<GroupRun>();
    let missing = |name: &str, kind| {
        broken(name, "groups", Seal::Sections, |e| {
            let at = e.entry_at(0, kind);
            e.put(at + offset_of!(SectionEntry, length), &[0; 8]);
            e.put(at + offset_of!(SectionEntry, count), &[0; 8]);
            let (start, length) = (e.section_at(kind), if kind == kind::GROUPS { 48 } else { 32 });
            e.put(start, &[0; 48][..length]);
        })
    };
    vec![
        missing("F142-no-runs", kind::GROUP_RUNS),
        missing("F142-no-groups", kind::GROUPS),
        case("F142-first-triangle", kind::GROUP_RUNS, 0, 1),
        case("F142-not-ascending", kind::GROUP_RUNS, 2 * run, 1),
        case("F142-beyond-the-triangles", kind::GROUP_RUNS, 3 * run, 4),
        case("F142-group", kind::GROUP_RUNS, offset_of!(GroupRun, group), 3),
        case("F143-material", kind::GROUPS, offset_of!(Group, material), 2),
        case("F143-group-reserved", kind::GROUPS, offset_of!(Group, reserved), 1),
        case("F143-material-reserved", kind::MATERIALS, offset_of!(Material, reserved) + 4, 1),
        case("F144-group-name-beyond", kind::GROUPS, offset_of!(Group, name_length), 100),
        case("F144-group-name-overflow", kind::GROUPS, offset_of!(Group, name), NONE),
        case("F144-material-name-not-utf8", kind::MATERIALS, 16 + offset_of!(Material, name_length), 3),
        broken("F148-row-missing", "groups", Seal::Sections, |e| {
            let at = e.entry_at(NONE, kind::OBJECT_NAMES);
            let start = e.bytes[at + offset_of!(SectionEntry, offset)..][..8].try_into().unwrap();
            e.put(at + offset_of!(SectionEntry, length), &8u64.to_le_bytes());
            e.put(at + offset_of!(SectionEntry, count), &1u64.to_le_bytes());
            e.put(u64::from_le_bytes(start) as usize + 8, &[0; 8]);
        }),
        broken("F148-name-beyond", "groups", Seal::Sections, |e| {
            let at = e.entry_at(NONE, kind::OBJECT_NAMES) + offset_of!(SectionEntry, offset);
            let start = e.bytes[at..][..8].try_into().unwrap();
            e.put(u64::from_le_bytes(start) as usize + 4, &9u32.to_le_bytes());
        }),
    ]
}

/// Faults of the container. A table of cases, hence its length.
fn container() -> Vec<Case> {
    let one = 1u32.to_le_bytes();
    let entry = |name, base, seal, kind, field: usize, value: u64, bytes: usize| {
        broken(name, base, seal, |e| {
            e.put(e.entry_at(0, kind) + field, &value.to_le_bytes()[..bytes]);
        })
    };
    let mut cases = vec![
        broken("F001-header-cut", "no-objects", Seal::None, |e| e.bytes.truncate(100)),
        broken("F002-text-transfer", "triangle", Seal::Header, |e| {
            e.put(5, b"\n");
        }),
        broken("F003-newer-minimum", "triangle", Seal::Header, |e| {
            e.put(16, &0x0001_0001u32.to_le_bytes()).put(20, &0x0001_0001u32.to_le_bytes());
        }),
        broken("F003-minimum-above-writer", "triangle", Seal::Header, |e| {
            e.put(20, &0x0001_0001u32.to_le_bytes());
        }),
        broken("F004-header-changed", "triangle", Seal::None, |e| {
            e.put(offset_of!(Header, optional_features), &one);
        }),
        broken("F005-file-cut", "triangle", Seal::None, |e| e.bytes.truncate(e.bytes.len() - 64)),
        broken("F006-header-reserved", "triangle", Seal::Header, |e| {
            e.put(offset_of!(Header, reserved), &one);
        }),
        entry(
            "F006-entry-reserved",
            "triangle",
            Seal::Table,
            kind::LINES,
            offset_of!(SectionEntry, reserved),
            1,
            4,
        ),
        broken("F007-boxes-of-8-bits", "triangle", Seal::Header, |e| {
            e.put(offset_of!(Header, required_features), &2u64.to_le_bytes());
        }),
        broken("F007-tets-that-deform", "triangle", Seal::Header, |e| {
            e.put(offset_of!(Header, required_features), &8u64.to_le_bytes());
        }),
        // Ten rows of 32 bytes become 20 of 16 or 16 of 20.
        broken("F007-tets-of-16-bytes", "tets-link32", Seal::Table, |e| {
            let entry = e.entry_at(0, kind::TETS);
            e.put(entry + offset_of!(SectionEntry, stride), &16u32.to_le_bytes());
            e.put(entry + offset_of!(SectionEntry, count), &20u64.to_le_bytes());
        }),
        broken("F007-tets-of-20-bytes", "tets-link32", Seal::Table, |e| {
            let entry = e.entry_at(0, kind::TETS);
            e.put(entry + offset_of!(SectionEntry, stride), &20u32.to_le_bytes());
            e.put(entry + offset_of!(SectionEntry, count), &16u64.to_le_bytes());
        }),
        field("F007-tets-with-three-vertices", "tets-link32", kind::OBJECT, offset_of!(Object, record), 2),
        entry("F007-trees-for-ranges-of-time", "sequence", Seal::Table, kind::SEQUENCE_POSITIONS, 0, 27, 4),
        broken("F007-unknown-feature", "triangle", Seal::Header, |e| {
            e.put(offset_of!(Header, required_features), &4u32.to_le_bytes());
        }),
        broken("F008-table-too-long", "triangle", Seal::Header, |e| {
            e.put(offset_of!(Header, section_count), &1000u32.to_le_bytes());
        }),
        broken("F008-table-elsewhere", "triangle", Seal::Header, |e| {
            e.put(offset_of!(Header, section_offset), &192u64.to_le_bytes());
        }),
        broken("F009-table-changed", "triangle", Seal::None, |e| {
            e.put(128 + offset_of!(SectionEntry, hash), &one);
        }),
        broken("F010-entries-swapped", "triangle", Seal::Table, |e| {
            let (a, b) = (e.bytes[128..192].to_vec(), e.bytes[192..256].to_vec());
            e.put(128, &b).put(192, &a);
        }),
        entry(
            "F011-alignment",
            "triangle",
            Seal::Table,
            kind::LINES,
            offset_of!(SectionEntry, alignment),
            32,
            4,
        ),
        entry(
            "F012-overlap",
            "triangle",
            Seal::Sections,
            kind::OBJECT,
            offset_of!(SectionEntry, offset),
            128,
            8,
        ),
        entry(
            "F012-beyond-the-end",
            "triangle",
            Seal::Table,
            kind::LINES,
            offset_of!(SectionEntry, length),
            1 << 40,
            8,
        ),
        entry(
            "F012-offset-overflow",
            "triangle",
            Seal::Table,
            kind::LINES,
            offset_of!(SectionEntry, offset),
            !63,
            8,
        ),
        entry("F013-count", "triangle", Seal::Table, kind::LINES, offset_of!(SectionEntry, count), 5, 8),
        broken("F014-stride", "triangle", Seal::Table, |e| {
            let at = e.entry_at(0, kind::TRIANGLE_IDS);
            e.put(at + offset_of!(SectionEntry, stride), &2u32.to_le_bytes());
            e.put(at + offset_of!(SectionEntry, count), &2u64.to_le_bytes());
        }),
        broken("F015-unknown-kind", "unknown-optional-section", Seal::Table, |e| {
            e.put(128 + offset_of!(SectionEntry, flags), &one);
        }),
        entry("F016-flags", "triangle", Seal::Table, kind::LINES, offset_of!(SectionEntry, flags), 3, 4),
        broken("F017-no-object-0", "triangle-bare", Seal::Table, |e| {
            for i in 0..e.entries().len() {
                e.put(128 + 64 * i + offset_of!(SectionEntry, object), &one);
            }
        }),
        broken("F017-provenance-of-an-object", "triangle", Seal::Table, |e| {
            e.put(e.entry_at(NONE, kind::PROVENANCE) + offset_of!(SectionEntry, object), &[0; 4]);
        }),
        broken("F018-content-id", "triangle", Seal::Header, |e| {
            e.put(offset_of!(Header, content_id), &one);
        }),
        broken("F019-bytes-at-the-end", "triangle", Seal::Header, |e| {
            e.bytes.extend([0; 64]);
            let length = e.bytes.len() as u64;
            e.put(offset_of!(Header, file_length), &length.to_le_bytes());
        }),
        broken("F020-gap", "triangle", Seal::None, |e| {
            e.put(e.section_at(kind::TRIANGLE_IDS) + 4, &[1]);
        }),
        broken("F021-section-changed", "triangle", Seal::None, |e| {
            e.put(e.section_at(kind::POSITIONS), &[1]);
        }),
    ];
    cases.push(field(
        "F022-too-many-triangles",
        "triangle-bare",
        kind::OBJECT,
        offset_of!(Object, triangles),
        (1 << 30) + 1,
    ));
    cases
}

/// Bytes of LINES where the blocks of `two-levels` start.
const INNER: usize = 448;
const LEAF: usize = 896;
const RAW: usize = 1152;
/// Byte of LINES of `grid-21` behind its last leaf: nodes, three indexed leaves and two raw ones.
const GRID_END: usize = LEAF + 3 * 160 + 2 * 416;
/// Byte of a node's child code.
const fn child(slot: usize) -> usize {
    384 + 4 * slot
}

/// Faults of the BVH, its leaves and the source geometry. A table of cases, hence its length.
fn tree() -> Vec<Case> {
    let base = "two-levels";
    let object = |name, at, value| field(name, base, kind::OBJECT, at, value);
    let line = |name, at, value| field(name, base, kind::LINES, at, value);
    let nan = f32::NAN.to_bits();
    let grid = |name, kind, at, value| field(name, "grid-21", kind, at, value);
    vec![
        object("F101-record-without-tets", offset_of!(Object, record), 1),
        field("F101-other-record", "tets-link32", kind::OBJECT, offset_of!(Object, record), 5),
        object("F102-triangles", offset_of!(Object, triangles), 42),
        object("F102-dropped", offset_of!(Object, dropped), 42),
        object("F103-nan", offset_of!(Object, lower), nan),
        field(
            "F103-bounds-of-nothing",
            "nothing-to-hit",
            kind::OBJECT,
            offset_of!(Object, upper),
            1f32.to_bits(),
        ),
        object("F104-bits", offset_of!(Object, coordinates), 17),
        object("F104-origin-of-no-grid", offset_of!(Object, grid_origin), 1),
        object("F104-not-announced", offset_of!(Object, coordinates), 0x7f7f_7f10),
        grid("F104-step", kind::OBJECT, offset_of!(Object, coordinates), 0x00ff_7f10),
        grid("F104-origin-between", kind::OBJECT, offset_of!(Object, grid_origin), 1e-7f32.to_bits()),
        grid("F104-displacement", kind::OBJECT, offset_of!(Object, displacement), nan),
        object("F104-widened-boxes-not-announced", offset_of!(Object, coordinates), WIDENED_BOXES),
        grid("F109-half-a-line", kind::LINES, GRID_END, 1),
        grid("F118-high-bit", kind::LINES, LEAF + 96, 1 << 15),
        line("F105-unassigned", child(0), 7 << 29),
        object("F105-root", offset_of!(Object, root), 1 << 29),
        line("F106-node", child(0), Child::Node(10_000).code()),
        line("F106-last-leaf", child(2), Child::Raw(37).code()),
        object("F106-root", offset_of!(Object, root), Child::Indexed(Child::INDEX_LIMIT - 1).code()),
        line("F106-no-tet-leaves", child(0), Child::Tets(0).code()),
        line("F107-cycle", INNER + child(0), Child::Node(0).code()),
        line("F107-itself", child(0), Child::Node(0).code()),
        line("F108-two-parents", child(1), Child::Node(INNER as u32 / 64).code()),
        line("F108-within-a-block", child(1), Child::Indexed(INNER as u32 / 64 + 1).code()),
        broken("F109-nobody-refers", base, Seal::Sections, |e| {
            for axis in 0..3 {
                e.put_f32(kind::LINES, 128 * axis + 8, f32::MAX).put_f32(
                    kind::LINES,
                    128 * axis + 72,
                    -f32::MAX,
                );
            }
            e.put_u32(kind::LINES, child(2), NONE);
        }),
        object("F110-deeper-than-said", offset_of!(Object, depth), 1),
        object("F110-too-deep", offset_of!(Object, depth), 97),
        line("F111-hole", child(4), Child::Node(7).code()),
        line("F111-no-children", INNER + child(0), NONE),
        line("F112-nan", 0, nan),
        line("F112-inside-out", 64, (-1f32).to_bits()),
        line("F113-no-triangles", LEAF + offset_of!(IndexedLeaf, triangles), 0),
        line("F113-17-triangles", RAW + offset_of!(RawLeaf, triangles), 17),
        line("F113-17-vertices", LEAF + offset_of!(IndexedLeaf, vertices), 17),
        line("F114-corner", LEAF + offset_of!(IndexedLeaf, corner), 0xff),
        line("F115-rows", LEAF + offset_of!(IndexedLeaf, first), 40),
        line("F115-overflow", RAW + offset_of!(RawLeaf, first), u32::MAX - 1),
        field("F116-id", base, kind::TRIANGLE_IDS, 0, 41),
        line("F117-infinite", LEAF + 4, f32::INFINITY.to_bits()),
        line("F117-raw-nan", RAW + 4, nan),
        line("F118-vertex", LEAF + 60, nan),
        line("F118-corner", LEAF + 192 + 12, 1),
        line("F118-reserved", LEAF + offset_of!(IndexedLeaf, reserved), 1),
        line("F118-raw-reserved", RAW + offset_of!(RawLeaf, reserved), 1),
        field("F140-triangles", base, kind::TRIANGLES, 0, 30),
        field("F140-corners", base, kind::CORNERS, 8, NONE),
        field("F141-nan", base, kind::POSITIONS, 4, nan),
    ]
}

/// A case in which `rows` of `before` rows of a section of object 0 are left. The others become a
/// gap, which is zero.
pub(super) fn shortened((name, base): (&str, &str), kind: u32, [stride, before, rows]: [usize; 3]) -> Case {
    broken(name, base, Seal::Sections, |e| {
        let end = e.section_at(kind) + stride * rows;
        e.put(end, &vec![0; stride * (before - rows)]);
        let at = e.entry_at(0, kind);
        e.put(at + offset_of!(SectionEntry, length), &((stride * rows) as u64).to_le_bytes());
        e.put(at + offset_of!(SectionEntry, count), &(rows as u64).to_le_bytes());
    })
}

/// Faults of the places of triangles.
fn places() -> Vec<Case> {
    let (base, tets) = ("places", "places-tets");
    let row =
        |name, base, triangle: usize, place| field(name, base, kind::TRIANGLE_PLACES, 4 * triangle, place);
    let line = |at: usize| (at / size_of::<CacheLine>()) as u32;
    let place = |leaf, slot| TrianglePlace { leaf, slot }.code();
    let first = Child::Indexed(line(LEAF));
    vec![
        shortened(("F102-places", base), kind::TRIANGLE_PLACES, [4, 41, 40]),
        row("F169-place-of-another", base, 0, place(first, 1)),
        row("F169-raw-leaf", base, 0, place(Child::Raw(line(LEAF)), 0)),
        row("F169-empty-slot", base, 7, place(first, 8)),
        row("F169-node", base, 3, place(Child::Indexed(0), 3)),
        row("F169-beyond", base, 8, place(Child::Raw(1 << 20), 0)),
        row("F169-beyond-the-limit", base, 8, NONE - 16),
        row("F169-dropped", base, 40, place(first, 0)),
        row("F169-grid", "places-grid-16", 1, place(Child::Indexed(0), 1)),
        row("F169-constrained-face", tets, 2, place(Child::Indexed(NODE_LINES as u32), 0)),
        row("F187-none", base, 1, NONE),
        row("F187-none-in-a-raw-leaf", base, 15, NONE),
        row("F187-none-on-a-grid", "places-grid-16", 39, NONE),
        row("F187-none-in-a-deformable-object", "places-deformable", 0, NONE),
    ]
}

/// Faults of free directions.
fn free_directions() -> Vec<Case> {
    let base = "free-directions";
    let (directions, levels, places) = (kind::FREE_DIRECTIONS, kind::FREE_LEVELS, kind::TRIANGLE_PLACES);
    let rows = |name: &str, kind: u32, rows: [usize; 3]| shortened((name, base), kind, rows);
    vec![
        rows("F022-two-rows-of-levels", levels, [16, 2, 2]),
        rows("F168-rows", directions, [20, 2, 1]),
        rows("F168-levels-alone", directions, [20, 2, 0]),
        Case::new("F168-both-sections", super::valid::free_directions_and_distances()),
        rows("F172-no-places", places, [4, 2, 0]),
        shortened(("F172-distances-without-places", "free-distances"), places, [4, 2, 0]),
        field("F170-reserved", base, directions, 16, (FreeBins::BACK >> 96) as u32 | 1 << 25),
        field("F170-last-bit", base, directions, 16, 1 << 31),
        field("F171-infinite", base, levels, 8, f32::INFINITY.to_bits()),
        field("F171-negative", base, levels, 0, (-1f32).to_bits()),
        field("F171-not-ascending", base, levels, 0, 1f32.to_bits()),
        field("F171-reserved", base, levels, 12, 1),
        // The bin in the middle is free, though the triangle above lies there.
        field("F209-met", base, directions, 4 + 4 * (FREE_BINS / 2 / 32), 1 << (FREE_BINS / 2 % 32)),
        // With a greater distance of the level, the triangle above lies within it.
        field("F209-met-within-a-level", base, levels, 8, 20f32.to_bits()),
        field("F209-met-within-a-level-of-distances", "free-distances", levels, 8, 20f32.to_bits()),
        // The middle of the triangle above, at 10.011, lies within it, though one of its corners,
        // at 10.050, does not.
        field("F209-middle-within-a-level", "free-distances", levels, 8, 10.02f32.to_bits()),
        broken("F210-sliver", base, Seal::Sections, |e| {
            // The third corner of the first triangle, vertex 5, comes close to the first edge.
            let lines = e.section_at(kind::LINES);
            e.put(lines + size_of::<f32>() * 5, &1f32.to_le_bytes());
            e.put(lines + size_of::<f32>() * (WIDTH + 5), &1e-3f32.to_le_bytes());
        }),
    ]
}

/// Faults of the opacity of triangles.
fn opacity() -> Vec<Case> {
    let base = "opacity";
    let row = |name, triangle: usize, value| field(name, base, kind::OPACITY, 4 * triangle, value);
    let micro = |name, word: usize, value| field(name, base, kind::OPACITY_MICRO, 4 * word, value);
    let rows = |name: &str, kind: u32, count: u64| {
        broken(name, base, Seal::Sections, |e| {
            // What is no longer in the section is a gap, which is zero.
            let rows = e.section_at(kind) + 4 * count as usize;
            e.put(rows, &vec![0; 24 - 4 * count as usize]);
            let at = e.entry_at(0, kind);
            e.put(at + offset_of!(SectionEntry, length), &(4 * count).to_le_bytes());
            e.put(at + offset_of!(SectionEntry, count), &count.to_le_bytes());
        })
    };
    vec![
        rows("F145-rows", kind::OPACITY, 5),
        rows("F145-micro-alone", kind::OPACITY, 0),
        row("F146-state", 0, 3 << 4),
        row("F146-level", 0, 9),
        row("F146-word", 3, 2 << 4 | 1),
        row("F146-words", 4, 1 << 4 | 3),
        row("F146-far", 4, u32::MAX - 13),
        micro("F147-state", 1, 3 << 30),
        micro("F147-behind-the-last", 0, 1 << 8),
    ]
}

/// Faults of tet leaves.
fn tets() -> Vec<Case> {
    let base = "tets-link32";
    let leaf = |name, row: usize, at: usize, value| field(name, base, kind::TET_LEAVES, 64 * row + at, value);
    // The middle tetrahedron of the first cube has neighbours behind slots 0 (tetrahedron 4) and 1
    // (3), and constrained faces behind the others.
    let middle = 2;
    vec![
        leaf("F105-subtree", 0, offset_of!(TetLeaf, subtree), Child::Indexed(11).code()),
        leaf("F120-flags", 0, offset_of!(TetLeaf, flags), 1),
        leaf("F120-flat-box", 0, offset_of!(TetLeaf, upper), 0),
        leaf("F121-hole", 1, offset_of!(TetLeaf, first_tet), 6),
        leaf("F121-beyond-the-end", 1, offset_of!(TetLeaf, vertices), NONE),
        leaf("F121-rows-left", 1, offset_of!(TetLeaf, hulls), 11),
        leaf("F122-no-tets", 0, offset_of!(TetLeaf, tets), 0),
        leaf("F122-no-faces", 1, offset_of!(TetLeaf, faces), 0),
        field("F123-twice", base, kind::LINES, child(2), Child::Tets(0).code()),
        field("F124-nan", base, kind::TET_VERTICES, 8, f32::NAN.to_bits()),
        field("F124-reserved", base, kind::TET_VERTICES, 12, 1),
        field("F125-tet-of-another-leaf", base, kind::HULL_FACES, 20 + 12, 7),
        field("F125-vertex-of-another-leaf", base, kind::HULL_FACES, 0, 8),
        broken("F125-twice", base, Seal::Sections, |e| {
            let at = e.section_at(kind::HULL_FACES);
            let first = e.bytes[at..at + 20].to_vec();
            e.put(at + 20, &first);
        }),
        broken("F126-tets-swapped", base, Seal::Sections, |e| {
            let tets = [16, 20].map(|at| e.get_u32(kind::TET_FACES, at));
            e.put_u32(kind::TET_FACES, 16, tets[1]).put_u32(kind::TET_FACES, 20, tets[0]);
        }),
        field("F126-vertex", base, kind::TET_FACES, 0, 3),
        field("F127-tet-of-another-leaf", base, kind::TETS, 32 * middle, 9),
        field("F127-face-of-another-leaf", base, kind::TETS, 32 * middle + 16, FACE_BIT | 2),
        field("F127-itself", base, kind::TETS, 32 * middle, middle as u32),
        field("F128-other-neighbour", base, kind::TETS, 32 * middle, 3),
        field("F128-vertex-of-another-leaf", base, kind::TETS, 32 * middle + 4, 8),
        field("F129-opposite-beyond-the-hull", base, kind::TETS, 12, 0),
        broken("F130-nobody-leads-there", base, Seal::Sections, |e| {
            e.put_u32(kind::TETS, 32 * middle, NONE).put_u32(kind::TETS, 32 * middle + 4, NONE);
        }),
        field("F131-face-of-another", base, kind::TRIANGLE_FACES, 16, 0),
        field("F131-face-missing", base, kind::TRIANGLE_FACES, 0, NONE),
        field("F131-face-of-nothing", base, kind::TET_FACES, 12, 1000),
    ]
}

/// Faults that only `verify` finds: contents that contradict the source geometry or each other.
fn geometry() -> Vec<Case> {
    let (base, tets) = ("two-levels", "tets-link32");
    let half = 0.5f32.to_bits();
    vec![
        field("F201-other-vertex", base, kind::LINES, LEAF + 132, half),
        field("F201-other-point", "grid-16", kind::LINES, LEAF + 4, 1),
        field("F208-displacement", "grid-21", kind::OBJECT, offset_of!(Object, displacement), 1),
        field("F202-other-vertex", tets, kind::TET_VERTICES, 16, half),
        field("F203-triangle-twice", base, kind::TRIANGLE_IDS, 4, 0),
        broken("F203-triangle-twice-with-a-place", "places", Seal::Sections, |e| {
            // Triangle 0 takes the slot of triangle 1, which then has no place.
            e.put_u32(kind::TRIANGLE_IDS, 4, 0).put_u32(kind::TRIANGLE_PLACES, 4, NONE);
        }),
        field("F203-more-dropped", base, kind::OBJECT, offset_of!(Object, dropped), 2),
        field("F204-small-box", base, kind::LINES, 64, half),
        // A box that holds the triangles, without room.
        field("F204-no-room", "widened-boxes", kind::LINES, 64, 4f32.to_bits()),
        field("F204-small-bounds", base, kind::OBJECT, offset_of!(Object, upper), half),
        field("F205-small-tet-box", tets, kind::TET_LEAVES, offset_of!(TetLeaf, upper), half),
        broken("F206-turned-over", tets, Seal::Sections, |e| {
            for axis in 0..3 {
                e.put_f32(kind::TET_VERTICES, 4 * axis, 0.75);
            }
        }),
        broken("F206-hull-outwards", tets, Seal::Sections, |e| {
            let swapped = [4, 8].map(|at| e.get_u32(kind::HULL_FACES, at));
            e.put_u32(kind::HULL_FACES, 4, swapped[1]).put_u32(kind::HULL_FACES, 8, swapped[0]);
        }),
        broken("F207-dropped-with-area", base, Seal::Sections, |e| {
            for (k, v) in [7, 8, 13].into_iter().enumerate() {
                e.put_u32(kind::TRIANGLES, 12 * 40 + 4 * k, v);
            }
        }),
    ]
}
