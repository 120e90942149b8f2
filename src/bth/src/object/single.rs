//! Tracing of one object by a single ray.

use crate::bvh::certain_hit::store_certain_hit;
use crate::bvh::guesses::Guesses;
use crate::bvh::single::{RayInObject, SingleQuery, SingleResult, trace_single};
use crate::bvh::single_stack::SingleStack;
use crate::intersect::exact_ray::{ExactRay, LineSource};
use crate::intersect::prepare::PreparedRay;
use crate::intersect::start_point::StartPoint;
use crate::query::{AnyHit, Count, Goal, NearestHit};
use crate::rays::{Hit, Ray, StartRay};
use crate::shortcuts::free;
use crate::simd::{Isa, Kernel, Scalar, Simd};
use crate::starts::locate::{locate, prefetch_leaf};
use bth_format::layout::NONE;
use bth_format::object::{ObjectBounds, ObjectView};
use glam::Vec4;

/// A ray in the space of an object, as a kernel takes it. There are no closures, which might be
/// compiled without the instruction set of the kernel.
pub(crate) trait SingleRay {
    /// What is computed of the ray at first.
    type Line;
    /// Computes it; `None` if the ray hits nothing.
    fn line<S: Simd>(&self, s: S, object: &ObjectView<'_>) -> Option<Self::Line>;
    /// The ray for decisions in f64.
    fn exact<'a>(&'a self, line: &'a Self::Line) -> ExactRay<'a>;
    /// The bounds for which the ray is prepared.
    fn bounds<'a>(object: &'a ObjectView<'_>, line: &'a Self::Line) -> &'a ObjectBounds;
    /// Prepares the ray for boxes and triangles, if f32 can.
    fn prepared<S: Simd>(&self, s: S, line: &Self::Line, bounds: &ObjectBounds) -> Option<PreparedRay>;
}

impl SingleRay for Ray {
    type Line = ();
    #[inline(always)]
    fn line<S: Simd>(&self, _s: S, _object: &ObjectView<'_>) -> Option<()> {
        Some(())
    }
    #[inline(always)]
    fn exact<'a>(&'a self, _line: &'a ()) -> ExactRay<'a> {
        ExactRay::plain(self)
    }
    #[inline(always)]
    fn bounds<'a>(object: &'a ObjectView<'_>, _line: &'a ()) -> &'a ObjectBounds {
        &object.bounds
    }
    #[inline(always)]
    fn prepared<S: Simd>(&self, s: S, _line: &(), bounds: &ObjectBounds) -> Option<PreparedRay> {
        PreparedRay::of(s, bounds, self)
    }
}

/// A ray from a start, and its floats as rows of four.
pub(crate) struct StartLine {
    rows: [Vec4; 2],
    ray: Ray,
    point: StartPoint,
}

/// A ray whose direction is in the space of the object.
impl SingleRay for StartRay {
    type Line = StartLine;
    #[inline(always)]
    fn line<S: Simd>(&self, s: S, object: &ObjectView<'_>) -> Option<StartLine> {
        let &StartRay { start, direction: [dx, dy, dz], tmax } = self;
        free::prefetch(s, object, start.primitive.triangle);
        prefetch_leaf(s, object, start.primitive.triangle);
        let point = locate(object, start).ok()?;
        // Vectors are made in registers: loading what was just written word by word would stall.
        let [x, y, z] = point.rounded();
        let begin = free::begin(s, object, start.primitive.triangle, &point, self.direction);
        if begin == f32::INFINITY {
            return None;
        }
        let rows = [Vec4::new(x, y, z, begin), Vec4::new(dx, dy, dz, tmax)];
        let floats = [rows[0].to_array(), rows[1].to_array()];
        Some(StartLine { rows, ray: zerocopy::transmute!(floats), point })
    }
    #[inline(always)]
    fn exact<'a>(&'a self, line: &'a StartLine) -> ExactRay<'a> {
        ExactRay::new(&line.ray, LineSource::Start(&line.point))
    }
    #[inline(always)]
    fn bounds<'a>(object: &'a ObjectView<'_>, _line: &'a StartLine) -> &'a ObjectBounds {
        &object.start_bounds
    }
    #[inline(always)]
    fn prepared<S: Simd>(&self, s: S, line: &StartLine, bounds: &ObjectBounds) -> Option<PreparedRay> {
        PreparedRay::of_rows(s, bounds, line.rows, &line.ray)
    }
}

/// A ray of f32, or from a start on the object.
impl SingleRay for ExactRay<'_> {
    /// True if the ray is from a start.
    type Line = bool;
    #[inline(always)]
    fn line<S: Simd>(&self, _s: S, _object: &ObjectView<'_>) -> Option<bool> {
        Some(matches!(self.line, LineSource::Start(_)))
    }
    #[inline(always)]
    fn exact<'a>(&'a self, _line: &'a bool) -> ExactRay<'a> {
        *self
    }
    #[inline(always)]
    fn bounds<'a>(object: &'a ObjectView<'_>, &is_from_start: &'a bool) -> &'a ObjectBounds {
        if is_from_start { &object.start_bounds } else { &object.bounds }
    }
    #[inline(always)]
    fn prepared<S: Simd>(&self, s: S, _line: &bool, bounds: &ObjectBounds) -> Option<PreparedRay> {
        PreparedRay::of(s, bounds, self.ray)
    }
}

/// A ray of a batch, with its line. The object has the bounds of the batch.
pub(crate) struct RayOfBatch<'a> {
    pub(crate) ray: &'a Ray,
    pub(crate) line: LineSource<'a>,
}

impl SingleRay for RayOfBatch<'_> {
    type Line = ();
    #[inline(always)]
    fn line<S: Simd>(&self, _s: S, _object: &ObjectView<'_>) -> Option<()> {
        Some(())
    }
    #[inline(always)]
    fn exact<'a>(&'a self, _line: &'a ()) -> ExactRay<'a> {
        ExactRay::new(self.ray, self.line)
    }
    #[inline(always)]
    fn bounds<'a>(object: &'a ObjectView<'_>, _line: &'a ()) -> &'a ObjectBounds {
        &object.bounds
    }
    #[inline(always)]
    fn prepared<S: Simd>(&self, s: S, _line: &(), bounds: &ObjectBounds) -> Option<PreparedRay> {
        PreparedRay::of(s, bounds, self.ray)
    }
}

/// Nearest hit of a ray in object space, in scalar code; `instance` is reported with a hit.
#[inline(never)]
pub(crate) fn nearest_in_scalar(object: &ObjectView<'_>, ray: &RayOfBatch<'_>, instance: u32) -> Hit {
    let mut hit = Hit::MISS;
    trace_in_scalar(object, NearestHit, ray, instance, &mut hit);
    hit
}

/// Returns true if a ray in object space hits anything, in scalar code.
#[inline(never)]
pub(crate) fn any_in_scalar(object: &ObjectView<'_>, ray: &RayOfBatch<'_>) -> bool {
    let mut hit = Hit::MISS;
    trace_in_scalar(object, AnyHit, ray, 0, &mut hit);
    hit.is_hit()
}

fn trace_in_scalar<G: Goal>(
    object: &ObjectView<'_>,
    goal: G,
    ray: &RayOfBatch<'_>,
    instance: u32,
    hit: &mut Hit,
) {
    Guesses::with(|guesses| {
        (&mut SingleKernel { object, goal, ray, instance, guesses, count: &mut (), hit }).run(Scalar);
    });
}

/// Traces one ray and stores its answer. `instance` is reported with a hit.
#[inline(always)]
pub(crate) fn trace<G: Goal, C: Count, R: SingleRay>(
    object: &ObjectView<'_>,
    goal: G,
    ray: &R,
    instance: u32,
    count: &mut C,
    hit: &mut Hit,
) {
    Guesses::with(|guesses| {
        // The kernel is passed by reference, because a copy of fields that were just written would
        // stall.
        let kernel = &mut SingleKernel { object, goal, ray, instance, guesses, count, hit };
        // Where nothing but the kernel is called, the registers need not be saved a second time.
        match Isa::already_chosen() {
            Some(isa) => isa.run_found(kernel),
            None => run_first(kernel),
        }
    });
}

/// Runs the kernel where no instruction set is chosen.
#[cold]
#[inline(never)]
fn run_first<G: Goal, C: Count, R: SingleRay>(kernel: &mut SingleKernel<'_, G, C, R>) {
    Isa::chosen().run(kernel);
}

/// The kernel of [`trace`]: all that is done for a ray, so that little is passed through memory.
struct SingleKernel<'a, G, C, R> {
    object: &'a ObjectView<'a>,
    goal: G,
    ray: &'a R,
    instance: u32,
    guesses: &'a Guesses,
    count: &'a mut C,
    hit: &'a mut Hit,
}

impl<G: Goal, C: Count, R: SingleRay> Kernel for &mut SingleKernel<'_, G, C, R> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let SingleKernel { object, goal, ray, instance, guesses, count, hit } = self;
        let (object, goal, instance) = (*object, *goal, *instance);
        let line = if object.header.root == NONE { None } else { ray.line(s, object) };
        let Some(line) = line else {
            **hit = Hit::MISS;
            return;
        };
        let (bounds, ray_of_line) = (R::bounds(object, &line), ray.exact(&line));
        let prepared = match ray.prepared(s, &line, bounds) {
            Some(prepared) => prepared,
            None => match PreparedRay::in_f64(bounds, ray_of_line.ray) {
                Some(prepared) => prepared,
                None => {
                    **hit = Hit::MISS;
                    return;
                }
            },
        };
        let (mut query, mut stack) = (None, SingleStack::new());
        let of = RayInObject { object, ray: ray_of_line, guesses };
        let query_of_ray = SingleQuery { goal, query: &mut query };
        // The answer is written in place: a copy of what was just written word by word would stall.
        match trace_single(s, of, &prepared, bounds, query_of_ray, &mut stack, *count) {
            SingleResult::Accepted => **hit = Hit::SOME,
            SingleResult::Certain(found) => {
                store_certain_hit(s, object, ray_of_line, found, goal, instance, hit);
            }
            SingleResult::OfQuery => {
                **hit = match &query {
                    Some(query) => query.answer(object.triangle_ids, instance),
                    None => Hit::MISS,
                };
            }
        }
    }
}
