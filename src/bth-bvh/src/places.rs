//! Finds for each triangle its place in the leaves of the wide BVH.

use super::Wide;
use bth_format::layout::*;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// The rows of `TRIANGLE_PLACES` for a mesh with this number of triangles; no rows without a root.
///
/// A triangle that lies in several leaves gets the place in the first of them, in the order of
/// their lines. A triangle without a place gets [`NONE`]: it lies in no triangle leaf, or beyond
/// the indices that a place can hold.
pub fn triangle_places(wide: &Wide, grid: Option<&Grid>, triangles: usize) -> Vec<u32> {
    if wide.root == NONE {
        return Vec::new();
    }
    let mut places = vec![NONE; triangles];
    for leaf in leaves(wide, grid) {
        for slot in 0..leaf.triangles {
            let triangle = wide.triangle_ids[(leaf.first + slot) as usize] as usize;
            if places[triangle] == NONE {
                places[triangle] = TrianglePlace { leaf: leaf.child, slot }.code();
            }
        }
    }
    places
}

/// A triangle leaf.
struct LeafRows {
    child: Child,
    /// Half line where it starts.
    half: u64,
    /// First row of TRIANGLE_IDS.
    first: u32,
    triangles: u32,
}

/// All triangle leaves in the order of their lines.
fn leaves(wide: &Wide, grid: Option<&Grid>) -> Vec<LeafRows> {
    let mut stack = vec![wide.root];
    let mut leaves = Vec::new();
    while let Some(code) = stack.pop() {
        match Child::from_code(code) {
            Some(child @ (Child::Indexed(_) | Child::Raw(_))) => {
                leaves.push(leaf(wide, child, grid.map(|grid| grid.bits)));
            }
            Some(Child::Node(line)) => {
                stack.extend(read::<WideNode>(wide, 2 * u64::from(line)).child);
            }
            Some(Child::Tets(_)) | None => {}
        }
    }
    leaves.sort_unstable_by_key(|leaf| leaf.half);
    leaves
}

/// Reads which triangles a leaf holds.
fn leaf(wide: &Wide, child: Child, bits: Option<GridBits>) -> LeafRows {
    let (Child::Indexed(index) | Child::Raw(index)) = child else { unreachable!("a triangle leaf") };
    let is_indexed = matches!(child, Child::Indexed(_));
    // Leaves on a grid are counted in half lines.
    let half = u64::from(index) * if bits.is_none() { 2 } else { 1 };
    let (first, triangles) = match (is_indexed, bits) {
        (true, None) => {
            let leaf: &IndexedLeaf = read(wide, half);
            (leaf.first, leaf.triangles)
        }
        (false, None) => {
            let leaf: &RawLeaf = read(wide, half);
            (leaf.first, leaf.triangles)
        }
        (true, Some(GridBits::B16)) => {
            let leaf: &IndexedLeaf16 = read(wide, half);
            (leaf.first, leaf.triangles.into())
        }
        (true, Some(GridBits::B21)) => {
            let leaf: &IndexedLeaf21 = read(wide, half);
            (leaf.first, leaf.triangles.into())
        }
        (false, Some(GridBits::B16)) => {
            let leaf: &RawLeaf16 = read(wide, half);
            (leaf.first, leaf.triangles)
        }
        (false, Some(GridBits::B21)) => {
            let leaf: &RawLeaf21 = read(wide, half);
            (leaf.first, leaf.triangles)
        }
    };
    LeafRows { child, half, first, triangles }
}

/// The block that starts at a half line.
fn read<T: FromBytes + KnownLayout + Immutable>(wide: &Wide, half: u64) -> &T {
    let bytes = &wide.lines.as_bytes()[half as usize * HALF_LINE..];
    T::ref_from_prefix(bytes).expect("blocks lie within the lines, at half lines").0
}

#[cfg(test)]
#[path = "places_tests.rs"]
mod tests;
