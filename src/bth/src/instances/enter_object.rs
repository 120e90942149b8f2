//! Transformation of rays into the space of an object.

use super::scene_batch::{BatchProgress, ObjectVisits, SceneBatch};
use crate::intersect::start_point::StartPoint;
use crate::nodes::affine::RayLanes;
use crate::query::sink::Visit;
use crate::rays::Ray;
use crate::shortcuts::free;
use crate::simd::{Isa, Kernel, LANES, Scalar, Simd};
use crate::starts::prepare::ENDED;
use crate::starts::world_ray::InstanceStart;

/// The rays of visits of one object, in its space and in the order of the visits.
#[derive(Default)]
pub(super) struct ObjectRays {
    pub(super) rays: Vec<Ray>,
    /// For each ray the factor from its t to t in world space.
    pub(super) t_scale: Vec<f32>,
    /// For each ray where it starts; empty if no rays start on triangles.
    pub(super) starts: Vec<StartPoint>,
    /// For each visit the index of its ray in the batch.
    index: Vec<u32>,
    /// For each ray the max t, in world space, of hits that can still change the result.
    so_far: Vec<f32>,
}

impl ObjectRays {
    /// Transforms the rays of visits into the space of the object. `progress` are the answers so
    /// far, beyond which they end.
    pub(super) fn fill(&mut self, of_object: &ObjectVisits<'_>, progress: BatchProgress<'_>) {
        let &ObjectVisits { batch, object, visits } = of_object;
        self.t_scale.clear();
        self.starts.clear();
        Isa::chosen().run(EnterKernel { object_rays: self, batch, visits, progress });
        if !batch.starts.is_empty() {
            let ObjectRays { rays, starts, .. } = self;
            starts.extend(rays.iter_mut().zip(visits).map(|(ray, visit)| match batch.start(*visit) {
                Some(InstanceStart { start, point, .. }) => {
                    ray.origin = point.rounded();
                    let begin = free::begin(Scalar, object, start.primitive.triangle, point, ray.direction);
                    if begin == f32::INFINITY {
                        *ray = ENDED;
                    } else {
                        ray.tmin = begin;
                    }
                    *point
                }
                None => StartPoint::beside(ray.origin),
            }));
        }
    }
}

/// The kernel of [`ObjectRays::fill`]. It transforms up to sixteen rays of the same instance at a
/// time; visits are sorted by instance.
struct EnterKernel<'a> {
    object_rays: &'a mut ObjectRays,
    batch: &'a SceneBatch<'a>,
    visits: &'a [Visit],
    progress: BatchProgress<'a>,
}

impl Kernel for EnterKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let EnterKernel {
            object_rays: ObjectRays { rays, t_scale, index, so_far, .. },
            batch,
            visits,
            progress,
        } = self;
        // All of them are replaced.
        rays.resize(visits.len(), NO_RAY);
        t_scale.resize(visits.len(), 1.0);
        let by_itself = |visit: Visit, ray: &mut Ray, t_scale: &mut f32| {
            let index = visit.ray as usize;
            let (own, so_far) = (batch.rays[index].tmax, progress.tmax(index));
            // Not `f32::min`, which would replace a `tmax` of NaN by a number.
            let tmax = if so_far < own { so_far } else { own };
            let of_object = batch.object_ray(visit, tmax);
            (*ray, *t_scale) = (of_object.ray, of_object.t_scale);
        };
        if !S::HAS_VECTORS {
            for (i, &visit) in visits.iter().enumerate() {
                by_itself(visit, &mut rays[i], &mut t_scale[i]);
            }
            return;
        }
        index.clear();
        so_far.clear();
        index.extend(visits.iter().map(|visit| visit.ray));
        so_far.extend(visits.iter().map(|visit| progress.tmax(visit.ray as usize)));
        index.resize(visits.len() + LANES, 0);
        so_far.resize(visits.len() + LANES, 0.0);
        let mut lanes = RayLanes::NONE;
        let mut start = 0;
        while start < visits.len() {
            let instance = visits[start].instance;
            let mut count = 1;
            while count < LANES && start + count < visits.len() && visits[start + count].instance == instance
            {
                count += 1;
            }
            let used = s.mask(((1u64 << count) - 1) as u32);
            let index = index[start..].first_chunk().expect("there is room for sixteen");
            let so_far = so_far[start..].first_chunk().expect("there is room for sixteen");
            let mut rows = [s.splat(0.0); LANES];
            let words = s.rows8(used, Ray::rows(batch.rays), s.load_u(index));
            for k in 0..3 {
                s.store(s.floats(words[k]), &mut lanes.origin[k]);
                s.store(s.floats(words[4 + k]), &mut lanes.direction[k]);
            }
            batch.world.placement(instance).inverse.transform(&mut lanes);
            for k in 0..3 {
                rows[k] = s.load(&lanes.origin[k]);
                rows[4 + k] = s.load(&lanes.direction[k]);
            }
            (rows[3], rows[7]) = (s.floats(words[3]), s.min(s.load(so_far), s.floats(words[7])));
            let rows = s.transpose(rows);
            let mut row = [0.0; LANES];
            for lane in 0..count {
                s.store(rows[lane % LANES], &mut row);
                let [ox, oy, oz, tmin, dx, dy, dz, tmax, ..] = row;
                rays[start + lane] = Ray { origin: [ox, oy, oz], tmin, direction: [dx, dy, dz], tmax };
            }
            for lane in 0..count {
                // Rays whose direction leaves the range of f32 are transformed one by one.
                if lanes.unscaled[lane % LANES] == 0 {
                    let at = start + lane;
                    by_itself(visits[at], &mut rays[at], &mut t_scale[at]);
                }
            }
            start += count;
        }
    }
}

const NO_RAY: Ray = Ray { origin: [0.0; 3], tmin: 0.0, direction: [0.0; 3], tmax: 0.0 };
