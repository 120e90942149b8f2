//! Tracing of one object by a single ray.

use crate::bvh::certain_hit::store_certain_hit;
use crate::bvh::leaf::ExactRay;
use crate::bvh::single::{SingleResult, trace_single};
use crate::bvh::single_stack::SingleStack;
use crate::intersect::prepare::PreparedRay;
use crate::query::{Answer, Count, Query};
use crate::simd::{Isa, Kernel, Simd};
use crate::tets::enter_tets;
use bth_format::layout::NONE;
use bth_format::object::ObjectView;

/// Traces one ray and stores its answer. `instance` is reported with a hit.
#[inline(always)]
pub(crate) fn trace<Q: Query, C: Count>(
    (object, goal): (&ObjectView<'_>, Q::Goal),
    ray: ExactRay<'_>,
    instance: u32,
    count: &mut C,
    answer: &mut Q::Answer,
) {
    // The kernel is passed by reference, because a copy of fields that were just written would stall.
    let kernel = &mut SingleKernel::<Q, C> { object, goal, ray, instance, count, answer };
    // Where nothing but the kernel is called, the registers need not be saved a second time.
    match Isa::already_chosen() {
        Some(isa) => isa.run_found(kernel),
        None => run_first(kernel),
    }
}

/// Runs the kernel where no instruction set is chosen.
#[cold]
#[inline(never)]
fn run_first<Q: Query, C: Count>(kernel: &mut SingleKernel<'_, Q, C>) {
    Isa::chosen().run(kernel);
}

/// The kernel of [`trace`]: all that is done for a ray, so that little is passed through memory.
struct SingleKernel<'a, Q: Query, C> {
    object: &'a ObjectView<'a>,
    goal: Q::Goal,
    ray: ExactRay<'a>,
    instance: u32,
    count: &'a mut C,
    answer: &'a mut Q::Answer,
}

impl<Q: Query, C: Count> Kernel for &mut SingleKernel<'_, Q, C> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let SingleKernel { object, goal, ray, instance, count, answer } = self;
        let (object, ray) = (*object, *ray);
        let mut query: Option<Q> = None;
        let result = if object.header.root == NONE {
            SingleResult::OfQuery
        } else {
            through_bvh(s, (object, ray), (*goal, &mut query), *count)
        };
        // The answer is written in place: a copy of what was just written word by word would stall.
        match result {
            SingleResult::Accepted => **answer = Q::ACCEPTED,
            SingleResult::Certain(candidate, norm) => {
                let place = (&mut **answer, *instance);
                store_certain_hit::<S, Q>(s, object, ray, (candidate, norm), *goal, place);
            }
            SingleResult::OfQuery => {
                **answer = match &query {
                    Some(query) => query.answer(object.triangle_ids, *instance),
                    None => Answer::MISS,
                };
            }
        }
    }
}

/// Traces a ray through the BVH.
#[inline(always)]
fn through_bvh<S: Simd, Q: Query, C: Count>(
    s: S,
    (object, ray): (&ObjectView<'_>, ExactRay<'_>),
    query: (Q::Goal, &mut Option<Q>),
    count: &mut C,
) -> SingleResult {
    let for_starts;
    let bounds = match ray.1 {
        None => &object.bounds,
        Some(_) => {
            for_starts = object.bounds.for_starts();
            &for_starts
        }
    };
    let prepared = match PreparedRay::of(s, bounds, ray.0) {
        Some(prepared) => prepared,
        None => match PreparedRay::in_f64(bounds, ray.0) {
            Some(prepared) => prepared,
            None => return SingleResult::OfQuery,
        },
    };
    let tets = |leaf, query: &mut Q, count: &mut C| enter_tets(object, leaf, ray, query, count);
    trace_single(s, (object, ray), (&prepared, bounds), query, &mut SingleStack::new(), count, tets)
}
