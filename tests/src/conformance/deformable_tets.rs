//! An object that can be given new positions and has tet leaves.

use super::invalid::broken;
use super::valid::{CUBE, FACES, TetParts, bounds, file, indexed, lines, node, raw};
use super::{Case, Seal};
use bth_compile::write::{ObjectParts, Source};
use bth_format::layout::*;
use std::mem::offset_of;
use zerocopy::IntoBytes;

/// Vertices of the source: of two triangles in a small cube, one of them twice; of a triangle alone; of two triangles in another cube.
const POSITIONS: [[f32; 3]; 12] = [
    [3.0, 1.0, 1.0],
    [1.0, 3.0, 1.0],
    [1.0, 1.0, 3.0],
    [3.0, 3.0, 3.0],
    [3.0, 1.0, 1.0],
    [6.0, 0.0, 0.0],
    [7.0, 0.0, 0.0],
    [6.0, 1.0, 0.5],
    [9.0, 0.0, 0.0],
    [8.0, 1.0, 0.0],
    [8.0, 0.0, 1.0],
    [9.0, 1.0, 1.0],
];

const TRIANGLES: [[u32; 3]; 5] = [[0, 1, 3], [4, 2, 1], [5, 6, 7], [8, 9, 11], [8, 10, 9]];

/// Where the blocks of subtrees lie.
#[derive(Clone, Copy, PartialEq)]
enum Layout {
    /// Where their tet leaves are in depth-first order.
    InPlace,
    /// Behind all others.
    Last,
    /// Nowhere for the second one.
    Pruned,
}

pub(super) fn valid() -> Vec<Case> {
    [RecordKind::Link32, RecordKind::Tet16]
        .map(|record| {
            Case::new(&format!("deformable-tets-{}", record.name()), object(record, Layout::InPlace))
        })
        .into()
}

/// Faults of it.
pub(super) fn invalid() -> Vec<Case> {
    let of = |name: &str, layout| Case::new(name, object(RecordKind::Link32, layout));
    vec![
        of("F163-no-subtree", Layout::Pruned),
        of("F164-subtrees-last", Layout::Last),
        broken("F163-tets-not-announced", "deformable-tets-link32", Seal::Header, |e| {
            e.put(offset_of!(Header, required_features), &0u64.to_le_bytes());
        }),
    ]
}

/// Points and tetrahedra of a cube of side 4 around one of side 2. The inner one is filled as [`CUBE`]; around it, each half of a side is
/// a prism between the cubes, of three tetrahedra.
fn nested() -> (Vec<[f32; 3]>, Vec<[u32; 4]>) {
    let point = |i: u32, lower: f32, side: f32| [0, 1, 2].map(|k| lower + side * (i >> k & 1) as f32);
    let points = (0..8).map(|i| point(i, 1.0, 2.0)).chain((0..8).map(|i| point(i, 0.0, 4.0))).collect();
    let mut tets = CUBE.to_vec();
    for (axis, end) in [(0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1)] {
        let on_side = |corner: u32| corner >> axis & 1 == end;
        // The diagonals of `CUBE` join the corners with an odd number of upper ends.
        let [p, q] = *[1, 2, 4, 7].into_iter().filter(|c| on_side(*c)).collect::<Vec<u32>>() else {
            unreachable!("two of four")
        };
        for r in [0, 3, 5, 6].into_iter().filter(|c| on_side(*c)) {
            let mut half = [p, q, r];
            half.sort_unstable();
            let [x, y, z] = half;
            tets.extend([[x, y, z, z + 8], [x, y, y + 8, z + 8], [x, x + 8, y + 8, z + 8]]);
        }
    }
    (points, tets)
}

fn object(record: RecordKind, layout: Layout) -> Vec<u8> {
    let corners = |ids: &[u32]| -> Vec<[[f32; 3]; 3]> {
        ids.iter().map(|id| TRIANGLES[*id as usize].map(|row| POSITIONS[row as usize])).collect()
    };
    let mut tets = TetParts::default();
    let (points, nested) = nested();
    tets.add(record, &points, &nested, &FACES, 0);
    // The surface in this one touches the box, so that readers need not use it in other positions.
    let cube = |i: u32| [(8 + (i & 1)) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32];
    tets.add(record, &[0, 1, 2, 3, 4, 5, 6, 7].map(cube), &CUBE, &FACES, 3);

    let (first, alone, second) = (corners(&[0, 1]), corners(&[2]), corners(&[3, 4]));
    let of = |corners: &[[[f32; 3]; 3]]| bounds(corners.as_flattened());
    let rows = |used: &[u32]| std::array::from_fn(|i| *used.get(i).unwrap_or(&used[0]));
    let root = NODE_LINES as u32;
    let (indexed_lines, raw_lines) = (INDEXED_LINES as u32, RAW_LINES as u32);
    let in_place = layout != Layout::Last;
    let [first_at, alone_at, second_at] = match in_place {
        true => [root, root + raw_lines, root + raw_lines + indexed_lines],
        false => [root + indexed_lines, root, root + raw_lines + indexed_lines],
    };
    tets.leaves[0].subtree = Child::Raw(first_at).code();
    tets.leaves[1].subtree = Child::Indexed(second_at).code();
    let root = node(&[
        (Child::Tets(0), of(&first)),
        (Child::Indexed(alone_at), of(&alone)),
        (Child::Tets(1), of(&second)),
    ]);
    // Blocks of leaves with their triangles and rows of LEAF_VERTICES.
    type Block = (Vec<CacheLine>, Vec<u32>, Vec<[u32; WIDTH]>);
    let raw_at = |first_row| -> Block {
        let rows = vec![rows(&[0, 4]), rows(&[1, 2]), rows(&[3, 1])];
        (lines(raw(&first, first_row).as_bytes()), vec![0, 1], rows)
    };
    let alone_at =
        |row| -> Block { (lines(indexed(&alone, row).as_bytes()), vec![2], vec![rows(&[5, 6, 7])]) };
    let second =
        || -> Block { (lines(indexed(&second, 3).as_bytes()), vec![3, 4], vec![rows(&[8, 9, 11, 10])]) };
    let mut blocks = if in_place { vec![raw_at(0), alone_at(2)] } else { vec![alone_at(0), raw_at(1)] };
    match layout {
        Layout::Pruned => tets.leaves[1].subtree = NONE,
        _ => blocks.push(second()),
    }
    let mut all = lines(root.as_bytes());
    let (mut ids, mut leaf_vertices) = (Vec::new(), Vec::new());
    for (lines, triangles, rows) in blocks {
        all.extend(lines);
        ids.extend(triangles);
        leaf_vertices.extend(rows);
    }
    file(&ObjectParts {
        bounds: Some(bounds(&POSITIONS)),
        root: Child::Node(0).code(),
        triangles: 5,
        lines: &all,
        triangle_ids: &ids,
        leaf_vertices: &leaf_vertices,
        record: Some(record),
        tet_leaves: &tets.leaves,
        tets: &tets.records,
        tet_vertices: &tets.vertices,
        tet_faces: &tets.faces,
        hull_faces: &tets.hulls,
        triangle_faces: &[0, 1, NONE, 2, 3],
        source: Some(Source { positions: &POSITIONS, triangles: &TRIANGLES, ..Source::default() }),
        ..ObjectParts::default()
    })
}
