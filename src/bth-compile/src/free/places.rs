//! The rows of the section: where each triangle lies in the wide BVH, with its bins.

use super::Free;
use crate::bvh::Wide;
use bth_format::layout::*;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// The contents of the sections of free directions.
#[derive(Clone, Debug)]
pub(crate) struct FreeRows {
    pub(crate) directions: Vec<FreeDirections>,
    pub(crate) distances: Vec<FreeDistances>,
    pub(crate) levels: [FreeLevels; 1],
}

impl FreeRows {
    /// The rows of all triangles. Those that lie in no triangle leaf, or beyond what a place can address, know nothing.
    pub(crate) fn new(free: &Free, wide: &Wide, grid: Option<&Grid>) -> Self {
        let mut directions = vec![FreeDirections::UNKNOWN; free.directions.len()];
        let mut distances = vec![FreeDistances::UNKNOWN; free.distances.len()];
        for leaf in leaves(wide) {
            let (first, triangles) = match (leaf, grid.map(|grid| grid.bits)) {
                (Child::Indexed(at), None) => {
                    counts(wide, at, 2, |leaf: &IndexedLeaf| (leaf.first, leaf.triangles))
                }
                (Child::Raw(at), None) => counts(wide, at, 2, |leaf: &RawLeaf| (leaf.first, leaf.triangles)),
                (Child::Indexed(at), Some(GridBits::B16)) => {
                    counts(wide, at, 1, |leaf: &IndexedLeaf16| (leaf.first, leaf.triangles.into()))
                }
                (Child::Indexed(at), Some(GridBits::B21)) => {
                    counts(wide, at, 1, |leaf: &IndexedLeaf21| (leaf.first, leaf.triangles.into()))
                }
                (Child::Raw(at), Some(GridBits::B16)) => {
                    counts(wide, at, 1, |leaf: &RawLeaf16| (leaf.first, leaf.triangles))
                }
                (Child::Raw(at), Some(GridBits::B21)) => {
                    counts(wide, at, 1, |leaf: &RawLeaf21| (leaf.first, leaf.triangles))
                }
                _ => continue,
            };
            for slot in 0..triangles {
                let triangle = wide.triangle_ids[(first + slot) as usize] as usize;
                let place = FreePlace { leaf, slot }.code();
                if place == NONE {
                    continue;
                }
                let found = free.directions.get(triangle).filter(|row| **row != FreeDirections::UNKNOWN);
                if let Some(found) = found {
                    directions[triangle] = FreeDirections { place, ..*found };
                }
                let found = free.distances.get(triangle).filter(|row| **row != FreeDistances::UNKNOWN);
                if let Some(found) = found {
                    distances[triangle] = FreeDistances { place, ..*found };
                }
            }
        }
        FreeRows { directions, distances, levels: [FreeLevels { distance: free.levels, reserved: 0 }] }
    }
}

/// First row of TRIANGLE_IDS and number of triangles of a leaf that starts `halves * at` half lines from the first line.
fn counts<T: FromBytes + KnownLayout + Immutable>(
    wide: &Wide,
    at: u32,
    halves: usize,
    read: impl Fn(&T) -> (u32, u32),
) -> (u32, u32) {
    let bytes = &wide.lines.as_bytes()[at as usize * halves * HALF_LINE..];
    read(T::ref_from_prefix(bytes).expect("leaves lie within the lines at half lines").0)
}

/// All triangle leaves, also those of subtrees beside tet leaves.
fn leaves(wide: &Wide) -> Vec<Child> {
    let mut stack: Vec<u32> = wide.subtrees.iter().copied().chain([wide.root]).collect();
    let mut leaves = Vec::new();
    while let Some(code) = stack.pop() {
        let Some(child) = Child::from_code(code) else { continue };
        let line = match child {
            Child::Node(line) | Child::Packed(line) => line as usize,
            Child::Indexed(_) | Child::Raw(_) => {
                leaves.push(child);
                continue;
            }
            Child::Tets(_) => continue,
        };
        let bytes = wide.lines[line..].as_bytes();
        let children = match child {
            Child::Packed(_) => PackedNode::ref_from_prefix(bytes).map(|(node, _)| node.child).ok(),
            _ => WideNode::ref_from_prefix(bytes).map(|(node, _)| node.child).ok(),
        };
        stack.extend(children.expect("nodes lie within the lines"));
    }
    leaves
}
