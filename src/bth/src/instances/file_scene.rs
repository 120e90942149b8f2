//! The instances of a file with scene sections at a time.

use super::hierarchy::NodeHierarchy;
use super::placement::{PartBoxes, Placement, PlacementError};
use super::world::{TransformSource, Update, World};
use crate::clock;
use crate::objects::Objects;
use bth_format::SceneView;
use bth_format::error::{Code, Error, Result};
use bth_format::file::File;
use bth_format::layout::*;

/// The scene sections of a scene that is a file with such sections.
pub(super) fn scene_of(objects: &Objects) -> SceneView<'_> {
    objects.sole_file().and_then(File::scene).expect("a file with scene sections, checked when it was opened")
}

impl World {
    /// The instances of a file at the first frame of its scene; `None` if the objects are not those of a file with scene sections.
    ///
    /// # Errors
    /// Those of [`File::check_scene`] and of [`Self::update`].
    pub(crate) fn new(objects: &Objects) -> Result<Option<World>> {
        let Some(file) = objects.sole_file() else { return Ok(None) };
        let Some(view) = file.check_scene()? else { return Ok(None) };
        let scene = &view.scene[0];
        let seconds = f64::from(scene.first_frame) / scene.rate;
        let source = TransformSource::File(NodeHierarchy::new(&view));
        let mut world = World::unplaced(source, seconds, view.instances.len(), file.object_count());
        world.place_instances(objects, seconds, true)?;
        Ok(Some(world))
    }

    /// Sets the time of a file's scene. After an error the instances are unchanged. It has no effect if the caller places the
    /// instances.
    ///
    /// # Errors
    /// `BTH-S001` if the transform of a visible instance is singular, `BTH-S002` if it or the world box is not finite. The error
    /// gives the node.
    pub(crate) fn update(&mut self, objects: &Objects, seconds: f64) -> Result<Update> {
        if !matches!(self.source, TransformSource::File(_)) {
            return Ok(Update::default());
        }
        let result = self.place_instances(objects, seconds, false);
        match &result {
            Ok(_) => self.seconds = seconds,
            // The instances of the former time have been placed before, so placing them again succeeds.
            Err(_) => drop(self.place_instances(objects, self.seconds, true)),
        }
        result
    }

    /// Places the instances that moved, or with `all` every instance, and rebuilds the top level.
    fn place_instances(&mut self, objects: &Objects, seconds: f64, all: bool) -> Result<Update> {
        let view = scene_of(objects);
        let TransformSource::File(hierarchy) = &mut self.source else { return Ok(Update::default()) };
        let mut update = Update { nodes: hierarchy.update(&view, seconds, all), ..Update::default() };
        for (row, instance) in view.instances.iter().enumerate() {
            let TransformSource::File(hierarchy) = &self.source else { break };
            if !hierarchy.moved(instance.node) {
                continue;
            }
            self.placements[row] = None;
            update.placed += 1;
            if hierarchy.hidden(instance.node) {
                continue;
            }
            let object = objects.header(instance.object);
            if object.root == NONE {
                continue;
            }
            let world = hierarchy.to_world(&view, instance.node);
            let parts = self.parts_of(objects, instance.object);
            let placement = Placement::new(&world, instance.object, object, &parts).map_err(|error| {
                let (code, expected, found) = error.words();
                let name = view.node_name(instance.node).escape_debug();
                let found = format!("{found}: node \"{name}\" at {seconds} s");
                let offset = u64::from(instance.node) * size_of::<Node>() as u64;
                let error = Error::within_file(code, kind::NODES, offset, expected, found);
                objects.sole_file().expect("a file with nodes").locate(error, NONE)
            })?;
            self.placements[row] = Some(placement);
        }
        if update.placed > 0 {
            let start = clock::now();
            self.build_top();
            (update.rebuilt, update.top_level) = (true, clock::elapsed(start));
        }
        update.visible = self.placements.iter().flatten().count();
        Ok(update)
    }

    /// Boxes that contain all triangles of an object. Those of the root's children give a tighter world box. They are used only
    /// if they are in memory already: reading the root of every mapped object would take longer than the tighter boxes save.
    pub(super) fn parts_of(&self, objects: &Objects, object: u32) -> PartBoxes {
        let in_memory = self.is_traced(object) || !objects.is_mapped(object);
        match objects.unchecked_view(object).filter(|_| in_memory) {
            Some(view) => PartBoxes::of_root_children(view),
            None => PartBoxes::whole(objects.header(object)),
        }
    }

    /// The transform from a node's space to world space, as rows of four, and whether the node is visible.
    ///
    /// # Panics
    /// If there is no such node, as where the caller places the instances.
    pub(crate) fn node(&self, objects: &Objects, node: u32) -> ([[f64; 4]; 3], bool) {
        let TransformSource::File(hierarchy) = &self.source else { panic!("expected a file with nodes") };
        (hierarchy.to_world(&scene_of(objects), node).rows(), !hierarchy.hidden(node))
    }
}

impl PlacementError {
    /// The code of an error about an instance, what is expected, and what was found.
    pub(crate) fn words(self) -> (Code, &'static str, &'static str) {
        match self {
            PlacementError::Singular => {
                (Code::Singular, "a transform that can be inverted", "one that cannot")
            }
            PlacementError::NotFinite => {
                (Code::NotFinite, "a finite transform and world box", "one that is not")
            }
        }
    }
}
