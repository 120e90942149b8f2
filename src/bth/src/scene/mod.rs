//! Scenes: opening of compiled files, what they hold, and new positions of their objects.

pub(crate) mod motion;

use crate::instances::World;
use crate::masks::Masks;
use crate::objects::Objects;
use bth_format::error::Error;
use bth_format::file::File;
use bth_format::layout::kind;
use bth_format::object::ObjectView;
use std::path::Path;

/// An open file that can be traced. The instances of a file with scene sections are placed as at a
/// given time (see [`Scene::set_frame`]). In a file without scene sections, each object has one
/// instance with the same index, and object space is world space. A scene of several files, whose
/// instances the caller places, comes from a [`SceneBuilder`](crate::SceneBuilder).
///
/// Queries take `&self` and may run on any number of threads at once. A ray hits nothing if its
/// origin or direction is not finite, its direction is zero, `tmin` or `tmax` is NaN, or `tmin`
/// exceeds `tmax`.
///
/// Results are exact: a ray hits a closed triangle if and only if its line intersects the triangle
/// in real arithmetic at a t that, rounded to f32 as reported, lies in the closed interval from
/// `tmin` to `tmax`. Lines in the plane of a triangle do not hit it. Hits in an object are ordered
/// by t in f64, which is within 2^-28 of the exact one; among equal ones the triangle of the lowest
/// id is reported. Results depend neither on hints nor on the acceleration structures in the file.
/// In a file with scene sections, a ray is first transformed into the object's space, where each
/// component of its origin and direction is rounded to f32 (relative error 2^-24). Among hits of
/// equal t in several instances, the instance of the lowest index is reported.
///
/// In files with opacity (`bthc compile --alpha`) rays pass through the transparent parts of
/// triangles: nearest hits, any hits, counts and lists of hits consider only hits on opaque parts.
/// Crossings, winding numbers, [`Self::contains`] and closest points are about the surface itself
/// and ignore opacity.
#[derive(Debug)]
pub struct Scene {
    objects: Objects,
    /// The instances at the scene's time; `None` if the scene is a file without scene sections.
    world: Option<World>,
    /// True if some triangle of some object may let rays pass.
    has_opacity: bool,
    /// The masks of instances and of groups of triangles.
    masks: Masks,
}

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
    Scene::checked(File::read(path)?).map_err(|e| e.in_file(path))
}

/// Opens a compiled file whose contents are in memory. Copies them, then does the same as [`open`].
///
/// # Errors
/// The errors of [`open`].
pub fn from_bytes(bytes: &[u8]) -> Result<Scene, Error> {
    Scene::checked(File::from_bytes(bytes)?)
}

/// Makes a scene of an open file, which is neither copied nor read again. Checks it like [`open`].
///
/// # Errors
/// The errors of [`open`], except errors about reading, the header and the section table.
pub fn from_file(file: File) -> Result<Scene, Error> {
    Scene::checked(file)
}

/// Maps a compiled file into memory and checks only its header, section table and scene sections,
/// so the time does not depend on the size of its objects.
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
    Scene::with_world(file).map_err(|e| e.in_file(path))
}

impl Scene {
    /// Checks all sections of a file and opens its scene.
    fn checked(file: File) -> Result<Scene, Error> {
        for object in 0..file.object_count() {
            file.check(object)?;
        }
        file.check_object_names()?;
        file.check_images()?;
        Scene::with_world(file)
    }

    /// Checks only the scene sections of a file and opens its scene.
    fn with_world(file: File) -> Result<Scene, Error> {
        let has_opacity = file.table().iter().any(|e| e.kind == kind::OPACITY && e.count != 0);
        let mut objects = Objects::of_file(file);
        let mut world = World::new(&objects)?;
        if let Some(world) = &mut world {
            world.deform_first(&mut objects)?;
        }
        Ok(Scene { objects, world, has_opacity, masks: Masks::default() })
    }

    /// A scene of the objects of several files, without objects and instances yet.
    pub(crate) fn of_several_files() -> Scene {
        let (objects, world) = (Objects::of_several_files(), Some(World::empty()));
        Scene { objects, world, has_opacity: false, masks: Masks::default() }
    }

    /// Adds the objects of another scene to a scene of several files; returns the index of the
    /// first.
    pub(crate) fn add_objects(&mut self, other: &Scene) -> u32 {
        let first = self.object_count();
        self.objects.add(&other.objects);
        if let Some(world) = &mut self.world {
            world.add_objects(self.objects.count());
            for object in first..self.objects.count() {
                let file = self.objects.locate(object).filter(|(_, row)| *row == 0);
                if let Some((file, _)) = file {
                    world.animation.add(file, object);
                }
            }
        }
        self.has_opacity |= other.has_opacity;
        first
    }

    /// The instances; `None` if the file has no scene sections.
    pub(crate) fn world(&self) -> Option<&World> {
        self.world.as_ref()
    }

    /// Returns true if some triangle of some object may let rays pass.
    pub(crate) fn has_opacity(&self) -> bool {
        self.has_opacity
    }

    /// The masks of instances and of groups of triangles.
    pub(crate) fn masks(&self) -> &Masks {
        &self.masks
    }

    /// Mutable access to the masks.
    pub(crate) fn masks_mut(&mut self) -> &mut Masks {
        &mut self.masks
    }

    /// The objects, and mutable access to the instances.
    pub(crate) fn objects_and_world_mut(&mut self) -> (&Objects, &mut Option<World>) {
        (&self.objects, &mut self.world)
    }

    /// Mutable access to the objects and the instances.
    pub(crate) fn parts_mut(&mut self) -> (&mut Objects, &mut Option<World>) {
        (&mut self.objects, &mut self.world)
    }

    /// Mutable access to the objects.
    pub(crate) fn objects_mut(&mut self) -> &mut Objects {
        &mut self.objects
    }

    /// The objects.
    pub(crate) fn objects(&self) -> &Objects {
        &self.objects
    }

    /// The file of the scene.
    ///
    /// # Panics
    /// If the scene was made by a [`SceneBuilder`](crate::SceneBuilder): its objects come from any
    /// number of files, see [`Self::file_of`].
    pub fn file(&self) -> &File {
        self.objects.sole_file().expect("a scene that is a file; `file_of` is for scenes of several files")
    }

    /// The file of an object, and the object's index there, which in a scene that is a file is the
    /// same.
    ///
    /// # Panics
    /// If `object` is not less than [`Self::object_count`].
    pub fn file_of(&self, object: u32) -> (&File, u32) {
        self.objects.locate(object).expect("an object below object_count")
    }

    /// Number of objects.
    pub fn object_count(&self) -> u32 {
        self.objects.count()
    }

    /// The sections of an object, given its index.
    ///
    /// # Panics
    /// If `object` is not less than [`Self::object_count`].
    pub fn object(&self, object: u32) -> ObjectView<'_> {
        *self.view(object)
    }

    /// The sections of an object below [`Self::object_count`].
    #[inline]
    pub(crate) fn view(&self, object: u32) -> &ObjectView<'_> {
        self.objects.view(object)
    }

    /// A scene with given instances.
    #[cfg(test)]
    pub(crate) fn with_instances(file: File, world: World) -> Scene {
        Scene {
            objects: Objects::of_file(file),
            world: Some(world),
            has_opacity: false,
            masks: Masks::default(),
        }
    }

    /// The object of a model whose only object was given no new positions and is opaque; `None`
    /// elsewhere, and before something was traced.
    #[inline(always)]
    pub(crate) fn sole_opaque(&self) -> Option<&ObjectView<'_>> {
        if self.world.is_none() && !self.has_opacity { self.objects.sole_view() } else { None }
    }

    /// The object and the index of the only visible instance, if there is exactly one and its
    /// object space is world space. Rays are then traced directly in the object, without the top
    /// level.
    #[inline(never)]
    pub(crate) fn sole(&self) -> Option<(&ObjectView<'_>, u32)> {
        let Some(world) = &self.world else {
            return (self.object_count() == 1).then(|| (self.view(0), 0));
        };
        let (instance, object) = world.sole()?;
        world.mark_traced(object);
        Some((self.view(object), instance))
    }

    /// Size in bytes of the sections that traversal reads.
    pub fn resident_bytes(&self) -> u64 {
        self.objects.resident_bytes()
    }
}
