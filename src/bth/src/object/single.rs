//! One ray through an object.

use crate::bvh::nodes::{Nodes, Packed, Wide};
use crate::bvh::single::walk;
use crate::bvh::single_stack::SingleStack;
use crate::intersect::prepare::PreparedRay;
use crate::query::{Count, Query};
use crate::rays::Ray;
use crate::simd::{Isa, Kernel, Simd};
use crate::tets::{TetStart, enter_tets, start_in_tets};
use bth_format::layout::{Child, NONE};
use bth_format::object::ObjectView;

/// Traces one ray; `from` is the triangle it starts on, or `NONE`, and `instance` is what a hit is reported with. The answer goes
/// into `to`.
#[inline(always)]
pub(crate) fn trace<Q: Query, C: Count>(
    object: &ObjectView<'_>,
    ray: &Ray,
    from: u32,
    instance: u32,
    count: &mut C,
    to: &mut Q::Answer,
) {
    if from == NONE || object.tet_leaves.is_empty() {
        let mut query = Q::new(ray);
        through_bvh(object, ray, &mut query, NONE, count);
        *to = query.answer(object.triangle_ids, instance);
        return;
    }
    trace_from::<Q, C>(object, ray, from, instance, count, to);
}

/// As [`trace`], from a triangle that may lie on tetrahedra.
#[inline(never)]
fn trace_from<Q: Query, C: Count>(
    object: &ObjectView<'_>,
    ray: &Ray,
    from: u32,
    instance: u32,
    count: &mut C,
    to: &mut Q::Answer,
) {
    let mut query = Q::new(ray);
    match start_in_tets(object, ray, from, &mut query, count) {
        TetStart::Done => {}
        TetStart::Walked(leaf) if leaf != NONE && object.header.root == Child::Tets(leaf).code() => {}
        TetStart::Walked(leaf) => through_bvh(object, ray, &mut query, leaf, count),
    }
    *to = query.answer(object.triangle_ids, instance);
}

/// Traces a ray through the BVH; `walked` is the tet leaf from which the query has what it knows, which is left out, or `NONE`.
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

/// A ray and its query, which says afterwards what was found.
struct SingleKernel<'a, Q: Query, C> {
    object: &'a ObjectView<'a>,
    ray: &'a Ray,
    query: &'a mut Q,
    /// The tet leaf from which the query has what it knows, which is to be left out; or `NONE`.
    walked: u32,
    count: &'a mut C,
    stack: &'a mut SingleStack,
}

// By reference: copies of what was just written word by word stall.
impl<Q: Query, C: Count> Kernel for &mut SingleKernel<'_, Q, C> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        if self.object.has_packed_nodes() {
            return through_packed_nodes(self);
        }
        self.walk(s, Wide);
    }
}

/// UncachedHits, so that the common kernel stays short.
#[cold]
#[inline(never)]
fn through_packed_nodes<Q: Query, C: Count>(single: &mut SingleKernel<'_, Q, C>) {
    Isa::chosen().run(SinglePackedKernel(single));
}

/// A ray among packed nodes, as a kernel.
struct SinglePackedKernel<'a, T>(&'a mut T);

impl<Q: Query, C: Count> Kernel for SinglePackedKernel<'_, SingleKernel<'_, Q, C>> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        self.0.walk(s, Packed);
    }
}

impl<Q: Query, C: Count> SingleKernel<'_, Q, C> {
    #[inline(always)]
    fn walk<S: Simd, N: Nodes>(&mut self, s: S, nodes: N) {
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
        walk(s, nodes, (object, ray), &prepared, *walked, *query, stack, *count, tets);
    }
}
