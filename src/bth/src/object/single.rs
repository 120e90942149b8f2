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
    // The kernel is passed by reference, because a copy of fields that were just written would stall.
    Isa::chosen().run(&mut SingleKernel::<Q, C> { object, goal, ray, from, instance, count, answer });
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
        let mut query = Q::new(*goal, ray);
        let (from_tets, walked) = if SMALL || *from == NONE || object.tet_leaves.is_empty() {
            (object.header.root == NONE, NONE)
        } else {
            from_tets(object, ray, *from, &mut query, *count)
        };
        if !from_tets {
            through_bvh(s, (object, ray), walked, &mut query, *count);
        }
        **answer = query.answer(object.triangle_ids, *instance);
    }
}

/// Traces a ray through the BVH, except for the tet leaf `walked`, whose hits the query already holds; `NONE` for no leaf.
#[inline(always)]
fn through_bvh<S: Simd, Q: Query, C: Count>(
    s: S,
    (object, ray): (&ObjectView<'_>, &Ray),
    walked: u32,
    query: &mut Q,
    count: &mut C,
) {
    let prepared = match PreparedRay::of(&object.bounds, ray) {
        Some(prepared) => prepared,
        None => match PreparedRay::in_f64(object.header, ray) {
            Some(prepared) => prepared,
            None => return,
        },
    };
    let tets = |leaf, query: &mut Q, count: &mut C| enter_tets(object, leaf, ray, query, count);
    trace_single(s, (object, ray), &prepared, walked, query, &mut SingleStack::new(), count, tets);
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
