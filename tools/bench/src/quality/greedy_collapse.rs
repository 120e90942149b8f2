//! The wide tree as most builders choose it, for comparison: from the top down, the child with the largest area is replaced
//! by its children while the node has room ("Shallow Bounding Volume Hierarchies for Fast SIMD Ray Tracing of Incoherent Rays", Dammertz,
//! Hanika and Keller 2008); leaves are as large as they can be.

use bth_compile::Result;
use bth_compile::bvh::BinaryBvh;
use bth_compile::comparison::{Decision, Planner, Role, Vertices};
use bth_format::layout::{INDEXED_LINES, NODE_LINES, WIDTH};

/// Decides for all nodes; also returns the cost of the tree without its tet leaves.
pub(super) fn decide(planner: &Planner<'_>, cut: &[u32]) -> Result<(Vec<Decision>, f32)> {
    let mut decisions = vec![Decision::default(); planner.bvh.nodes.len()];
    let fits = fits(planner, cut);
    for &at in cut {
        decisions[at as usize].set_cut();
    }
    let mut greedy = Greedy { planner, fits: &fits, decisions: &mut decisions };
    let cost = if cut.first() == Some(&0) { 0.0 } else { greedy.tree(0)? };
    if planner.below_cut {
        for &at in cut {
            greedy.tree(at)?;
        }
    }
    Ok((decisions, cost))
}

/// Which nodes can be leaves: those with at most 16 vertices and `plan.triangles` triangles, and no cut node below.
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
            let area = self.planner.area(at);
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
            let area = |n: u32| self.planner.area(n);
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

/// Sets how many children lie below a node that has been opened, and returns the number; 1 for other nodes.
fn share(bvh: &BinaryBvh, opened: &[u32], at: u32, decisions: &mut [Decision]) -> usize {
    if !opened.contains(&at) {
        return 1;
    }
    let left = share(bvh, opened, at + 1, decisions);
    let all = left + share(bvh, opened, bvh.nodes[at as usize].right, decisions);
    decisions[at as usize].set_share(all, left);
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use bth_compile::Silent;
    use bth_compile::bvh::{self, CollapseOptions, Plan};
    use bth_compile::comparison::collapse_by;
    use bth_import::Mesh;

    /// A bumpy field of `n` by `n` squares.
    fn field(n: u32) -> Mesh {
        let height = |row: u32| (row.wrapping_mul(2_654_435_761) >> 22) as f32 * 0.009;
        let point = |row: u32| [(row % (n + 1)) as f32, (row / (n + 1)) as f32, height(row)];
        let positions = (0..(n + 1) * (n + 1)).map(point).collect();
        let square = |k: u32| {
            let a = k / n * (n + 1) + k % n;
            [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]
        };
        Mesh { positions, triangles: (0..n * n).flat_map(square).collect(), ..Mesh::default() }
    }

    #[test]
    fn the_greedy_tree_costs_at_least_as_much_as_the_least_one() {
        let mesh = field(40);
        let (tree, _) = bvh::build(&mesh, &bvh::BvhOptions::default(), &Silent).unwrap();
        let cut = [tree.nodes[0].right];
        for (children, triangles) in [(2, 1), (4, 16), (8, 8), (16, 16)] {
            let options =
                CollapseOptions { plan: Plan { children, triangles }, ..CollapseOptions::default() };
            for cut in [&cut[..], &[]] {
                let (_, least) = bvh::collapse(&mesh, &tree, cut, &options, &Silent).unwrap();
                let (wide, greedy) = collapse_by(&mesh, &tree, cut, &options, &decide, &Silent).unwrap();
                assert!(least.cost <= greedy.cost * (1.0 + 1e-5), "{children} {triangles}");
                assert_eq!(wide.triangle_ids.len() as u64, greedy.indexed_triangles + greedy.raw_triangles);
                assert!(greedy.children <= greedy.nodes * children as u64);
            }
        }
    }
}
