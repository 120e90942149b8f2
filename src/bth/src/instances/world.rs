//! The instances of a scene at a time.

use super::affine::Inverse;
use super::hierarchy::NodeHierarchy;
use super::placement::{PartBoxes, Placement, PlacementError};
use super::top_level::TopLevel;
#[cfg(test)]
use bth_format::SceneView;
use bth_format::error::{Code, Error, Result};
use bth_format::file::File;
use bth_format::layout::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Statistics of an update of a scene's time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Update {
    /// Nodes that moved, were hidden or became visible, including all their descendants.
    pub nodes: usize,
    /// Instances of these nodes, which were placed again.
    pub placed: usize,
    /// Visible instances of the whole scene.
    pub visible: usize,
    /// Time to rebuild the top level.
    pub top_level: Duration,
}

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

/// The instances of a file with scene sections at a time. The sections have been checked.
#[derive(Debug)]
pub(crate) struct World {
    /// Time of the scene.
    pub(crate) seconds: f64,
    hierarchy: NodeHierarchy,
    /// For each instance its placement; `None` if it is not visible.
    pub(crate) placements: Vec<Option<Placement>>,
    pub(crate) top: TopLevel,
    /// The only visible instance, if there is exactly one.
    only_visible: Option<u32>,
    /// For each object whether a ray has been traced in it.
    traced: Vec<AtomicBool>,
}

impl World {
    /// The instances of a file at the first frame of its scene; `None` if the file has no scene sections.
    ///
    /// # Errors
    /// Those of [`File::check_scene`] and of [`Self::update`].
    pub(crate) fn new(file: &File) -> Result<Option<World>> {
        let Some(view) = file.check_scene()? else { return Ok(None) };
        let scene = &view.scene[0];
        let mut world = World {
            seconds: f64::from(scene.first_frame) / scene.rate,
            hierarchy: NodeHierarchy::new(&view),
            placements: vec![None; view.instances.len()],
            top: TopLevel::default(),
            only_visible: None,
            traced: (0..file.object_count()).map(|_| AtomicBool::new(false)).collect(),
        };
        world.place_instances(file, world.seconds, true)?;
        Ok(Some(world))
    }

    /// Instances with given placements, without a hierarchy.
    #[cfg(test)]
    pub(crate) fn with_placements(placements: Vec<Option<Placement>>, objects: u32) -> World {
        let empty = SceneView {
            scene: &[],
            nodes: &[],
            instances: &[],
            tracks: &[],
            times: &[],
            values: &[],
            cameras: &[],
            lights: &[],
            names: &[],
        };
        let mut top = TopLevel::default();
        top.build(&placements);
        let traced = (0..objects).map(|_| AtomicBool::new(false)).collect();
        let only_visible = only_visible(&placements);
        World { seconds: 0.0, hierarchy: NodeHierarchy::new(&empty), placements, top, only_visible, traced }
    }

    /// Sets the time. After an error the instances are unchanged.
    ///
    /// # Errors
    /// `BTH-S001` if the transform of a visible instance is singular, `BTH-S002` if it or the world box is not finite. The error
    /// gives the node.
    pub(crate) fn update(&mut self, file: &File, seconds: f64) -> Result<Update> {
        let result = self.place_instances(file, seconds, false);
        match &result {
            Ok(_) => self.seconds = seconds,
            // The instances of the former time have been placed before, so placing them again succeeds.
            Err(_) => drop(self.place_instances(file, self.seconds, true)),
        }
        result
    }

    /// Places the instances that moved, or with `all` every instance, and rebuilds the top level.
    fn place_instances(&mut self, file: &File, seconds: f64, all: bool) -> Result<Update> {
        let view = file.scene().expect("checked when the scene was opened");
        let mut update = Update { nodes: self.hierarchy.update(&view, seconds, all), ..Update::default() };
        for (row, instance) in view.instances.iter().enumerate() {
            if !self.hierarchy.moved(instance.node) {
                continue;
            }
            self.placements[row] = None;
            update.placed += 1;
            if self.hierarchy.hidden(instance.node) {
                continue;
            }
            let object = file.object_header(instance.object);
            if object.root == NONE {
                continue;
            }
            let world = self.hierarchy.to_world(&view, instance.node);
            // The boxes of the root's children give a tighter world box. They are used only if they are in memory already:
            // reading the root of every mapped object would take longer than the tighter boxes save.
            let traced = self.traced[instance.object as usize].load(Ordering::Relaxed);
            let parts = match file.view(instance.object) {
                Ok(view) if traced || !file.is_mapped() => PartBoxes::of_root_children(view),
                _ => PartBoxes::whole(object),
            };
            let placement = Placement::new(&world, instance.object, object, &parts).map_err(|error| {
                let (code, expected, found) = match error {
                    PlacementError::Singular => {
                        (Code::Singular, "a transform that can be inverted", "one that cannot")
                    }
                    PlacementError::NotFinite => {
                        (Code::NotFinite, "a finite transform and world box", "one that is not")
                    }
                };
                let name = view.node_name(instance.node).escape_debug();
                let found = format!("{found}: node \"{name}\" at {seconds} s");
                let offset = u64::from(instance.node) * size_of::<Node>() as u64;
                file.locate(Error::within_file(code, kind::NODES, offset, expected, found), NONE)
            })?;
            self.placements[row] = Some(placement);
        }
        if update.placed > 0 {
            let start = Instant::now();
            self.top.build(&self.placements);
            self.only_visible = only_visible(&self.placements);
            update.top_level = start.elapsed();
        }
        update.visible = self.placements.iter().flatten().count();
        Ok(update)
    }

    /// World box of an instance, computed from the object's box, so it does not depend on which objects have been traced. `None`
    /// if the instance is not visible.
    pub(crate) fn bounds(&self, file: &File, instance: u32) -> Option<([f32; 3], [f32; 3])> {
        self.placements[instance as usize].as_ref()?;
        let view = file.scene().expect("checked when the scene was opened");
        let instance = view.instances[instance as usize];
        let (world, object) =
            (self.hierarchy.to_world(&view, instance.node), file.object_header(instance.object));
        let placement = Placement::new(&world, instance.object, object, &PartBoxes::whole(object)).ok()?;
        Some((placement.lower, placement.upper))
    }

    /// The transforms and the world box of an instance; `None` if it is not visible.
    pub(crate) fn placed(&self, file: &File, instance: u32) -> Option<Placed> {
        let placement = self.placements[instance as usize].as_ref()?;
        let node = file.scene().expect("checked when the scene was opened").instances[instance as usize].node;
        let Inverse { linear, origin } = placement.inverse;
        Some(Placed {
            object: placement.object(),
            to_world: self.node(file, node).0,
            inverse: linear,
            origin,
            lower: placement.lower,
            upper: placement.upper,
        })
    }

    /// The transform from a node's space to world space, as rows of four, and whether the node is visible.
    pub(crate) fn node(&self, file: &File, node: u32) -> ([[f64; 4]; 3], bool) {
        let view = file.scene().expect("checked when the scene was opened");
        (self.hierarchy.to_world(&view, node).rows(), !self.hierarchy.hidden(node))
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

    /// Bytes on the heap: of the instances and the top level, and of the hierarchy.
    pub(crate) fn bytes(&self) -> (usize, usize) {
        (size_of_val(self.placements.as_slice()) + self.top.bytes(), self.hierarchy.bytes())
    }
}

/// The only visible instance, if there is exactly one.
fn only_visible(placements: &[Option<Placement>]) -> Option<u32> {
    let mut visible = placements.iter().enumerate().filter(|(_, placement)| placement.is_some());
    let (row, _) = visible.next()?;
    visible.next().is_none().then_some(row as u32)
}
