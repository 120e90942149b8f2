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

/// Traces one ray; `from` is the triangle it starts on, or `NONE`, and `instance` is what a hit is reported with. The answer goes
/// into `to`.
#[inline]
pub(crate) fn trace<Q: Query, C: Count>(
    object: &ObjectView<'_>,
    ray: &Ray,
    from: u32,
    instance: u32,
    scratch: &mut Scratch,
    count: &mut C,
    to: &mut Q::Answer,
) {
    if from == NONE || object.tet_leaves.is_empty() {
        return through_bvh::<Q, C>(Single { object, ray, instance, start: None, scratch, count, to });
    }
    trace_from::<Q, C>(object, ray, from, instance, scratch, count, to);
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
    to: &mut Q::Answer,
) {
    let mut query = Q::new(ray);
    let walked = match start_in_tets(object, ray, from, &mut query, count) {
        Start::Done => {
            *to = query.answer(object.triangle_ids, instance);
            return;
        }
        Start::Walked(leaf) => leaf,
    };
    if object.header.root == Child::Tets(walked).code() && walked != NONE {
        *to = query.answer(object.triangle_ids, instance);
        return;
    }
    through_bvh(Single { object, ray, instance, start: Some((&query, walked)), scratch, count, to });
}

#[inline]
fn through_bvh<Q: Query, C: Count>(mut single: Single<'_, Q, C>) {
    if single.object.header.root == NONE {
        *single.to = single.query().answer(single.object.triangle_ids, single.instance);
        return;
    }
    Isa::chosen().run(&mut single);
}

struct Single<'a, Q: Query, C> {
    object: &'a ObjectView<'a>,
    ray: &'a Ray,
    instance: u32,
    /// What the query has found in a tet leaf, which is to be left out.
    start: Option<(&'a Q, u32)>,
    scratch: &'a mut Scratch,
    count: &'a mut C,
    to: &'a mut Q::Answer,
}

impl<Q: Query, C> Single<'_, Q, C> {
    /// The query as it is before the walk.
    #[inline(always)]
    fn query(&self) -> Q {
        self.start.map_or_else(|| Q::new(self.ray), |(query, _)| *query)
    }
}

// By reference, and the query is made, and its answer worked out and put in its place, within the kernel: copies of what was just
// written word by word stall.
impl<Q: Query, C: Count> Kernel for &mut Single<'_, Q, C> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        if self.object.has_packed_nodes() {
            return through_packed_nodes(self);
        }
        self.walk(s, Wide);
    }
}

/// Apart, so that the common kernel stays short.
#[cold]
#[inline(never)]
fn through_packed_nodes<Q: Query, C: Count>(single: &mut Single<'_, Q, C>) {
    Isa::chosen().run(AmongPacked(single));
}

/// A ray among packed nodes, as a kernel.
struct AmongPacked<'a, T>(&'a mut T);

impl<Q: Query, C: Count> Kernel for AmongPacked<'_, Single<'_, Q, C>> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        self.0.walk(s, Packed);
    }
}

impl<Q: Query, C: Count> Single<'_, Q, C> {
    #[inline(always)]
    fn walk<S: Simd, N: Nodes>(&mut self, s: S, nodes: N) {
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
        *self.to = flight.query().answer(object.triangle_ids, self.instance);
    }
}
