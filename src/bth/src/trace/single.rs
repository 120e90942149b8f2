//! One ray through an object.

use super::Scratch;
use super::bvh;
use super::bvh::flight::Flight;
use super::bvh::nodes::{Nodes, Packed, Wide};
use super::prepare::Frame;
use super::query::{Count, Query};
use super::tets::{Start, enter_tets, start_in_tets};
use crate::layout::{Child, NONE};
use crate::object::ObjectView;
use crate::rays::Ray;
use crate::simd::{Isa, Kernel, Simd};

/// Traces one ray; `from` is the triangle it starts on, or `NONE`, and `instance` is what a hit is reported with.
#[inline]
pub(crate) fn trace<Q: Query, C: Count>(
    object: &ObjectView<'_>,
    ray: &Ray,
    from: u32,
    instance: u32,
    scratch: &mut Scratch,
    count: &mut C,
) -> Q::Answer {
    if from == NONE || object.tet_leaves.is_empty() {
        return through_bvh::<Q, C>(Single { object, ray, instance, start: None, scratch, count });
    }
    trace_from::<Q, C>(object, ray, from, instance, scratch, count)
}

/// As [`trace`], from a triangle that may lie on tetrahedra.
#[inline(never)]
fn trace_from<Q: Query, C: Count>(
    object: &ObjectView<'_>,
    ray: &Ray,
    from: u32,
    instance: u32,
    scratch: &mut Scratch,
    count: &mut C,
) -> Q::Answer {
    let mut query = Q::new(ray);
    let walked = match start_in_tets(object, ray, from, &mut query, count) {
        Start::Done => return query.answer(object.triangle_ids, instance),
        Start::Walked(leaf) => leaf,
    };
    if object.header.root == Child::Tets(walked).code() && walked != NONE {
        return query.answer(object.triangle_ids, instance);
    }
    through_bvh(Single { object, ray, instance, start: Some((&query, walked)), scratch, count })
}

#[inline]
fn through_bvh<Q: Query, C: Count>(mut single: Single<'_, Q, C>) -> Q::Answer {
    if single.object.header.root == NONE {
        return single.query().answer(single.object.triangle_ids, single.instance);
    }
    Isa::chosen().run(&mut single)
}

struct Single<'a, Q, C> {
    object: &'a ObjectView<'a>,
    ray: &'a Ray,
    instance: u32,
    /// What the query has found in a tet leaf, which is to be left out.
    start: Option<(&'a Q, u32)>,
    scratch: &'a mut Scratch,
    count: &'a mut C,
}

impl<Q: Query, C> Single<'_, Q, C> {
    /// The query as it is before the walk.
    #[inline(always)]
    fn query(&self) -> Q {
        self.start.map_or_else(|| Q::new(self.ray), |(query, _)| *query)
    }
}

// By reference, and the query is made, and its answer worked out, within the kernel: copies of what was just written word by
// word stall.
impl<Q: Query, C: Count> Kernel for &mut Single<'_, Q, C> {
    type Output = Q::Answer;
    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Q::Answer {
        if self.object.has_packed_nodes() {
            return through_packed_nodes(self);
        }
        self.walk(s, Wide)
    }
}

/// Apart, so that the common kernel stays short.
#[cold]
#[inline(never)]
fn through_packed_nodes<Q: Query, C: Count>(single: &mut Single<'_, Q, C>) -> Q::Answer {
    Isa::chosen().run(AmongPacked(single))
}

/// A ray among packed nodes, as a kernel.
struct AmongPacked<'a, T>(&'a mut T);

impl<Q: Query, C: Count> Kernel for AmongPacked<'_, Single<'_, Q, C>> {
    type Output = Q::Answer;
    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Q::Answer {
        self.0.walk(s, Packed)
    }
}

impl<Q: Query, C: Count> Single<'_, Q, C> {
    #[inline(always)]
    fn walk<S: Simd, N: Nodes>(&mut self, s: S, nodes: N) -> Q::Answer {
        let (object, ray) = (self.object, self.ray);
        let query = self.query();
        let mut flight = Flight::vacant(query);
        if flight.aim_at(object, &Frame::new(object.header), (0, ray), Some(query)) {
            if self.start.is_some() {
                flight.take_over();
            }
            self.scratch.stacks.reserve(object, 1);
            bvh::walk::walk(
                s,
                nodes,
                object,
                ray,
                self.start.map_or(NONE, |(_, walked)| walked),
                &mut flight,
                &mut self.scratch.stacks,
                self.count,
                |leaf, query, count| enter_tets(object, leaf, ray, query, count),
            );
        }
        flight.query().answer(object.triangle_ids, self.instance)
    }
}
