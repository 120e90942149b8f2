//! Queries of many rays in one call.

use crate::hits::Accept;
use crate::query::sink::Answers;
use crate::rays::{Hit, Ray};
use crate::scene::Scene;
use crate::trace_ray::TraceRay;

/// Rays in world space that are traced together, with options: [`Ray`]s, or
/// [`StartRay`](crate::rays::StartRay)s. Made by [`Scene::batch`].
///
/// Rays that are traced together answer as each would alone, to the last bit. About a thousand
/// coherent rays that are adjacent in the slice (a tile of a picture, the shadow rays of a tile)
/// are traced fastest.
///
/// ```
/// use bth::rays::{Hit, Ray, StartRay};
///
/// # const CUBE: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/cube.bth"));
/// let scene = bth::from_bytes(CUBE)?;
/// let rays = vec![Ray::new([0.25, 0.5, 2.0], [0.0, 0.0, -1.0]); 1024];
/// let mut hits = vec![Hit::MISS; rays.len()];
/// scene.batch(&rays).nearest(&mut hits);
///
/// // The next rays start where these hit: they need no offset and do not hit what they leave.
/// let up = [0.0, 0.0, 1.0];
/// let onward: Vec<StartRay> = hits.iter().map(|hit| StartRay::from_hit(hit, up)).collect();
/// let mut blocked = vec![true; rays.len()];
/// scene.batch(&onward).any(&mut blocked);
/// assert!(blocked.iter().all(|blocked| !blocked));
/// # Ok::<(), bth::Error>(())
/// ```
#[derive(Clone, Copy, Debug)]
#[must_use = "nothing is traced before `nearest` or `any`"]
pub struct RayBatch<'a, R: TraceRay = Ray> {
    scene: &'a Scene,
    rays: &'a [R],
    accept: Option<&'a Accept<'a>>,
    #[cfg(feature = "rayon")]
    parallel: bool,
}

/// Number of rays that one task of a parallel batch traces: many enough for packets, few enough to
/// balance.
#[cfg(feature = "rayon")]
const TASK: usize = 4096;

impl<'a, R: TraceRay> RayBatch<'a, R> {
    #[inline]
    pub(crate) fn new(scene: &'a Scene, rays: &'a [R]) -> Self {
        RayBatch {
            scene,
            rays,
            accept: None,
            #[cfg(feature = "rayon")]
            parallel: false,
        }
    }

    /// Sets what the rays are allowed to hit; by default everything, whatever the masks of the
    /// scene. Where something is excluded, rays are traced one at a time, as by
    /// [`Scene::nearest_accepted`].
    #[inline]
    pub fn accept(self, accept: &'a Accept<'a>) -> Self {
        RayBatch { accept: Some(accept), ..self }
    }

    /// Traces on all threads of the current pool of `rayon`. Answers do not depend on the number of
    /// threads.
    #[cfg(feature = "rayon")]
    #[inline]
    pub fn parallel(self) -> Self {
        RayBatch { parallel: true, ..self }
    }

    /// Stores the nearest hit of each ray, or [`Hit::MISS`].
    ///
    /// # Panics
    /// If there are not as many hits as rays.
    // What a single ray needs is inlined into the caller: what is not asked for, such as
    // conditions, then takes no time.
    #[inline(always)]
    pub fn nearest(self, hits: &mut [Hit]) {
        assert_eq!(self.rays.len(), hits.len(), "as many results as rays");
        match (self.rays, &mut *hits, self.accept) {
            ([ray], [hit], None) => self.scene.store_nearest(ray, hit),
            _ => self.trace(Answers::Nearest(hits)),
        }
    }

    /// Stores for each ray whether it hits anything.
    ///
    /// # Panics
    /// The panics of [`Self::nearest`].
    #[inline(always)]
    pub fn any(self, found: &mut [bool]) {
        assert_eq!(self.rays.len(), found.len(), "as many results as rays");
        match (self.rays, &mut *found, self.accept) {
            ([ray], [found], None) => *found = self.scene.hits_any(ray),
            _ => self.trace(Answers::Any(found)),
        }
    }

    /// Stores the answers of any number of rays under any conditions.
    #[inline(never)]
    fn trace(self, answers: Answers<'_>) {
        #[cfg(feature = "rayon")]
        if self.parallel {
            return match answers {
                Answers::Nearest(hits) => {
                    self.in_tasks(hits, |part, hits| part.trace(Answers::Nearest(hits)))
                }
                Answers::Any(found) => self.in_tasks(found, |part, found| part.trace(Answers::Any(found))),
            };
        }
        let (scene, rays) = (self.scene, self.rays);
        match (self.accept.filter(|accept| !scene.accepts_everything(accept)), answers) {
            (None, answers) => scene.trace(rays, answers),
            (Some(accept), Answers::Nearest(hits)) => scene.nearest_accepted_batch(rays, accept, hits),
            (Some(accept), Answers::Any(found)) => scene.any_accepted_batch(rays, accept, found),
        }
    }

    /// Calls `trace` for each part of the rays and its results, in parallel.
    #[cfg(feature = "rayon")]
    fn in_tasks<T: Send>(self, results: &mut [T], trace: impl Fn(RayBatch<'a, R>, &mut [T]) + Sync) {
        use rayon::iter::{IndexedParallelIterator, ParallelIterator};
        use rayon::slice::ParallelSliceMut;
        results.par_chunks_mut(TASK).enumerate().for_each(|(task, results)| {
            let part = task * TASK..task * TASK + results.len();
            trace(RayBatch { rays: &self.rays[part], parallel: false, ..self }, results);
        });
    }
}
