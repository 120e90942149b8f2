//! Batches of rays in f64 through an object whose space is world space.

use super::lines::{InstanceLine, Place, RayInInstance, exact_line, long_line};
use crate::intersect::exact_line::ExactLine;
use crate::intersect::exact_ray::{ExactRay, LineLanes, LineSource, Lines, WorldLines};
use crate::intersect::long::LongLine;
use crate::intersect::origin::{ROUNDED_TO_F32, RoundedLine, RoundedOrigin};
use crate::intersect::prepare::PreparedRay;
use crate::intersect::start_point::StartPoint;
use crate::intersect::vector::max_norm;
use crate::nodes::affine::{ObjectRay, UNSCALED};
use crate::object::single::SingleRay;
use crate::object::{self, Scratch};
use crate::query::sink::{Answers, Sink};
use crate::rays::{Ray, Ray64};
use crate::simd::Simd;
use crate::starts::prepare::ENDED;
use crate::starts::world_ray::WorldRay;
use bth_format::object::{ObjectBounds, ObjectView};
use glam::DVec4;

/// Rays that are rounded to f32 and traced together. One bound holds for the errors of all of them.
const TOGETHER: usize = 1024;

/// Stores the answers of rays that hit anything in an instance whose object's space is world space.
pub(crate) fn trace_wide(
    object: &ObjectView<'_>,
    rays: &[Ray64],
    instance: u32,
    scratch: &mut Scratch,
    mut answers: Answers<'_>,
) {
    let (lines, mut narrow, mut alone) = (WideRays(rays), Vec::new(), Vec::new());
    for first in (0..rays.len()).step_by(TOGETHER) {
        let mut farthest = 0.0f64;
        narrow.clear();
        for i in first..rays.len().min(first + TOGETHER) {
            let of_object = ObjectRay::of(lines.line(i), rays[i].tmin as f32, rays[i].tmax as f32);
            if of_object.t_scale == 1.0 && of_object.line.origin.1 == 0.0 {
                farthest = farthest.max(max_norm(rays[i].origin));
                narrow.push(of_object.ray);
            } else {
                alone.push(i);
                narrow.push(ENDED);
            }
        }
        let origin = RoundedOrigin([farthest; 3], 0.0);
        let line = RoundedLine { origin, direction: [1.0; 3], direction_error: 0.0 };
        let object = ObjectView { bounds: line.with_rounded_range().bounds(object), ..*object };
        let sink = Sink::new(object.triangle_ids, answers.reborrow(), instance);
        let mut sink = sink.with_lines(Lines::World(&lines, 0));
        object::trace_batch(&object, &narrow, None, scratch, &mut sink.part(first));
    }
    for i in alone {
        let (ray, narrow) = (&rays[i], rays[i].narrow());
        let of_object = RayInInstance::in_world(None, instance, wide_ray(&narrow, ray), narrow.tmax);
        match &mut answers {
            Answers::Nearest(hits) => object::store_nearest(object, &of_object, instance, &mut hits[i]),
            Answers::Any(found) => found[i] = object::any(object, &of_object),
        }
    }
}

/// A ray in f64 that f32 can follow, through an object whose space is world space.
#[derive(Clone, Copy)]
pub(crate) struct WideRay<'a>(WideRays<'a>);

impl<'a> WideRay<'a> {
    /// `None` for rays whose numbers must be scaled before they are rounded to f32.
    #[inline(always)]
    pub(crate) fn new(ray: &'a Ray64) -> Option<WideRay<'a>> {
        let is_unscaled = UNSCALED.contains(&max_norm(ray.direction));
        is_unscaled.then_some(WideRay(WideRays(std::slice::from_ref(ray))))
    }
}

impl SingleRay for WideRay<'_> {
    type Line = InstanceLine<Option<ObjectBounds>>;
    #[inline(always)]
    fn line<S: Simd>(&self, _s: S, object: &ObjectView<'_>) -> Option<Self::Line> {
        let &WideRays([Ray64 { origin: [x, y, z], tmin, direction: [dx, dy, dz], tmax }]) = &self.0 else {
            return None;
        };
        // Vectors are made in registers: loading what was just written word by word would stall.
        let rows = [DVec4::new(*x, *y, *z, *tmin).as_vec4(), DVec4::new(*dx, *dy, *dz, *tmax).as_vec4()];
        let [x, y, z, _] = rows[0].abs().to_array();
        let (farthest, bounds) = (x.max(y).max(z), &object.bounds);
        let bounds =
            (farthest > bounds.near()).then(|| bounds.for_lines(farthest, 0.0, ROUNDED_TO_F32 as f32));
        Some(InstanceLine::new(rows, bounds))
    }
    #[inline(always)]
    fn exact<'a>(&'a self, line: &'a Self::Line) -> ExactRay<'a> {
        ExactRay::new(&line.ray, LineSource::World(&self.0, 0))
    }
    #[inline(always)]
    fn bounds<'a>(object: &'a ObjectView<'_>, line: &'a Self::Line) -> &'a ObjectBounds {
        line.bounds.as_ref().unwrap_or(&object.near_bounds)
    }
    #[inline(always)]
    fn prepared<S: Simd>(&self, s: S, line: &Self::Line, bounds: &ObjectBounds) -> Option<PreparedRay> {
        line.prepared(s, bounds)
    }
}

/// A ray in f64, given the same ray rounded to f32.
pub(crate) fn wide_ray<'a>(ray: &'a Ray, wide: &'a Ray64) -> WorldRay<'a> {
    WorldRay { ray, start: None, wide: Some(wide) }
}

/// The lines of rays in f64.
#[derive(Clone, Copy)]
struct WideRays<'a>(&'a [Ray64]);

impl WorldLines for WideRays<'_> {
    #[inline]
    fn line(&self, ray: usize) -> RoundedLine {
        let Ray64 { origin, direction, .. } = self.0[ray];
        RoundedLine { origin: RoundedOrigin(origin, 0.0), direction, direction_error: 0.0 }.or_unknown()
    }
    fn lanes(&self, first: usize, rays: &[u32], of_lanes: &mut LineLanes) {
        for (lane, ray) in rays.iter().enumerate() {
            of_lanes.set(lane, &self.line(first + *ray as usize));
        }
    }
    fn common_origin(&self, first: usize, count: usize) -> Option<RoundedLine> {
        let rays = &self.0[first..first + count];
        rays.iter().all(|ray| ray.origin == rays[0].origin).then(|| self.line(first))
    }
    fn long(&self, ray: usize) -> Option<LongLine> {
        long_line(Place::World(None), &wide_ray(&ENDED, &self.0[ray]), 1.0)
    }
    fn exact(&self, ray: usize) -> ExactLine {
        exact_line(Place::World(None), &wide_ray(&ENDED, &self.0[ray]), 1.0)
    }
    fn start(&self, _ray: usize) -> Option<&StartPoint> {
        None
    }
    fn are_from_starts(&self) -> bool {
        false
    }
    fn range(&self, ray: usize) -> Option<[f64; 2]> {
        Some([self.0[ray].tmin, self.0[ray].tmax])
    }
}
