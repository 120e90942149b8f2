//! The free bins of a triangle: a traversal of the BVH that stops at what no open bin may see.

use super::boxes::{Boxes, TRIANGLE, Viewer, WIDTH};
use super::frame::{BinSet, Frame, SHARES, bins_of_slopes};
use super::shaft::{Corners, Shaft, Start};
use crate::bvh::BinaryBvh;
use bth_format::layout::{FREE_BINS, FreeBins, NONE};
use bth_import::Mesh;

/// What all searches of a mesh share.
pub(super) struct Surroundings<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) tree: &'a BinaryBvh,
    pub(super) boxes: Boxes,
    /// Distance within which [`FreeBins::NEARBY`] promises that nothing is met.
    pub(super) reach: f64,
}

/// Boxes and triangles whose size, relative to their distance, is at most this block the bins in which they may be seen, without proof
/// that they are met: six degrees.
const SMALL: f32 = 1.0 / 10.0;
/// Share of the directions of the front from which on the back is not searched.
const ENOUGH: f64 = 1.0 / 8.0;
/// What is free at all is kept unless this many times as much is free nearby.
const GAIN_OF_NEARBY: f64 = 2.0;

/// Index of `open` within the reach, and for all distances.
const NEAR: usize = 0;
const ALL: usize = 1;

/// A child that is still to be visited.
#[derive(Clone, Copy)]
struct Entry {
    child: u32,
    squared_gap: f32,
    bins: BinSet,
}

/// Searches for triangles one after the other, with memory of its own.
pub(super) struct Search<'a> {
    around: &'a Surroundings<'a>,
    stack: Vec<Entry>,
}

/// The start triangle of a search, and what is not blocked so far.
struct State {
    triangle: u32,
    start: Start,
    frame: Frame,
    /// 1 for the front, -1 for the back.
    side: i32,
    open: [BinSet; 2],
    /// Shafts that have been needed, and where each bin's is; 0xff where it has not.
    shafts: Vec<Shaft>,
    shaft_of: [u8; FREE_BINS],
}

impl State {
    /// Whether rays in the directions of a bin certainly miss another triangle.
    fn certainly_misses(&mut self, bin: usize, other: &Corners) -> bool {
        let mut at = usize::from(self.shaft_of[bin]);
        if at == 0xff {
            at = self.shafts.len();
            self.shaft_of[bin] = at as u8;
            self.shafts.push(Shaft::new(&self.start, &self.frame.cone(bin), self.side));
        }
        self.shafts[at].certainly_misses(&self.start, other)
    }

    fn block(&mut self, bins: BinSet, is_near: bool) {
        self.open[ALL] &= !bins;
        if is_near {
            self.open[NEAR] &= !bins;
        }
    }
}

/// Share of the cosine-weighted directions of a side that some bins hold.
pub(super) fn share(mut bins: BinSet) -> f64 {
    let mut sum = 0.0;
    while bins != 0 {
        sum += SHARES[bins.trailing_zeros() as usize];
        bins &= bins - 1;
    }
    sum
}

impl<'a> Search<'a> {
    pub(super) fn new(around: &'a Surroundings<'a>) -> Self {
        Search { around, stack: Vec::new() }
    }

    /// The free bins of a triangle, on its front unless its back is far more open.
    pub(super) fn decide(&mut self, triangle: u32) -> FreeBins {
        let front = self.decide_side(triangle, false);
        if front.1 >= ENOUGH {
            return front.0;
        }
        let back = self.decide_side(triangle, true);
        if back.1 > front.1 { back.0 } else { front.0 }
    }

    /// The free bins of a side and their share.
    fn decide_side(&mut self, triangle: u32, is_back: bool) -> (FreeBins, f64) {
        let corners = self.around.mesh.corners(triangle);
        let Some(frame) = Frame::new(corners, is_back) else { return (FreeBins(0), 0.0) };
        let mut state = State {
            triangle,
            start: Start::new(corners),
            frame,
            side: if is_back { -1 } else { 1 },
            open: [FreeBins::ALL; 2],
            shafts: Vec::new(),
            shaft_of: [0xff; FREE_BINS],
        };
        self.search(&mut state);
        let [near, all] = state.open.map(share);
        let side = if is_back { FreeBins::BACK } else { 0 };
        if self.around.reach > 0.0 && all * GAIN_OF_NEARBY < near {
            (FreeBins(state.open[NEAR] | side | FreeBins::NEARBY), near)
        } else if state.open[ALL] != 0 {
            (FreeBins(state.open[ALL] | side), all)
        } else {
            (FreeBins(0), 0.0)
        }
    }

    #[inline]
    fn is_near(&self, squared_gap: f32) -> bool {
        f64::from(squared_gap) < self.around.reach * self.around.reach * (1.0 + 1e-4)
    }

    /// Bins that something at this distance can still block.
    #[inline]
    fn blockable(&self, state: &State, squared_gap: f32) -> BinSet {
        state.open[if self.is_near(squared_gap) { NEAR } else { ALL }]
    }

    /// Blocks the bins in which a triangle of the mesh may be met.
    fn search(&mut self, state: &mut State) {
        let around = self.around;
        if around.boxes.nodes.is_empty() {
            return;
        }
        let viewer = Viewer::new(&around.boxes, &state.frame, state.start.corners.stored);
        self.stack.clear();
        self.stack.push(Entry { child: 0, squared_gap: 0.0, bins: FreeBins::ALL });
        while let Some(Entry { child, squared_gap, bins }) = self.stack.pop() {
            let bins = bins & self.blockable(state, squared_gap);
            if bins == 0 {
                continue;
            }
            if child & TRIANGLE != 0 {
                self.meet(state, around.tree.order[(child & !TRIANGLE) as usize], bins);
                continue;
            }
            let node = &around.boxes.nodes[child as usize];
            let seen = viewer.see(node);
            let first = self.stack.len();
            for lane in 0..WIDTH {
                let child = node.child[lane];
                if child == NONE {
                    break;
                }
                let squared_gap = seen.squared_gap[lane];
                let of_child = seen.bins(lane) & bins & self.blockable(state, squared_gap);
                if of_child == 0 {
                    continue;
                }
                if seen.squared_size[lane] <= SMALL * SMALL * squared_gap {
                    state.block(of_child, self.is_near(squared_gap));
                    continue;
                }
                self.stack.push(Entry { child, squared_gap, bins: of_child });
            }
            // The nearest is popped first.
            self.stack[first..].sort_by(|a, b| b.squared_gap.total_cmp(&a.squared_gap));
        }
    }

    /// Blocks those of the bins `of` its box in which another triangle may be met.
    fn meet(&mut self, state: &mut State, triangle: u32, of: BinSet) {
        if triangle == state.triangle {
            return;
        }
        let other = Corners::new(self.around.mesh.corners(triangle));
        if !state.start.is_below(&other, state.side) {
            return;
        }
        let (slopes, squared_gap) = slopes(state, &other);
        let mut bins = of & bins_of_slopes(slopes[0], slopes[1]) & self.blockable(state, squared_gap);
        if bins != 0
            && let Some((away, error)) = state.start.plane_of(&other)
        {
            bins &= !state.frame.bins_along(away, error);
        }
        let is_near = self.is_near(squared_gap);
        while bins != 0 {
            let bin = bins.trailing_zeros() as usize;
            bins &= bins - 1;
            if !state.certainly_misses(bin, &other) {
                state.block(1 << bin, is_near);
            }
        }
    }
}

/// Slopes between which points of another triangle, above the plane of the start triangle, are seen from the latter, and a lower bound
/// of the squared distance between both.
fn slopes(state: &State, other: &Corners) -> ([[f32; 2]; 2], f32) {
    /// More than the relative error of a few roundings of f64 and one to f32.
    const SLACK: f64 = 1.0 / (1 << 20) as f64;
    let corners = state.start.corners.at.map(|p| state.frame.local(p));
    let points = other.at.map(|p| state.frame.local(p));
    let largest =
        points.iter().flatten().chain(corners.iter().flatten()).fold(0.0, |m: f64, x| m.max(x.abs()));
    let slack = SLACK * largest + 1e-12 * state.frame.origin.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let range = |k: usize| {
        let of = |points: &[[f64; 3]; 3], pick: fn(f64, f64) -> f64| {
            pick(pick(points[0][k], points[1][k]), points[2][k])
        };
        let start = if k == 2 { [0.0; 2] } else { [of(&corners, f64::min), of(&corners, f64::max)] };
        [of(&points, f64::min) - start[1] - slack, of(&points, f64::max) - start[0] + slack]
    };
    let ranges = [range(0), range(1), range(2)];
    let gap = ranges.iter().map(|[least, most]| least.max(-most).max(0.0).powi(2)).sum::<f64>();
    let [near, far] = ranges[2].map(|z| 1.0 / z.max(1e-300));
    let slope = |[least, most]: [f64; 2]| {
        [(least * near).min(least * far).max(-1e6) as f32, (most * near).max(most * far).min(1e6) as f32]
    };
    ([slope(ranges[0]), slope(ranges[1])], (gap * (1.0 - SLACK)) as f32)
}
