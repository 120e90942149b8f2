//! Plans which nodes of the binary BVH become wide nodes and leaves, by dynamic programming over
//! SAH costs.
//!
//! As in "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs" (Ylitie et al.
//! 2017, §3.1): `cost[k]` of a node is the smallest cost of its subtree as at most `k` children of
//! one wide node. The costs of a node are needed by its parent alone, so only decisions are stored.

use super::BinaryBvh;
use super::poses::Weighed;
use bth_format::layout::{INDEXED_LINES, NODE_LINES, RAW_LINES, WIDTH};
use bth_import::Mesh;
use bth_import::error::Result;
use bth_import::monitor::Monitor;
use zerocopy::FromZeros;

/// Costs of a ray's visits, relative to a visit of a wide node. A visit's probability is the node's
/// area over the root's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Costs {
    /// A wide node.
    pub node: f32,
    /// A leaf with shared vertices, which is 4 lines, and each of its triangles.
    pub indexed: [f32; 2],
    /// A leaf without sharing, which is 10 lines, and each of its triangles.
    pub raw: [f32; 2],
    /// Price of one more line of 64 bytes for each triangle of the model, visited or not, as a
    /// share of the visits to the binary BVH. Weighs the size of the file against visits.
    pub line: f32,
}

impl Default for Costs {
    /// A leaf tests its triangles together, so that it costs about as much as a node whatever their
    /// number; a raw leaf reads 2.5 times the memory. The price of lines takes the bunny from 45 to
    /// 32 bytes a triangle for 0.3 % more visits, and a soup from 160 to 100 for 3 %.
    fn default() -> Self {
        Costs { node: 1.0, indexed: [1.0, 0.02], raw: [2.5, 0.02], line: 0.05 }
    }
}

/// The role of a node that takes one slot of a wide node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// A wide node.
    Node,
    /// A leaf with shared vertices.
    Indexed,
    /// A leaf without sharing.
    Raw,
}

/// A node's decisions in 4 bits each: at bit 4 k for k in 2..16, the number of k slots that its
/// left child takes, 0 for the same as with k - 1; at bit 0, the number of 16 slots when it is
/// itself a wide node; at bit 4, its role.
#[derive(Clone, Copy, Debug, Default, FromZeros)]
pub(super) struct Decision(u64);

impl Decision {
    const CUT: u64 = 8 << 4;

    fn share(self, slots: usize) -> usize {
        (self.0 >> (4 * (slots % WIDTH)) & 15) as usize
    }

    /// Sets how many of `slots` slots the left child takes.
    fn set_share(&mut self, slots: usize, left: usize) {
        self.0 |= (left as u64) << (4 * (slots % WIDTH));
    }

    /// Sets the role of a node whose role has not been set.
    fn set_role(&mut self, role: Role) {
        self.0 |= role as u64 * 16;
    }

    /// Makes the node a tet leaf.
    fn set_cut(&mut self) {
        self.0 |= Self::CUT;
    }

    pub(super) fn role(self) -> Role {
        match self.0 >> 4 & 7 {
            0 => Role::Node,
            1 => Role::Indexed,
            _ => Role::Raw,
        }
    }

    /// Returns true if the node is a tet leaf; its role is then the role of its subtree.
    pub(super) fn is_cut(self) -> bool {
        self.0 & Self::CUT != 0
    }
}

/// Costs and vertices of a subtree, the input of the planning of its parent.
struct Summary {
    /// Smallest cost in at most as many slots as the row; rows 1 to 15.
    cost: [f32; WIDTH],
    /// Distinct vertices, ascending, when there are at most 16.
    vertices: Option<Vertices>,
}

/// At most 16 ascending vertex indices.
#[derive(Clone, Copy)]
struct Vertices {
    index: [u32; WIDTH],
    count: usize,
}

impl Vertices {
    /// The vertices of a triangle.
    fn of_triangle(mut triangle: [u32; 3]) -> Vertices {
        triangle.sort_unstable();
        let mut vertices = Vertices { index: [0; WIDTH], count: 0 };
        for v in triangle {
            if vertices.count == 0 || vertices.index[vertices.count - 1] != v {
                vertices.index[vertices.count] = v;
                vertices.count += 1;
            }
        }
        vertices
    }

    /// The union, if it has at most 16 vertices.
    fn join(&self, other: &Vertices) -> Option<Vertices> {
        let mut joined = Vertices { index: [0; WIDTH], count: 0 };
        let (a, b) = (&self.index[..self.count], &other.index[..other.count]);
        let (mut i, mut j) = (0, 0);
        while i < a.len() || j < b.len() {
            let next = match (a.get(i), b.get(j)) {
                (Some(&x), Some(&y)) => x.min(y),
                (Some(&x), None) | (None, Some(&x)) => x,
                (None, None) => break,
            };
            i += usize::from(a.get(i) == Some(&next));
            j += usize::from(b.get(j) == Some(&next));
            *joined.index.get_mut(joined.count)? = next;
            joined.count += 1;
        }
        Some(joined)
    }
}

/// Input of the planning.
pub(super) struct Planner<'a> {
    mesh: &'a Mesh,
    /// Binary BVH of at least one node.
    bvh: &'a BinaryBvh,
    pub(super) costs: Costs,
    monitor: &'a dyn Monitor,
    weighed: Weighed<'a>,
    inverse_area: f64,
    /// Price of a line.
    pub(super) line: f32,
}

/// Subtrees of more triangles are planned as separate tasks.
const PLAN_TASK: u32 = 1 << 13;

impl<'a> Planner<'a> {
    /// Prepares the planning for a BVH of at least one node.
    pub(super) fn new(mesh: &'a Mesh, weighed: Weighed<'a>, costs: Costs, monitor: &'a dyn Monitor) -> Self {
        let bvh = weighed.bvh;
        let area = weighed.area(0);
        // A deformable mesh may lie on one line: then all trees cost the same.
        let inverse_area = if area > 0.0 { 1.0 / area } else { 0.0 };
        let visits = weighed.total() * inverse_area;
        let line = (f64::from(costs.line) * visits / bvh.order.len() as f64) as f32;
        Planner { mesh, bvh, costs, monitor, weighed, inverse_area, line }
    }

    /// Decisions for all nodes, and the cost of the tree without its tet leaves; `cut` holds these,
    /// ascending.
    pub(super) fn run(&self, cut: &[u32]) -> Result<(Vec<Decision>, f32)> {
        let mut decisions: Vec<Decision> = super::zeroed(self.bvh.nodes.len());
        let summary = self.subtree(0, cut, &mut decisions)?;
        Ok((decisions, summary.cost[1]))
    }

    /// Probability that a ray through the root enters the node.
    fn area(&self, at: u32) -> f32 {
        (self.weighed.area(at) * self.inverse_area) as f32
    }

    fn subtree(&self, at: u32, cut: &[u32], decisions: &mut [Decision]) -> Result<Summary> {
        if cut.first() != Some(&at) {
            return self.plain(at, cut, decisions);
        }
        decisions[0].set_cut();
        // The cut nodes are given, and the slot of a tet leaf costs the same in every tree, so its
        // cost does not count.
        Ok(Summary { cost: [0.0; WIDTH], vertices: None })
    }

    /// Plans a node that is not cut.
    fn plain(&self, at: u32, cut: &[u32], decisions: &mut [Decision]) -> Result<Summary> {
        let node = &self.bvh.nodes[at as usize];
        let area = self.area(at);
        if node.is_leaf() {
            let triangle = self.bvh.order[node.first as usize];
            let vertices = Vertices::of_triangle(self.mesh.triangles[triangle as usize]);
            decisions[0].set_role(Role::Indexed);
            let cost =
                area * (self.costs.indexed[0] + self.costs.indexed[1]) + self.line * INDEXED_LINES as f32;
            return Ok(Summary { cost: [cost; WIDTH], vertices: Some(vertices) });
        }
        let (own, below) = decisions.split_at_mut(1);
        let (left_below, right_below) = below.split_at_mut((node.right - at - 1) as usize);
        let (left_cut, right_cut) = cut.split_at(cut.partition_point(|&c| c < node.right));
        let (left, right) = if node.count > PLAN_TASK {
            self.monitor.check()?;
            let (left, right) = rayon::join(
                || self.subtree(at + 1, left_cut, left_below),
                || self.subtree(node.right, right_cut, right_below),
            );
            (left?, right?)
        } else {
            (self.subtree(at + 1, left_cut, left_below)?, self.subtree(node.right, right_cut, right_below)?)
        };

        let decision = &mut own[0];
        *decision = Decision::default();
        // In more than 15 slots no subtree is needed.
        let leaves =
            [at + 1, node.right].map(|at| (self.bvh.nodes[at as usize].count as usize).min(WIDTH - 1));
        let pair = Pair { costs: [&left.cost, &right.cost], leaves };
        let (children, share) = pair.distribute(WIDTH);
        decision.set_share(WIDTH, share);
        let mut summary = Summary { cost: [f32::INFINITY; WIDTH], vertices: None };
        let mut role = (area * self.costs.node + self.line * NODE_LINES as f32 + children, Role::Node);
        // A subtree with a cut node cannot be a triangle leaf.
        if node.count as usize <= WIDTH && cut.is_empty() {
            if let (Some(a), Some(b)) = (&left.vertices, &right.vertices) {
                summary.vertices = a.join(b);
            }
            let leaf = |[entry, each]: [f32; 2], lines: usize| {
                area * (entry + each * node.count as f32) + self.line * lines as f32
            };
            let indexed = leaf(self.costs.indexed, INDEXED_LINES);
            if summary.vertices.is_some() && indexed <= role.0 {
                role = (indexed, Role::Indexed);
            }
            let raw = leaf(self.costs.raw, RAW_LINES);
            if raw < role.0 {
                role = (raw, Role::Raw);
            }
        }
        decision.set_role(role.1);
        summary.cost[1] = role.0;
        pair.in_several_slots(decision, &mut summary.cost);
        Ok(summary)
    }
}

/// The smallest costs of the two subtrees of a node in 1 to 15 slots each, and the numbers of their
/// leaves, in more slots than which they cost no less.
struct Pair<'a> {
    costs: [&'a [f32; WIDTH]; 2],
    leaves: [usize; 2],
}

impl Pair<'_> {
    /// The smallest cost of both in `slots` slots, and how many of these the left one takes.
    #[inline(always)]
    fn distribute(&self, slots: usize) -> (f32, usize) {
        let [left, right] = self.leaves;
        let first = slots.saturating_sub(right).max(1).min(left);
        let mut best = (f32::INFINITY, first);
        for j in first..=left.min(slots - 1) {
            let cost = self.costs[0][j] + self.costs[1][right.min(slots - j)];
            if cost < best.0 {
                best = (cost, j);
            }
        }
        best
    }

    /// Decides how a node whose cost in one slot is known shares more slots between its children.
    #[inline(always)]
    fn in_several_slots(&self, decision: &mut Decision, cost: &mut [f32; WIDTH]) {
        let leaves = self.leaves[0] + self.leaves[1];
        for slots in 2..WIDTH.min(leaves + 1) {
            let (shared, share) = self.distribute(slots);
            cost[slots] = cost[slots - 1];
            if shared < cost[slots] {
                cost[slots] = shared;
                decision.set_share(slots, share);
            }
        }
        for slots in (leaves + 1)..WIDTH {
            cost[slots] = cost[leaves];
        }
    }
}

/// The children, as nodes of the binary BVH, of a wide node.
pub(super) fn children(bvh: &BinaryBvh, decisions: &[Decision], at: u32) -> Vec<u32> {
    let mut children = Vec::with_capacity(WIDTH);
    let share = decisions[at as usize].share(WIDTH);
    gather(bvh, decisions, at + 1, share, &mut children);
    gather(bvh, decisions, bvh.nodes[at as usize].right, WIDTH - share, &mut children);
    children
}

fn gather(bvh: &BinaryBvh, decisions: &[Decision], at: u32, slots: usize, children: &mut Vec<u32>) {
    let decision = decisions[at as usize];
    let used = (2..=slots).rev().find(|&k| decision.share(k) != 0);
    match used {
        Some(used) if !decision.is_cut() => {
            let share = decision.share(used);
            gather(bvh, decisions, at + 1, share, children);
            gather(bvh, decisions, bvh.nodes[at as usize].right, used - share, children);
        }
        _ => children.push(at),
    }
}
