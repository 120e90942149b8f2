//! Splits subtrees of few triangles again, by a full sweep.

use super::super::bounds::Bounds;
use super::super::build::{Effort, levels, split_with};
use super::super::plan::{Decision, Planner, Role};
use super::super::split::Reference;
use super::super::sweep_split::Scratch;
use super::super::{BinaryBvh, MAX_LEVELS, Node, Quality};
use super::copy_subtree;
use bth_format::layout::WIDTH;
use bth_import::error::Result;
use rayon::prelude::*;

/// Largest number of triangles of a subtree that is split again. With half of it sponza_dabrovic
/// keeps a quarter of the gain.
const MOST_TRIANGLES: u32 = 200;

/// A subtree, by its root, and what replaces it.
type Replaced = (u32, BinaryBvh);

/// Finds the subtrees of few triangles in the planned BVH that cost less when they are split again.
pub(super) fn find(planner: &Planner<'_>, decisions: &[Decision]) -> Result<Vec<Replaced>> {
    let bvh = planner.bvh;
    let effort = Effort { sweep_count: usize::MAX, ..Quality::Balanced.effort() };
    let cheaper = |scratch: &mut Scratch<Bounds>, Root { at, level }: Root| -> Result<Option<Replaced>> {
        planner.monitor.check()?;
        let mut before = BinaryBvh::default();
        copy_subtree(bvh, at, &mut before);
        let mesh = planner.mesh;
        let reference = |&id: &u32| Reference { bounds: Bounds::of_points(&mesh.corners(id)), id };
        let mut references: Vec<_> = before.order.iter().map(reference).collect();
        let after = split_with(&mut references, &effort, scratch, planner.monitor)?;
        let area = bvh.nodes[at as usize].half_area();
        let scale = if area > 0.0 { f64::from(planner.area(at)) / area } else { 0.0 };
        let is_cheaper = planner.cost_of_part(&after, scale)? < planner.cost_of_part(&before, scale)?;
        // A deeper tree could not be traversed.
        let is_cheaper = is_cheaper && level + levels(&after) <= MAX_LEVELS;
        Ok(is_cheaper.then_some((at, after)))
    };
    let roots = small_subtrees(bvh, decisions);
    let found: Vec<_> = roots
        .par_iter()
        .with_min_len(4)
        .map_init(Scratch::default, |scratch, &root| cheaper(scratch, root))
        .collect::<Result<_>>()?;
    Ok(found.into_iter().flatten().collect())
}

/// The root of a subtree.
#[derive(Clone, Copy)]
struct Root {
    at: u32,
    /// Edges above it.
    level: u32,
}

/// The topmost wide nodes of at most [`MOST_TRIANGLES`] triangles. Skips nodes that fit one leaf.
fn small_subtrees(bvh: &BinaryBvh, decisions: &[Decision]) -> Vec<Root> {
    let mut found = Vec::new();
    let mut stack = vec![Root { at: 0, level: 0 }];
    while let Some(root) = stack.pop() {
        let at = root.at;
        let node = &bvh.nodes[at as usize];
        if node.count as usize <= WIDTH {
            continue;
        }
        if node.count <= MOST_TRIANGLES && decisions[at as usize].role() == Role::Node {
            found.push(root);
        } else {
            stack.extend([node.right, at + 1].map(|at| Root { at, level: root.level + 1 }));
        }
    }
    found
}

/// Replaces a subtree by another one over the same triangles.
pub(super) fn replace(bvh: &mut BinaryBvh, at: u32, part: &BinaryBvh) {
    let first = bvh.nodes[at as usize].first;
    bvh.order[first as usize..][..part.order.len()].copy_from_slice(&part.order);
    for (to, node) in bvh.nodes[at as usize..].iter_mut().zip(&part.nodes) {
        let right = if node.is_leaf() { 0 } else { node.right + at };
        *to = Node { first: node.first + first, right, ..*node };
    }
}
