//! The binary BVH, input of the stages marks, costs and tets, and its collapse to the wide BVH.
//!
//! [`build()`] splits top-down (binned or full-sweep SAH), then moves subtrees to positions of
//! lower cost. [`collapse()`] plans the wide tree by dynamic programming and writes its lines.
//!
//! [`Parts`] splits a mesh that is too large to be built at once. [`join()`] joins the wide trees
//! of its parts.
//!
//! [`build_poses()`] builds one tree for several poses of a mesh that deforms, with the cost summed
//! over them.
//!
//! [`sampling`] draws sample rays and walks them through the binary BVH.
//!
//! Spatial splits are not made: with nodes of 16 children the few large triangles of much overlap
//! end up in one leaf near the root, and splitting them gained nothing.
#![warn(missing_docs)]

mod binned_split;
mod bounds;
mod build;
mod build_poses;
mod collapse;
mod extent;
mod linked_tree;
mod parts;
mod places;
mod plan;
mod pose_bounds;
mod poses;
mod reinsertion;
pub mod sampling;
mod slot_order;
mod split;
mod sweep_split;
pub mod vectors;
mod wide;
mod wide_lines;
mod wide_tree;

#[cfg(test)]
mod samples;
#[doc(hidden)]
pub mod testing;
#[cfg(test)]
mod validate;

pub use build::{BvhOptions, BvhReport, Effort, Quality, build, build_part};
pub use build_poses::{PoseOptions, build_poses};
pub use collapse::{CollapseOptions, collapse};
pub use parts::{Part, Parts, join};
pub use places::triangle_places;
pub use plan::Costs;
pub use poses::{Poses, Weighed};
pub use wide::{CollapseReport, Wide};

use bounds::Bounds;
use rayon::prelude::*;
use zerocopy::FromZeros;

/// Edges on the longest path of a binary BVH that [`build()`] makes; below
/// `bth_format::limits::MAX_DEPTH`, since a wide node takes at least one level of the binary tree.
pub const MAX_LEVELS: u32 = 90;

/// Largest number of poses over which the cost of a tree is summed.
pub const MAX_POSES: usize = 16;

/// Node of a [`BinaryBvh`].
#[derive(Clone, Copy, Debug, PartialEq, FromZeros)]
pub struct Node {
    /// Box, object space: exactly the bounds of the corners of the node's triangles.
    pub lower: [f32; 3],
    /// Upper end of the box.
    pub upper: [f32; 3],
    /// First row of `order`.
    pub first: u32,
    /// Triangles below this node, at least 1.
    pub count: u32,
    /// Index of the right child; 0 for a leaf. The left child is the next node.
    pub right: u32,
}

impl Node {
    /// Returns true if the node has no children.
    #[inline]
    pub fn is_leaf(&self) -> bool {
        self.right == 0
    }

    /// Half the surface area of the box. A triangle of non-zero area extends along two axes, and
    /// f64 holds the product of any two extents, so this is zero only if all triangles below have
    /// no area.
    pub fn half_area(&self) -> f64 {
        Bounds::of_node(self).half_area()
    }
}

/// A binary BVH in depth-first order: node 0 is the root, a left child follows its parent,
/// so walking the nodes backwards visits children before parents.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BinaryBvh {
    /// Nodes in preorder; empty when the mesh has no triangle that can be hit.
    pub nodes: Vec<Node>,
    /// Triangle ids, without triangles of exactly zero area. Each node covers
    /// `order[first..first + count]`. A leaf of the tree holds one triangle.
    pub order: Vec<u32>,
}

/// Nodes that one task sums; a constant, so that the rounding does not depend on the number of
/// threads.
const SUMMED_AT_ONCE: usize = 1 << 16;

/// Sums a value over the first `nodes` nodes.
fn sum(nodes: usize, value: impl Fn(u32) -> f64 + Sync) -> f64 {
    let parts = (0..nodes.div_ceil(SUMMED_AT_ONCE)).into_par_iter();
    let part = |k: usize| {
        let end = nodes.min((k + 1) * SUMMED_AT_ONCE);
        (k * SUMMED_AT_ONCE..end).map(|at| value(at as u32)).sum::<f64>()
    };
    parts.map(part).collect::<Vec<f64>>().into_iter().sum()
}

/// So many zero elements. The system makes their pages when they are first written, which several
/// threads may do.
fn zeroed<T: FromZeros>(count: usize) -> Vec<T> {
    let no_memory = |_| std::alloc::handle_alloc_error(std::alloc::Layout::new::<T>());
    T::new_vec_zeroed(count).unwrap_or_else(no_memory)
}
