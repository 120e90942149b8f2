//! The free bins of a triangle: a traversal of the BVH that stops at what no open bin may see.

use super::frame::{BinSet, Frame, share};
use super::meet::meet;
use super::see::see;
use super::start::Start;
use super::tree::{BLOCK, Block, Tree};
use bth::simd::{Kernel, Simd};
use bth_format::layout::FreeBins;
use bth_import::Mesh;

/// What all searches of a mesh share.
pub(super) struct Surroundings<'a> {
    pub(super) mesh: &'a Mesh,
    /// Triangles in the order of the BVH.
    pub(super) order: &'a [u32],
    pub(super) tree: Tree,
    /// Distance within which [`FreeBins::NEARBY`] promises that nothing is met.
    pub(super) reach: f32,
}

/// Share of the directions of the front from which on the back is not searched.
const ENOUGH: f64 = 1.0 / 8.0;
/// What is free at all is kept unless this many times as much is free nearby.
const GAIN_OF_NEARBY: f64 = 2.0;

/// Index of `open` within the reach, and for all distances.
const NEAR: usize = 0;
const ALL: usize = 1;

/// Decides the bins of some triangles, by rows of the order of the BVH.
pub(super) struct Decide<'a> {
    pub(super) around: &'a Surroundings<'a>,
    pub(super) rows: std::ops::Range<usize>,
}

impl Kernel for Decide<'_> {
    type Output = Vec<FreeBins>;
    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Vec<FreeBins> {
        let mut search = Search { around: self.around, stack: Vec::new() };
        let mut decided = Vec::with_capacity(self.rows.len());
        for row in self.rows {
            decided.push(search.decide(s, row));
        }
        decided
    }
}

/// A child that is still to be visited.
#[derive(Clone, Copy)]
struct Entry {
    child: u32,
    squared_gap: f32,
    bins: BinSet,
}

/// Searches for triangles one after the other, with memory of its own.
struct Search<'a> {
    around: &'a Surroundings<'a>,
    stack: Vec<Entry>,
}

/// The start triangle of a search, and what is not blocked so far.
struct State {
    /// Row of the triangle in the order of the BVH.
    row: usize,
    start: Start,
    open: [BinSet; 2],
    /// Squared distance below which something may lie within the reach.
    near: f32,
}

impl State {
    /// Bins that something at this distance can still block.
    #[inline(always)]
    fn blockable(&self, squared_gap: f32) -> BinSet {
        self.open[if squared_gap < self.near { NEAR } else { ALL }]
    }

    #[inline(always)]
    fn block(&mut self, bins: BinSet, squared_gap: f32) {
        self.open[ALL] &= !bins;
        if squared_gap < self.near {
            self.open[NEAR] &= !bins;
        }
    }
}

impl Search<'_> {
    /// The free bins of a triangle, on its front unless its back is far more open.
    #[inline(always)]
    fn decide<S: Simd>(&mut self, s: S, row: usize) -> FreeBins {
        let mut best = (FreeBins(0), 0.0);
        for is_back in [false, true] {
            let found = self.decide_side(s, row, is_back);
            if found.1 > best.1 {
                best = found;
            }
            if best.1 >= ENOUGH {
                break;
            }
        }
        best.0
    }

    /// The free bins of a side and their share.
    #[inline(always)]
    fn decide_side<S: Simd>(&mut self, s: S, row: usize, is_back: bool) -> (FreeBins, f64) {
        let corners = self.around.mesh.corners(self.around.order[row]);
        let Some(frame) = Frame::new(corners, is_back) else { return (FreeBins(0), 0.0) };
        let reach = self.around.reach;
        let near = reach * reach * (1.0 + 1e-4);
        let start = Start::new(corners, &frame, is_back);
        let mut state = State { row, start, open: [FreeBins::ALL; 2], near };
        self.search(s, &mut state);
        let [near, all] = [share(state.open[NEAR]), share(state.open[ALL])];
        let side = if is_back { FreeBins::BACK } else { 0 };
        if reach > 0.0 && all * GAIN_OF_NEARBY < near {
            (FreeBins(state.open[NEAR] | side | FreeBins::NEARBY), near)
        } else if state.open[ALL] != 0 {
            (FreeBins(state.open[ALL] | side), all)
        } else {
            (FreeBins(0), 0.0)
        }
    }

    /// Blocks the bins in which a triangle of the mesh may be met.
    #[inline(always)]
    fn search<S: Simd>(&mut self, s: S, state: &mut State) {
        let tree = &self.around.tree;
        self.stack.clear();
        self.stack.push(Entry { child: 0, squared_gap: 0.0, bins: FreeBins::ALL });
        while let Some(Entry { child, squared_gap, bins }) = self.stack.pop() {
            let bins = bins & state.blockable(squared_gap);
            if bins == 0 {
                continue;
            }
            if child & BLOCK != 0 {
                let block = &tree.blocks[(child & !BLOCK) as usize];
                if squared_gap > 0.0 {
                    search_block::<S, false>(s, block, bins, state);
                } else {
                    search_block::<S, true>(s, block, bins, state);
                }
                continue;
            }
            let node = &tree.nodes[child as usize];
            let seen = see(s, &state.start, node);
            let first = self.stack.len();
            let mut lanes = seen.lanes;
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize;
                lanes &= lanes - 1;
                let squared_gap = seen.squared_gap[lane];
                let of_child = seen.bins(lane) & bins & state.blockable(squared_gap);
                if of_child == 0 {
                    continue;
                }
                if seen.small >> lane & 1 == 1 {
                    state.block(of_child, squared_gap);
                    continue;
                }
                self.stack.push(Entry { child: node.child[lane], squared_gap, bins: of_child });
            }
            nearest_last(&mut self.stack[first..]);
        }
    }
}

/// Sorts by insertion: the entries are few.
#[inline(always)]
fn nearest_last(entries: &mut [Entry]) {
    for i in 1..entries.len() {
        let entry = entries[i];
        let mut at = i;
        while at > 0 && entries[at - 1].squared_gap < entry.squared_gap {
            entries[at] = entries[at - 1];
            at -= 1;
        }
        entries[at] = entry;
    }
}

/// Blocks those of the bins of a block's box in which its triangles may be met.
#[inline(always)]
fn search_block<S: Simd, const TOUCHES: bool>(s: S, block: &Block, bins: BinSet, state: &mut State) {
    let met = meet::<S, TOUCHES>(s, &state.start, block);
    let mut lanes = met.above;
    while lanes != 0 {
        let lane = lanes.trailing_zeros() as usize;
        lanes &= lanes - 1;
        let squared_gap = met.squared_gap[lane];
        let bins = bins & state.blockable(squared_gap);
        if bins == 0 || block.first as usize + lane == state.row {
            continue;
        }
        let blocked = met.blocked(s, &state.start, lane, bins);
        if blocked == 0 {
            continue;
        }
        if met.certainly_above >> lane & 1 == 0 && !state.start.is_below(&block.corners(lane)) {
            continue;
        }
        state.block(blocked, squared_gap);
    }
}
