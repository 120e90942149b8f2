//! The instances of a scene, as rays meet them. They come from a file with scene sections ([`super::file_scene`]) or from the caller
//! of a scene builder ([`super::caller`]).

use super::caller_instances::{CallerInstances, InstanceRow};
use super::placement::{PartBoxes, Placement};
use super::top_level::TopLevel;
use crate::deformers::Deformers;
use crate::nodes::affine::{Affine, Inverse};
use crate::nodes::hierarchy::NodeHierarchy;
use crate::objects::Objects;
use bth_format::SceneView;
use bth_format::file::File;
use std::sync::atomic::{AtomicBool, Ordering};

/// The transforms of a visible instance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placed {
    /// Index of the object.
    pub(crate) object: u32,
    /// From object space to world space: rows of four.
    pub(crate) to_world: [[f64; 4]; 3],
    /// Rows of the linear part of the inverse, and the origin of object space in world space.
    pub(crate) inverse: [[f64; 3]; 3],
    pub(crate) origin: [f64; 3],
    /// The world box.
    pub(crate) lower: [f32; 3],
    pub(crate) upper: [f32; 3],
}

/// The scene sections of a scene that is a file with such sections.
pub(super) fn scene_of(objects: &Objects) -> SceneView<'_> {
    objects.sole_file().and_then(File::scene).expect("a file with scene sections, checked when it was opened")
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
    /// What deforms the objects.
    pub(crate) deformers: Deformers,
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
            deformers: Deformers::default(),
        };
        world.add_objects(objects);
        world
    }

    /// No instances yet; the caller will place them.
    pub(crate) fn empty() -> World {
        World::unplaced(TransformSource::Caller(CallerInstances::default()), 0.0, 0, 0)
    }

    /// Instances with given placements. Their transforms are the identity unless [`Self::set_transforms`] sets them.
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
        if let TransformSource::Caller(caller) = &mut self.source {
            caller.add_objects(count);
        }
    }

    /// Builds the top level.
    pub(super) fn build_top(&mut self) {
        self.top.build(&self.placements);
        let mut visible = self.placements.iter().enumerate().filter(|(_, placement)| placement.is_some());
        let first = visible.next().map(|(row, _)| row as u32);
        self.only_visible = first.filter(|_| visible.next().is_none());
    }

    /// Whether rays have been traced in an object.
    pub(super) fn is_traced(&self, object: u32) -> bool {
        self.traced[object as usize].load(Ordering::Relaxed)
    }

    /// An instance.
    pub(crate) fn row(&self, objects: &Objects, instance: u32) -> InstanceRow {
        match &self.source {
            TransformSource::File(hierarchy) => {
                let view = scene_of(objects);
                let row = view.instances[instance as usize];
                let to_world = match self.deformers.is_skinned(row.object) {
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

    /// World box of an instance, computed from the object's box, so it does not depend on which objects have been traced. `None`
    /// if the instance is not visible.
    pub(crate) fn bounds(&self, objects: &Objects, instance: u32) -> Option<([f32; 3], [f32; 3])> {
        self.placements[instance as usize].as_ref()?;
        let InstanceRow { object, to_world, .. } = self.row(objects, instance);
        let header = objects.header(object);
        let placement = Placement::new(&to_world, object, header, &PartBoxes::whole(header)).ok()?;
        Some((placement.lower, placement.upper))
    }

    /// The transforms and the world box of an instance; `None` if it is not visible.
    pub(crate) fn placed(&self, objects: &Objects, instance: u32) -> Option<Placed> {
        let placement = self.placements[instance as usize].as_ref()?;
        let Inverse { linear, origin } = placement.inverse;
        Some(Placed {
            object: placement.object(),
            to_world: self.row(objects, instance).to_world.rows(),
            inverse: linear,
            origin,
            lower: placement.lower,
            upper: placement.upper,
        })
    }

    /// The only visible instance and its object, if there is exactly one and the object's space is world space. Most such scenes
    /// are models that were exported as scenes.
    pub(crate) fn sole(&self) -> Option<(u32, u32)> {
        let instance = self.only_visible?;
        let placement = self.placements[instance as usize].as_ref()?;
        placement.inverse.is_identity().then(|| (instance, placement.object()))
    }

    /// Whether exactly one instance is visible.
    pub(crate) fn has_single_visible(&self) -> bool {
        self.only_visible.is_some()
    }

    /// Records that a ray is traced in an object. It is stored only once, so that threads do not contend for the cache line.
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

    /// Bytes on the heap: of the instances and the top level, and of the hierarchy or the caller's transforms.
    pub(crate) fn bytes(&self) -> (usize, usize) {
        let source = match &self.source {
            TransformSource::File(hierarchy) => hierarchy.bytes() + self.deformers.bytes(),
            TransformSource::Caller(caller) => caller.bytes(),
        };
        (size_of_val(self.placements.as_slice()) + self.top.bytes(), source)
    }
}
