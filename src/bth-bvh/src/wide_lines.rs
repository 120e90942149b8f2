//! Contents of the wide BVH's nodes and leaves.

use super::Node;
use bth_format::layout::{BOX_MARGIN, CacheLine, IndexedLeaf, NONE, RawLeaf, WIDTH, WideNode};
use bth_import::Mesh;
use zerocopy::{Immutable, IntoBytes};

/// Writes a structure at a line.
pub(super) fn put<T: IntoBytes + Immutable>(lines: &mut [CacheLine], at: usize, value: &T) {
    let bytes = value.as_bytes();
    lines[at..at + bytes.len() / size_of::<CacheLine>()].as_mut_bytes().copy_from_slice(bytes);
}

/// A wide node over at most 16 nodes of the binary BVH and their child codes, with their boxes or
/// these widened.
pub(super) fn wide_node<'a>(children: impl Iterator<Item = (&'a Node, u32)>, widened: bool) -> WideNode {
    let empty = [[f32::MAX; WIDTH], [-f32::MAX; WIDTH]];
    let mut wide = WideNode { bounds: [empty; 3], child: [NONE; WIDTH] };
    for (slot, (node, code)) in children.enumerate() {
        let margin = if widened { margin(node) } else { 0.0 };
        for k in 0..3 {
            // Sums and products are rounded, each to a neighbour at most.
            let [lower, upper] = [node.lower[k] - margin, node.upper[k] + margin];
            wide.bounds[k][0][slot] = if widened { lower.next_down() } else { lower };
            wide.bounds[k][1][slot] = if widened { upper.next_up() } else { upper };
        }
        wide.child[slot] = code;
    }
    wide
}

/// The largest |coordinate| of a node's box.
pub(super) fn greatest_coordinate(node: &Node) -> f32 {
    node.lower.iter().chain(&node.upper).fold(0.0, |greatest, x| x.abs().max(greatest))
}

/// By how much the box of a node is widened: at least as much as any corner in it asks for.
fn margin(node: &Node) -> f32 {
    greatest_coordinate(node) * BOX_MARGIN as f32
}

/// A leaf over 1 to 16 triangles of at most 16 distinct vertices, and the rows of these vertices.
pub(super) fn indexed_leaf(mesh: &Mesh, ids: &[u32], first: u32) -> (IndexedLeaf, [u32; WIDTH]) {
    let mut rows = [0u32; WIDTH];
    let mut vertices = 0;
    let mut corner = [[0u8; WIDTH]; 3];
    for (slot, &id) in ids.iter().enumerate() {
        for (c, &row) in mesh.triangles[id as usize].iter().enumerate() {
            let at = rows[..vertices].iter().position(|&r| r == row).unwrap_or_else(|| {
                rows[vertices] = row;
                vertices += 1;
                vertices - 1
            });
            corner[c][slot] = at as u8;
        }
    }
    let unused = rows[0];
    rows[vertices..].fill(unused);
    let positions = rows.map(|row| mesh.positions[row as usize]);
    let vertex = std::array::from_fn(|k| positions.map(|p| p[k]));
    let (triangles, vertices) = (ids.len() as u32, vertices as u32);
    (IndexedLeaf { vertex, corner, first, triangles, vertices, reserved: 0 }, rows)
}

/// A leaf over 1 to 16 triangles, and the rows of the vertices of each corner.
pub(super) fn raw_leaf(mesh: &Mesh, ids: &[u32], first: u32) -> (RawLeaf, [[u32; WIDTH]; 3]) {
    let triangles: [_; WIDTH] =
        std::array::from_fn(|slot| mesh.triangles[*ids.get(slot).unwrap_or(&ids[0]) as usize]);
    let rows = std::array::from_fn(|c| triangles.map(|rows| rows[c]));
    let corners = triangles.map(|rows| rows.map(|row| mesh.positions[row as usize]));
    let corner = std::array::from_fn(|c| std::array::from_fn(|k| corners.map(|triangle| triangle[c][k])));
    (RawLeaf { corner, first, triangles: ids.len() as u32, reserved: [0; 14] }, rows)
}
