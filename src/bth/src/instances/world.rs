//! The instances of a scene at a time.

use super::placement::{Misplaced, Parts, Placed};
use super::pose::Pose;
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

/// The instances of a file with scene sections at a time. The sections have been checked.
#[derive(Debug)]
pub(crate) struct World {
    pub(crate) seconds: f64,
    pose: Pose,
    /// For each instance its placement; `None` if it is not visible.
    pub(crate) placed: Vec<Option<Placed>>,
    pub(crate) top: TopLevel,
    /// The only visible instance, if there is exactly one.
    alone: Option<u32>,
    /// For each object whether a ray has been traced in it.
    touched: Vec<AtomicBool>,
}

impl World {
    /// The instances of a file at the first frame of its scene; `None` if the file has no scene.
    ///
    /// # Errors
    /// Those of [`File::check_scene`] and of [`Self::update`].
    pub(crate) fn new(file: &File) -> Result<Option<World>> {
        let Some(view) = file.check_scene()? else { return Ok(None) };
        let scene = &view.scene[0];
        let mut world = World {
            seconds: f64::from(scene.first_frame) / scene.rate,
            pose: Pose::new(&view),
            placed: vec![None; view.instances.len()],
            top: TopLevel::default(),
            alone: None,
            touched: (0..file.object_count()).map(|_| AtomicBool::new(false)).collect(),
        };
        world.place(file, world.seconds, true)?;
        Ok(Some(world))
    }

    /// Instances with given placements, without a hierarchy.
    #[cfg(test)]
    pub(crate) fn of_places(placed: Vec<Option<Placed>>, objects: u32) -> World {
        let nothing = SceneView {
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
        top.build(&placed);
        let touched = (0..objects).map(|_| AtomicBool::new(false)).collect();
        let alone = alone(&placed);
        World { seconds: 0.0, pose: Pose::new(&nothing), placed, top, alone, touched }
    }

    /// Moves to a time. After an error the instances are as before.
    ///
    /// # Errors
    /// `BTH-S001` and `BTH-S002` with the node.
    pub(crate) fn update(&mut self, file: &File, seconds: f64) -> Result<Update> {
        let result = self.place(file, seconds, false);
        match &result {
            Ok(_) => self.seconds = seconds,
            // The instances of the former time have been placed before, so placing them again succeeds.
            Err(_) => drop(self.place(file, self.seconds, true)),
        }
        result
    }

    /// Places the instances that moved, or with `all` every instance, and rebuilds the top level.
    fn place(&mut self, file: &File, seconds: f64, all: bool) -> Result<Update> {
        let view = file.scene().expect("checked when the scene was opened");
        let mut update = Update { nodes: self.pose.update(&view, seconds, all), ..Update::default() };
        for (row, instance) in view.instances.iter().enumerate() {
            if !self.pose.moved(instance.node) {
                continue;
            }
            self.placed[row] = None;
            update.placed += 1;
            if self.pose.hidden(instance.node) {
                continue;
            }
            let object = file.object_header(instance.object);
            if object.root == NONE {
                continue;
            }
            let world = self.pose.world(&view, instance.node);
            // The boxes of the root's children give a tighter world box. They are used only if they are in memory already: reading
            // the root of every mapped object would take longer than the tighter boxes save.
            let touched = self.touched[instance.object as usize].load(Ordering::Relaxed);
            let parts = match file.view(instance.object) {
                Ok(view) if touched || !file.is_mapped() => Parts::of(view),
                _ => Parts::whole(object),
            };
            let place = Placed::new(&world, instance.object, object, &parts).map_err(|why| {
                let (code, expected, found) = match why {
                    Misplaced::Singular => {
                        (Code::Singular, "a transform that can be inverted", "one that cannot")
                    }
                    Misplaced::NotFinite => {
                        (Code::NotFinite, "a finite transform and world box", "one that is not")
                    }
                };
                let name = view.node_name(instance.node).escape_debug();
                let found = format!("{found}: node \"{name}\" at {seconds} s");
                let at = u64::from(instance.node) * size_of::<Node>() as u64;
                file.locate(Error::within_file(code, kind::NODES, at, expected, found), NONE)
            })?;
            self.placed[row] = Some(place);
        }
        if update.placed > 0 {
            let start = Instant::now();
            self.top.build(&self.placed);
            self.alone = alone(&self.placed);
            update.top_level = start.elapsed();
        }
        update.visible = self.placed.iter().flatten().count();
        Ok(update)
    }

    /// World box of an instance, computed from the object's box, so it does not depend on which objects have been traced. `None` if the
    /// instance is not visible.
    pub(crate) fn bounds(&self, file: &File, instance: u32) -> Option<([f32; 3], [f32; 3])> {
        self.placed[instance as usize].as_ref()?;
        let view = file.scene().expect("checked when the scene was opened");
        let instance = view.instances[instance as usize];
        let (world, object) = (self.pose.world(&view, instance.node), file.object_header(instance.object));
        let placed = Placed::new(&world, instance.object, object, &Parts::whole(object)).ok()?;
        Some((placed.lower, placed.upper))
    }

    /// The transform from a node's space to world space, as rows of four, and whether the node is visible.
    pub(crate) fn node(&self, file: &File, node: u32) -> ([[f64; 4]; 3], bool) {
        let view = file.scene().expect("checked when the scene was opened");
        (self.pose.world(&view, node).rows(), !self.pose.hidden(node))
    }

    /// The only visible instance and its object, if there is exactly one and the object's space is world space. Most such scenes are
    /// models that were exported as scenes.
    pub(crate) fn sole(&self) -> Option<(u32, u32)> {
        let instance = self.alone?;
        let place = self.placed[instance as usize].as_ref()?;
        place.inverse.is_identity().then(|| (instance, place.object()))
    }

    /// Whether exactly one instance is visible.
    pub(crate) fn is_alone(&self) -> bool {
        self.alone.is_some()
    }

    /// Records that a ray is traced in an object.
    pub(crate) fn touch(&self, object: u32) {
        let touched = &self.touched[object as usize];
        if !touched.load(Ordering::Relaxed) {
            touched.store(true, Ordering::Relaxed);
        }
    }

    /// Number of objects in which rays have been traced.
    pub(crate) fn touched(&self) -> usize {
        self.touched.iter().filter(|t| t.load(Ordering::Relaxed)).count()
    }

    /// Bytes on the heap: of the instances and the top level, and of the hierarchy.
    pub(crate) fn bytes(&self) -> (usize, usize) {
        (size_of_val(self.placed.as_slice()) + self.top.bytes(), self.pose.bytes())
    }
}

/// The only visible instance, if there is exactly one.
fn alone(placed: &[Option<Placed>]) -> Option<u32> {
    let mut seen = placed.iter().enumerate().filter(|(_, place)| place.is_some());
    let (row, _) = seen.next()?;
    seen.next().is_none().then_some(row as u32)
}
