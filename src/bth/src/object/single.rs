//! Tracing of one object by a single ray.

use crate::SMALL;
use crate::bvh::certain_hit::store_certain_hit;
use crate::bvh::single::{SingleResult, trace_single};
use crate::bvh::single_stack::SingleStack;
use crate::intersect::prepare::PreparedRay;
use crate::query::{Answer, Count, Query};
use crate::rays::Ray;
use crate::simd::{Isa, Kernel, Simd};
use crate::tets::{TetStart, enter_tets, start_in_tets};
use bth_format::layout::{Child, NONE};
use bth_format::object::ObjectView;

/// Traces one ray and stores its answer. `from` is the triangle on which the ray starts, or `NONE`; `instance` is reported with a
/// hit.
#[inline(always)]
pub(crate) fn trace<Q: Query, C: Count>(
    (object, goal): (&ObjectView<'_>, Q::Goal),
    ray: &Ray,
    from: u32,
    instance: u32,
    count: &mut C,
    answer: &mut Q::Answer,
) {
    // The kernel is passed by reference, because a copy of fields that were just written would stall.
    let kernel = &mut SingleKernel::<Q, C> { object, goal, ray, from, instance, count, answer };
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
    ray: &'a Ray,
    from: u32,
    instance: u32,
    count: &'a mut C,
    answer: &'a mut Q::Answer,
}

impl<Q: Query, C: Count> Kernel for &mut SingleKernel<'_, Q, C> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let SingleKernel { object, goal, ray, from, instance, count, answer } = self;
        let (object, ray) = (*object, *ray);
        let mut query = None;
        let (from_tets, walked) = if SMALL || *from == NONE || object.tet_leaves.is_empty() {
            (object.header.root == NONE, NONE)
        } else {
            from_tets(object, ray, *from, query.insert(Q::new(*goal, ray)), *count)
        };
        let result = if from_tets {
            SingleResult::OfQuery
        } else {
            through_bvh(s, (object, ray), walked, (*goal, &mut query), *count)
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

/// Traces a ray through the BVH, except for the tet leaf `walked`, whose hits the query already holds; `NONE` for no leaf.
#[inline(always)]
fn through_bvh<S: Simd, Q: Query, C: Count>(
    s: S,
    (object, ray): (&ObjectView<'_>, &Ray),
    walked: u32,
    query: (Q::Goal, &mut Option<Q>),
    count: &mut C,
) -> SingleResult {
    let prepared = match PreparedRay::of(s, &object.bounds, ray) {
        Some(prepared) => prepared,
        None => match PreparedRay::in_f64(object.header, ray) {
            Some(prepared) => prepared,
            None => return SingleResult::OfQuery,
        },
    };
    let tets = |leaf, query: &mut Q, count: &mut C| enter_tets(object, leaf, ray, query, count);
    trace_single(s, (object, ray), &prepared, walked, query, &mut SingleStack::new(), count, tets)
}

/// Walks the ray from a triangle through the tetrahedra of which that is a face. Returns whether the query is complete, and the tet
/// leaf whose hits the query holds, or `NONE`.
#[inline(never)]
fn from_tets<Q: Query, C: Count>(
    object: &ObjectView<'_>,
    ray: &Ray,
    from: u32,
    query: &mut Q,
    count: &mut C,
) -> (bool, u32) {
    let mut either = query.to_either();
    let start = start_in_tets(object, ray, from, &mut either, count);
    *query = Q::from_either(query.goal(), &either);
    match start {
        TetStart::Done => (true, NONE),
        TetStart::Walked(leaf) => {
            let root = object.header.root;
            (root == NONE || leaf != NONE && root == Child::Tets(leaf).code(), leaf)
        }
    }
}
