//! Instances at a scene's time.

use crate::instances::World;
use crate::objects::Objects;
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
/// frame. Does not check the sections of objects.
///
/// # Errors
/// The errors of [`File::check_scene`], and `BTH-S001` or `BTH-S002` as in
/// [`Scene::set_seconds`](crate::Scene::set_seconds).
pub fn check_first_frame(file: &File) -> Result<(), Error> {
    World::new(&Objects::of_file(file.clone())).map(drop)
}

/// Checks that a time is finite.
pub(crate) fn check_time(seconds: f64) -> Result<(), Error> {
    if seconds.is_finite() {
        return Ok(());
    }
    Err(Error::of_call(Code::NotFinite, "a finite time", format!("{seconds}")))
}
