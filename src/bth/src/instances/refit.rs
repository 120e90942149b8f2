//! Refitting of the top level: instances have moved, and the boxes of the same nodes are computed
//! again, from the leaves up. A refit costs a fraction of a build, but nodes grow where instances
//! that share one move apart. [`CostRatio`](super::top_nodes::CostRatio) tells how much.

use super::placement::Placement;
use super::top_level::{PlacedRows, TopLevel};
use super::top_nodes::{INSTANCE, InstanceBounds, TreeLines, node_mut, put_bounds, used};
use crate::parallel::Tasks;
use bth_format::layout::{CacheLine, NODE_LINES, WIDTH, WideNode};
use glam::Vec4;

/// How the boxes of instances are stored.
const TASKS: Tasks = Tasks { rows: 64 * NODE_LINES, min_rows: 512 * NODE_LINES };

impl TopLevel {
    /// Computes all boxes again after instances have moved. The visible instances are those for
    /// which the BVH was built.
    pub(crate) fn refit(&mut self, placements: &[Option<Placement>], rows: Option<&[u32]>) {
        self.measure(&PlacedRows { placements, rows, first: self.first_row });
        let TreeLines::Own(mut lines) = std::mem::take(&mut self.lines) else { return };
        TASKS.for_each(&mut lines, |_, lines| self.refit_instances(lines, placements));
        // Children come behind their parents, so that their boxes are final when the parent is
        // reached.
        for code in (0..lines.len()).step_by(NODE_LINES).rev() {
            let (node, behind) = lines[code..].split_at_mut(NODE_LINES);
            let node = node_mut(node);
            for slot in 0..used(node) {
                let child = node.child[slot];
                if child & INSTANCE == 0 {
                    let lines = &mut behind[child as usize - code - NODE_LINES..][..NODE_LINES];
                    let bounds = union(node_mut(lines));
                    put_bounds(node, slot, &bounds);
                }
            }
        }
        self.cost.update(&lines);
        self.lines = TreeLines::Own(lines);
    }

    /// Stores the boxes of the instances in some nodes.
    fn refit_instances(&self, lines: &mut [CacheLine], placements: &[Option<Placement>]) {
        for lines in lines.chunks_exact_mut(NODE_LINES) {
            let node = node_mut(lines);
            for slot in 0..used(node) {
                let code = node.child[slot];
                if code & INSTANCE != 0
                    && let Some(placement) = &placements[((code & !INSTANCE) - self.first_row) as usize]
                {
                    put_bounds(node, slot, &self.bounds_of(&placement.row_box()));
                }
            }
        }
    }

    /// The expected cost relative to that when the BVH was built. It is 1 where there is only one
    /// node, or none.
    pub(super) fn cost_ratio(&self) -> f64 {
        self.cost.ratio()
    }
}

/// The box of all children of a node. Empty slots hold boxes that change no union.
fn union(node: &WideNode) -> InstanceBounds {
    let (mut lower, mut upper) = ([0.0; 4], [0.0; 4]);
    for k in 0..3 {
        let (mut least, mut greatest) = (f32::INFINITY, f32::NEG_INFINITY);
        for slot in 0..WIDTH {
            let (low, high) = (node.bounds[k][0][slot], node.bounds[k][1][slot]);
            least = if low < least { low } else { least };
            greatest = if high > greatest { high } else { greatest };
        }
        (lower[k], upper[k]) = (-least, greatest);
    }
    InstanceBounds { lower: Vec4::from_array(lower), upper: Vec4::from_array(upper) }
}
