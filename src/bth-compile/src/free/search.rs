//! What is known of the directions of a triangle: a traversal of the BVH that stops at what no open
//! bin may see.

use super::Kept;
use super::frame::{BinSet, Frame, IN_SECTORS, SECTORS, share};
use super::meet::meet;
use super::see::{SMALL, SMALL_FOR_SECTORS, see};
use super::start::Start;
use super::tree::{BLOCK, Block, Tree};
use bth::simd::{Kernel, Simd};
use bth_format::layout::{FREE_SECTORS, FreeBins, FreeSectors};
use bth_import::Mesh;
use std::ops::Range;

/// What all searches of a mesh share.
pub(super) struct Surroundings<'a> {
    pub(super) mesh: &'a Mesh,
    /// Triangles in the order of the BVH.
    pub(super) order: &'a [u32],
    pub(super) tree: Tree,
    /// Distances of the levels of sectors; ascending, or zeros.
    pub(super) levels: [f32; FreeSectors::LEVELS],
    /// What is decided.
    pub(super) kept: Kept,
}

impl Surroundings<'_> {
    /// Runs of rows that follow each other and whose triangles have the same corners in the same
    /// order. What is known of one of them is known of all, since triangles with the same three
    /// corners do not block each other. Without this, a pile of coincident triangles would take
    /// quadratic time: none of them ends the search of another.
    pub(super) fn coincident(&self, rows: Range<usize>) -> impl Iterator<Item = Range<usize>> {
        let corners = |row: usize| self.mesh.corners(self.order[row]).map(|p| p.map(f32::to_bits));
        let mut rest = rows;
        std::iter::from_fn(move || {
            let first = rest.next()?;
            let of_first = corners(first);
            while rest.start < rest.end && corners(rest.start) == of_first {
                rest.start += 1;
            }
            Some(first..rest.start)
        })
    }
}

/// What is known of a triangle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Found {
    /// Free bins of one side.
    pub(super) bins: FreeBins,
    /// Sectors of the front and of the back; of one side only where there are bins.
    pub(super) sectors: [FreeSectors; 2],
}

/// Share of the directions of the front that are free, or beyond a level, in the mean of the
/// levels, from which on the back is not searched.
const ENOUGH: f64 = 1.0 / 8.0;

/// Decides the directions of some triangles, by rows of the order of the BVH.
pub(super) struct Decide<'a> {
    pub(super) around: &'a Surroundings<'a>,
    pub(super) rows: Range<usize>,
}

impl Kernel for Decide<'_> {
    type Output = Vec<Found>;
    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Vec<Found> {
        let mut search = Search { around: self.around, stack: Vec::new() };
        let mut decided = Vec::with_capacity(self.rows.len());
        for rows in self.around.coincident(self.rows) {
            let found = search.decide(s, rows.start);
            decided.extend(std::iter::repeat_n(found, rows.len()));
        }
        decided
    }
}

/// [`SECTORS`] in memory.
static BINS_OF: [BinSet; FREE_SECTORS] = SECTORS;

/// Bound of the rounding of squared distances in f32, as a factor: more than the square of a
/// distance by a thousand roundings.
const MORE: f32 = 1.0 + 1e-4;

/// A child that is still to be visited.
#[derive(Clone, Copy)]
struct Entry {
    child: u32,
    squared_gap: f32,
    bins: BinSet,
}

/// Searches for triangles one after the other, with a separate stack.
struct Search<'a> {
    around: &'a Surroundings<'a>,
    stack: Vec<Entry>,
}

/// The start triangle of a search, and what is not blocked so far.
struct State {
    /// Row of the triangle in the order of the BVH.
    row: usize,
    start: Start,
    /// Bins in which rays hit nothing at all.
    free: BinSet,
    /// For each level the bins of the sectors in which rays hit nothing within its distance.
    open: [BinSet; FreeSectors::LEVELS],
    /// Squared distances below which something may lie within a level.
    near: [f32; FreeSectors::LEVELS],
}

impl State {
    /// Bins that something at this distance can still block.
    #[inline(always)]
    fn blockable(&self, squared_gap: f32) -> BinSet {
        // What is open for a level is open for those below it.
        self.free | self.open.get(self.levels_below(squared_gap)).copied().unwrap_or_default()
    }

    /// Number of levels beyond whose distance something is.
    #[inline(always)]
    fn levels_below(&self, squared_gap: f32) -> usize {
        let mut levels = 0;
        for level in 0..FreeSectors::LEVELS {
            levels += usize::from(squared_gap >= self.near[level]);
        }
        levels
    }

    #[inline(always)]
    fn block(&mut self, bins: BinSet, squared_gap: f32) {
        self.free &= !bins;
        let first = self.levels_below(squared_gap);
        let mut met = self.open.get(first).map_or(0, |open| open & bins);
        while met != 0 {
            let sector = FreeSectors::of_bin(met.trailing_zeros() as usize);
            let sector = BINS_OF[sector.expect("open bins have sectors")];
            for level in first..FreeSectors::LEVELS {
                self.open[level] &= !sector;
            }
            met &= !sector;
        }
    }

    /// The levels of all sectors.
    fn sectors(&self) -> FreeSectors {
        (0..FREE_SECTORS).fold(FreeSectors(0), |all, sector| {
            let level = self.open.iter().rposition(|open| open & SECTORS[sector] != 0);
            all.with(sector, level.map_or(0, |level| level + 1))
        })
    }
}

impl Search<'_> {
    #[inline(always)]
    fn decide<S: Simd>(&mut self, s: S, row: usize) -> Found {
        if self.around.kept == Kept::Directions { self.one_side(s, row) } else { self.both_sides(s, row) }
    }

    /// The free bins and the sectors of a triangle's front, unless its back is far more open.
    #[inline(always)]
    fn one_side<S: Simd>(&mut self, s: S, row: usize) -> Found {
        let mut best = (Found::default(), 0.0);
        for is_back in [false, true] {
            let Some(state) = self.search(s, row, (is_back, FreeBins::ALL)) else { break };
            let beyond: f64 = state.open.iter().map(|open| share(*open)).sum();
            let value = share(state.free).max(beyond / FreeSectors::LEVELS as f64);
            if value > best.1 {
                let mut found = Found { bins: FreeBins(state.free), ..Found::default() };
                found.bins.0 |= if is_back { FreeBins::BACK } else { 0 };
                found.sectors[usize::from(is_back)] = state.sectors();
                best = (found, value);
            }
            if best.1 >= ENOUGH {
                break;
            }
        }
        best.0
    }

    /// The sectors of both sides of a triangle.
    #[inline(always)]
    fn both_sides<S: Simd>(&mut self, s: S, row: usize) -> Found {
        let mut found = Found::default();
        for is_back in [false, true] {
            if let Some(state) = self.search(s, row, (is_back, 0)) {
                found.sectors[usize::from(is_back)] = state.sectors();
            }
        }
        found
    }

    /// Decides what is known of one side of a triangle; `None` without axes. `free` are the bins
    /// that may turn out to be free.
    #[inline(always)]
    fn search<S: Simd>(&mut self, s: S, row: usize, (is_back, free): (bool, BinSet)) -> Option<State> {
        let corners = self.around.mesh.corners(self.around.order[row]);
        let frame = Frame::new(corners, is_back)?;
        let levels = self.around.levels;
        let mut state = State {
            row,
            start: Start::new(corners, &frame, is_back, if free == 0 { SMALL_FOR_SECTORS } else { SMALL }),
            free,
            open: levels.map(|distance| if distance > 0.0 { IN_SECTORS } else { 0 }),
            near: levels.map(|distance| distance * distance * MORE),
        };
        self.block_all(s, &mut state);
        Some(state)
    }

    /// Blocks the bins in which rays may hit a triangle of the mesh. The result does not depend on
    /// the order of the visits. Children are sorted by distance where distances alone are open,
    /// since near ones block these. Where a bin is still free, all in it must be visited, in any
    /// order.
    #[inline(always)]
    fn block_all<S: Simd>(&mut self, s: S, state: &mut State) {
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
            if state.free == 0 {
                nearest_last(&mut self.stack[first..]);
            }
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

/// Blocks the bins of a block's box in which rays may hit its triangles.
#[inline(always)]
fn search_block<S: Simd, const TOUCHES: bool>(s: S, block: &Block, bins: BinSet, state: &mut State) {
    let met = meet::<S, TOUCHES>(s, &state.start, block, bins);
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
