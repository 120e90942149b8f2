//! The wide BVH and the report on its making.

use bth_format::layout::CacheLine;
#[cfg(doc)]
use bth_format::layout::Child;
use bth_format::layout::WIDTH;
use serde::{Deserialize, Serialize};

/// The wide BVH, ready for the `LINES` and `TRIANGLE_IDS` sections.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wide {
    /// Nodes that lead to nodes, in depth-first order; then all other nodes, each followed by its
    /// leaves. All nodes and then leaves where `leaf_vertices` are recorded.
    pub lines: Vec<CacheLine>,
    /// Ids of the leaves' triangles, in order of the leaves' lines.
    pub triangle_ids: Vec<u32>,
    /// For each leaf, in order of the leaves' lines, the rows of the mesh's positions in its slots:
    /// one array for an indexed leaf, one for each corner of a raw one. Empty if they are not
    /// recorded.
    pub leaf_vertices: Vec<[u32; WIDTH]>,
    /// True if child boxes are widened ([`WIDENED_BOXES`](bth_format::layout::WIDENED_BOXES)).
    pub widened_boxes: bool,
    /// [`Child`] code of the root, `NONE` when no triangle can be hit.
    pub root: u32,
    /// Wide nodes on the longest path from the root.
    pub depth: u32,
}

/// Report of [`collapse`](super::collapse()).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CollapseReport {
    /// Wide nodes.
    pub nodes: u64,
    /// Children of the wide nodes.
    pub children: u64,
    /// Leaves with shared vertices.
    pub indexed_leaves: u64,
    /// Triangles in them.
    pub indexed_triangles: u64,
    /// Leaves without sharing.
    pub raw_leaves: u64,
    /// Triangles in them.
    pub raw_triangles: u64,
    /// Tet leaves.
    pub tet_leaves: u64,
    /// Wide nodes on the longest path.
    pub depth: u32,
    /// Cost of the tree without its tet leaves, which the choice of the tree minimizes; see
    /// [`Costs`](super::Costs).
    pub cost: f64,
    /// Wide nodes that a sample ray enters on average, or a random line through the root's box
    /// where the tree was chosen by areas.
    pub node_visits: f64,
    /// The same for triangle leaves.
    pub leaf_visits: f64,
    /// Bytes of lines and triangle ids.
    pub bytes: u64,
    /// Bytes of lines and ids for each triangle in a triangle leaf.
    pub bytes_per_triangle: f64,
}

impl CollapseReport {
    /// Adds the report on a part of a tree, whose box rays enter with this probability.
    pub(super) fn add(&mut self, part: &CollapseReport, share: f64) {
        self.nodes += part.nodes;
        self.children += part.children;
        self.indexed_leaves += part.indexed_leaves;
        self.indexed_triangles += part.indexed_triangles;
        self.raw_leaves += part.raw_leaves;
        self.raw_triangles += part.raw_triangles;
        self.cost += part.cost * share;
        self.node_visits += part.node_visits * share;
        self.leaf_visits += part.leaf_visits * share;
    }

    /// Sets the counts of bytes.
    pub fn measure(&mut self, wide: &Wide) {
        self.bytes = 64 * wide.lines.len() as u64 + 4 * wide.triangle_ids.len() as u64;
        self.bytes_per_triangle = self.bytes as f64 / (wide.triangle_ids.len() as f64).max(1.0);
    }
}
