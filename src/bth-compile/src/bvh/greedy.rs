//! The wide tree as most builders make it, to compare with: from the top, the child of the largest area is opened
//! while there is room ("Shallow Bounding Volume Hierarchies for Fast SIMD Ray Tracing of Incoherent Rays", Dammertz,
//! Hanika and Keller 2008); leaves are as large as they can be.

use super::BinaryBvh;
use super::plan::{Decision, Planner, Role, Vertices};
use crate::error::Result;
use bth_format::layout::{INDEXED_LINES, NODE_LINES, WIDTH};

/// Decides for all nodes; returns the cost as [`Planner::run`] does.
pub(super) fn decide(planner: &Planner<'_>, cut: &[u32], decisions: &mut [Decision]) -> Result<f32> {
    let fits = fits(planner, cut);
    for &at in cut {
        decisions[at as usize].set_cut();
    }
    let mut greedy = Greedy { planner, fits: &fits, decisions };
    let cost = if cut.first() == Some(&0) { 0.0 } else { greedy.tree(0)? };
    if planner.below_cut {
        for &at in cut {
            greedy.tree(at)?;
        }
    }
    Ok(cost)
}

/// Which nodes can be leaves: they have at most 16 vertices and the most triangles, and no cut node below.
fn fits(planner: &Planner<'_>, cut: &[u32]) -> Vec<bool> {
    let Planner { mesh, bvh, plan, .. } = planner;
    let mut fits = vec![false; bvh.nodes.len()];
    let mut vertices: Vec<Option<Vertices>> = vec![None; bvh.nodes.len()];
    for (at, node) in bvh.nodes.iter().enumerate().rev() {
        vertices[at] = if node.is_leaf() {
            let triangle = bvh.order[node.first as usize];
            Some(Vertices::of_triangle(mesh.triangles[triangle as usize]))
        } else if node.count as usize <= plan.triangles {
            let [left, right] = [vertices[at + 1], vertices[node.right as usize]];
            left.zip(right).and_then(|(a, b)| a.join(&b))
        } else {
            None
        };
        fits[at] = vertices[at].is_some();
        if cut.binary_search(&(at as u32)).is_ok() {
            vertices[at] = None;
        }
    }
    fits
}

struct Greedy<'a> {
    planner: &'a Planner<'a>,
    fits: &'a [bool],
    decisions: &'a mut [Decision],
}

impl Greedy<'_> {
    /// Decides for the tree below a node, be that cut or not, and returns its cost.
    fn tree(&mut self, root: u32) -> Result<f32> {
        let Planner { bvh, costs, line, .. } = *self.planner;
        let mut cost = 0.0;
        let mut pending = vec![root];
        let mut done = 0u32;
        while let Some(at) = pending.pop() {
            if done.is_multiple_of(4096) {
                self.planner.monitor.check()?;
            }
            done += 1;
            let node = &bvh.nodes[at as usize];
            let area = self.planner.area(node);
            if self.fits[at as usize] {
                self.decisions[at as usize].set_role(Role::Indexed);
                let [entry, each] = costs.indexed;
                cost += area * (entry + each * node.count as f32) + line * INDEXED_LINES as f32;
                continue;
            }
            cost += area * costs.node + line * NODE_LINES as f32;
            let opened = self.open(at);
            let left = share(bvh, &opened, at + 1, self.decisions);
            share(bvh, &opened, node.right, self.decisions);
            self.decisions[at as usize].set_share(WIDTH, left);
            let inside = |n: u32| n == at || opened.contains(&n);
            let below = opened.iter().chain([&at]).flat_map(|&n| [n + 1, bvh.nodes[n as usize].right]);
            pending.extend(below.filter(|&n| !inside(n) && !self.decisions[n as usize].is_cut()));
        }
        Ok(cost)
    }

    /// The nodes of the binary tree between a wide node and its children.
    fn open(&self, at: u32) -> Vec<u32> {
        let Planner { bvh, plan, .. } = *self.planner;
        let mut children = vec![at + 1, bvh.nodes[at as usize].right];
        let mut opened = Vec::new();
        while children.len() < plan.children {
            let can = |&&n: &&u32| !self.fits[n as usize] && !self.decisions[n as usize].is_cut();
            let area = |n: u32| self.planner.area(&bvh.nodes[n as usize]);
            let largest =
                children.iter().filter(can).max_by(|a, b| area(**a).total_cmp(&area(**b)).then(b.cmp(a)));
            let Some(&largest) = largest else { break };
            children.retain(|&n| n != largest);
            children.extend([largest + 1, bvh.nodes[largest as usize].right]);
            opened.push(largest);
        }
        opened
    }
}

/// Notes how many children lie below a node that has been opened, and returns it; 1 for another.
fn share(bvh: &BinaryBvh, opened: &[u32], at: u32, decisions: &mut [Decision]) -> usize {
    if !opened.contains(&at) {
        return 1;
    }
    let left = share(bvh, opened, at + 1, decisions);
    let all = left + share(bvh, opened, bvh.nodes[at as usize].right, decisions);
    decisions[at as usize].set_share(all, left);
    all
}
