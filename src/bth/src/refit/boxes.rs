//! The refit of an object: positions into leaves, boxes of leaves into nodes, from the leaves up.
//!
//! A task goes through its subtree depth first, which is the order of its nodes, of its leaves and
//! of LEAF_VERTICES, so that all of them are read and written one after the other; only positions
//! are read in the order of the source. Boxes are exact bounds, so they have the same bits whoever
//! computes them.

use super::plan::{ChildSlot, LeafRange, RefitPlan, RefitTask};
use crate::bvh::nodes::leaf_size;
use crate::parallel;
use crate::simd::{Isa, Kernel, LANES, Simd};
use bth_format::file::RefitParts;
use bth_format::layout::{
    CacheLine, Child, INDEXED_LINES, IndexedLeaf, NODE_LINES, NONE, RAW_LINES, RawLeaf, WIDTH, WideNode,
};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// Lower and upper end of a box.
pub(super) type Ends = [[f32; 3]; 2];

/// Stores the positions in all leaves and the boxes in all nodes; returns the bounds of all
/// triangles.
pub(super) fn refit(plan: &RefitPlan, parts: &mut RefitParts<'_>) -> Ends {
    let RefitParts { lines, leaf_vertices, positions, .. } = parts;
    let boxes = refit_tasks(plan, lines, leaf_vertices, positions);
    let mut root = boxes.first().copied();
    for (task, ends) in plan.tasks.iter().zip(&boxes) {
        put_at(lines, task.parent, ends);
    }
    for leaf in &plan.leaves {
        let Some((leaf_lines, rows)) = leaf_size(leaf.code) else { continue };
        let at = leaf.code & (Child::INDEX_LIMIT - 1);
        let range = LeafRange { line: at, lines: leaf_lines, row: leaf.row, rows };
        let leaves = &mut lines[range.line as usize..][..leaf_lines as usize];
        let rows = &leaf_vertices[range.row as usize..][..rows as usize];
        let ends = Isa::chosen().run(LeafKernel { leaf: leaves, rows, positions });
        put_at(lines, leaf.parent, &ends);
        root = root.or(Some(ends));
    }
    // Children come behind their parents, so that their boxes are final when the parent is reached.
    for &line in plan.nodes.iter().rev() {
        let (node, behind) = lines[line as usize..].split_at_mut(NODE_LINES);
        let node = block_mut::<WideNode>(node);
        for slot in 0..WIDTH {
            let code = node.child[slot];
            if plan.nodes.binary_search(&code).is_ok() {
                let child = &mut behind[code as usize - line as usize - NODE_LINES..][..NODE_LINES];
                put(node, slot, &super::cost::bounds(block_mut(child)));
            }
        }
    }
    match plan.nodes.first() {
        Some(&line) => super::cost::bounds(block_mut(&mut lines[line as usize..][..NODE_LINES])),
        None => root.unwrap_or_default(),
    }
}

/// Refits the subtrees of all tasks; returns their boxes.
fn refit_tasks(
    plan: &RefitPlan,
    lines: &mut [CacheLine],
    leaf_vertices: &[[u32; WIDTH]],
    positions: &[[f32; 3]],
) -> Vec<Ends> {
    let (mut nodes, mut leaves) = lines.split_at_mut(plan.node_lines as usize);
    let (mut node, mut leaf) = (0, plan.node_lines as usize);
    let mut kernel = |task: &RefitTask| {
        let own_nodes = take(&mut nodes, &mut node, task.node as usize, task.node_lines as usize);
        let range = task.leaves;
        let own_leaves = take(&mut leaves, &mut leaf, range.line as usize, range.lines as usize);
        let rows = &leaf_vertices[range.row as usize..][..range.rows as usize];
        TaskKernel { first: task.node, nodes: own_nodes, leaves: own_leaves, rows, positions }
    };
    let kernels: Vec<_> = plan.tasks.iter().map(&mut kernel).collect();
    parallel::map(kernels, |kernel| Isa::chosen().run(kernel))
}

/// Takes a range of lines from the front of `rest`, whose first line is `at`, and drops those
/// before it.
fn take<'a>(
    rest: &mut &'a mut [CacheLine],
    at: &mut usize,
    first: usize,
    count: usize,
) -> &'a mut [CacheLine] {
    let (_, behind) = std::mem::take(rest).split_at_mut(first - *at);
    let (taken, behind) = behind.split_at_mut(count);
    *rest = behind;
    *at = first + count;
    taken
}

/// The node or leaf in lines that are as long as it.
#[inline(always)]
fn block_mut<T: FromBytes + IntoBytes + KnownLayout + Immutable>(lines: &mut [CacheLine]) -> &mut T {
    T::mut_from_bytes(lines.as_mut_bytes()).ok().expect("a block is a whole number of aligned lines")
}

/// Stores the box of a child.
#[inline(always)]
fn put(node: &mut WideNode, slot: usize, ends: &Ends) {
    for k in 0..3 {
        node.bounds[k][0][slot] = ends[0][k];
        node.bounds[k][1][slot] = ends[1][k];
    }
}

fn put_at(lines: &mut [CacheLine], parent: Option<ChildSlot>, ends: &Ends) {
    if let Some(ChildSlot { node, slot }) = parent {
        put(block_mut(&mut lines[node as usize..][..NODE_LINES]), slot as usize, ends);
    }
}

/// Kernel that refits a subtree.
struct TaskKernel<'a> {
    /// Line of the root, which is the first of `nodes`.
    first: u32,
    nodes: &'a mut [CacheLine],
    leaves: &'a mut [CacheLine],
    /// Rows of LEAF_VERTICES of the leaves.
    rows: &'a [[u32; WIDTH]],
    positions: &'a [[f32; 3]],
}

impl Kernel for TaskKernel<'_> {
    type Output = Ends;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Ends {
        let TaskKernel { first, nodes, mut leaves, mut rows, positions } = self;
        // The nodes on the path from the root to the current one, and in each the slot of the next.
        let mut path: Vec<(usize, usize)> = Vec::new();
        let (mut at, mut slot) = (0, 0);
        loop {
            let node: &mut WideNode = block_mut(&mut nodes[at..at + NODE_LINES]);
            let code = if slot < WIDTH { node.child[slot] } else { NONE };
            if code == NONE {
                let ends = union(s, node);
                let Some((parent, parent_slot)) = path.pop() else { return ends };
                put(block_mut(&mut nodes[parent..parent + NODE_LINES]), parent_slot, &ends);
                (at, slot) = (parent, parent_slot + 1);
            } else if let Some((leaf_lines, leaf_rows)) = leaf_size(code) {
                let (leaf, behind) = std::mem::take(&mut leaves).split_at_mut(leaf_lines as usize);
                let (leaf_vertices, rows_behind) = rows.split_at(leaf_rows as usize);
                (leaves, rows) = (behind, rows_behind);
                put(node, slot, &refit_leaf(s, leaf, leaf_vertices, positions));
                slot += 1;
            } else {
                path.push((at, slot));
                (at, slot) = (code.wrapping_sub(first) as usize, 0);
            }
        }
    }
}

/// Kernel that refits one leaf.
struct LeafKernel<'a> {
    leaf: &'a mut [CacheLine],
    rows: &'a [[u32; WIDTH]],
    positions: &'a [[f32; 3]],
}

impl Kernel for LeafKernel<'_> {
    type Output = Ends;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Ends {
        refit_leaf(s, self.leaf, self.rows, self.positions)
    }
}

/// Stores the positions in a leaf, and returns its box. An indexed leaf has one row of vertices, a
/// raw one has three.
#[inline(always)]
fn refit_leaf<S: Simd>(s: S, leaf: &mut [CacheLine], rows: &[[u32; WIDTH]], positions: &[[f32; 3]]) -> Ends {
    const { assert!(WIDTH == LANES) };
    if let [row] = rows {
        let leaf: &mut IndexedLeaf = block_mut(&mut leaf[..INDEXED_LINES]);
        let points = s.points(positions, row);
        for k in 0..3 {
            s.store(points[k], &mut leaf.vertex[k]);
        }
        return ends(s, points, points);
    }
    let leaf: &mut RawLeaf = block_mut(&mut leaf[..RAW_LINES]);
    let (mut lower, mut upper) = ([s.splat(f32::MAX); 3], [s.splat(-f32::MAX); 3]);
    for c in 0..3 {
        let points = s.points(positions, &rows[c]);
        for k in 0..3 {
            s.store(points[k], &mut leaf.corner[c][k]);
            lower[k] = s.min(lower[k], points[k]);
            upper[k] = s.max(upper[k], points[k]);
        }
    }
    ends(s, lower, upper)
}

/// The box of all children of a node. Empty slots hold boxes that change no union.
#[inline(always)]
fn union<S: Simd>(s: S, node: &WideNode) -> Ends {
    let [x, y, z] = &node.bounds;
    ends(s, [s.load(&x[0]), s.load(&y[0]), s.load(&z[0])], [s.load(&x[1]), s.load(&y[1]), s.load(&z[1])])
}

/// The min of all lanes of `lower` and the max of all lanes of `upper`, per axis.
#[inline(always)]
fn ends<S: Simd>(s: S, lower: [S::F; 3], upper: [S::F; 3]) -> Ends {
    let mut ends = [[0.0; 3]; 2];
    for k in 0..3 {
        ends[0][k] = s.least(lower[k]);
        // A difference from 0 and a sum with 0 keep zeros positive, like the zeros of positions.
        ends[1][k] = 0.0 - s.least(s.sub(s.splat(0.0), upper[k]));
    }
    ends
}
