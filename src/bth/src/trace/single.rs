//! One ray through an object.

use super::Scratch;
use super::bvh_walk;
use super::flight::Flight;
use super::prepare::Frame;
use super::query::{Count, Query};
use super::tets::{Start, enter_tets, start_in_tets};
use crate::layout::{Child, NONE};
use crate::object::ObjectView;
use crate::rays::Ray;
use crate::simd::{Isa, Kernel, Simd};

/// Traces one ray and returns the query as it ends.
pub(crate) fn trace<Q: Query, C: Count>(
    object: &ObjectView<'_>,
    ray: &Ray,
    from: u32,
    scratch: &mut Scratch,
    mut query: Q,
    count: &mut C,
) -> Q {
    let walked = match start_in_tets(object, ray, from, &mut query, count) {
        Start::Done => return query,
        Start::Walked(leaf) => leaf,
    };
    if object.header.root == NONE || object.header.root == Child::Tets(walked).code() && walked != NONE {
        return query;
    }
    Isa::chosen().run(Single { object, ray, walked, query, scratch, count })
}

struct Single<'a, Q, C> {
    object: &'a ObjectView<'a>,
    ray: &'a Ray,
    /// A tet leaf to leave out.
    walked: u32,
    query: Q,
    scratch: &'a mut Scratch,
    count: &'a mut C,
}

impl<Q: Query, C: Count> Kernel for Single<'_, Q, C> {
    type Output = Q;
    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Q {
        let mut flight = Flight::vacant(self.query);
        if !flight.aim_at(self.object, &Frame::new(self.object.header), self.ray) {
            return self.query;
        }
        self.scratch.stacks.reserve(self.object, 1);
        bvh_walk::walk(
            s,
            self.object,
            self.ray,
            self.walked,
            &mut flight,
            &mut self.scratch.stacks,
            self.count,
            |leaf, query, count| enter_tets(self.object, leaf, self.ray, query, count),
        );
        *flight.query()
    }
}
