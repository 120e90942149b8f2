//! BVH against BVH: the pairs of triangles of two disjoint nodes that are in bad contact
//! (the paper's BVHCOLLISION, Figure 2).

use super::triangle_contact::{Triangle, in_bad_contact};
use bth_bvh::{BinaryBvh, Node};
use bth_format::exact::is_zero_area;
use bth_import::Mesh;
use bth_import::error::Result;
use bth_import::monitor::Monitor;
use rayon::prelude::*;

/// Steps of a traversal between two checks for cancellation.
const STEPS_BETWEEN_CHECKS: u64 = 1 << 16;
/// Triangles of two siblings beyond which their collision is worth several threads.
const PARALLEL_COLLISION: u32 = 1 << 15;
/// Parts of a collision that several threads process. A constant, because the counts of the report
/// must not depend on the number of threads.
const PARTS: usize = 256;
/// Max number of rounds of splitting, even if there are fewer parts then.
const SPLITTING_ROUNDS: usize = 24;

/// A BVH with its triangles gathered in the order of its leaves, which keeps traversals local.
pub(super) struct Gathered<'a> {
    pub(super) bvh: &'a BinaryBvh,
    triangles: Vec<Triangle>,
}

/// Counts of a collision.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Contacts {
    /// Pairs of triangles with overlapping boxes.
    pub(super) tested: u64,
    /// Pairs of triangles in bad contact.
    pub(super) bad: u64,
}

/// True if a traversal continues after a bad contact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum After {
    /// One bad contact suffices.
    Stop,
    /// All bad contacts are to be found.
    GoOn,
}

impl<'a> Gathered<'a> {
    /// Returns true if a triangle has zero area, given its row of the BVH's order.
    pub(super) fn is_flat(&self, row: u32) -> bool {
        is_zero_area(self.triangles[row as usize].corners)
    }

    pub(super) fn new(mesh: &Mesh, bvh: &'a BinaryBvh) -> Self {
        let triangles = bvh
            .order
            .par_iter()
            .map(|&id| Triangle { corners: mesh.corners(id), vertices: mesh.triangles[id as usize] })
            .collect();
        Self { bvh, triangles }
    }

    /// Tests the triangles of one node against the triangles of another, on this thread. `found` is
    /// called with the rows in `order` of each bad pair and returns true to go on.
    pub(super) fn collide(
        &self,
        left: u32,
        right: u32,
        monitor: &dyn Monitor,
        mut found: impl FnMut(u32, u32) -> After,
    ) -> Result<Contacts> {
        let mut contacts = Contacts::default();
        let mut stack = vec![(left, right)];
        let mut steps = 0u64;
        while let Some((i, j)) = stack.pop() {
            steps += 1;
            if steps.is_multiple_of(STEPS_BETWEEN_CHECKS) {
                monitor.check()?;
            }
            let (a, b) = (self.node(i), self.node(j));
            if !overlap(a, b) {
                continue;
            }
            if a.is_leaf() && b.is_leaf() {
                contacts.tested += 1;
                if in_bad_contact(&self.triangles[a.first as usize], &self.triangles[b.first as usize]) {
                    contacts.bad += 1;
                    if found(a.first, b.first) == After::Stop {
                        break;
                    }
                }
            } else {
                stack.extend(self.split(i, j));
            }
        }
        Ok(contacts)
    }

    /// Runs [`Gathered::collide`] on several threads when the nodes are large. The counts do not
    /// depend on the number of threads, even when a bad contact stops the traversal.
    pub(super) fn collide_in_parallel(
        &self,
        left: u32,
        right: u32,
        monitor: &dyn Monitor,
        found: impl Fn(u32, u32) -> After + Sync,
    ) -> Result<Contacts> {
        if self.node(left).count.saturating_add(self.node(right).count) < PARALLEL_COLLISION {
            return self.collide(left, right, monitor, found);
        }
        // Pairs of nodes are split breadth first until there are enough parts; pairs whose boxes do
        // not overlap are dropped.
        let mut parts = vec![(left, right)];
        for _ in 0..SPLITTING_ROUNDS {
            parts = parts
                .into_iter()
                .filter(|&(i, j)| overlap(self.node(i), self.node(j)))
                .flat_map(|(i, j)| {
                    let leaves = self.node(i).is_leaf() && self.node(j).is_leaf();
                    if leaves { vec![(i, j)] } else { self.split(i, j).to_vec() }
                })
                .collect();
            if parts.len() >= PARTS || parts.is_empty() {
                break;
            }
        }
        // A bad pair ends only the parts after its own, so that the parts up to the first bad one
        // have always been counted in full.
        let first_stop = std::sync::atomic::AtomicUsize::new(usize::MAX);
        let counted: Vec<Contacts> = parts
            .par_iter()
            .enumerate()
            .map(|(k, &(i, j))| {
                use std::sync::atomic::Ordering::Relaxed;
                if first_stop.load(Relaxed) < k {
                    return Ok(Contacts::default());
                }
                self.collide(i, j, monitor, |a, b| {
                    let after = found(a, b);
                    if after == After::Stop {
                        first_stop.fetch_min(k, Relaxed);
                    }
                    after
                })
            })
            .collect::<Result<_>>()?;
        let mut total = Contacts::default();
        for c in counted.into_iter().take(first_stop.into_inner().saturating_add(1)) {
            total.tested += c.tested;
            total.bad += c.bad;
        }
        Ok(total)
    }

    #[inline]
    fn node(&self, i: u32) -> &Node {
        &self.bvh.nodes[i as usize]
    }

    /// Splits the node with more triangles, whose box is more likely to be too coarse.
    #[inline]
    fn split(&self, i: u32, j: u32) -> [(u32, u32); 2] {
        if self.node(i).count >= self.node(j).count {
            [(self.node(i).right, j), (i + 1, j)]
        } else {
            [(i, self.node(j).right), (i, j + 1)]
        }
    }
}

/// Returns true if two closed boxes have a point in common. Exact: the boxes are bounds of f32
/// corners.
#[inline]
fn overlap(a: &Node, b: &Node) -> bool {
    let axis = |k: usize| (a.lower[k] <= b.upper[k]) & (b.lower[k] <= a.upper[k]);
    axis(0) & axis(1) & axis(2)
}
