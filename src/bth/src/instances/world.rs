//! The instances of a scene, as queries see them. A file with scene sections ([`super::by_file`])
//! or the caller of a scene builder ([`super::by_caller`]) places them.

use super::groups::{Groups, InstancePath};
use super::placement::{PartBoxes, Placement, PlacementError, Unplaceable};
use super::stored::StoredRows;
use super::top_level::TopLevel;
use crate::animation::Animation;
use crate::clock;
use crate::nodes::affine::Affine;
use crate::nodes::hierarchy::NodeHierarchy;
use crate::objects::Objects;
use crate::update::Update;
use bth_format::SceneView;
use bth_format::file::File;
use bth_format::layout::NONE;
use std::borrow::Cow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

/// The top level is built again if its expected cost would exceed this multiple of the cost when it
/// was built. See `docs/decisions.md`.
const MAX_COST_RATIO: f64 = 1.5;

/// An instance: its object, its node, and its transform to world space. A row may show a group, or
/// be in one; its transform then leads to the group's space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InstanceRow {
    /// Index of the object; `NONE` if the instance was removed. For a group
    /// [`object_of_group`](super::object_of_group).
    pub(crate) object: u32,
    /// The group in which it is, or `NONE`.
    pub(crate) within: u32,
    /// Index of the node in the file of the object, or `NONE`.
    pub(crate) node: u32,
    pub(crate) to_world: Affine,
}

/// An instance as it is to be.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NewInstance {
    pub(crate) row: InstanceRow,
    pub(crate) visible: bool,
}

impl NewInstance {
    /// No instance.
    pub(super) const VACANT: NewInstance = NewInstance {
        row: InstanceRow { object: NONE, within: NONE, node: NONE, to_world: Affine::IDENTITY },
        visible: false,
    };
}

/// The scene sections of a scene that is a file with such sections.
pub(super) fn scene_of(objects: &Objects) -> SceneView<'_> {
    objects.sole_file().and_then(File::scene).expect("a file with scene sections, checked when it was opened")
}

/// The placement of an instance; `None` if it is not visible.
pub(super) type PlaceResult = Result<Option<Placement>, PlacementError>;

/// The instances as the caller has placed them in the last commit.
#[derive(Debug, Default)]
pub(super) struct CallerInstances {
    pub(super) rows: Vec<NewInstance>,
    /// Number of groups.
    pub(super) groups: u32,
    /// Memory for the placements of a commit.
    pub(super) placed: Vec<PlaceResult>,
}

impl CallerInstances {
    /// Bytes on the heap.
    pub(super) fn bytes(&self) -> usize {
        self.rows.capacity() * size_of::<NewInstance>() + self.placed.capacity() * size_of::<PlaceResult>()
    }
}

/// Where the transforms of instances come from.
#[derive(Debug)]
pub(super) enum TransformSource {
    /// The node hierarchy of the file.
    File(NodeHierarchy),
    /// The caller.
    Caller(CallerInstances),
}

/// The instances of a scene at a time.
#[derive(Debug)]
pub(crate) struct World {
    /// Time of the scene; 0 if the caller places the instances.
    pub(crate) seconds: f64,
    pub(super) source: TransformSource,
    /// For each instance its placement; `None` if it is not visible. With groups for each row, in
    /// the space of its group. Rows in trees of the file come before and have none.
    pub(crate) placements: Vec<Option<Placement>>,
    /// The rows in trees of the file.
    pub(super) stored: Option<Arc<StoredRows>>,
    /// The tree over the instances; with groups, over the rows of the world.
    pub(crate) top: TopLevel,
    /// The groups, if there are any.
    groups: Option<Box<Groups>>,
    /// The only visible instance, if there is exactly one.
    only_visible: Option<u32>,
    /// For each object whether a ray has been traced in it.
    pub(super) traced: Vec<AtomicBool>,
    /// For each object the boxes from which the world boxes of its instances are computed, once
    /// they were needed.
    parts: Vec<OnceLock<Box<PartBoxes>>>,
    /// What moves the vertices of objects.
    pub(crate) animation: Animation,
}

impl World {
    /// Instances that are not placed yet, of `objects` objects.
    pub(super) fn unplaced(source: TransformSource, seconds: f64, instances: usize, objects: u32) -> World {
        let (placements, top, only_visible) = (vec![None; instances], TopLevel::default(), None);
        let mut world = World {
            seconds,
            source,
            placements,
            stored: None,
            top,
            groups: None,
            only_visible,
            traced: Vec::new(),
            parts: Vec::new(),
            animation: Animation::default(),
        };
        world.add_objects(objects);
        world
    }

    /// No instances yet; the caller will place them.
    pub(crate) fn empty() -> World {
        World::unplaced(TransformSource::Caller(CallerInstances::default()), 0.0, 0, 0)
    }

    /// Instances with given placements. Their transforms are the identity unless
    /// [`Self::set_transforms`] sets them.
    #[cfg(test)]
    pub(crate) fn with_placements(placements: Vec<Option<Placement>>, objects: u32) -> World {
        let mut world = World::empty();
        world.add_objects(objects);
        world.placements = placements;
        world.set_transforms(&[]);
        world.build_top();
        world
    }

    /// Sets the transforms from objects to the world, which place nothing.
    #[cfg(test)]
    pub(super) fn set_transforms(&mut self, transforms: &[Affine]) {
        let row = |(i, placement): (usize, &Option<Placement>)| NewInstance {
            visible: placement.is_some(),
            row: InstanceRow {
                object: placement.as_ref().map_or(0, Placement::object),
                within: NONE,
                node: 0,
                to_world: transforms.get(i).copied().unwrap_or(Affine::IDENTITY),
            },
        };
        let rows = self.placements.iter().enumerate().map(row).collect();
        if let TransformSource::Caller(caller) = &mut self.source {
            caller.rows = rows;
        }
    }

    /// Makes the number of objects `count`.
    pub(crate) fn add_objects(&mut self, count: u32) {
        self.traced.resize_with(count as usize, || AtomicBool::new(false));
        self.parts.resize_with(count as usize, OnceLock::new);
    }

    /// Places an instance of an object; `None` if the object has no triangles. `inlined`: it is
    /// compiled inside of a kernel.
    ///
    /// The boxes of the root's children give a tighter world box than the object's box. They are
    /// used only if they are in memory already: reading the root of every mapped object would take
    /// longer than the tighter boxes save.
    #[inline(always)]
    pub(super) fn place(
        &self,
        objects: &Objects,
        object: u32,
        to_world: &Affine,
        inlined: bool,
    ) -> Result<Option<Placement>, PlacementError> {
        let header = objects.header(object);
        if header.root == NONE {
            return Ok(None);
        }
        let whole;
        let cached = &self.parts[object as usize];
        let parts = match cached.get() {
            Some(parts) => parts,
            None => match objects.unchecked_view(object).filter(|_| self.is_in_memory(objects, object)) {
                Some(view) => cached.get_or_init(|| Box::new(PartBoxes::of_root_children(view))),
                None => {
                    whole = PartBoxes::whole(header, objects.anchor(object));
                    &whole
                }
            },
        };
        let placement = match inlined {
            true => Placement::inlined(to_world, object, header, parts),
            false => Placement::new(to_world, object, header, parts),
        };
        placement.map(Some)
    }

    /// Returns true if the root of an object can be read without waiting for the disk.
    fn is_in_memory(&self, objects: &Objects, object: u32) -> bool {
        self.is_traced(object) || !objects.is_mapped(object)
    }

    /// Forgets the boxes of objects that have new positions.
    pub(crate) fn forget_parts(&mut self, objects: &[u32]) {
        for object in objects {
            self.parts[*object as usize].take();
        }
    }

    /// Places all visible instances of some objects again, whose boxes have changed, and refits or
    /// builds the top level.
    ///
    /// # Errors
    /// The first instance that cannot be placed. No instance is changed then.
    pub(crate) fn place_again(&mut self, objects: &Objects, changed: &[u32]) -> Result<Update, Unplaceable> {
        self.forget_parts(changed);
        self.place_stored(objects)?;
        let mut placed = Vec::new();
        for (instance, placement) in self.placements.iter().enumerate() {
            let instance = instance as u32;
            let Some(object) = placement.as_ref().map(Placement::object) else { continue };
            let shows_group = self.groups().is_some_and(|groups| groups.shows_group(instance));
            if !shows_group && changed.contains(&object) {
                let to_world = self.row_in_group(objects, instance).to_world;
                let placement = self.place(objects, object, &to_world, false);
                placed.push((instance, placement.map_err(|error| Unplaceable { instance, error })?));
            }
        }
        let mut update = Update { placed: placed.len(), visible: self.visible(), ..Update::default() };
        for (instance, placement) in &mut placed {
            std::mem::swap(&mut self.placements[*instance as usize], placement);
        }
        if update.placed > 0 {
            let touched = || placed.iter().map(|(instance, _)| *instance);
            if let Err(failed) = self.update_groups(objects, touched()) {
                for (instance, placement) in &placed {
                    self.placements[*instance as usize] = *placement;
                }
                self.place_groups_again(objects);
                return Err(failed);
            }
            self.update_top(true, &mut update);
        }
        Ok(update)
    }

    /// Sets the groups, whose rows are not yet placed.
    pub(super) fn set_groups(&mut self, groups: Groups) {
        self.groups = Some(Box::new(groups));
    }

    /// The groups, if there are any.
    #[inline(always)]
    pub(crate) fn groups(&self) -> Option<&Groups> {
        self.groups.as_deref()
    }

    /// The groups, to stage rows.
    pub(super) fn groups_mut(&mut self) -> Option<&mut Groups> {
        self.groups.as_deref_mut()
    }

    /// Places the rows of groups after rows were staged; `touched` are rows of objects that were
    /// placed again where they were. Returns true if other rows of the world are visible than
    /// before; without groups it is not known, and true.
    pub(super) fn update_groups(
        &mut self,
        objects: &Objects,
        touched: impl Iterator<Item = u32>,
    ) -> Result<bool, Unplaceable> {
        let Some(groups) = &mut self.groups else { return Ok(true) };
        touched.for_each(|row| groups.touch(row));
        groups.update(objects, &mut self.placements, MAX_COST_RATIO)
    }

    /// Places all rows of groups again, after an error: the rows of objects are as they were.
    pub(super) fn place_groups_again(&mut self, objects: &Objects) {
        if let Some(groups) = &mut self.groups {
            groups.stage_all();
            let _ = groups.update(objects, &mut self.placements, 0.0);
            self.build_top();
        }
    }

    /// Number of visible instances.
    pub(super) fn visible(&self) -> usize {
        let stored = self.stored.as_ref().map_or(0, |stored| stored.visible());
        stored + self.placements.iter().flatten().count()
    }

    /// Number of rows in trees of the file. They come before the others.
    pub(super) fn first_row(&self) -> u32 {
        self.stored.as_ref().map_or(0, |stored| stored.rows())
    }

    /// Number of rows.
    pub(crate) fn row_count(&self) -> usize {
        self.first_row() as usize + self.placements.len()
    }

    /// The placement of an instance in a tree of the file, in a world without groups.
    #[inline(never)]
    pub(super) fn stored_placement(&self, instance: u32) -> Option<&Placement> {
        self.stored.as_ref()?.placement(instance)
    }

    /// Returns true if a row is visible, whatever shows its group.
    fn shows(&self, row: u32) -> bool {
        match &self.stored {
            Some(stored) if row < stored.rows() => stored.row(row).visible,
            _ => self.placements[(row - self.first_row()) as usize].is_some(),
        }
    }

    /// Refits the top level if the same instances are visible and its cost permits, else builds it.
    pub(super) fn update_top(&mut self, same_visible: bool, update: &mut Update) {
        let start = clock::now();
        if same_visible {
            self.top.refit(&self.placements, self.groups.as_ref().map(|groups| groups.world_rows()));
        }
        if !same_visible || self.top.cost_ratio() > MAX_COST_RATIO {
            self.build_top();
            update.rebuilt = true;
        }
        (update.cost_ratio, update.top_level) = (self.top.cost_ratio(), clock::elapsed(start));
    }

    /// Builds the top level.
    pub(super) fn build_top(&mut self) {
        let rows = self.groups.as_ref().map(|groups| groups.world_rows());
        self.top.build(&self.placements, rows);
        if rows.is_some() {
            self.only_visible = None;
            return;
        }
        let mut visible = self.placements.iter().enumerate().filter(|(_, placement)| placement.is_some());
        let first = visible.next().map(|(row, _)| row as u32);
        self.only_visible = first.filter(|_| visible.next().is_none());
    }

    /// Returns true if rays have been traced in an object.
    fn is_traced(&self, object: u32) -> bool {
        self.traced[object as usize].load(Ordering::Relaxed)
    }

    /// An instance, with its transform to the world.
    pub(crate) fn row(&self, objects: &Objects, instance: u32) -> InstanceRow {
        let Some(groups) = self.groups() else { return self.row_in_group(objects, instance) };
        let found = groups.find(instance);
        let row = self.row_in_group(objects, found.path[found.path.len() - 1]);
        InstanceRow { to_world: found.to_world, ..row }
    }

    /// A row, with its transform to the space of its group.
    pub(crate) fn row_in_group(&self, objects: &Objects, instance: u32) -> InstanceRow {
        match &self.source {
            TransformSource::File(hierarchy) => {
                let view = scene_of(objects);
                let row = view.instances[instance as usize];
                let to_world = match row.group().is_none() && self.animation.is_skinned(row.object) {
                    true => Affine::IDENTITY,
                    false => hierarchy.to_world(&view, row.node),
                };
                InstanceRow { object: row.object, within: NONE, node: row.node, to_world }
            }
            TransformSource::Caller(caller) => caller.rows[instance as usize].row,
        }
    }

    /// Index of an instance's object; `NONE` if the instance was removed.
    pub(crate) fn object_of(&self, objects: &Objects, instance: u32) -> u32 {
        if let Some(groups) = self.groups() {
            return groups.find(instance).object;
        }
        match &self.source {
            TransformSource::File(_) => {
                objects.sole_file().expect("a file with a scene").instances()[instance as usize].object
            }
            TransformSource::Caller(caller) => caller.rows[instance as usize].row.object,
        }
    }

    /// Number of instances, visible or not, with groups written out.
    pub(crate) fn instance_count(&self) -> u32 {
        self.groups().map_or(self.row_count() as u32, Groups::count)
    }

    /// The rows on the way to an instance.
    pub(crate) fn path(&self, instance: u32) -> InstancePath {
        self.groups().map_or_else(|| InstancePath::of_row(instance), |groups| groups.find(instance).path)
    }

    /// The placement of an instance in the world; `None` if there is no such instance or it is not
    /// visible. With groups it has no box.
    pub(crate) fn placed(&self, instance: u32) -> Option<Cow<'_, Placement>> {
        let Some(groups) = self.groups() else {
            return match &self.stored {
                Some(stored) if instance >= stored.rows() => None,
                Some(stored) => stored.placement(instance).map(Cow::Borrowed),
                None => self.placements.get(instance as usize)?.as_ref().map(Cow::Borrowed),
            };
        };
        let found = (instance < groups.count()).then(|| groups.find(instance))?;
        let is_visible = found.path.iter().all(|row| self.shows(*row));
        let (inverse, accuracy) = found.to_world.inverse().filter(|_| is_visible)?;
        Some(Cow::Owned(Placement::without_box(inverse, accuracy, found.object)))
    }

    /// World box of an instance, computed from the object's box, so it does not depend on which
    /// objects have been traced. `None` if the instance is not visible.
    pub(crate) fn bounds(&self, objects: &Objects, instance: u32) -> Option<([f32; 3], [f32; 3])> {
        self.placed(instance)?;
        let InstanceRow { object, to_world, .. } = self.row(objects, instance);
        let header = objects.header(object);
        let whole = PartBoxes::whole(header, objects.anchor(object));
        let placement = Placement::new(&to_world, object, header, &whole).ok()?;
        Some((placement.lower, placement.upper))
    }

    /// World boxes of the visible rows of the world; `None` without groups.
    pub(crate) fn row_boxes(&self, objects: &Objects) -> Option<Vec<([f32; 3], [f32; 3])>> {
        let groups = self.groups()?;
        if let Some(stored) = self.stored.as_ref().filter(|stored| stored.holds_world()) {
            let tree = stored.trees().last()?;
            let rows = tree.first_row..tree.first_row + tree.rows;
            let placed = rows.filter_map(|row| groups.box_of_stored(objects, row));
            return Some(placed.map(|placement| (placement.lower, placement.upper)).collect());
        }
        let rows = groups.world_rows().iter();
        let placed = rows.filter_map(|row| self.placements[(*row - self.first_row()) as usize].as_ref());
        Some(placed.map(|placement| (placement.lower, placement.upper)).collect())
    }

    /// The only visible instance and its object, if there is exactly one and the object's space is
    /// world space. Most such scenes are models that were exported as scenes.
    pub(crate) fn sole(&self) -> Option<(u32, u32)> {
        let instance = self.only_visible?;
        let placement = self.placements[instance as usize].as_ref()?;
        placement.inverse.is_identity().then(|| (instance, placement.object()))
    }

    /// The visible instance, if there is exactly one.
    #[inline(always)]
    pub(crate) fn only_visible(&self) -> Option<u32> {
        self.only_visible
    }

    /// Records that a ray is traced in an object. It is stored only once, so that threads do not
    /// contend for the cache line.
    pub(crate) fn mark_traced(&self, object: u32) {
        let traced = &self.traced[object as usize];
        if !traced.load(Ordering::Relaxed) {
            traced.store(true, Ordering::Relaxed);
        }
    }

    /// Number of objects in which rays have been traced.
    pub(crate) fn traced_objects(&self) -> usize {
        self.traced.iter().filter(|t| t.load(Ordering::Relaxed)).count()
    }

    /// Bytes on the heap: of the instances and the top level, and of the hierarchy or the caller's
    /// transforms.
    pub(crate) fn bytes(&self) -> (usize, usize) {
        let source = match &self.source {
            TransformSource::File(hierarchy) => hierarchy.bytes() + self.animation.bytes(),
            TransformSource::Caller(caller) => caller.bytes(),
        };
        let parts = self.parts.iter().filter(|parts| parts.get().is_some()).count() * size_of::<PartBoxes>();
        let groups =
            self.groups().map_or(0, Groups::bytes) + self.stored.as_ref().map_or(0, |stored| stored.bytes());
        let instances =
            groups + size_of_val(self.placements.as_slice()) + size_of_val(self.parts.as_slice()) + parts;
        (instances + self.top.bytes(), source)
    }
}
