//! Tracing of one object by a single ray.

use crate::SMALL;
use crate::bvh::single::trace_single;
use crate::bvh::single_stack::SingleStack;
use crate::intersect::prepare::PreparedRay;
use crate::query::{Count, Query};
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
    if SMALL || from == NONE || object.tet_leaves.is_empty() {
        let mut query = Q::new(goal, ray);
        through_bvh(object, ray, &mut query, NONE, count);
        *answer = query.answer(object.triangle_ids, instance);
        return;
    }
    trace_from::<Q, C>((object, goal), ray, from, instance, count, answer);
}

/// As [`trace`], from a triangle that may be a face of tetrahedra.
#[inline(never)]
fn trace_from<Q: Query, C: Count>(
    (object, goal): (&ObjectView<'_>, Q::Goal),
    ray: &Ray,
    from: u32,
    instance: u32,
    count: &mut C,
    answer: &mut Q::Answer,
) {
    let mut query = Q::new(goal, ray);
    match start_in_tets(object, ray, from, &mut query, count) {
        TetStart::Done => {}
        TetStart::Walked(leaf) if leaf != NONE && object.header.root == Child::Tets(leaf).code() => {}
        TetStart::Walked(leaf) => through_bvh(object, ray, &mut query, leaf, count),
    }
    *answer = query.answer(object.triangle_ids, instance);
}

/// Traces a ray through the BVH. `walked` is a tet leaf that is skipped, because the query already holds the ray's hits in it, or
/// `NONE`.
#[inline(always)]
pub(crate) fn through_bvh<Q: Query, C: Count>(
    object: &ObjectView<'_>,
    ray: &Ray,
    query: &mut Q,
    walked: u32,
    count: &mut C,
) {
    if object.header.root != NONE {
        let stack = &mut SingleStack::new();
        Isa::chosen().run(&mut SingleKernel { object, ray, query, walked, count, stack });
    }
}

/// The kernel of [`through_bvh`]; the result is left in the query.
struct SingleKernel<'a, Q: Query, C> {
    object: &'a ObjectView<'a>,
    ray: &'a Ray,
    query: &'a mut Q,
    walked: u32,
    count: &'a mut C,
    stack: &'a mut SingleStack,
}

// The kernel is passed by reference, because a copy of fields that were just written would stall.
impl<Q: Query, C: Count> Kernel for &mut SingleKernel<'_, Q, C> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let SingleKernel { object, ray, query, walked, count, stack } = self;
        let (object, ray) = (*object, *ray);
        let tets = |leaf, query: &mut Q, count: &mut C| enter_tets(object, leaf, ray, query, count);
        let prepared = match PreparedRay::of(&object.bounds, ray) {
            Some(prepared) => prepared,
            None => match PreparedRay::in_f64(object.header, ray) {
                Some(prepared) => prepared,
                None => return,
            },
        };
        trace_single(s, (object, ray), &prepared, *walked, *query, stack, *count, tets);
    }
}
