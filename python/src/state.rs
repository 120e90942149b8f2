//! A scene as its file places the instances, or as Python does.
//!
//! A scene is a file until Python first places an instance. From then on a scene builder holds it,
//! with the same objects and ids of instances.

use bth_format::layout::NONE;
use bth_format::{Error, File};
use std::ops::Deref;

/// The rows of a 3×4 matrix, one after the other.
pub(crate) type Matrix = [f64; 12];

/// A scene, and what changes it. Reads as a [`bth::Scene`].
pub(crate) enum State {
    /// The file places the instances.
    File(Box<bth::Scene>),
    /// Python places the instances.
    Placed(Box<Placed>),
}

pub(crate) struct Placed {
    pub(crate) builder: bth::SceneBuilder,
    file: File,
    /// For each instance its node in the file, or `NONE`.
    pub(crate) nodes: Vec<u32>,
}

impl Deref for State {
    type Target = bth::Scene;

    fn deref(&self) -> &bth::Scene {
        match self {
            State::File(scene) => scene,
            State::Placed(placed) => placed.builder.scene(),
        }
    }
}

impl State {
    /// The compiled file, without objects that Python has added.
    pub(crate) fn file(&self) -> &File {
        match self {
            State::File(scene) => scene.file(),
            State::Placed(placed) => &placed.file,
        }
    }

    /// The name of an instance's node; empty without one.
    pub(crate) fn instance_name(&self, instance: u32) -> &str {
        let node = match self {
            State::File(scene) => scene.instance(instance).node,
            State::Placed(placed) => placed.nodes.get(instance as usize).copied().unwrap_or(NONE),
        };
        self.file().scene().map_or("", |view| view.node_name(node))
    }

    /// Returns true if Python has placed instances.
    pub(crate) fn is_placed(&self) -> bool {
        matches!(self, State::Placed(_))
    }

    /// Returns true if there is an instance with this id, which was not removed.
    pub(crate) fn has(&self, instance: u32) -> bool {
        instance < self.instance_count() && self.object_of(instance) != NONE
    }

    pub(crate) fn set_seconds(&mut self, seconds: f64) -> Result<(), Error> {
        // Scenes that Python places do not depend on the time.
        if let State::File(scene) = self {
            scene.set_seconds(seconds)?;
        }
        Ok(())
    }

    /// Gives an object new positions; returns the expected cost of rays relative to the compiled
    /// pose.
    pub(crate) fn set_positions(&mut self, object: u32, positions: &[[f32; 3]]) -> Result<f64, Error> {
        let update = match self {
            State::File(scene) => scene.set_positions(object, positions)?,
            State::Placed(placed) => {
                placed.builder.set_positions(object, positions)?;
                placed.builder.commit()?
            }
        };
        Ok(update.deformed_cost_ratio)
    }

    /// As [`Self::set_positions`], at a share of the way between two.
    pub(crate) fn set_positions_between(
        &mut self,
        object: u32,
        ends: [&[[f32; 3]]; 2],
        share: f64,
    ) -> Result<f64, Error> {
        let update = match self {
            State::File(scene) => scene.set_positions_between(object, ends, share)?,
            State::Placed(placed) => {
                placed.builder.set_positions_between(object, ends, share)?;
                placed.builder.commit()?
            }
        };
        Ok(update.deformed_cost_ratio)
    }

    pub(crate) fn set_instance_mask(&mut self, instance: u32, mask: u32) -> Result<(), Error> {
        match self {
            State::File(scene) => scene.set_instance_mask(instance, mask),
            State::Placed(placed) => placed.builder.set_instance_mask(instance, mask)?,
        }
        Ok(())
    }

    pub(crate) fn set_group_mask(&mut self, object: u32, group: u32, mask: u32) -> Result<(), Error> {
        match self {
            State::File(scene) => scene.set_group_mask(object, group, mask),
            State::Placed(placed) => placed.builder.set_group_mask(object, group, mask)?,
        }
        Ok(())
    }

    /// The objects whose positions differ from the file.
    pub(crate) fn deformed(&self) -> impl Iterator<Item = u32> {
        (0..self.object_count()).filter(|&object| {
            let (file, row) = self.file_of(object);
            let of_file = file.object(row).expect("an object of the file");
            !std::ptr::eq(self.object(object).positions, of_file.positions)
        })
    }

    /// Returns true if tracks or sequences of the file move the scene.
    pub(crate) fn is_animated(&self) -> bool {
        let State::File(scene) = self else { return false };
        let has_frames = |object| !scene.file().sequence(object).times.is_empty();
        scene.description().is_some_and(|view| !view.tracks.is_empty())
            || (0..scene.object_count()).any(has_frames)
    }

    /// Lets Python place the instances. Answers stay the same.
    pub(crate) fn placed(&mut self) -> Result<&mut Placed, Error> {
        if let State::File(scene) = self {
            let mut placed = Placed::of(scene)?;
            let deformed: Vec<u32> = self.deformed().collect();
            for object in deformed {
                placed.builder.set_positions(object, self.object(object).positions)?;
            }
            placed.builder.commit()?;
            *self = State::Placed(Box::new(placed));
        }
        match self {
            State::Placed(placed) => Ok(placed),
            State::File(_) => unreachable!("it was replaced above"),
        }
    }
}

impl Placed {
    /// The same instances and masks, to be committed.
    fn of(scene: &bth::Scene) -> Result<Placed, Error> {
        let mut builder = bth::SceneBuilder::new();
        builder.add(scene);
        let mut nodes = Vec::new();
        for id in 0..scene.instance_count() {
            let instance = scene.instance(id);
            builder.instance(instance.object, &flat(&instance.to_world))?;
            builder.set_visible(id, instance.visible)?;
            builder.set_instance_mask(id, scene.instance_mask(id))?;
            nodes.push(instance.node);
        }
        for object in 0..scene.object_count() {
            for group in 0..scene.group_count(object) {
                builder.set_group_mask(object, group, scene.group_mask(object, group))?;
            }
        }
        Ok(Placed { builder, file: scene.file().clone(), nodes })
    }

    /// Makes changes visible. If an instance cannot be placed, `undo` takes them back.
    pub(crate) fn commit(
        &mut self,
        undo: impl FnOnce(&mut bth::SceneBuilder) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let Err(error) = self.builder.commit() else { return Ok(()) };
        undo(&mut self.builder)?;
        self.builder.commit()?;
        Err(error)
    }
}

/// The rows of a matrix, one after the other.
pub(crate) fn flat(rows: &[[f64; 4]; 3]) -> Matrix {
    let mut matrix = [0.0; 12];
    matrix.copy_from_slice(rows.as_flattened());
    matrix
}
