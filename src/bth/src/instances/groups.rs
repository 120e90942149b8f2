//! Groups: instances that are placed as a whole, to any depth. Each has a separate top level in its
//! space, over its rows: instances of objects and of groups before it.
//!
//! Queries number instances as if all groups were written out: the rows of the world in order, in
//! the place of the row of a group the rows of the group. The transform of such an instance is the
//! product of the transforms on the way to it, from the world inwards, each product rounded to f64.
//! With it, an instance is what it would be in a scene without groups.

use super::group_row::{GroupRow, group_in};
use super::placement::{PartBoxes, Placement, PlacementError, Unplaceable};
use super::stored::StoredRows;
use super::top_level::TopLevel;
use super::top_nodes::used;
use crate::intersect::vector::max_norm;
use crate::nodes::affine::{Accuracy, Affine, Inverse};
use crate::objects::Objects;
use bth_format::layout::{NONE, Object};
use bth_format::limits::MAX_PATH;
use std::ops::Range;
use std::sync::Arc;
use zerocopy::FromZeros;

/// Up to this bound of the condition number of a product, it is not computed.
const SAFE_CONDITION: f64 = (1u64 << 23) as f64;
/// Max number of products beyond [`SAFE_CONDITION`] that are tried: a small file may have billions.
const MAX_PRODUCTS: usize = 1 << 22;
/// 2^-44: bounds the roundings of products of up to sixteen transforms, each at most 2^-50 relative
/// to the norms of its factors.
const PRODUCT_ERROR: f64 = 1.0 / (1u64 << 44) as f64;

/// A group, or the world.
#[derive(Debug, Default)]
pub(super) struct NodeGroup {
    /// Its rows, ascending; none if they are in a tree of the file.
    pub(super) rows: Vec<u32>,
    /// Its rows in a tree of the file.
    stored: Range<u32>,
    /// The tree over its rows; not of the world, which has its own.
    pub(super) top: TopLevel,
    /// Number of instances once groups are written out.
    pub(super) count: u32,
    /// Its box, and boxes that contain all of it; `None` if nothing in it is visible.
    boxes: Option<Box<(Object, PartBoxes)>>,
    /// Max |coordinate| that a point of it may have on the way from its object: a bound of sums of
    /// norms of products.
    pub(super) magnitude: f64,
    /// Bound of the condition numbers of the products of transforms in it.
    pub(super) condition: f64,
    changed: bool,
}

impl NodeGroup {
    /// Bound of how far instances of the group are off in its space, for a transform to the world
    /// with this inverse: their transforms are rounded products.
    pub(super) fn off(&self, inverse: &Inverse, accuracy: Accuracy) -> f64 {
        PRODUCT_ERROR * (accuracy.condition() * self.magnitude + inverse.norm() * max_norm(inverse.origin))
    }

    /// The same in the world.
    pub(super) fn off_in_world(&self, to_world: &Affine) -> f64 {
        PRODUCT_ERROR * (to_world.norm() * self.magnitude + max_norm(to_world.translation))
    }
}

/// Where a walk is: in a group, or in the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct Level {
    group: usize,
    /// The transform to the world, if it is a group.
    to_world: Option<Affine>,
    /// Number of its first instance.
    first: u32,
}

/// What a row of a level shows.
pub(super) struct Shown {
    /// The transform to the world.
    pub(super) to_world: Affine,
    pub(super) content: RowContent,
}

pub(super) enum RowContent {
    /// An instance of an object: its number, and the object.
    Instance(u32, u32),
    Group(Level),
}

/// The rows on the way to an instance: the first in the world, the last of the object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InstancePath {
    rows: [u32; MAX_PATH as usize],
    levels: usize,
}

impl InstancePath {
    /// The path of an instance that is not in a group.
    pub(crate) fn of_row(row: u32) -> InstancePath {
        let mut path = InstancePath::default();
        path.push(row);
        path
    }

    fn push(&mut self, row: u32) {
        self.rows[self.levels] = row;
        self.levels += 1;
    }
}

impl std::ops::Deref for InstancePath {
    type Target = [u32];
    fn deref(&self) -> &[u32] {
        &self.rows[..self.levels]
    }
}

/// An instance found by its number.
pub(super) struct FoundInstance {
    pub(super) path: InstancePath,
    pub(super) to_world: Affine,
    pub(super) object: u32,
}

/// The groups of a scene.
#[derive(Debug, Default)]
pub(crate) struct Groups {
    /// The rows in trees of the file.
    stored: Option<Arc<StoredRows>>,
    /// The rows behind them.
    rows: Vec<GroupRow>,
    /// Groups before those that show them, the world last.
    groups: Vec<NodeGroup>,
}

/// What a row shows, and the number of the group in which it is; `NONE` for the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct RowPlace {
    pub(crate) object: u32,
    pub(crate) within: u32,
}

impl Groups {
    /// Rows in a number of groups, not yet placed; each only shows groups with a lower number than
    /// that in which it is. `None` if there are too many instances once they are written out, or
    /// too many on the way to one.
    pub(super) fn new(places: impl Iterator<Item = RowPlace>, count: u32) -> Option<Groups> {
        let mut groups = Groups::default();
        groups.groups.resize_with(count as usize + 1, NodeGroup::default);
        groups.add(places, count).then_some(groups)
    }

    /// The `count` groups of a file with trees; `places` are the rows that no tree holds. `None` as
    /// in [`Self::new`].
    pub(super) fn of_file(
        stored: &Arc<StoredRows>,
        places: impl Iterator<Item = RowPlace>,
        count: u32,
    ) -> Option<Groups> {
        let mut groups = Groups { stored: Some(Arc::clone(stored)), ..Groups::default() };
        groups.groups.resize_with(count as usize + 1, NodeGroup::default);
        groups.groups.iter_mut().for_each(|group| group.top.first_row = stored.rows());
        for (group, tree) in groups.groups.iter_mut().zip(stored.trees()) {
            *group = NodeGroup {
                stored: tree.first_row..tree.first_row.saturating_add(tree.rows),
                top: TopLevel::stored(stored.file(), tree),
                count: tree.instances,
                magnitude: tree.magnitude,
                condition: tree.condition,
                ..NodeGroup::default()
            };
        }
        if !groups.add(places, count) {
            return None;
        }
        for shown in groups.rows.iter().filter_map(|row| group_in(row.object)) {
            let group = &mut groups.groups[shown];
            if group.boxes.is_none() && !group.stored.is_empty() {
                group.boxes = group.boxes_of_top();
            }
        }
        Some(groups)
    }

    /// Adds rows to groups, and counts the instances. Returns false if there are too many.
    fn add(&mut self, places: impl Iterator<Item = RowPlace>, count: u32) -> bool {
        let (base, groups) = (self.first_row(), self);
        for RowPlace { object, within } in places {
            let row = base + groups.rows.len() as u32;
            groups.rows.push(GroupRow {
                to_outer: Affine::IDENTITY,
                object,
                first: 0,
                visible: false,
                moved: true,
                was_visible: false,
            });
            if object != NONE {
                groups.groups[within.min(count) as usize].rows.push(row);
            }
        }
        let mut levels = vec![0; groups.groups.len()];
        for number in 0..groups.groups.len() {
            let (before, group) = groups.groups.split_at_mut(number);
            for row in &group[0].rows {
                let row = &mut groups.rows[(*row - base) as usize];
                row.first = group[0].count;
                let (instances, below) = match group_in(row.object) {
                    Some(shown) => (before[shown].count, levels[shown]),
                    None => (1, 0),
                };
                levels[number] = levels[number].max(below + 1);
                let Some(sum) = group[0].count.checked_add(instances).filter(|sum| *sum < NONE) else {
                    return false;
                };
                group[0].count = sum;
            }
        }
        levels.iter().all(|levels| *levels <= MAX_PATH)
    }

    /// Number of rows in trees of the file, which come before the others.
    fn first_row(&self) -> u32 {
        self.stored.as_ref().map_or(0, |stored| stored.rows())
    }

    /// A row.
    #[inline(always)]
    fn row(&self, row: u32) -> &GroupRow {
        match &self.stored {
            Some(stored) if row < stored.rows() => stored.row(row),
            _ => &self.rows[(row - self.first_row()) as usize],
        }
    }

    /// Number of instances once groups are written out.
    pub(super) fn count(&self) -> u32 {
        self.groups.last().map_or(0, |world| world.count)
    }

    pub(super) fn group(&self, level: &Level) -> &NodeGroup {
        &self.groups[level.group]
    }

    /// The groups, the world last.
    pub(super) fn each(&self) -> &[NodeGroup] {
        &self.groups
    }

    /// The rows of the world.
    pub(super) fn world_rows(&self) -> &[u32] {
        self.groups.last().map_or(&[], |world| &world.rows)
    }

    /// The world as a level.
    pub(super) fn world(&self) -> Level {
        Level { group: self.groups.len() - 1, to_world: None, first: 0 }
    }

    /// Returns true if a row shows a group.
    pub(super) fn shows_group(&self, row: u32) -> bool {
        group_in(self.row(row).object).is_some()
    }

    /// Notes how a row is to be placed. Rows of objects are placed by the caller.
    pub(super) fn stage(&mut self, row: u32, to_outer: &Affine, visible: bool) {
        let row = (row - self.first_row()) as usize;
        let row = &mut self.rows[row];
        (row.to_outer, row.visible, row.moved) = (*to_outer, visible, true);
    }

    /// Notes that all rows have to be placed again.
    pub(super) fn stage_all(&mut self) {
        self.rows.iter_mut().for_each(|row| row.moved = true);
    }

    /// Notes that a row of an object has been placed again.
    pub(super) fn touch(&mut self, row: u32) {
        let row = (row - self.first_row()) as usize;
        self.rows[row].moved = true;
    }

    /// What a row of a level shows.
    #[inline(always)]
    pub(super) fn show(&self, level: &Level, row: u32) -> Shown {
        let row = self.row(row);
        let to_world = match &level.to_world {
            Some(outer) => outer.times(&row.to_outer),
            None => row.to_outer,
        };
        let first = level.first + row.first;
        let content = match group_in(row.object) {
            Some(group) => RowContent::Group(Level { group, to_world: Some(to_world), first }),
            None => RowContent::Instance(first, row.object),
        };
        Shown { to_world, content }
    }

    /// Finds an instance by its number, which is below [`Self::count`].
    pub(super) fn find(&self, instance: u32) -> FoundInstance {
        let (mut level, mut path) = (self.world(), InstancePath::default());
        let stored = self.stored.as_ref().map_or(&[][..], |stored| stored.instances());
        let in_trees = self.first_row();
        let first_of = |row: u32| match row < in_trees {
            true => stored[row as usize].first,
            false => self.rows[(row - in_trees) as usize].first,
        };
        loop {
            let group = self.group(&level);
            // Of rows with the same number all but the last show empty groups.
            let (mut first, mut end) = (0, group.len());
            while end - first > 1 {
                let middle = first + (end - first) / 2;
                match level.first + first_of(group.row(middle)) <= instance {
                    true => first = middle,
                    false => end = middle,
                }
            }
            let row = group.row(first);
            path.push(row);
            let Shown { to_world, content } = self.show(&level, row);
            match content {
                RowContent::Instance(_, object) => return FoundInstance { path, to_world, object },
                RowContent::Group(inner) => level = inner,
            }
        }
    }

    /// Places the rows of groups after rows have been staged, from the inmost outwards: only groups
    /// in which something has moved, and the rows that show them. Returns true if other rows of the
    /// world are visible than before. `max_cost` is the ratio of costs from which on trees are
    /// built again.
    pub(super) fn update(
        &mut self,
        objects: &Objects,
        placements: &mut [Option<Placement>],
        max_cost: f64,
    ) -> Result<bool, Unplaceable> {
        let (mut same_visible, world) = (true, self.groups.len() - 1);
        let first_row = self.first_row();
        for number in 0..self.groups.len() {
            let (before, group) = self.groups.split_at_mut(number);
            let group = &mut group[0];
            (same_visible, group.changed) = (true, false);
            for &row in &group.rows {
                let at = (row - first_row) as usize;
                let (data, placement) = (&mut self.rows[at], &mut placements[at]);
                if let Some(shown) = group_in(data.object) {
                    if !(data.moved || before[shown].changed) {
                        continue;
                    }
                    *placement = None;
                    if let Some((header, parts)) = before[shown].boxes.as_deref().filter(|_| data.visible) {
                        let placed = Placement::new(&data.to_outer, shown as u32, header, parts);
                        *placement = Some(placed.map_err(|error| Unplaceable { instance: row, error })?);
                    }
                } else if !data.moved {
                    continue;
                }
                same_visible &= data.was_visible == placement.is_some();
                (data.moved, data.was_visible, group.changed) = (false, placement.is_some(), true);
            }
            // The tree of a group without rows is empty.
            if group.changed {
                group.measure(objects, (&self.rows, before, first_row), placements);
                if number != world {
                    group.place(placements, same_visible, max_cost);
                }
            }
        }
        match self.first_singular(placements, (&self.world(), 1.0), &mut MAX_PRODUCTS.clone()) {
            Some(instance) => Err(Unplaceable { instance, error: PlacementError::Singular }),
            None => Ok(same_visible),
        }
    }

    /// The first row below a level whose product of transforms cannot be inverted, or at which the
    /// number of products left to try is 0; `condition` is the level's.
    fn first_singular(
        &self,
        placements: &[Option<Placement>],
        (level, condition): (&Level, f64),
        left: &mut usize,
    ) -> Option<u32> {
        let (group, first_row) = (self.group(level), self.first_row());
        for row in (0..group.len()).map(|i| group.row(i)) {
            let accuracy = match row.checked_sub(first_row) {
                Some(at) => placements[at as usize].as_ref().map(|placement| placement.accuracy),
                None => Some(self.row(row))
                    .filter(|row| row.visible)
                    .and_then(|row| Some(row.to_outer.inverse()?.1)),
            };
            let Some(accuracy) = accuracy else { continue };
            let shown = group_in(self.row(row).object);
            let inner = shown.map_or(1.0, |group| self.groups[group].condition);
            if condition * accuracy.condition() * inner <= SAFE_CONDITION {
                continue;
            }
            let Shown { to_world, content } = self.show(level, row);
            let Some((_, accuracy)) = to_world.inverse().filter(|_| *left > 0) else { return Some(row) };
            *left -= 1;
            if let RowContent::Group(inner) = content {
                let singular = self.first_singular(placements, (&inner, accuracy.condition()), left);
                if singular.is_some() {
                    return singular;
                }
            }
        }
        None
    }

    /// The placement of a row in a tree of the file, with its box; `None` if it is not visible.
    pub(super) fn box_of_stored(&self, objects: &Objects, row: u32) -> Option<Placement> {
        let GroupRow { to_outer, object, visible, .. } = self.row(row);
        if !visible {
            return None;
        }
        match group_in(*object) {
            Some(shown) => {
                let (header, parts) = *self.groups[shown].boxes_of_top()?;
                Placement::new(to_outer, shown as u32, &header, &parts).ok()
            }
            None => {
                let header = objects.header(*object);
                let parts = PartBoxes::whole(header, objects.anchor(*object));
                Placement::new(to_outer, *object, header, &parts).ok()
            }
        }
    }

    /// Bytes on the heap.
    pub(super) fn bytes(&self) -> usize {
        let group = |group: &NodeGroup| {
            size_of::<NodeGroup>()
                + size_of_val(group.rows.as_slice())
                + group.top.bytes()
                + group.boxes.as_ref().map_or(0, |boxes| size_of_val(boxes.as_ref()))
        };
        size_of_val(self.rows.as_slice()) + self.groups.iter().map(group).sum::<usize>()
    }
}

impl NodeGroup {
    /// Number of rows.
    fn len(&self) -> u32 {
        if self.stored.is_empty() { self.rows.len() as u32 } else { self.stored.end - self.stored.start }
    }

    /// Row `i` of the group.
    fn row(&self, i: u32) -> u32 {
        if self.stored.is_empty() { self.rows[i as usize] } else { self.stored.start + i }
    }

    /// Computes the bounds of what is in the group. The groups before are known.
    fn measure(
        &mut self,
        objects: &Objects,
        (rows, before, first_row): (&[GroupRow], &[NodeGroup], u32),
        placements: &[Option<Placement>],
    ) {
        (self.magnitude, self.condition) = (0.0, 1.0);
        for &row in &self.rows {
            let at = (row - first_row) as usize;
            let Some(placement) = &placements[at] else { continue };
            let GroupRow { to_outer, object, .. } = &rows[at];
            let (magnitude, condition) = match group_in(*object) {
                Some(group) => (before[group].magnitude, before[group].condition),
                None => {
                    let header = objects.header(*object);
                    let [lower, upper] = [header.lower, header.upper].map(|end| max_norm(end.map(f64::from)));
                    (lower.max(upper) + max_norm(objects.anchor(*object)), 1.0)
                }
            };
            let outer = to_outer.norm() * magnitude + max_norm(to_outer.translation);
            self.magnitude = self.magnitude.max(outer * (1.0 + PRODUCT_ERROR));
            self.condition = self.condition.max(condition * placement.accuracy.condition());
        }
    }

    /// Refits or builds the tree over the rows.
    fn place(&mut self, placements: &[Option<Placement>], same_visible: bool, max_cost: f64) {
        if same_visible {
            self.top.refit(placements, Some(&self.rows));
        }
        if !same_visible || self.top.cost_ratio() > max_cost {
            self.top.build(placements, Some(&self.rows));
        }
        self.boxes = self.boxes_of_top();
    }

    /// The boxes of the root of the tree; `None` if nothing is visible.
    fn boxes_of_top(&self) -> Option<Box<(Object, PartBoxes)>> {
        if self.top.is_empty() {
            return None;
        }
        let (mut header, nodes) = (Object::new_zeroed(), self.top.nodes());
        let root = nodes.node(0);
        for k in 0..3 {
            header.lower[k] = root.bounds[k][0].iter().fold(f32::MAX, |least, x| least.min(*x));
            header.upper[k] = root.bounds[k][1].iter().fold(f32::MIN, |most, x| most.max(*x));
        }
        let parts = PartBoxes::new(used(root), &root.bounds, [0.0; 3]);
        Some(Box::new((header, parts)))
    }
}
