//! Opening of compiled files as scenes.

use super::Scene;
use crate::instances::World;
use crate::masks::Masks;
use crate::objects::Objects;
use bth_format::error::Error;
use bth_format::file::File;
use bth_format::layout::kind;
use std::path::Path;

/// Reads a compiled file into memory and checks every index, so that tracing is safe for any
/// contents of the file. The time is linear in the size of the file. Hashes and geometry are not
/// checked; see [`mod@bth_format::verify`].
///
/// # Errors
/// - `BTH-O…` if the file cannot be read.
/// - `BTH-F0…` if the header or the section table violates the specification, `BTH-F1…` if the
///   contents of a section do. The error gives the section and the byte offset.
/// - `BTH-S…` if an instance cannot be placed at the first frame of the scene.
pub fn open(path: impl AsRef<Path>) -> Result<Scene, Error> {
    let path = path.as_ref();
    checked(File::read(path)?).map_err(|e| e.in_file(path))
}

/// Opens a compiled file whose contents are in memory. Copies them, then does the same as [`open`].
///
/// # Errors
/// The errors of [`open`].
pub fn from_bytes(bytes: &[u8]) -> Result<Scene, Error> {
    checked(File::from_bytes(bytes)?)
}

/// Makes a scene of an open file, which is neither copied nor read again. Checks it like [`open`].
///
/// # Errors
/// The errors of [`open`], except errors about reading, the header and the section table.
pub fn from_file(file: File) -> Result<Scene, Error> {
    checked(file)
}

/// Maps a compiled file into memory and checks only its header, section table and scene sections,
/// so the time does not depend on the size of its objects. Of a scene with stored trees the scene
/// sections are not checked, either: rows that the trees hold are read when rays come near them.
///
/// # Safety
/// Until the scene, and every scene that [`SceneBuilder`](crate::SceneBuilder) makes of it, is
/// dropped, the file must not be written to or truncated (see [`File::map`]). [`open`] must accept
/// its contents. It accepts unchanged files that `bthc` has written. With other contents tracing
/// may panic or not terminate, but it does not read out of bounds.
///
/// # Errors
/// The errors of [`open`], except errors about the contents of objects.
#[allow(unsafe_code)]
pub unsafe fn map(path: impl AsRef<Path>) -> Result<Scene, Error> {
    let path = path.as_ref();
    // SAFETY: the caller's contract includes the contract of `File::map`.
    let file = unsafe { File::map(path)? };
    with_world(file, World::with_trees).map_err(|e| e.in_file(path))
}

/// Checks all sections of a file and opens its scene.
fn checked(file: File) -> Result<Scene, Error> {
    for object in 0..file.object_count() {
        file.check(object)?;
    }
    file.check_object_names()?;
    file.check_images()?;
    with_world(file, |_| Ok(None))
}

/// Opens the scene of a file. Checks only the scene sections, and not them where `stored` returns
/// instances.
fn with_world(
    file: File,
    stored: impl FnOnce(&Objects) -> Result<Option<World>, Error>,
) -> Result<Scene, Error> {
    let has = |section: u32| file.table().iter().any(|e| e.kind == section && e.count != 0);
    let (has_opacity, has_tetrahedra) = (has(kind::OPACITY), has(kind::TET_LEAVES));
    let mut objects = Objects::of_file(file);
    let mut world = match stored(&objects)? {
        Some(world) => Some(world),
        None => World::new(&objects)?,
    };
    match &mut world {
        Some(world) => world.deform_first(&mut objects)?,
        // Objects with positions in f64 are traced as instances.
        None if objects.any_exact() => world = Some(World::of_objects_in_place(&objects)?),
        None => {}
    }
    Ok(Scene { objects, world, has_opacity, has_tetrahedra, masks: Masks::default() })
}
