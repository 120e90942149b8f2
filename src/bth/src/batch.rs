//! Queries of many rays in one call.

use crate::hits::Accept;
use crate::rays::{Hit, PrimitiveRef, Ray};
use crate::scene::Scene;

/// Rays in world space that are traced together, with options. Made by [`Scene::batch`].
///
/// Rays that are traced together answer as each would alone, to the last bit. About a thousand coherent rays that are adjacent in
/// the slice (a tile of a picture, the shadow rays of a tile) are traced fastest.
///
/// ```no_run
/// use bth::rays::{Hit, Ray};
///
/// let scene = bth::open("bunny.bth")?;
/// let rays = vec![Ray::new([0.0, 0.1, 1.0], [0.0, 0.0, -1.0]); 1024];
/// let mut hits = vec![Hit::MISS; rays.len()];
/// scene.batch(&rays).nearest(&mut hits);
///
/// // The triangles on which the next rays start are a hint, which never changes an answer.
/// let onward: Vec<Ray> = rays.iter().zip(&hits).map(|(ray, hit)| Ray::new(ray.at(hit.t), [0.0, 1.0, 0.0])).collect();
/// let starts: Vec<_> = hits.iter().map(|hit| hit.primitive).collect();
/// let mut blocked = vec![false; rays.len()];
/// scene.batch(&onward).from(&starts[..]).any(&mut blocked);
/// # Ok::<(), bth::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
#[must_use = "nothing is traced before `nearest` or `any`"]
pub struct RayBatch<'a> {
    scene: &'a Scene,
    rays: &'a [Ray],
    from: Option<&'a [PrimitiveRef]>,
    accept: Option<&'a Accept<'a>>,
    #[cfg(feature = "rayon")]
    parallel: bool,
}

/// Number of rays that one task of a parallel batch traces: many enough for packets, few enough to balance.
#[cfg(feature = "rayon")]
const TASK: usize = 4096;

impl Scene {
    /// A batch of rays, to be traced by [`RayBatch::nearest`] or [`RayBatch::any`].
    #[inline]
    pub fn batch<'a>(&'a self, rays: &'a [Ray]) -> RayBatch<'a> {
        RayBatch {
            scene: self,
            rays,
            from: None,
            accept: None,
            #[cfg(feature = "rayon")]
            parallel: false,
        }
    }
}

impl<'a> RayBatch<'a> {
    /// Sets for each ray the triangle on which it starts, or [`PrimitiveRef::NONE`]: a hint where a traversal of tetrahedra may
    /// begin. `None` for no hints.
    #[inline]
    pub fn from(self, triangles: impl Into<Option<&'a [PrimitiveRef]>>) -> Self {
        RayBatch { from: triangles.into(), ..self }
    }

    /// Sets what the rays are allowed to hit; by default everything, whatever the masks of the scene. Where something is excluded, rays
    /// are traced one at a time and hints are not used, as by [`Scene::nearest_accepted`].
    #[inline]
    pub fn accept(self, accept: &'a Accept<'a>) -> Self {
        RayBatch { accept: Some(accept), ..self }
    }

    /// Traces on all threads of the current pool of `rayon`. Answers do not depend on the number of threads.
    #[cfg(feature = "rayon")]
    #[inline]
    pub fn parallel(self) -> Self {
        RayBatch { parallel: true, ..self }
    }

    /// Stores the nearest hit of each ray, or [`Hit::MISS`].
    ///
    /// # Panics
    /// If there are not as many hits, and hints if there are any, as rays.
    // What a single ray needs is inlined into the caller: what is not asked for, such as conditions, then takes no time.
    #[inline(always)]
    pub fn nearest(self, hits: &mut [Hit]) {
        self.check_lengths(hits.len());
        match (self.rays, &mut *hits, self.accept) {
            ([ray], [hit], None) => self.scene.nearest_of_ray(ray, self.first_start(), hit),
            _ => self.nearest_of_many(hits),
        }
    }

    /// Stores for each ray whether it hits anything.
    ///
    /// # Panics
    /// As [`Self::nearest`].
    #[inline(always)]
    pub fn any(self, found: &mut [bool]) {
        self.check_lengths(found.len());
        match (self.rays, &mut *found, self.accept) {
            ([ray], [found], None) => *found = self.scene.any_of_ray(ray, self.first_start()),
            _ => self.any_of_many(found),
        }
    }

    /// As [`Self::nearest`], for any number of rays and any conditions.
    #[inline(never)]
    fn nearest_of_many(self, hits: &mut [Hit]) {
        #[cfg(feature = "rayon")]
        if self.parallel {
            return self.in_tasks(hits, |part, hits| part.nearest_of_many(hits));
        }
        match self.conditions() {
            None => self.scene.nearest_hits_of(self.rays, self.from, hits),
            Some(accept) => self.scene.nearest_accepted_batch(self.rays, accept, hits),
        }
    }

    /// As [`Self::any`], for any number of rays and any conditions.
    #[inline(never)]
    fn any_of_many(self, found: &mut [bool]) {
        #[cfg(feature = "rayon")]
        if self.parallel {
            return self.in_tasks(found, |part, found| part.any_of_many(found));
        }
        match self.conditions() {
            None => self.scene.any_hits_of(self.rays, self.from, found),
            Some(accept) => self.scene.any_accepted_batch(self.rays, accept, found),
        }
    }

    /// The triangle on which the first ray starts, or [`PrimitiveRef::NONE`].
    #[inline(always)]
    fn first_start(&self) -> PrimitiveRef {
        self.from.and_then(|from| from.first()).map_or(PrimitiveRef::NONE, |&first| first)
    }

    /// What the rays are allowed to hit; `None` if that is everything.
    fn conditions(&self) -> Option<&'a Accept<'a>> {
        self.accept.filter(|accept| !self.scene.accepts_everything(accept))
    }

    #[inline(always)]
    fn check_lengths(&self, results: usize) {
        assert_eq!(self.rays.len(), results, "as many results as rays");
        assert!(self.from.is_none_or(|from| from.len() == results), "as many hints as rays");
    }

    /// Calls `trace` for each part of the rays and its results, in parallel.
    #[cfg(feature = "rayon")]
    fn in_tasks<T: Send>(self, results: &mut [T], trace: impl Fn(RayBatch<'a>, &mut [T]) + Sync) {
        use rayon::iter::{IndexedParallelIterator, ParallelIterator};
        use rayon::slice::ParallelSliceMut;
        results.par_chunks_mut(TASK).enumerate().for_each(|(task, results)| {
            let part = task * TASK..task * TASK + results.len();
            let from = self.from.map(|from| &from[part.clone()]);
            trace(RayBatch { rays: &self.rays[part], from, parallel: false, ..self }, results);
        });
    }
}
