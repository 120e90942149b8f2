//! A scene: what callers open and trace.

use crate::instances::World;
use crate::object;
use crate::query::Steps;
use crate::rays::{Hit, Ray, Surface};
use bth_format::error::Error;
use bth_format::file::File;
use bth_format::layout::NONE;
use bth_format::object::ObjectView;
use std::path::Path;

/// An open file, ready to trace. A file with a scene shows its instances at a time (see
/// [`Scene::set_frame`]); in others each object stands once in the world, untransformed: instance
/// and object numbers are the same.
///
/// Queries take `&self` and may run on any number of threads. A ray whose origin or direction is not
/// finite, whose direction is zero or whose `tmin` exceeds its `tmax` hits nothing.
///
/// Answers are exact: a ray hits a closed triangle if and only if its real line meets it within
/// [`tmin`, `tmax`] (t as reported, rounded to f32), lines within the plane of a triangle excepted; of equal
/// hits the triangle of least id is reported. They depend neither on hints nor on the structure in the file.
/// In a scene the ray is first transformed into the object's space and rounded there: relative 2^-24 for each
/// component of origin and direction. Of equal t the instance of least number is reported.
#[derive(Debug)]
pub struct Scene {
    file: File,
    /// What the file's scene sections say, at a time; `None` without them.
    world: Option<World>,
}

/// Reads a compiled file into memory and checks every index, so that tracing is safe whatever the
/// file holds. Costs O(file); hashes and geometry are [`mod@bth_format::verify`]'s business.
///
/// # Errors
/// `BTH-O…` when it cannot be read, `BTH-F0…` when header or table, `BTH-F1…` when contents break the
/// specification; the error names the section and byte. `BTH-S…` when the first frame of its scene cannot be shown.
pub fn open(path: impl AsRef<Path>) -> Result<Scene, Error> {
    let path = path.as_ref();
    Scene::checked(File::read(path)?).map_err(|e| e.in_file(path))
}

/// As [`open`], from bytes, which are copied.
///
/// # Errors
/// As [`open`].
pub fn from_bytes(bytes: &[u8]) -> Result<Scene, Error> {
    Scene::checked(File::from_bytes(bytes)?)
}

/// Maps a compiled file and checks header, section table and scene only: ready at once whatever its size.
///
/// # Safety
/// Until the scene is dropped nobody may write to the file or truncate it (see [`File::map`]).
/// The contents must be such that [`open`] accepts them: files that `bthc` wrote and nobody changed. With
/// others, tracing may panic or never end; it does not read out of bounds.
///
/// # Errors
/// As [`open`], without those about contents of objects.
#[allow(unsafe_code)]
pub unsafe fn map(path: impl AsRef<Path>) -> Result<Scene, Error> {
    // SAFETY: the caller's contract includes that of `File::map`.
    let file = unsafe { File::map(path.as_ref())? };
    Scene::with_world(file)
}

impl Scene {
    fn checked(file: File) -> Result<Scene, Error> {
        for object in 0..file.object_count() {
            file.check(object)?;
        }
        Scene::with_world(file)
    }

    fn with_world(file: File) -> Result<Scene, Error> {
        let world = World::new(&file)?;
        Ok(Scene { file, world })
    }

    /// The instances, if the file has a scene.
    pub(crate) fn world(&self) -> Option<&World> {
        self.world.as_ref()
    }

    /// The file and the instances, to move these.
    pub(crate) fn parts_mut(&mut self) -> (&File, &mut Option<World>) {
        (&self.file, &mut self.world)
    }

    /// The file behind the scene.
    pub fn file(&self) -> &File {
        &self.file
    }

    /// Objects in the scene.
    pub fn object_count(&self) -> u32 {
        self.file.object_count()
    }

    /// The sections of an object.
    ///
    /// # Panics
    /// If there is no such object.
    pub fn object(&self, object: u32) -> ObjectView<'_> {
        self.file.object(object).expect("an object below object_count, checked when opened")
    }

    #[inline]
    fn view(&self, object: u32) -> &ObjectView<'_> {
        self.file.view(object).expect("an object below object_count, checked when opened")
    }

    /// A file and its instances.
    #[cfg(test)]
    pub(crate) fn of(file: File, world: World) -> Scene {
        Scene { file, world: Some(world) }
    }

    /// The only object that rays can meet, where its space is the world's, and the instance it is: no top level is needed then.
    #[inline(always)]
    fn sole(&self) -> Option<(&ObjectView<'_>, u32)> {
        let Some(world) = &self.world else {
            return (self.object_count() == 1).then(|| (self.view(0), 0));
        };
        let (instance, object) = world.sole()?;
        world.touch(object);
        Some((self.view(object), instance))
    }

    /// Bytes of the sections that traversal reads.
    pub fn resident_bytes(&self) -> u64 {
        self.file.resident_bytes()
    }

    /// Nearest hit of a ray. `from` is the surface that it starts on, or [`Surface::NONE`]: a hint,
    /// where to begin, which never changes the answer.
    pub fn nearest(&self, ray: &Ray, from: Surface) -> Hit {
        let mut hit = Hit::MISS;
        self.nearest_batch(std::slice::from_ref(ray), Some(&[from]), std::slice::from_mut(&mut hit));
        hit
    }

    /// As [`Self::nearest`], with a count of the work.
    pub fn nearest_counted(&self, ray: &Ray, from: Surface) -> (Hit, Steps) {
        if let Some((object, instance)) = self.sole() {
            return object::nearest_counted(object, ray, hint(from, instance), instance);
        }
        if let Some(world) = &self.world {
            return world.nearest_counted(&self.file, ray, from);
        }
        let (mut best, mut steps, mut ray) = (Hit::MISS, Steps::default(), *ray);
        for instance in 0..self.object_count() {
            let (hit, more) =
                object::nearest_counted(self.view(instance), &ray, hint(from, instance), instance);
            steps += more;
            if hit.t < best.t {
                (best, ray.tmax) = (hit, hit.t);
            }
        }
        (best, steps)
    }

    /// Whether a ray hits anything; `from` as for [`Self::nearest`].
    pub fn any(&self, ray: &Ray, from: Surface) -> bool {
        let mut found = false;
        self.any_batch(std::slice::from_ref(ray), Some(&[from]), std::slice::from_mut(&mut found));
        found
    }

    /// Nearest hits of many rays; `from`, if given, names the surface that each starts on.
    ///
    /// # Panics
    /// If the slices differ in length.
    #[inline]
    pub fn nearest_batch(&self, rays: &[Ray], from: Option<&[Surface]>, hits: &mut [Hit]) {
        check_lengths(rays, from, hits.len());
        match (self.sole(), rays, &mut *hits) {
            (Some((object, instance)), [ray], [hit]) => {
                object::nearest_to(object, ray, hint(surface(from, 0), instance), instance, hit);
            }
            (sole, ..) => self.nearest_many(sole, rays, from, hits),
        }
    }

    /// As [`Self::nearest_batch`], for more rays than one, or more objects.
    #[inline(never)]
    fn nearest_many(
        &self,
        sole: Option<(&ObjectView<'_>, u32)>,
        rays: &[Ray],
        from: Option<&[Surface]>,
        hits: &mut [Hit],
    ) {
        object::fill_misses(hits);
        if let Some((object, instance)) = sole {
            if rays.len() < object::MIN_BATCH {
                for (i, (ray, hit)) in rays.iter().zip(hits).enumerate() {
                    *hit = object::nearest(object, ray, hint(surface(from, i), instance), instance);
                }
                return;
            }
            let from = hints(object, from, instance);
            return object::with_scratch(|scratch| {
                object::nearest_batch(object, rays, from.as_deref(), instance, scratch, hits);
            });
        }
        if let Some(world) = &self.world {
            return world.nearest(&self.file, rays, from, hits);
        }
        for instance in 0..self.object_count() {
            let object = self.view(instance);
            for (i, (ray, best)) in rays.iter().zip(hits.iter_mut()).enumerate() {
                // Not `min`, which would make a range of NaN.
                let tmax = if best.t < ray.tmax { best.t } else { ray.tmax };
                let ray = Ray { tmax, ..*ray };
                let hit = object::nearest(object, &ray, hint(surface(from, i), instance), instance);
                if hit.t < best.t {
                    *best = hit;
                }
            }
        }
    }

    /// Whether each of many rays hits anything.
    ///
    /// # Panics
    /// If the slices differ in length.
    #[inline]
    pub fn any_batch(&self, rays: &[Ray], from: Option<&[Surface]>, found: &mut [bool]) {
        check_lengths(rays, from, found.len());
        match (self.sole(), rays, &mut *found) {
            (Some((object, instance)), [ray], [found]) => {
                *found = object::any(object, ray, hint(surface(from, 0), instance));
            }
            (sole, ..) => self.any_many(sole, rays, from, found),
        }
    }

    /// As [`Self::nearest_many`], of [`Self::any_batch`].
    #[inline(never)]
    fn any_many(
        &self,
        sole: Option<(&ObjectView<'_>, u32)>,
        rays: &[Ray],
        from: Option<&[Surface]>,
        found: &mut [bool],
    ) {
        found.fill(false);
        if let Some((object, instance)) = sole {
            if rays.len() < object::MIN_BATCH {
                for (i, (ray, found)) in rays.iter().zip(found).enumerate() {
                    *found = object::any(object, ray, hint(surface(from, i), instance));
                }
                return;
            }
            let from = hints(object, from, instance);
            return object::with_scratch(|scratch| {
                object::any_batch(object, rays, from.as_deref(), scratch, found);
            });
        }
        if let Some(world) = &self.world {
            return world.any(&self.file, rays, from, found);
        }
        for instance in 0..self.object_count() {
            let object = self.view(instance);
            for (i, (ray, found)) in rays.iter().zip(found.iter_mut()).enumerate() {
                *found = *found || object::any(object, ray, hint(surface(from, i), instance));
            }
        }
    }
}

fn check_lengths(rays: &[Ray], from: Option<&[Surface]>, results: usize) {
    assert_eq!(rays.len(), results, "as many results as rays");
    assert!(from.is_none_or(|f| f.len() == rays.len()), "as many surfaces as rays");
}

fn surface(from: Option<&[Surface]>, ray: usize) -> Surface {
    from.map_or(Surface::NONE, |f| f[ray])
}

/// The triangles of the only object that rays start on, if that is of use.
fn hints(object: &ObjectView<'_>, from: Option<&[Surface]>, instance: u32) -> Option<Vec<u32>> {
    let from = from.filter(|_| !object.tet_leaves.is_empty())?;
    Some(from.iter().map(|&from| hint(from, instance)).collect())
}

/// The triangle of an object that a ray starts on, or `NONE`.
fn hint(from: Surface, instance: u32) -> u32 {
    if from.instance == instance { from.triangle } else { NONE }
}
