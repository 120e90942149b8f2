//! The classes of the bins of triangles: a traversal of the BVH that stops at what no undecided shaft may meet.

use super::bins::{ALL_BINS, BinSet, CONES, Differences};
use super::shaft::{Corners, Shaft, Start};
use crate::bvh::BinaryBvh;
use bth_format::layout::{FREE_BINS, FreeClass, NONE, free_bin};
use bth_import::Mesh;

/// What all searches of a mesh share.
pub(super) struct Surroundings<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) tree: &'a BinaryBvh,
    /// Boxes of the nodes.
    pub(super) boxes: Vec<[[f64; 3]; 2]>,
    /// Distance within which class [`FreeClass::Near`] promises that nothing is met.
    pub(super) reach: f64,
}

impl<'a> Surroundings<'a> {
    pub(super) fn new(mesh: &'a Mesh, tree: &'a BinaryBvh, reach: f32) -> Self {
        let boxes = tree.nodes.iter().map(|node| [node.lower, node.upper].map(|p| p.map(f64::from)));
        Surroundings { mesh, tree, boxes: boxes.collect(), reach: f64::from(reach) }
    }
}

/// Searches for the triangles of a part of the mesh, one after the other: what blocked a bin of one triangle often blocks it for the
/// next one.
pub(super) struct Search<'a> {
    around: &'a Surroundings<'a>,
    /// For each bin a triangle that blocked it before, within the reach or at all; `NONE` if there is none.
    blockers: [[u32; FREE_BINS]; 2],
    stack: Vec<Entry>,
}

/// A node that is still to be visited.
struct Entry {
    node: u32,
    /// Lower bound of the squared distance from the start triangle.
    squared_gap: f64,
    /// Bins whose shafts may meet the node's box.
    bins: BinSet,
}

/// The start triangle of a search, and what is not blocked so far.
struct State {
    start: Start,
    triangle: u32,
    center: [f64; 3],
    /// Bins on the side of the normal, and on the other side.
    sides: [BinSet; 2],
    /// Bins that nothing is known to block within the reach, and those that nothing is known to block.
    open: [BinSet; 2],
    /// Shafts that have been needed.
    shafts: Vec<(usize, Shaft)>,
}

/// Index of `open` and `blockers` within the reach, and for all distances.
const NEAR: usize = 0;
const ALL: usize = 1;

impl State {
    fn new(mesh: &Mesh, triangle: u32) -> Self {
        let start = Start::new(mesh.corners(triangle));
        let mut sides = [0; 2];
        for (bin, cone) in CONES.iter().enumerate() {
            match start.side(cone) {
                1 => sides[0] |= 1 << bin,
                -1 => sides[1] |= 1 << bin,
                _ => {}
            }
        }
        let center = start.corners.center();
        State { start, triangle, center, sides, open: [sides[0] | sides[1]; 2], shafts: Vec::new() }
    }

    /// Bins that a triangle or node of this distance can still block.
    #[inline]
    fn blockable(&self, is_near: bool) -> BinSet {
        if is_near { self.open[NEAR] } else { self.open[ALL] }
    }

    /// The bins of those sides on which something lies.
    #[inline]
    fn on_sides(&self, [above, below]: [bool; 2]) -> BinSet {
        (if above { self.sides[0] } else { 0 }) | (if below { self.sides[1] } else { 0 })
    }

    fn block(&mut self, bin: usize, is_near: bool) {
        self.open[ALL] &= !(1 << bin);
        if is_near {
            self.open[NEAR] &= !(1 << bin);
        }
    }

    /// The bin in which a center of a triangle lies as seen from the start triangle's, and the squared distance.
    #[inline]
    fn bin_of(&self, center: [f64; 3]) -> (usize, f64) {
        let d: [f64; 3] = std::array::from_fn(|k| center[k] - self.center[k]);
        (free_bin(d.map(|x| x as f32)), d.iter().map(|x| x * x).sum())
    }

    /// What has become of the bins.
    fn classes(&self) -> [FreeClass; FREE_BINS] {
        std::array::from_fn(|bin| {
            let is_open = |which: usize| self.open[which] >> bin & 1 == 1;
            match (is_open(ALL), is_open(NEAR)) {
                (true, _) => FreeClass::All,
                (false, true) => FreeClass::Near,
                (false, false) => FreeClass::Unknown,
            }
        })
    }

    fn shaft(&mut self, bin: usize) -> usize {
        match self.shafts.iter().position(|(of, _)| *of == bin) {
            Some(at) => at,
            None => {
                let side = if self.sides[0] >> bin & 1 == 1 { 1 } else { -1 };
                self.shafts.push((bin, Shaft::new(&self.start, &CONES[bin], side)));
                self.shafts.len() - 1
            }
        }
    }
}

/// Bins that are open for any of the start triangles.
fn open_of(states: &[State]) -> [BinSet; 2] {
    states.iter().fold([0; 2], |[near, all], state| [near | state.open[NEAR], all | state.open[ALL]])
}

/// Length of the longest side of a box.
fn greatest_side([lower, upper]: &[[f64; 3]; 2]) -> f64 {
    (0..3).fold(0.0, |most: f64, k| most.max(upper[k] - lower[k]))
}

impl<'a> Search<'a> {
    pub(super) fn new(around: &'a Surroundings<'a>) -> Self {
        Search { around, blockers: [[NONE; FREE_BINS]; 2], stack: Vec::new() }
    }

    /// Decides the bins of the triangles of a subtree. `decided` is called with the row of `order` and the classes of each.
    ///
    /// Where the box of a subtree is no larger than that of all start triangles, it is searched for each of these by itself. Down to
    /// there the box of the start triangles stands for all: most of what is far away is left out for all of them together.
    pub(super) fn decide(&mut self, subtree: u32, decided: &mut impl FnMut(u32, [FreeClass; FREE_BINS])) {
        let around = self.around;
        let node = &around.tree.nodes[subtree as usize];
        let rows = node.first..node.first + node.count;
        let mut states: Vec<State> = Vec::with_capacity(node.count as usize);
        for row in rows.clone() {
            let mut state = State::new(around.mesh, around.tree.order[row as usize]);
            self.ask_blockers(&mut state);
            states.push(state);
        }
        let from = &around.boxes[subtree as usize];
        let (mut open, mut stack) = (open_of(&states), vec![(0, 0.0)]);
        while let Some((node, squared_gap)) = stack.pop() {
            let differences = Differences::new(from, &around.boxes[node as usize]);
            let bins = open[usize::from(!self.is_near(squared_gap))];
            if bins == 0 || differences.bins(bins) == 0 {
                continue;
            }
            let below = &around.tree.nodes[node as usize];
            if below.is_leaf() || greatest_side(&around.boxes[node as usize]) <= greatest_side(from) {
                for state in &mut states {
                    self.search(state, node);
                }
                open = open_of(&states);
                continue;
            }
            let gap = |child: u32| Differences::new(from, &around.boxes[child as usize]).squared_gap();
            let mut children = [node + 1, below.right].map(|child| (child, gap(child)));
            // The nearer child is popped first.
            children.sort_by(|a, b| b.1.total_cmp(&a.1));
            stack.extend(children);
        }
        for (row, state) in rows.zip(states) {
            decided(row, state.classes());
        }
    }

    /// Blocks the bins of a start triangle whose shafts triangles of a subtree may meet.
    fn search(&mut self, state: &mut State, subtree: u32) {
        self.push(state, subtree);
        while let Some(Entry { node, squared_gap, bins }) = self.stack.pop() {
            if bins & state.blockable(self.is_near(squared_gap)) == 0 {
                continue;
            }
            let below = &self.around.tree.nodes[node as usize];
            if below.is_leaf() {
                for row in below.first..below.first + below.count {
                    self.meet(state, self.around.tree.order[row as usize]);
                }
                continue;
            }
            let first = self.stack.len();
            self.push(state, node + 1);
            self.push(state, below.right);
            if self.stack.len() == first + 2 && self.stack[first].squared_gap < self.stack[first + 1].squared_gap {
                self.stack.swap(first, first + 1);
            }
        }
    }

    #[inline]
    fn is_near(&self, squared_gap: f64) -> bool {
        squared_gap < self.around.reach * self.around.reach * (1.0 + 1e-12)
    }

    /// Blocks bins by what blocked them before, where a ray from center to center proves it.
    fn ask_blockers(&self, state: &mut State) {
        for which in [NEAR, ALL] {
            for bin in 0..FREE_BINS {
                let blocker = self.blockers[which][bin];
                if blocker == NONE || blocker == state.triangle || state.open[which] >> bin & 1 == 0 {
                    continue;
                }
                let center = Corners::new(self.around.mesh.corners(blocker)).center();
                let (seen_in, squared_distance) = state.bin_of(center);
                let is_near = self.is_near(squared_distance);
                if seen_in == bin && (is_near || which == ALL) {
                    state.block(bin, is_near);
                }
            }
        }
    }

    /// Pushes a node that may block bins.
    #[inline]
    fn push(&mut self, state: &State, node: u32) {
        let bounds = &self.around.boxes[node as usize];
        let differences = Differences::new(&state.start.corners.bounds, bounds);
        let squared_gap = differences.squared_gap();
        let open = state.blockable(self.is_near(squared_gap)) & state.on_sides(state.start.sides_of_box(bounds));
        if open == 0 {
            return;
        }
        let bins = differences.bins(open);
        if bins != 0 {
            self.stack.push(Entry { node, squared_gap, bins });
        }
    }

    /// Blocks the bins whose shafts another triangle may meet.
    fn meet(&mut self, state: &mut State, triangle: u32) {
        if triangle == state.triangle {
            return;
        }
        let other = Corners::new(self.around.mesh.corners(triangle));
        let differences = Differences::new(&state.start.corners.bounds, &other.bounds);
        let is_near = self.is_near(differences.squared_gap());
        let mut bins = state.blockable(is_near) & state.on_sides(state.start.sides_of(&other));
        if bins == 0 {
            return;
        }
        bins &= differences.bins(bins);
        while bins != 0 {
            let bin = bins.trailing_zeros() as usize;
            bins &= bins - 1;
            let shaft = state.shaft(bin);
            if !state.shafts[shaft].1.certainly_misses(&state.start, &other) {
                state.block(bin, is_near);
                self.blockers[ALL][bin] = triangle;
                if is_near {
                    self.blockers[NEAR][bin] = triangle;
                }
            }
        }
    }
}

const _: () = assert!(ALL_BINS.count_ones() == FREE_BINS as u32);
