//! Rays through an object whose space is world space, where f32 does not hold the ray or the
//! object: f32 only approximates their lines.

use super::lines::{InstanceLine, Place, RayInInstance, exact_line, long_line};
use crate::intersect::exact_line::ExactLine;
use crate::intersect::exact_ray::{ExactRay, LineLanes, LineSource, Lines, WorldLines};
use crate::intersect::long::LongLine;
use crate::intersect::origin::{ROUNDED_TO_F32, RoundedLine};
use crate::intersect::prepare::PreparedRay;
use crate::intersect::start_point::StartPoint;
use crate::intersect::vector::max_norm;
use crate::nodes::affine::UNSCALED;
use crate::object::single::SingleRay;
use crate::object::{self, Scratch};
use crate::query::sink::{Answers, Sink};
use crate::rays::{Hit, Ray, Ray64};
use crate::simd::{Isa, Kernel, Simd};
use crate::starts::prepare::ENDED;
use crate::starts::world_ray::WorldRay;
use bth_format::object::{ObjectBounds, ObjectView};
use glam::{DVec4, Vec4, Vec4Swizzles};

/// A ray with an origin.
pub(crate) trait LineRay: Copy + Sync {
    /// Bound of the error that rounding to f32 adds to the range of t, relative to the direction.
    const RANGE_ERROR: f32;
    /// The ray in world space. A ray in f64 has no numbers of f32 there.
    fn world_ray(&self) -> WorldRay<'_>;
    /// The ray rounded to f32.
    fn narrow(&self) -> Ray;

    /// Origin and `tmin`, and direction and `tmax`.
    #[inline(always)]
    fn rows(&self, anchor: [f64; 3]) -> [DVec4; 2] {
        let ray = self.world_ray();
        let ([x, y, z], [dx, dy, dz], [tmin, tmax]) = (ray.origin(), ray.direction(), ray.range());
        let [ax, ay, az] = anchor;
        [DVec4::new(x - ax, y - ay, z - az, tmin), DVec4::new(dx, dy, dz, tmax)]
    }

    /// Returns true if f32 can follow the line, and f64 can decide about it: its direction needs no
    /// scaling.
    #[inline(always)]
    fn is_plain(&self) -> bool {
        let ray = self.world_ray();
        UNSCALED.contains(&max_norm(ray.direction())) & (max_norm(ray.origin()) <= f32::MAX.into())
    }
}

impl LineRay for Ray {
    const RANGE_ERROR: f32 = 0.0;
    #[inline(always)]
    fn world_ray(&self) -> WorldRay<'_> {
        WorldRay::plain(self)
    }
    fn narrow(&self) -> Ray {
        *self
    }
}

impl LineRay for Ray64 {
    const RANGE_ERROR: f32 = ROUNDED_TO_F32 as f32;
    #[inline(always)]
    fn world_ray(&self) -> WorldRay<'_> {
        WorldRay { ray: &ENDED, start: None, wide: Some(self) }
    }
    fn narrow(&self) -> Ray {
        Ray64::narrow(self)
    }
}

/// Stores the nearest hit of a ray in an object in world space.
#[inline(always)]
pub(crate) fn store_nearest<R: LineRay>(object: &ObjectView<'_>, ray: &R, instance: u32, hit: &mut Hit) {
    if ray.is_plain() {
        return object::store_nearest(object, &LineRays(std::slice::from_ref(ray)), instance, hit);
    }
    *hit = by_line(object, ray, instance, |ray| ray.hit_in_world(object::nearest(object, ray, instance)));
}

/// Returns true if a ray hits anything in an object in world space.
#[inline(always)]
pub(crate) fn any<R: LineRay>(object: &ObjectView<'_>, ray: &R) -> bool {
    if ray.is_plain() {
        return object::any(object, &LineRays(std::slice::from_ref(ray)));
    }
    by_line(object, ray, 0, |ray| object::any(object, ray))
}

/// Calls `trace` with a ray as instances take it, which may be any.
#[cold]
fn by_line<R: LineRay, T>(
    object: &ObjectView<'_>,
    ray: &R,
    instance: u32,
    trace: impl FnOnce(&RayInInstance<'_>) -> T,
) -> T {
    let narrow = ray.narrow();
    let world_ray = WorldRay { ray: &narrow, ..ray.world_ray() };
    let of_object = RayInInstance::in_world(None, instance, world_ray, narrow.tmax);
    trace(&of_object.relative_to(object.anchor))
}

/// Rays that are rounded to f32 and traced together. One bound holds for the errors of all of them.
const TOGETHER: usize = 1024;

/// Stores the answers of rays that hit anything in an instance whose object's space is world space.
pub(crate) fn trace_batch<R: LineRay>(
    object: &ObjectView<'_>,
    rays: &[R],
    instance: u32,
    scratch: &mut Scratch,
    mut answers: Answers<'_>,
) {
    let (lines, mut narrow, mut alone) = (LineRays(rays), Vec::new(), Vec::new());
    for first in (0..rays.len()).step_by(TOGETHER) {
        let part = &rays[first..rays.len().min(first + TOGETHER)];
        narrow.resize(part.len(), ENDED);
        let kernel = NarrowKernel { rays: part, anchor: object.anchor, narrow: &mut narrow };
        let (mut farthest, are_plain) = Isa::chosen().run(kernel);
        if !are_plain {
            farthest = 0.0;
            for (i, narrow) in narrow.iter_mut().enumerate() {
                let of_ray = narrow.origin.iter().fold(0.0f32, |most, x| most.max(x.abs()));
                if part[i].is_plain() && of_ray.is_finite() {
                    farthest = farthest.max(of_ray);
                } else {
                    alone.push(first + i);
                    *narrow = ENDED;
                }
            }
        }
        let bounds = object.bounds.for_lines(farthest, 0.0, R::RANGE_ERROR);
        let object = ObjectView { bounds, ..*object };
        let sink = Sink::new(object.triangle_ids, answers.reborrow(), instance);
        let mut sink = sink.with_lines(Lines::World(&lines, 0));
        object::trace_batch(&object, &narrow, None, scratch, &mut sink.part(first));
    }
    for i in alone {
        match &mut answers {
            Answers::Nearest(hits) => store_nearest(object, &rays[i], instance, &mut hits[i]),
            Answers::Any(found) => found[i] = any(object, &rays[i]),
        }
    }
}

/// Rounds rays to f32, with origins relative to an anchor. Returns their max |coordinate|, and true
/// if all rays are plain.
struct NarrowKernel<'a, R> {
    rays: &'a [R],
    anchor: [f64; 3],
    narrow: &'a mut [Ray],
}

impl<R: LineRay> Kernel for NarrowKernel<'_, R> {
    type Output = (f32, bool);
    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> (f32, bool) {
        let NarrowKernel { rays, anchor, narrow } = self;
        let (mut farthest, mut least, mut most) = (Vec4::ZERO, Vec4::INFINITY, Vec4::ZERO);
        for (ray, to) in rays.iter().zip(narrow) {
            let [origin, direction] = ray.rows(anchor).map(|row| row.as_vec4());
            farthest = farthest.max(origin.abs());
            // The largest |component| of the direction, in all lanes but the last.
            let size = direction.abs();
            let size = size.max(size.yzxw()).max(size.zxyw());
            (least, most) = (least.min(size), most.max(size));
            *to = zerocopy::transmute!([origin.to_array(), direction.to_array()]);
        }
        let farthest = farthest.x.max(farthest.y).max(farthest.z);
        // The limits are numbers of f32.
        let are_plain = UNSCALED.contains(&least.x.into()) & UNSCALED.contains(&most.x.into());
        (farthest, are_plain & farthest.is_finite())
    }
}

/// The lines of plain rays.
struct LineRays<'a, R>(&'a [R]);

impl<R: LineRay> LineRays<'_, R> {
    #[inline(always)]
    fn rounded(&self, ray: usize) -> RoundedLine {
        self.0[ray].world_ray().line()
    }
}

impl<R: LineRay> WorldLines for LineRays<'_, R> {
    #[inline]
    fn line(&self, ray: usize) -> RoundedLine {
        self.rounded(ray)
    }
    fn lanes(&self, first: usize, rays: &[u32], of_lanes: &mut LineLanes) {
        for (lane, ray) in rays.iter().enumerate() {
            of_lanes.set(lane, &self.rounded(first + *ray as usize));
        }
    }
    fn common_origin(&self, first: usize, count: usize) -> Option<RoundedLine> {
        let (rays, origin) = (&self.0[first..first + count], |ray: &R| ray.world_ray().origin());
        rays.iter().all(|ray| origin(ray) == origin(&rays[0])).then(|| self.rounded(first))
    }
    fn long(&self, ray: usize) -> Option<LongLine> {
        long_line(Place::World(None), &self.0[ray].world_ray(), 1.0)
    }
    fn exact(&self, ray: usize) -> ExactLine {
        exact_line(Place::World(None), &self.0[ray].world_ray(), 1.0)
    }
    fn start(&self, _ray: usize) -> Option<&StartPoint> {
        None
    }
    fn are_from_starts(&self) -> bool {
        false
    }
    fn range(&self, ray: usize) -> Option<[f64; 2]> {
        self.0[ray].world_ray().wide.map(|ray| [ray.tmin, ray.tmax])
    }
}

/// The first ray.
impl<R: LineRay> SingleRay for LineRays<'_, R> {
    type Line = InstanceLine;
    #[inline(always)]
    fn line<S: Simd>(&self, _: S, object: &ObjectView<'_>) -> Option<Self::Line> {
        // Vectors are made in registers: loading what was just written word by word would stall.
        let [start, end] = self.0.first()?.rows(object.anchor);
        let rows = [start.as_vec4(), end.as_vec4()];
        let [x, y, z, _] = rows[0].abs().to_array();
        let bounds = object.bounds.for_far_lines(x.max(y).max(z), 0.0, R::RANGE_ERROR);
        Some(InstanceLine::new(rows, bounds))
    }
    #[inline(always)]
    fn exact<'a>(&'a self, line: &'a Self::Line) -> ExactRay<'a> {
        ExactRay::new(&line.ray, LineSource::World(self, 0))
    }
    #[inline(always)]
    fn bounds<'a>(object: &'a ObjectView<'_>, line: &'a Self::Line) -> &'a ObjectBounds {
        line.bounds(object)
    }
    #[inline(always)]
    fn prepared<S: Simd>(&self, s: S, line: &Self::Line, bounds: &ObjectBounds) -> Option<PreparedRay> {
        line.prepared(s, bounds)
    }
}
