//! Enumerates the triangles of an object that a ray may hit, for queries that report several hits
//! or that decide about triangles by another rule.
//!
//! The conservative f32 tests of boxes and triangles exclude what the line certainly misses, and
//! triangles whose depths all lie out of range. Every other triangle is passed once to a
//! [`Receiver`], which decides exactly. A triangle that the line touches is never excluded, even if
//! it is touched at an edge, at a vertex or in its plane: its exact weights are then all of one
//! sign or zero, and the filter excludes only triangles with two weights of certain and opposite
//! signs.

use super::ray_state::key_limit;
use super::walk::{BoxQuery, ObjectTree, TriangleQuery, any_in_set, run_walk};
use crate::intersect::boxes::{RaySlabLanes, RaySlabs};
use crate::intersect::exact_ray::{ExactRay, LineSource};
use crate::intersect::filter::TriangleBlock;
use crate::intersect::prepare::PreparedRay;
use crate::query::{Receiver, TriangleRef};
use crate::shortcuts::SpecialLeaf;
use crate::simd::{Scalar, Simd};
use bth_format::layout::{NONE, WideNode};
use bth_format::object::{ObjectBounds, ObjectView};

/// Passes to a receiver each triangle of an object that the line of a ray touches at a t from
/// `tmin` to `tmax` and the receiver's limit, and some others. Nearer boxes come first, but
/// triangles come in no particular order. A ray that starts on a triangle passes all that it
/// touches at t >= 0. Returns true if the receiver has ended the enumeration.
pub(crate) fn enumerate(object: &ObjectView<'_>, ray: ExactRay<'_>, receiver: &mut dyn Receiver) -> bool {
    let bounds = match ray.line {
        LineSource::Ray => &object.bounds,
        LineSource::Start(_) => &object.start_bounds,
        LineSource::World(lines, at) => &lines.line(at).bounds(object),
    };
    enumerate_within(object, bounds, ray, receiver)
}

/// Does the same as [`enumerate`], with tests of boxes and triangles for these bounds.
pub(crate) fn enumerate_within(
    object: &ObjectView<'_>,
    bounds: &ObjectBounds,
    ray: ExactRay<'_>,
    receiver: &mut dyn Receiver,
) -> bool {
    if object.header.root == NONE {
        return false;
    }
    let prepared = PreparedRay::of(Scalar, bounds, ray.ray).or_else(|| PreparedRay::in_f64(bounds, ray.ray));
    let Some(prepared) = &prepared else { return false };
    run_walk(&ObjectTree::new(object), &mut RayTriangles { bounds, ray, prepared, receiver })
}

/// The triangles that a ray may hit. The receiver is called through a table, so that there is one
/// kernel per instruction set.
struct RayTriangles<'a> {
    bounds: &'a ObjectBounds,
    ray: ExactRay<'a>,
    prepared: &'a PreparedRay,
    receiver: &'a mut dyn Receiver,
}

impl<'a> BoxQuery for RayTriangles<'a> {
    /// Numbers, not vectors: instructions broadcast them from memory, and no leaf stores and loads
    /// them.
    type Constants<S: Simd> = &'a RaySlabs;
    #[inline(always)]
    fn lanes<S: Simd>(&self, _: S) -> &'a RaySlabs {
        &self.prepared.slabs
    }
    #[inline(always)]
    fn children<S: Simd>(&self, s: S, slabs: &&'a RaySlabs, node: &WideNode, limit: f32) -> (u32, S::F) {
        RaySlabLanes::new(s, slabs).children(s, node, limit)
    }
    #[inline(always)]
    fn limit(&self) -> f32 {
        let slabs = &self.prepared.slabs;
        let limit = slabs.limit(self.receiver.limit(), self.bounds.origin_error);
        // This comparison compiles to a single instruction.
        if slabs.last < limit { slabs.last } else { limit }
    }
    #[inline(always)]
    fn max_key(limit: f32) -> f32 {
        key_limit(limit)
    }
}

impl<'a> TriangleQuery for RayTriangles<'a> {
    #[inline(always)]
    fn triangles<S: Simd, B: TriangleBlock>(
        &mut self,
        s: S,
        _: &&'a RaySlabs,
        block: &B,
        ids: &[u32],
        limit: f32,
    ) -> bool {
        let PreparedRay { filter, slabs, .. } = self.prepared;
        let found = filter.candidates(s, (block, 0), slabs.first, limit, self.bounds);
        found.maybe != 0 && pass_triangles(block, found.maybe, ids, self.receiver)
    }
    #[inline(always)]
    fn special<S: Simd>(
        &mut self,
        _: S,
        _: &&'a RaySlabs,
        object: &ObjectView<'_>,
        leaf: SpecialLeaf,
    ) -> bool {
        leaf.pass_triangles(object, self.ray, self.receiver)
    }
}

/// Passes the triangles of a leaf whose bit is set in `triangles`. Returns true if the query is
/// complete.
#[inline(never)]
fn pass_triangles(
    block: &impl TriangleBlock,
    triangles: u32,
    ids: &[u32],
    receiver: &mut dyn Receiver,
) -> bool {
    any_in_set(triangles, |i| {
        receiver.receive(TriangleRef::index(block.first() + i as u32, ids), block.corners(i))
    })
}
