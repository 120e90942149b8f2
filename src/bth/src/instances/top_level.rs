//! The top-level BVH over the instances of a scene: 16 children per node, built by midpoint splits.
//! Where instances only move, its boxes can be computed again in the same nodes ([`super::refit`]).
//!
//! Sixteen instances or fewer become the children of one node. Splitting them further would give
//! nodes with two or three children, whose empty slots cost memory and time.

use super::placement::{Placement, RowBox};
use super::top_nodes::{CostRatio, INSTANCE, InstanceBounds, TopNodes, TreeLines, node_mut, put_bounds};
use bth_format::file::File;
use bth_format::layout::{CacheLine, NODE_LINES, NONE, Tree, WIDTH, WideNode, kind};
use bth_format::limits::MAX_DEPTH;
use bth_format::object::ObjectBounds;
use glam::Vec4;

/// The boxes are built for rays whose origin has at most this factor times the max
/// |coordinate| of the instances' boxes. For rays from farther away they are widened during
/// traversal, see [`TopLevel::origin_slack`].
const REACH: f32 = 4.0;

/// The top-level BVH.
#[derive(Debug, Default)]
pub(crate) struct TopLevel {
    /// The nodes, the root first and parents before their children, aligned to cache lines like the
    /// nodes of objects. The child code of a node is the index of its first line. The child code of
    /// an instance is [`INSTANCE`] and its index.
    pub(super) lines: TreeLines,
    /// Max |coordinate| of the instances' boxes.
    pub(crate) extent: f32,
    /// For rays whose origin has a |coordinate| greater than this, the boxes are widened by
    /// `origin_slack` times that
    /// |coordinate|.
    pub(crate) reach: f32,
    /// Max [`RowBox::origin_slack`] of the instances.
    pub(crate) origin_slack: f32,
    /// The cube that holds all boxes in the nodes, for the preparation of rays.
    pub(super) cube: ObjectBounds,
    /// Number of levels of nodes.
    pub(crate) depth: u32,
    pub(super) cost: CostRatio,
    /// The row of the first placement: the rows before are in trees of the file.
    pub(super) first_row: u32,
}

/// From this level on, ranges are halved by their number of instances: instances whose distances
/// differ by hundreds of powers of two would otherwise make a tree that is deeper than stacks
/// allow. Each of the levels below at least halves the up to 2^30 instances.
const HALVED_LEVEL: u32 = MAX_DEPTH as u32 - 28;

/// From this number of visible instances on, the subtrees of the root are built by several threads.
#[cfg(feature = "rayon")]
const MIN_PARALLEL: usize = 4096;

/// A visible instance, while the BVH is built.
#[derive(Clone, Copy, Debug)]
struct BuildItem {
    /// Its world box, widened for rays from within the reach. In the unused number of the lower end
    /// are the bits of its index.
    bounds: InstanceBounds,
}

/// Bits of the smallest normal number. Indices of instances are below 2^30, so their sum is far
/// below the bits of infinity.
const LEAST_NORMAL: u32 = f32::MIN_POSITIVE.to_bits();

impl BuildItem {
    fn new(mut bounds: InstanceBounds, instance: u32) -> BuildItem {
        // Neither a denormal number, with which arithmetic may be slow, nor a NaN, whose bits might
        // not survive a copy.
        bounds.lower.w = f32::from_bits(instance + LEAST_NORMAL);
        BuildItem { bounds }
    }
    fn instance(&self) -> u32 {
        self.bounds.lower.w.to_bits() - LEAST_NORMAL
    }
}

/// A range of the items from which a node is built.
#[derive(Clone, Copy, Debug)]
struct ItemRange {
    first: u32,
    end: u32,
    bounds: InstanceBounds,
    /// For each axis twice the min coordinate of the items' centres, negated.
    least: Vec4,
    /// For each axis twice the max coordinate of the items' centres.
    greatest: Vec4,
}

impl ItemRange {
    /// A range without items that begins at `first`.
    fn empty(first: u32) -> ItemRange {
        let none = Vec4::NEG_INFINITY;
        ItemRange { first, end: first, bounds: InstanceBounds::EMPTY, least: none, greatest: none }
    }

    fn of(first: u32, items: &[BuildItem]) -> ItemRange {
        let mut range = ItemRange::empty(first);
        range.end += items.len() as u32;
        items.iter().for_each(|item| range.enclose(&item.bounds, Vec4::INFINITY));
        range
    }

    /// Enlarges the boxes for an item if `limit` is infinite, and leaves them as they are if it is
    /// negative infinity.
    #[inline(always)]
    fn enclose(&mut self, bounds: &InstanceBounds, limit: Vec4) {
        let center = bounds.upper - bounds.lower;
        self.bounds.lower = self.bounds.lower.max(bounds.lower.min(limit));
        self.bounds.upper = self.bounds.upper.max(bounds.upper.min(limit));
        self.greatest = self.greatest.max(center.min(limit));
        self.least = self.least.max((-center).min(limit));
    }

    fn len(&self) -> u32 {
        self.end - self.first
    }
}

/// A node whose children are not yet determined.
#[derive(Clone, Copy, Debug)]
struct BuildTask {
    node: u32,
    /// Level in the BVH; 1 for the root.
    level: u32,
    range: ItemRange,
}

impl TopLevel {
    /// Builds the BVH over the visible instances, or over the visible ones of some rows.
    pub(crate) fn build(&mut self, placements: &[Option<Placement>], rows: Option<&[u32]>) {
        self.build_over(PlacedRows { placements, rows, first: self.first_row });
    }

    /// Builds the BVH over rows.
    pub(super) fn build_over(&mut self, rows: impl VisibleRows) {
        // There is rarely more than one node for every seven instances.
        let count = rows.max_count();
        let mut lines = match std::mem::take(&mut self.lines) {
            TreeLines::Own(lines) => lines,
            TreeLines::Stored(..) => Vec::new(),
        };
        lines.clear();
        lines.reserve_exact((count / 7 + 1) * NODE_LINES);
        self.depth = 0;
        self.measure(&rows);
        let mut items = Vec::with_capacity(count);
        rows.for_each(|row, of| items.push(BuildItem::new(self.bounds_of(&of), row)));
        drop(rows);
        self.build_from(&mut lines, &mut items);
        self.cost = CostRatio::of_new(&lines);
        self.lines = TreeLines::Own(lines);
    }

    /// A tree that a file holds.
    pub(super) fn stored(file: &File, tree: &Tree) -> TopLevel {
        let section = file.section(NONE, kind::TREE_LINES).map_or(0..0, |section| {
            let first = section.entry.offset as usize + tree.first_line as usize * size_of::<CacheLine>();
            first..first + tree.lines as usize * size_of::<CacheLine>()
        });
        let mut top = TopLevel {
            lines: TreeLines::Stored(file.clone(), section),
            extent: tree.extent,
            origin_slack: tree.origin_slack,
            depth: tree.depth,
            ..TopLevel::default()
        };
        top.set_reach();
        top
    }

    /// Sets what rays need to know about all boxes.
    pub(super) fn measure(&mut self, rows: &impl VisibleRows) {
        let (mut extent, mut origin_slack) = (0.0f32, 0.0f32);
        rows.for_each(|_, of| {
            origin_slack = origin_slack.max(of.origin_slack);
            for k in 0..3 {
                let greater = of.upper[k].abs().max(of.lower[k].abs());
                extent = extent.max(greater);
            }
        });
        (self.extent, self.origin_slack) = (extent, origin_slack);
        self.set_reach();
    }

    /// Sets what follows from the extent and the slack.
    fn set_reach(&mut self) {
        self.reach = REACH * self.extent;
        self.cube = ObjectBounds::around(self.greatest_coordinate());
    }

    /// The world box of a row, widened for rays from within the reach.
    pub(super) fn bounds_of(&self, of: &RowBox) -> InstanceBounds {
        let pad = (of.origin_slack * self.reach).next_up();
        let (mut lower, mut upper) = ([0.0; 4], [0.0; 4]);
        for k in 0..3 {
            lower[k] = -((of.lower[k] - pad).next_down().max(f32::MIN));
            upper[k] = (of.upper[k] + pad).next_up().min(f32::MAX);
        }
        InstanceBounds { lower: Vec4::from_array(lower), upper: Vec4::from_array(upper) }
    }

    fn build_from(&mut self, lines: &mut Vec<CacheLine>, items: &mut [BuildItem]) {
        if items.is_empty() {
            return;
        }
        let range = ItemRange::of(0, items);
        #[cfg(feature = "rayon")]
        if items.len() >= MIN_PARALLEL {
            return self.build_in_parallel(lines, items, range);
        }
        self.depth = build_subtree(lines, items, range, 1);
    }

    /// Builds the root, and the subtrees of its children in parallel.
    #[cfg(feature = "rayon")]
    fn build_in_parallel(&mut self, all: &mut Vec<CacheLine>, items: &mut [BuildItem], range: ItemRange) {
        use rayon::iter::{IntoParallelIterator, ParallelIterator};
        let mut ranges = [range; WIDTH];
        let count = split_into(items, &mut ranges, false);
        // The ranges follow each other, once sorted.
        let mut order: Vec<u64> =
            (0..count).map(|slot| u64::from(ranges[slot].first) << 32 | slot as u64).collect();
        order.sort_unstable();
        let (mut rest, mut tasks) = (items, Vec::new());
        for slot in order.into_iter().map(|key| key as u32 as usize) {
            let (items, others) = rest.split_at_mut(ranges[slot].len() as usize);
            rest = others;
            tasks.push((slot, items, ItemRange { first: 0, end: ranges[slot].len(), ..ranges[slot] }));
        }
        let subtrees: Vec<_> = tasks
            .into_par_iter()
            .map(|(slot, items, range)| {
                let mut lines = Vec::with_capacity((items.len() / 7 + 1) * NODE_LINES);
                let depth = build_subtree(&mut lines, items, range, 2);
                (slot, lines, depth)
            })
            .collect();
        let root = add_node(all);
        for (slot, lines, depth) in subtrees {
            let first = all.len() as u32;
            put(all, root, slot, first, &ranges[slot].bounds);
            self.depth = self.depth.max(depth);
            all.extend_from_slice(&lines);
            for lines in all[first as usize..].chunks_exact_mut(NODE_LINES) {
                for code in node_mut(lines).child.iter_mut().filter(|code| **code & INSTANCE == 0) {
                    *code += first;
                }
            }
        }
    }

    /// The nodes.
    #[inline(always)]
    pub(crate) fn nodes(&self) -> TopNodes<'_> {
        self.lines.nodes()
    }

    /// The lines of the nodes of a tree that was built.
    pub(super) fn into_lines(self) -> Vec<CacheLine> {
        match self.lines {
            TreeLines::Own(lines) => lines,
            TreeLines::Stored(..) => Vec::new(),
        }
    }

    /// Returns true if no instance is visible.
    pub(crate) fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// Max |coordinate| of the boxes in the nodes.
    pub(crate) fn greatest_coordinate(&self) -> f32 {
        (self.extent + self.origin_slack * self.reach).next_up().next_up()
    }

    /// Bytes on the heap.
    pub(crate) fn bytes(&self) -> usize {
        match &self.lines {
            TreeLines::Own(lines) => lines.capacity() * size_of::<CacheLine>(),
            TreeLines::Stored(..) => 0,
        }
    }
}

/// The visible rows over which a tree is built.
pub(super) trait VisibleRows {
    /// Calls `visit` with each row and its box.
    fn for_each(&self, visit: impl FnMut(u32, RowBox));
    /// Number of rows, or more.
    fn max_count(&self) -> usize;
}

/// The visible ones of all rows that are placed, or of some.
pub(super) struct PlacedRows<'a> {
    pub(super) placements: &'a [Option<Placement>],
    pub(super) rows: Option<&'a [u32]>,
    /// The row of the first placement.
    pub(super) first: u32,
}

impl VisibleRows for PlacedRows<'_> {
    fn for_each(&self, mut visit: impl FnMut(u32, RowBox)) {
        let mut visit = |row: u32, placement: &Option<Placement>| {
            placement.iter().for_each(|placement| visit(row, placement.row_box()));
        };
        match self.rows {
            None => (0..).zip(self.placements).for_each(|(row, placement)| visit(row, placement)),
            Some(rows) => {
                rows.iter().for_each(|&row| visit(row, &self.placements[(row - self.first) as usize]));
            }
        }
    }

    fn max_count(&self) -> usize {
        self.rows.map_or(self.placements.len(), <[u32]>::len)
    }
}

/// Rows with their boxes.
impl VisibleRows for Vec<(u32, RowBox)> {
    fn for_each(&self, mut visit: impl FnMut(u32, RowBox)) {
        self.iter().for_each(|(row, of)| visit(*row, *of));
    }

    fn max_count(&self) -> usize {
        self.len()
    }
}

/// Adds the nodes over a range of the items to `lines`, the root first, which is on a given level;
/// returns the max level.
fn build_subtree(lines: &mut Vec<CacheLine>, items: &mut [BuildItem], range: ItemRange, level: u32) -> u32 {
    let mut depth = level;
    let mut tasks = vec![BuildTask { node: add_node(lines), level, range }];
    while let Some(BuildTask { node, level, range }) = tasks.pop() {
        depth = depth.max(level);
        if range.len() <= WIDTH as u32 {
            for (slot, item) in items[range.first as usize..range.end as usize].iter().enumerate() {
                put(lines, node, slot, INSTANCE | item.instance(), &item.bounds);
            }
            continue;
        }
        let mut ranges = [range; WIDTH];
        let count = split_into(items, &mut ranges, level >= HALVED_LEVEL);
        for (slot, range) in ranges[..count].iter().enumerate() {
            let child = add_node(lines);
            put(lines, node, slot, child, &range.bounds);
            tasks.push(BuildTask { node: child, level: level + 1, range: *range });
        }
    }
    depth
}

/// Adds a node without children; returns its code.
fn add_node(lines: &mut Vec<CacheLine>) -> u32 {
    const LINES: [CacheLine; NODE_LINES] = zerocopy::transmute!(EMPTY);
    let code = lines.len();
    lines.extend_from_slice(&LINES);
    code as u32
}

/// Stores a child in a slot of a node.
fn put(lines: &mut [CacheLine], node: u32, slot: usize, code: u32, bounds: &InstanceBounds) {
    let node = node_mut(&mut lines[node as usize..][..NODE_LINES]);
    node.child[slot] = code;
    put_bounds(node, slot, bounds);
}

/// Splits the first range into up to 16, always the range of largest area among the ranges with
/// more items than a node has children. Returns the number of ranges. With `halved` they are split
/// by number, not by place.
fn split_into(items: &mut [BuildItem], ranges: &mut [ItemRange; WIDTH], halved: bool) -> usize {
    let priority =
        |range: &ItemRange| if range.len() > WIDTH as u32 { range.bounds.area() } else { f64::NEG_INFINITY };
    let mut areas = [f64::NEG_INFINITY; WIDTH];
    areas[0] = priority(&ranges[0]);
    let mut count = 1;
    while count < WIDTH {
        let largest = (0..count).fold(0, |best, i| if areas[i] > areas[best] { i } else { best });
        if areas[largest] == f64::NEG_INFINITY {
            break;
        }
        let (left, right) = split(items, ranges[largest], halved);
        (ranges[largest], areas[largest]) = (left, priority(&left));
        (ranges[count], areas[count]) = (right, priority(&right));
        count += 1;
    }
    count
}

/// Splits a range of at least two items at the middle of their centres, along the axis on which the
/// centres have the largest extent. If all centres lie on one side, or if `halved` is set, the
/// range is halved.
fn split(items: &mut [BuildItem], range: ItemRange, halved: bool) -> (ItemRange, ItemRange) {
    let items = &mut items[range.first as usize..range.end as usize];
    // Differences may overflow to infinity, which is then the max extent.
    let spread = (range.greatest + range.least).to_array();
    let axis = (0..3).fold(0, |best, k| if spread[k] > spread[best] { k } else { best });
    let middle = (range.greatest / 2.0 - range.least / 2.0).to_array()[axis];
    // Lanes other than the axis are compared with a number that is greater than none.
    let mut limits = [f32::NEG_INFINITY; 4];
    limits[axis] = middle;
    let limits = Vec4::from_array(limits);
    let (mut left, mut right) = (ItemRange::empty(range.first), ItemRange::empty(0));
    let mut count = 0;
    for i in 0..items.len() {
        let item = items[i];
        let is_left = (item.bounds.upper - item.bounds.lower).cmplt(limits).any();
        // There are no branches, because on which side an item lies is not predictable.
        items[i] = items[count];
        items[count] = item;
        count += usize::from(is_left);
        let limit = Vec4::splat(if is_left { f32::INFINITY } else { f32::NEG_INFINITY });
        left.enclose(&item.bounds, limit);
        right.enclose(&item.bounds, -limit);
    }
    if halved || count == 0 || count == items.len() {
        let half = items.len() / 2;
        return (
            ItemRange::of(range.first, &items[..half]),
            ItemRange::of(range.first + half as u32, &items[half..]),
        );
    }
    left.end = range.first + count as u32;
    (right.first, right.end) = (left.end, range.end);
    (left, right)
}

/// A node without children.
const EMPTY: WideNode =
    WideNode { bounds: [[[f32::MAX; WIDTH], [f32::MIN; WIDTH]]; 3], child: [NONE; WIDTH] };

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instances::top_nodes::node;

    #[test]
    fn subtrees_on_deep_levels_are_halved_and_stay_within_the_depth_of_stacks() {
        // Each instance is twice as far away as the one before, a hundred times over.
        let place = |i: u32| Vec4::splat((0.5f32).powi(i as i32 / 100) * (i % 100 + 1) as f32);
        let items: Vec<BuildItem> = (0..10_000)
            .map(|i| BuildItem::new(InstanceBounds { lower: -place(i), upper: place(i) }, i))
            .collect();
        for (level, most) in [(1, HALVED_LEVEL), (HALVED_LEVEL, MAX_DEPTH as u32 - 10)] {
            let (mut items, mut lines) = (items.clone(), Vec::new());
            let range = ItemRange::of(0, &items);
            assert!(build_subtree(&mut lines, &mut items, range, level) <= most);
            let mut found: Vec<u32> = lines
                .chunks_exact(NODE_LINES)
                .flat_map(|lines| node(lines).child)
                .filter(|code| *code != NONE && code & INSTANCE != 0)
                .collect();
            found.sort_unstable();
            assert!(found.into_iter().eq((0..10_000).map(|i| i | INSTANCE)));
        }
    }
}
