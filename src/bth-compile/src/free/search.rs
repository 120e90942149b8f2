//! The classes of the bins of triangles: a traversal of the BVH that stops at what no undecided shaft may meet.

use super::bins::{ALL_BINS, BinSet, CONES, Differences};
use super::shaft::{Corners, Shaft, Start};
use crate::bvh::BinaryBvh;
use bth_format::layout::{FREE_BINS, FreeClass, NONE};
use bth_import::Mesh;
use glam::DVec3;

/// What all searches of a mesh share.
pub(super) struct Surroundings<'a> {
    pub(super) mesh: &'a Mesh,
    pub(super) tree: &'a BinaryBvh,
    /// Boxes of the nodes.
    pub(super) boxes: Vec<[[f64; 3]; 2]>,
    /// Distance within which class [`FreeClass::Near`] promises that nothing is met.
    pub(super) reach: f64,
    /// Whether to decide what is free nearby on sides where no direction is free.
    pub(super) closed_sides: bool,
}

impl<'a> Surroundings<'a> {
    pub(super) fn new(mesh: &'a Mesh, tree: &'a BinaryBvh, reach: f32, closed_sides: bool) -> Self {
        let boxes = tree.nodes.iter().map(|node| [node.lower, node.upper].map(|p| p.map(f64::from)));
        Surroundings { mesh, tree, boxes: boxes.collect(), reach: f64::from(reach), closed_sides }
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
    /// Bins on the side of the normal, and on the other side.
    sides: [BinSet; 2],
    /// For each side the bins with directions whose sine of the angle with the triangle's plane is at most (i + 1) / 16.
    low: [[BinSet; LEVELS]; 2],
    /// Bins that nothing is known to block within the reach, and those that nothing is known to block.
    open: [BinSet; 2],
    /// Shafts that have been needed.
    shafts: Vec<(usize, Shaft)>,
}

/// Index of `open` and `blockers` within the reach, and for all distances.
const NEAR: usize = 0;
const ALL: usize = 1;

/// Levels of sines of angles.
const LEVELS: usize = 16;

/// The level of a sine; that of 1 for greater numbers and for what is no number.
#[inline]
fn level(sine: f64) -> usize {
    if sine < 1.0 { (sine.max(0.0) * LEVELS as f64) as usize } else { LEVELS - 1 }
}

impl State {
    fn new(mesh: &Mesh, triangle: u32) -> Self {
        let start = Start::new(mesh.corners(triangle));
        let (mut sides, mut low) = ([0; 2], [[0; LEVELS]; 2]);
        for (bin, cone) in CONES.iter().enumerate() {
            let side = match start.side(cone) {
                1 => 0,
                -1 => 1,
                _ => continue,
            };
            sides[side] |= 1 << bin;
            let first = level(start.elevation(cone)).saturating_sub(1);
            low[side][first..].iter_mut().for_each(|bins| *bins |= 1 << bin);
        }
        State { start, triangle, sides, low, open: [sides[0] | sides[1]; 2], shafts: Vec::new() }
    }

    /// Bins that a triangle or node of this distance can still block.
    #[inline]
    fn blockable(&self, is_near: bool) -> BinSet {
        if is_near { self.open[NEAR] } else { self.open[ALL] }
    }

    /// The bins in which something can be met that is `heights` high on the two sides and at least `distance` away: in others rays
    /// are higher by then.
    #[inline]
    fn below(&self, heights: [f64; 2], distance: f64) -> BinSet {
        let mut bins = 0;
        for side in 0..2 {
            if heights[side] > 0.0 {
                bins |= self.low[side][level(heights[side] / distance)];
            }
        }
        bins
    }

    fn block(&mut self, bin: usize, is_near: bool) {
        self.open[ALL] &= !(1 << bin);
        if is_near {
            self.open[NEAR] &= !(1 << bin);
        }
    }

    /// Gives up the sides on which everything is blocked: rays that go on into a solid are rare.
    fn leave_closed_sides(&mut self) {
        for side in self.sides {
            if self.open[ALL] & side == 0 {
                self.open[NEAR] &= !side;
            }
        }
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

/// Some triangle that a ray meets at no less than a distance, rounded as it may be.
fn cast(around: &Surroundings<'_>, origin: [f64; 3], direction: [f64; 3], distance: f64) -> Option<u32> {
    let [origin, direction] = [origin, direction].map(DVec3::from);
    let least = distance / direction.length();
    let inverse = direction.recip();
    let mut stack = vec![0];
    while let Some(node) = stack.pop() {
        let [lower, upper] = around.boxes[node as usize].map(|p| (DVec3::from(p) - origin) * inverse);
        let (enter, leave) = (lower.min(upper).max_element(), lower.max(upper).min_element());
        let below = &around.tree.nodes[node as usize];
        // False where a component is no number, too: nothing depends on what is found.
        if !(enter.max(least) <= leave) {
            continue;
        }
        if !below.is_leaf() {
            stack.extend([below.right, node + 1]);
            continue;
        }
        let triangle = around.tree.order[below.first as usize];
        let [a, b, c] = crate::vectors::corners(around.mesh, triangle).map(|p| p - origin);
        let sides = [direction.dot(b.cross(c)), direction.dot(c.cross(a)), direction.dot(a.cross(b))];
        let t = a.dot(b.cross(c)) / (sides[0] + sides[1] + sides[2]);
        if (sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0)) && t >= least {
            return Some(triangle);
        }
    }
    None
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
            if row == node.first {
                self.find_blockers(&mut state, greatest_side(&around.boxes[subtree as usize]));
            }
            if !around.closed_sides {
                state.leave_closed_sides();
            }
            states.push(state);
        }
        let from = &around.boxes[subtree as usize];
        let (mut open, mut stack) = (open_of(&states), vec![(0, 0.0, ALL_BINS)]);
        while let Some((node, squared_gap, parent_bins)) = stack.pop() {
            let differences = Differences::new(from, &around.boxes[node as usize]);
            let bins = parent_bins & open[usize::from(!self.is_near(squared_gap))];
            let bins = if bins == 0 { 0 } else { differences.bins(bins) };
            if bins == 0 {
                continue;
            }
            let below = &around.tree.nodes[node as usize];
            if below.is_leaf() || greatest_side(&around.boxes[node as usize]) <= greatest_side(from) {
                for state in &mut states {
                    self.search(state, node, bins);
                }
                open = open_of(&states);
                continue;
            }
            let gap = |child: u32| Differences::new(from, &around.boxes[child as usize]).squared_gap();
            let mut children = [node + 1, below.right].map(|child| (child, gap(child), bins));
            // The nearer child is popped first.
            children.sort_by(|a, b| b.1.total_cmp(&a.1));
            stack.extend(children);
        }
        for (row, state) in rows.zip(states) {
            decided(row, state.classes());
        }
    }

    /// Blocks those of the bins of a start triangle whose shafts triangles of a subtree may meet.
    fn search(&mut self, state: &mut State, subtree: u32, bins: BinSet) {
        self.push(state, subtree, bins);
        while let Some(Entry { node, squared_gap, bins }) = self.stack.pop() {
            if bins & state.blockable(self.is_near(squared_gap)) == 0 {
                continue;
            }
            let below = &self.around.tree.nodes[node as usize];
            if below.is_leaf() {
                for row in below.first..below.first + below.count {
                    self.meet(state, self.around.tree.order[row as usize], bins);
                }
                continue;
            }
            let first = self.stack.len();
            self.push(state, node + 1, bins);
            self.push(state, below.right, bins);
            if self.stack.len() == first + 2 && self.stack[first].squared_gap < self.stack[first + 1].squared_gap {
                self.stack.swap(first, first + 1);
            }
        }
    }

    #[inline]
    fn is_near(&self, squared_gap: f64) -> bool {
        squared_gap < self.around.reach * self.around.reach * (1.0 + 1e-12)
    }

    /// Blocks bins by what blocked them before.
    fn ask_blockers(&mut self, state: &mut State) {
        for which in [NEAR, ALL] {
            for bin in 0..FREE_BINS {
                let blocker = self.blockers[which][bin];
                if blocker != NONE && state.open[which] >> bin & 1 == 1 {
                    self.meet(state, blocker, 1 << bin);
                }
            }
        }
    }

    /// Finds for bins that are still open a blocker by a ray through the middle of the bin, at least `distance` away, so that it is
    /// likely to block the bin for triangles nearby, too.
    fn find_blockers(&mut self, state: &mut State, distance: f64) {
        for bin in 0..FREE_BINS {
            if state.open[ALL] >> bin & 1 == 0 {
                continue;
            }
            let corners = &CONES[bin].corners;
            let middle = std::array::from_fn(|k| (corners[0][k] + corners[2][k]) / 2.0);
            if let Some(blocker) = cast(self.around, state.start.corners.center, middle, distance) {
                self.blockers[ALL][bin] = blocker;
                self.meet(state, blocker, 1 << bin);
            }
        }
    }

    /// Pushes a node that may block some of the bins `of` its parent.
    #[inline]
    fn push(&mut self, state: &State, node: u32, of: BinSet) {
        let bounds = &self.around.boxes[node as usize];
        let differences = Differences::new(&state.start.corners.bounds, bounds);
        let squared_gap = differences.squared_gap();
        let open = of & state.blockable(self.is_near(squared_gap));
        if open == 0 {
            return;
        }
        let open = open & state.below(state.start.heights_of_box(bounds), squared_gap.sqrt());
        if open == 0 {
            return;
        }
        let bins = differences.bins(open);
        if bins != 0 {
            self.stack.push(Entry { node, squared_gap, bins });
        }
    }

    /// Blocks those of the bins `of` its leaf whose shafts another triangle may meet.
    fn meet(&mut self, state: &mut State, triangle: u32, of: BinSet) {
        if triangle == state.triangle {
            return;
        }
        let other = Corners::new(self.around.mesh.corners(triangle));
        let differences = Differences::new(&state.start.corners.bounds, &other.bounds);
        let squared_gap = differences.squared_gap();
        let is_near = self.is_near(squared_gap);
        // The leaf holds this triangle alone, so that its box has been asked for.
        let mut bins = of & state.blockable(is_near);
        if bins == 0 {
            return;
        }
        let distance = squared_gap.sqrt().max(state.start.corners.gap(&other));
        bins &= state.below(state.start.heights_of(&other), distance);
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
