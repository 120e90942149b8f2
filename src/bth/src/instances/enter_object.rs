//! Transformation of rays into the space of an object.

use super::lines::visit_ray;
use super::placement::Placement;
use super::scene_batch::{BatchProgress, ObjectVisits};
use crate::intersect::origin::ROUNDED_TO_F32;
use crate::intersect::vector::{max_norm, minus};
use crate::nodes::affine::{ObjectRay, RayLanes};
use crate::query::sink::Visit;
use crate::rays::Ray;
use crate::shortcuts::free;
use crate::simd::{Isa, Kernel, LANES, Scalar, Simd};
use crate::starts::prepare::ENDED;
use crate::starts::world_ray::InstanceStart;
use bth_format::object::ObjectBounds;

/// The rays of visits of one object, in its space and in the order of the visits.
#[derive(Default)]
pub(super) struct ObjectRays {
    pub(super) rays: Vec<Ray>,
    /// For each ray the factor from its t to t in world space.
    pub(super) t_scale: Vec<f32>,
    /// The bounds for which all of the rays are prepared.
    pub(super) bounds: ObjectBounds,
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
        let farthest = Isa::chosen().run(EnterKernel { object_rays: self, of_object, progress });
        for (ray, visit) in self.rays.iter_mut().zip(visits) {
            if batch.starts.is_empty() {
                break;
            }
            let Some(InstanceStart { start, point, .. }) = batch.start(*visit) else { continue };
            ray.origin = minus(point.origin.0, object.anchor).map(|x| x as f32);
            ray.tmin = free::begin(Scalar, object, start.primitive.triangle, point, ray.direction);
            if ray.tmin == f32::INFINITY {
                *ray = ENDED;
            }
        }
        let Farthest { in_object, error, direction_error, .. } = farthest;
        self.bounds = object.bounds.for_lines(in_object, error, direction_error);
    }
}

/// What the bounds of rays depend on: the max |coordinate| of their origins in the space of the
/// object, and bounds of the errors of their lines.
#[derive(Default)]
struct Farthest {
    in_object: f32,
    error: f32,
    direction_error: f32,
    /// Max |coordinate| of the object's anchor.
    anchor: f64,
}

impl Farthest {
    fn of(anchor: [f64; 3]) -> Farthest {
        Farthest { anchor: max_norm(anchor), ..Farthest::default() }
    }

    /// Includes rays through an instance, given the max |coordinate| of their origins in world
    /// space. `rounded` are origins of starts, which f32 does not hold.
    fn include(&mut self, placement: &Placement, in_object: f32, in_world: f32, rounded: bool) {
        let error = placement.accuracy.error();
        let of_f32 = if rounded { placement.inverse.rounding_error(in_world.into()) } else { 0.0 };
        self.in_object = self.in_object.max(in_object);
        self.error = self.error.max(((f64::from(in_object) + self.anchor) * error + of_f32) as f32);
        self.direction_error = self.direction_error.max(error as f32);
    }
}

/// The kernel of [`ObjectRays::fill`]. It transforms up to sixteen rays of the same instance at a
/// time; visits are sorted by instance.
struct EnterKernel<'a> {
    object_rays: &'a mut ObjectRays,
    of_object: &'a ObjectVisits<'a>,
    progress: BatchProgress<'a>,
}

impl Kernel for EnterKernel<'_> {
    type Output = Farthest;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Farthest {
        let EnterKernel {
            object_rays: ObjectRays { rays, t_scale, index, so_far, .. },
            of_object: &ObjectVisits { batch, object, visits },
            progress,
        } = self;
        let anchor = object.anchor;
        // All of them are replaced.
        rays.resize(visits.len(), NO_RAY);
        t_scale.resize(visits.len(), 1.0);
        let (mut farthest, rounded) = (Farthest::of(anchor), !batch.starts.is_empty());
        let by_itself = |visit: Visit, ray: &mut Ray, t_scale: &mut f32| {
            let index = visit.ray as usize;
            let (own, so_far) = (batch.rays[index].tmax, progress.tmax(index));
            // Not `f32::min`, which would replace a `tmax` of NaN by a number.
            let tmax = if so_far < own { so_far } else { own };
            let of_visit = visit_ray(batch, visit, tmax).relative_to(anchor);
            let ObjectRay { ray: of_f32, t_scale: scale, .. } = of_visit.of_object;
            (*ray, *t_scale) = (of_f32, scale);
        };
        // Rays in f64 are not rounded before.
        if !S::HAS_VECTORS || !batch.wide.is_empty() {
            for (i, &visit) in visits.iter().enumerate() {
                by_itself(visit, &mut rays[i], &mut t_scale[i]);
                let [in_object, in_world] =
                    [&rays[i], &batch.rays[visit.ray as usize]].map(|ray| greatest_of(ray.origin));
                farthest.include(batch.world.placement(visit.instance), in_object, in_world, rounded);
            }
            farthest.direction_error += if batch.wide.is_empty() { 0.0 } else { ROUNDED_TO_F32 as f32 };
            return farthest;
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
            let placement = batch.world.placement(instance);
            placement.inverse.transform(&mut lanes, anchor);
            let (mut in_object, mut in_world) = (s.splat(0.0), s.splat(0.0));
            for k in 0..3 {
                rows[k] = s.load(&lanes.origin[k]);
                rows[4 + k] = s.load(&lanes.direction[k]);
                in_object = s.max_abs(rows[k], in_object);
                in_world = s.max_abs(s.floats(words[k]), in_world);
            }
            let [in_object, in_world] = [in_object, in_world]
                .map(|lanes| -s.least(s.sub(s.splat(0.0), s.select(used, lanes, s.splat(0.0)))));
            farthest.include(placement, in_object, in_world, rounded);
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
        farthest
    }
}

/// Max |coordinate|.
fn greatest_of(point: [f32; 3]) -> f32 {
    point.iter().fold(0.0, |most, x| most.max(x.abs()))
}

const NO_RAY: Ray = Ray { origin: [0.0; 3], tmin: 0.0, direction: [0.0; 3], tmax: 0.0 };
