//! Motion of a [`Scene`]: instances at its time, and new positions of objects.

use crate::clock;
use crate::instances::{Trees, World};
use crate::objects::Objects;
use crate::refit::OwnPositions;
use crate::scene::Scene;
use crate::update::Update;
use bth_format::{Code, Error, File};

/// An instance at the scene's time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstanceView {
    /// Index of its object; `u32::MAX` if a scene builder has removed the instance.
    pub object: u32,
    /// Index of the node to which it is attached, in the file of its object; `u32::MAX` in a file
    /// without scene sections and for instances that the caller of a scene builder has placed.
    pub node: u32,
    /// Transform from object space to world space: the rows of a 3×4 matrix that is applied to
    /// columns (x, y, z, 1).
    pub to_world: [[f64; 4]; 3],
    /// True if rays can hit it: it is neither hidden nor scaled to zero, and its object has
    /// triangles. Always true in a file without scene sections.
    pub visible: bool,
}

/// Checks the scene sections of a file, and that every visible instance can be placed at the first
/// frame. The sections of objects are not checked, and only their `OBJECT` rows have to be there.
/// Returns the trees that the file may hold.
///
/// # Errors
/// Those of [`File::check_scene`], and `BTH-S001` or `BTH-S002` as for [`Scene::set_seconds`].
pub fn check_first_frame(file: &File) -> Result<Trees, Error> {
    World::first_trees(&Objects::of_file(file.clone()))
}

/// Checks that a time is finite.
pub(crate) fn check_time(seconds: f64) -> Result<(), Error> {
    if seconds.is_finite() {
        return Ok(());
    }
    Err(Error::of_call(Code::NotFinite, "a finite time", format!("{seconds}")))
}

/// Implements [`Scene::instance`].
pub(super) fn instance(scene: &Scene, instance: u32) -> InstanceView {
    let Some(world) = scene.world() else {
        assert!(instance < scene.object_count(), "an instance below instance_count");
        let row = |k: usize| std::array::from_fn(|j| f64::from(u8::from(j == k)));
        let to_world = [row(0), row(1), row(2)];
        return InstanceView { object: instance, node: bth_format::layout::NONE, to_world, visible: true };
    };
    assert!(instance < world.instance_count(), "an instance below instance_count");
    let visible = world.placed(instance).is_some();
    let row = world.row(scene.objects(), instance);
    InstanceView { object: row.object, node: row.node, to_world: row.to_world.rows(), visible }
}

/// Stages positions of an object, refits it, and places its instances again. After an error the
/// scene is unchanged.
pub(super) fn refit_object(
    scene: &mut Scene,
    object: u32,
    stage: impl FnOnce(&mut OwnPositions) -> Result<(), Error>,
) -> Result<Update, Error> {
    let start = clock::now();
    let (objects, world) = scene.parts_mut();
    stage(objects.own_positions(object)?)?;
    let refitted = objects.refit(&[object], start);
    let placed = match world {
        Some(world) => world.place_again(objects, &[object]),
        None => Ok(Update { visible: objects.count() as usize, ..Update::default() }),
    };
    match placed {
        Ok(update) => Ok(update.with_refit(refitted)),
        Err(failed) => {
            objects.undo_refit(&[object]);
            if let Some(world) = world {
                world.forget_parts(&[object]);
            }
            Err(failed.error(&format!("instance {}", failed.instance)))
        }
    }
}
