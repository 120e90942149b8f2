//! Scenes: opening of compiled files and queries by rays in world space.

use crate::SMALL;
use crate::instances::World;
use crate::masks::Masks;
use crate::object;
use crate::objects::Objects;
use crate::query::Steps;
use crate::rays::{Hit, PrimitiveRef, Ray};
use bth_format::error::Error;
use bth_format::file::File;
use bth_format::layout::{NONE, kind};
use bth_format::object::ObjectView;
use std::path::Path;

/// An open file that can be traced. The instances of a file with scene sections are placed as at a given time (see
/// [`Scene::set_frame`]). In a file without scene sections, each object has one instance with the same index, and object space is
/// world space. A scene of several files, whose instances the caller places, comes from a
/// [`SceneBuilder`](crate::SceneBuilder).
///
/// Queries take `&self` and may run on any number of threads at once. A ray hits nothing if its origin or direction is not
/// finite, its direction is zero, `tmin` or `tmax` is NaN, or `tmin` exceeds `tmax`.
///
/// Results are exact: a ray hits a closed triangle if and only if its line intersects the triangle in real arithmetic at a t
/// that, rounded to f32 as reported, lies in the closed interval from `tmin` to `tmax`. Lines in the plane of a triangle do not
/// hit it. Among hits of equal t in an object the triangle of least id is reported. Results depend neither on hints nor on the
/// acceleration structures in the file. In a file with scene sections, a ray is first transformed into the object's space, where
/// each component of its origin and direction is rounded to f32 (relative error 2^-24). Among hits of equal t in several
/// instances that of least index is reported.
///
/// In files with opacity (`bthc compile --alpha`) rays pass through the transparent parts of triangles: nearest and any hits,
/// counts, and all other hits are those on parts that are not transparent. Crossings, winding numbers, [`Self::contains`] and
/// closest points are about the surface itself and look at no opacity.
#[derive(Debug)]
pub struct Scene {
    objects: Objects,
    /// The instances at the scene's time; `None` if the scene is a file without scene sections.
    world: Option<World>,
    /// Whether some triangle of some object may let rays pass.
    has_opacity: bool,
    /// The masks of instances and of groups of triangles.
    masks: Masks,
}

/// Reads a compiled file into memory and checks every index, so that tracing is safe for any contents of the file. The time is
/// linear in the size of the file. Hashes and geometry are not checked; see [`mod@bth_format::verify`].
///
/// # Errors
/// - `BTH-O…` if the file cannot be read.
/// - `BTH-F0…` if the header or the section table violates the specification, `BTH-F1…` if the contents of a section do. The error
///   gives the section and the byte offset.
/// - `BTH-S…` if an instance cannot be placed at the first frame of the scene.
pub fn open(path: impl AsRef<Path>) -> Result<Scene, Error> {
    let path = path.as_ref();
    Scene::checked(File::read(path)?).map_err(|e| e.in_file(path))
}

/// As [`open`], for the contents of a file in memory, which are copied.
///
/// # Errors
/// As [`open`].
pub fn from_bytes(bytes: &[u8]) -> Result<Scene, Error> {
    Scene::checked(File::from_bytes(bytes)?)
}

/// As [`open`], for an open file, which is neither copied nor read again.
///
/// # Errors
/// As [`open`], except for those about reading, the header and the section table.
pub fn from_file(file: File) -> Result<Scene, Error> {
    Scene::checked(file)
}

/// Maps a compiled file into memory and checks only its header, section table and scene sections, so the time does not depend on
/// the size of its objects.
///
/// # Safety
/// Until the scene, and every scene that [`SceneBuilder`](crate::SceneBuilder) makes of it, is dropped, the file must not be written to or truncated (see [`File::map`]). Its contents must be such that
/// [`open`] accepts them, as those of unchanged files that `bthc` has written. With other contents tracing may panic or not
/// terminate, but it does not read out of bounds.
///
/// # Errors
/// As [`open`], except for those about the contents of objects.
#[allow(unsafe_code)]
pub unsafe fn map(path: impl AsRef<Path>) -> Result<Scene, Error> {
    // SAFETY: the caller's contract includes that of `File::map`.
    let file = unsafe { File::map(path.as_ref())? };
    Scene::with_world(file)
}

impl Scene {
    /// Checks all sections of a file and opens its scene.
    fn checked(file: File) -> Result<Scene, Error> {
        for object in 0..file.object_count() {
            file.check(object)?;
        }
        file.check_object_names()?;
        file.check_images()?;
        file.check_segments()?;
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

    /// Adds the objects of another scene to a scene of several files; returns the index of the first.
    pub(crate) fn add_objects(&mut self, other: &Scene) -> u32 {
        let first = self.object_count();
        self.objects.add(&other.objects);
        if let Some(world) = &mut self.world {
            world.add_objects(self.objects.count());
            for object in first..self.objects.count() {
                let file = self.objects.locate(object).filter(|(_, row)| *row == 0);
                if let Some((file, _)) = file {
                    world.deformers.add(file, object);
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
    /// If the scene was made by a [`SceneBuilder`](crate::SceneBuilder): its objects come from any number of files, see
    /// [`Self::file_of`].
    pub fn file(&self) -> &File {
        self.objects.sole_file().expect("a scene that is a file; `file_of` is for scenes of several files")
    }

    /// The file of an object, and the object's index there, which in a scene that is a file is the same.
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

    /// The object and the index of the only visible instance, if there is exactly one and its object space is world space. Rays
    /// are then traced directly in the object, without the top level.
    #[inline(always)]
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

    /// Nearest hit of a ray in world space.
    pub fn nearest(&self, ray: &Ray) -> Option<Hit> {
        self.nearest_from(ray, PrimitiveRef::NONE)
    }

    /// As [`Self::nearest`], for a ray that starts on a triangle, or [`PrimitiveRef::NONE`]. The triangle is a hint where a
    /// traversal of tetrahedra may begin, and never changes the result.
    pub fn nearest_from(&self, ray: &Ray, triangle: PrimitiveRef) -> Option<Hit> {
        let mut hit = Hit::MISS;
        self.nearest_of_ray(ray, triangle, &mut hit);
        hit.is_hit().then_some(hit)
    }

    /// Whether a ray in world space hits anything.
    pub fn any(&self, ray: &Ray) -> bool {
        self.any_from(ray, PrimitiveRef::NONE)
    }

    /// As [`Self::any`], with a hint as for [`Self::nearest_from`].
    pub fn any_from(&self, ray: &Ray, triangle: PrimitiveRef) -> bool {
        self.any_of_ray(ray, triangle)
    }

    /// As [`Self::nearest_from`], with statistics of the traversal. A miss is [`Hit::MISS`].
    pub fn nearest_counted(&self, ray: &Ray, from: PrimitiveRef) -> (Hit, Steps) {
        let counted = self.nearest_of_all_counted(ray, from);
        if self.has_opacity { self.counted_not_transparent(ray, counted) } else { counted }
    }

    /// As [`Self::nearest_counted`], as if every triangle were opaque.
    fn nearest_of_all_counted(&self, ray: &Ray, from: PrimitiveRef) -> (Hit, Steps) {
        if let Some((object, instance)) = self.sole() {
            return object::nearest_counted(object, ray, hint(from, instance), instance);
        }
        if let Some(world) = &self.world {
            return world.nearest_counted(&self.objects, ray, from);
        }
        let (mut best, mut steps, mut ray) = (Hit::MISS, Steps::default(), *ray);
        for instance in 0..self.object_count() {
            let (hit, object_steps) =
                object::nearest_counted(self.view(instance), &ray, hint(from, instance), instance);
            steps += object_steps;
            if hit.t < best.t {
                (best, ray.tmax) = (hit, hit.t);
            }
        }
        (best, steps)
    }

    /// Stores the nearest hit of a ray, or [`Hit::MISS`]. `from` is the triangle on which it starts, or [`PrimitiveRef::NONE`].
    ///
    /// Not inlined: every crate that traces single rays would hold kernels of its own.
    #[inline(never)]
    pub(crate) fn nearest_of_ray(&self, ray: &Ray, from: PrimitiveRef, hit: &mut Hit) {
        match self.opaque_model() {
            Some(object) => object::trace_nearest(object, ray, hint(from, 0), 0, hit),
            None => self.nearest_hits_of(std::slice::from_ref(ray), Some(&[from]), std::slice::from_mut(hit)),
        }
    }

    /// Whether a ray hits anything; `from` as for [`Self::nearest_of_ray`].
    #[inline(never)]
    pub(crate) fn any_of_ray(&self, ray: &Ray, from: PrimitiveRef) -> bool {
        if let Some(object) = self.opaque_model() {
            return object::trace_any(object, ray, hint(from, 0));
        }
        let mut found = [false];
        self.any_hits_of(std::slice::from_ref(ray), Some(&[from]), &mut found);
        found[0]
    }

    /// The object of a scene that is a model: a file of one opaque object without scene sections. A single ray in it needs no more
    /// than this test.
    #[inline(always)]
    fn opaque_model(&self) -> Option<&ObjectView<'_>> {
        if self.world.is_some() || self.has_opacity { None } else { self.objects.sole_view() }
    }

    /// Stores the nearest hit of each ray, or [`Hit::MISS`]. `hits`, and `from` if it is given, are as long as `rays`.
    #[inline(never)]
    pub(crate) fn nearest_hits_of(&self, rays: &[Ray], from: Option<&[PrimitiveRef]>, hits: &mut [Hit]) {
        if self.has_opacity {
            return self.nearest_not_transparent(rays, from, hits);
        }
        self.nearest_of_all(rays, from, hits);
    }

    /// As [`Self::nearest_hits_of`], as if every triangle were opaque.
    pub(crate) fn nearest_of_all(&self, rays: &[Ray], from: Option<&[PrimitiveRef]>, hits: &mut [Hit]) {
        object::fill_misses(hits);
        if let Some((object, instance)) = self.sole() {
            if rays.len() < object::MIN_BATCH {
                for (i, (ray, hit)) in rays.iter().zip(hits).enumerate() {
                    *hit = object::nearest(object, ray, hint(start_primitive(from, i), instance), instance);
                }
                return;
            }
            return object::with_scratch(|scratch| {
                object::nearest_batch(object, rays, from, instance, scratch, hits);
            });
        }
        if let Some(world) = &self.world {
            return world.nearest(&self.objects, rays, from, hits);
        }
        for instance in 0..self.object_count() {
            let object = self.view(instance);
            for (i, (ray, best)) in rays.iter().zip(hits.iter_mut()).enumerate() {
                // Not `f32::min`, which would replace a `tmax` of NaN by a number.
                let tmax = if best.t < ray.tmax { best.t } else { ray.tmax };
                let ray = Ray { tmax, ..*ray };
                let hit = object::nearest(object, &ray, hint(start_primitive(from, i), instance), instance);
                if hit.t < best.t {
                    *best = hit;
                }
            }
        }
    }

    /// Stores for each ray whether it hits anything. `found`, and `from` if it is given, are as long as `rays`.
    #[inline(never)]
    pub(crate) fn any_hits_of(&self, rays: &[Ray], from: Option<&[PrimitiveRef]>, found: &mut [bool]) {
        if self.has_opacity {
            return self.any_not_transparent(rays, from, found);
        }
        self.any_of_all(rays, from, found);
    }

    /// As [`Self::any_hits_of`], as if every triangle were opaque.
    pub(crate) fn any_of_all(&self, rays: &[Ray], from: Option<&[PrimitiveRef]>, found: &mut [bool]) {
        found.fill(false);
        if let Some((object, instance)) = self.sole() {
            if rays.len() < object::MIN_BATCH {
                for (i, (ray, found)) in rays.iter().zip(found).enumerate() {
                    *found = object::any(object, ray, hint(start_primitive(from, i), instance));
                }
                return;
            }
            return object::with_scratch(|scratch| {
                object::any_batch(object, rays, from, instance, scratch, found);
            });
        }
        if let Some(world) = &self.world {
            return world.any(&self.objects, rays, from, found);
        }
        for instance in 0..self.object_count() {
            let object = self.view(instance);
            for (i, (ray, found)) in rays.iter().zip(found.iter_mut()).enumerate() {
                *found = *found || object::any(object, ray, hint(start_primitive(from, i), instance));
            }
        }
    }
}

/// The triangle on which a ray of a batch starts, or [`PrimitiveRef::NONE`].
fn start_primitive(from: Option<&[PrimitiveRef]>, ray: usize) -> PrimitiveRef {
    from.map_or(PrimitiveRef::NONE, |f| f[ray])
}

/// The triangle of an instance's object on which a ray starts, or `NONE`.
fn hint(from: PrimitiveRef, instance: u32) -> u32 {
    if SMALL { NONE } else { from.triangle_of(instance) }
}
