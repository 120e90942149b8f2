//! The instances of a scene, as queries see them. A file with scene sections ([`super::by_file`])
//! or the caller of a scene builder ([`super::by_caller`]) places them.

use super::placement::{PartBoxes, Placement, PlacementError};
use super::top_level::TopLevel;
use crate::animation::Animation;
use crate::clock;
use crate::nodes::affine::Affine;
use crate::nodes::hierarchy::NodeHierarchy;
use crate::objects::Objects;
use crate::update::Update;
use bth_format::file::File;
use bth_format::layout::NONE;
use bth_format::{Error, SceneView};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// The top level is built again if its expected cost would exceed this multiple of the cost when it
/// was built. See `docs/decisions.md`.
const MAX_COST_RATIO: f64 = 1.5;

/// An instance: its object, its node, and its transform to world space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InstanceRow {
    /// Index of the object; `NONE` if the instance was removed.
    pub(crate) object: u32,
    /// Index of the node in the file of the object, or `NONE`.
    pub(crate) node: u32,
    pub(crate) to_world: Affine,
}

/// An instance that cannot be placed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unplaceable {
    pub(crate) instance: u32,
    pub(crate) error: PlacementError,
}

impl Unplaceable {
    /// The error of a call; `instance` describes the instance.
    pub(crate) fn error(self, instance: &str) -> Error {
        let (code, expected, found) = self.error.words();
        Error::of_call(code, expected, format!("{found}: {instance}"))
    }
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
    pub(super) rows: Vec<InstanceRow>,
    /// Memory for the placements of a commit.
    pub(super) placed: Vec<PlaceResult>,
}

impl CallerInstances {
    /// Bytes on the heap.
    pub(super) fn bytes(&self) -> usize {
        self.rows.capacity() * size_of::<InstanceRow>() + self.placed.capacity() * size_of::<PlaceResult>()
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
    /// For each instance its placement; `None` if it is not visible.
    pub(crate) placements: Vec<Option<Placement>>,
    pub(crate) top: TopLevel,
    /// The only visible instance, if there is exactly one.
    only_visible: Option<u32>,
    /// For each object whether a ray has been traced in it.
    traced: Vec<AtomicBool>,
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
            top,
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
        let row = |(i, placement): (usize, &Option<Placement>)| InstanceRow {
            object: placement.as_ref().map_or(0, Placement::object),
            node: 0,
            to_world: transforms.get(i).copied().unwrap_or(Affine::IDENTITY),
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
        let mut placed = Vec::new();
        for (instance, placement) in self.placements.iter().enumerate() {
            let instance = instance as u32;
            let Some(object) = placement.as_ref().map(Placement::object) else { continue };
            if changed.contains(&object) {
                let to_world = self.row(objects, instance).to_world;
                let placement = self.place(objects, object, &to_world, false);
                placed.push((instance, placement.map_err(|error| Unplaceable { instance, error })?));
            }
        }
        let mut update = Update { placed: placed.len(), visible: self.visible(), ..Update::default() };
        for (instance, placement) in placed {
            self.placements[instance as usize] = placement;
        }
        if update.placed > 0 {
            self.update_top(true, &mut update);
        }
        Ok(update)
    }

    /// Number of visible instances.
    pub(super) fn visible(&self) -> usize {
        self.placements.iter().flatten().count()
    }

    /// Refits the top level if the same instances are visible and its cost permits, else builds it.
    pub(super) fn update_top(&mut self, same_visible: bool, update: &mut Update) {
        let start = clock::now();
        if same_visible {
            self.top.refit(&self.placements);
        }
        if !same_visible || self.top.cost_ratio() > MAX_COST_RATIO {
            self.build_top();
            update.rebuilt = true;
        }
        (update.cost_ratio, update.top_level) = (self.top.cost_ratio(), clock::elapsed(start));
    }

    /// Builds the top level.
    pub(super) fn build_top(&mut self) {
        self.top.build(&self.placements);
        let mut visible = self.placements.iter().enumerate().filter(|(_, placement)| placement.is_some());
        let first = visible.next().map(|(row, _)| row as u32);
        self.only_visible = first.filter(|_| visible.next().is_none());
    }

    /// Returns true if rays have been traced in an object.
    fn is_traced(&self, object: u32) -> bool {
        self.traced[object as usize].load(Ordering::Relaxed)
    }

    /// An instance.
    pub(crate) fn row(&self, objects: &Objects, instance: u32) -> InstanceRow {
        match &self.source {
            TransformSource::File(hierarchy) => {
                let view = scene_of(objects);
                let row = view.instances[instance as usize];
                let to_world = match self.animation.is_skinned(row.object) {
                    true => Affine::IDENTITY,
                    false => hierarchy.to_world(&view, row.node),
                };
                InstanceRow { object: row.object, node: row.node, to_world }
            }
            TransformSource::Caller(caller) => caller.rows[instance as usize],
        }
    }

    /// Index of an instance's object; `NONE` if the instance was removed.
    pub(crate) fn object_of(&self, objects: &Objects, instance: u32) -> u32 {
        match &self.source {
            TransformSource::File(_) => scene_of(objects).instances[instance as usize].object,
            TransformSource::Caller(caller) => caller.rows[instance as usize].object,
        }
    }

    /// World box of an instance, computed from the object's box, so it does not depend on which
    /// objects have been traced. `None` if the instance is not visible.
    pub(crate) fn bounds(&self, objects: &Objects, instance: u32) -> Option<([f32; 3], [f32; 3])> {
        self.placements[instance as usize].as_ref()?;
        let InstanceRow { object, to_world, .. } = self.row(objects, instance);
        let header = objects.header(object);
        let whole = PartBoxes::whole(header, objects.anchor(object));
        let placement = Placement::new(&to_world, object, header, &whole).ok()?;
        Some((placement.lower, placement.upper))
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
        let instances = size_of_val(self.placements.as_slice()) + size_of_val(self.parts.as_slice()) + parts;
        (instances + self.top.bytes(), source)
    }
}
