//! Enumeration of the triangles of an object that a ray may hit, for queries that report more than one hit or that decide about
//! triangles by a rule of their own.
//!
//! The conservative f32 tests of boxes and triangles exclude what the line certainly passes by, and triangles whose depths all
//! lie out of range. Every other triangle is passed to a [`Receiver`], once, which decides exactly. A triangle that the line
//! touches is never excluded, be it at an edge, at a vertex, or because the line lies in the triangle's plane: its exact weights
//! are then all of one sign or zero, and the filter excludes only triangles with two weights of certain and opposite signs.

use super::candidate::{Candidate, ReadCorners};
use super::nodes::{indexed_leaf, prefetch, raw as raw_leaf};
use super::ray_state::key_limit;
use super::single_stack::SingleStack;
use super::stack::BOTTOM;
use crate::intersect::boxes::RaySlabLanes;
use crate::intersect::line::Line;
use crate::intersect::prepare::PreparedRay;
use crate::intersect::start_point::ExactRay;
use crate::query::{NearestHit, TriangleRef};
use crate::simd::{Isa, Kernel, Scalar, Simd};
use crate::tets::flood::{FaceReceiver, VisitedSet};
use crate::tets::walk::TetWalker;
use bth_format::layout::{Child, NONE, TetFace, WIDTH};
use bth_format::object::{ObjectBounds, ObjectView};

/// Receiver of the triangles that a ray may hit.
pub(crate) trait Receiver {
    /// Receives a triangle, given its corners in object space, in the order of the source. Returns whether the query is
    /// complete, which ends the enumeration.
    fn receive(&mut self, triangle: TriangleRef<'_>, corners: [[f32; 3]; 3]) -> bool;
    /// Upper bound of the exact t, in the units of the ray, of further intersections that can change the result. It may shrink
    /// with every triangle; triangles beyond it are left out where that costs nothing.
    fn limit(&self) -> f64;
}

/// Passes the triangles of an object that a ray in object space may hit within its range to a receiver: each triangle that the
/// line touches at a t from `tmin` to the lesser of `tmax` and the receiver's limit, and some others. For a line in the plane of a
/// triangle these are the t of its points in the triangle. Nearer boxes come first, but triangles come in no particular order.
/// Returns whether the receiver has ended the enumeration. A ray that starts on a triangle passes all that it touches at t >= 0.
pub(crate) fn enumerate(
    object: &ObjectView<'_>,
    (ray, start): ExactRay<'_>,
    receiver: &mut dyn Receiver,
) -> bool {
    let bounds = if start.is_some() { &object.start_bounds } else { &object.bounds };
    enumerate_within(object, bounds, (ray, start), receiver)
}

/// As [`enumerate`], with tests of boxes and triangles for these bounds.
pub(crate) fn enumerate_within(
    object: &ObjectView<'_>,
    bounds: &ObjectBounds,
    (ray, start): ExactRay<'_>,
    receiver: &mut dyn Receiver,
) -> bool {
    if object.header.root == NONE {
        return false;
    }
    let prepared = match PreparedRay::of(Scalar, bounds, ray) {
        Some(prepared) => prepared,
        None => match PreparedRay::in_f64(bounds, ray) {
            Some(prepared) => prepared,
            None => return false,
        },
    };
    let stack = &mut SingleStack::new();
    Isa::chosen().run(EnumerateKernel {
        object,
        bounds,
        ray: (ray, start),
        prepared: &prepared,
        stack,
        receiver,
    })
}

/// The kernel of [`enumerate`]. The receiver is called through a table, so that there is one kernel per instruction set.
struct EnumerateKernel<'a> {
    object: &'a ObjectView<'a>,
    bounds: &'a ObjectBounds,
    ray: ExactRay<'a>,
    prepared: &'a PreparedRay,
    stack: &'a mut SingleStack,
    receiver: &'a mut dyn Receiver,
}

impl Kernel for EnumerateKernel<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> bool {
        let EnumerateKernel { object, bounds, ray, prepared, stack, receiver } = self;
        let (origin_error, origin_reach) = (bounds.origin_error, bounds.origin_reach);
        let (slabs, node_base) = (&prepared.slabs, object.node_base());
        let mut code = object.header.root;
        let mut stack = stack.start(code);
        let mut last = lesser(slabs.last, slabs.limit(receiver.limit(), origin_error));
        // Stack entries with a greater key are dropped.
        let mut limit = key_limit(last);
        while code != BOTTOM {
            if code & Child::LEAF_BIT == 0 {
                let planes = RaySlabLanes::new(s, slabs);
                let node = node_base.node(code);
                let ((bits, enter), children) = (planes.children(s, node, last), &node.child);
                if bits == 0 {
                    code = stack.pop(limit, NearestHit);
                } else if bits & (bits - 1) == 0 {
                    code = children[bits.trailing_zeros() as usize % WIDTH];
                } else {
                    let free = stack.free_entries();
                    let (count, nearest) =
                        s.sort_far_to_near(bits, enter, s.load_u(children), free.codes, free.keys);
                    code = children[nearest % WIDTH];
                    free.push(count);
                    // The entry below the new top is most often needed next.
                    prefetch(s, node_base, stack.below());
                }
                continue;
            }
            let (mut unpacked, mut unpacked_raw) = (None, None);
            let maybe = if let Some(leaf) = indexed_leaf(s, object, node_base, code, &mut unpacked) {
                prepared.filter.candidates(s, (leaf, 0), slabs.first, last, origin_reach).maybe
            } else {
                match Child::from_code(code) {
                    Some(Child::Raw(at)) => {
                        let leaf = raw_leaf(s, object, at, &mut unpacked_raw);
                        prepared.filter.candidates(s, (leaf, 0), slabs.first, last, origin_reach).maybe
                    }
                    Some(Child::Tets(row)) => {
                        let subtree = object.tet_leaves[row as usize].subtree;
                        if subtree != NONE {
                            code = subtree;
                            continue;
                        }
                        if pass_faces(object, row, ray, receiver) {
                            return true;
                        }
                        0
                    }
                    _ => 0,
                }
            };
            if maybe != 0 && pass_triangles(object, (code, maybe), receiver) {
                return true;
            }
            last = lesser(slabs.last, slabs.limit(receiver.limit(), origin_error));
            limit = key_limit(last);
            code = stack.pop(limit, NearestHit);
        }
        false
    }
}

/// The lesser of two numbers; this comparison compiles to a single instruction.
#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// Passes the triangles of the leaf with child code `leaf` whose bit is set in `triangles`; returns whether the query is complete.
#[inline(never)]
fn pass_triangles(
    object: &ObjectView<'_>,
    (leaf, mut triangles): (u32, u32),
    receiver: &mut dyn Receiver,
) -> bool {
    while triangles != 0 {
        let candidate = Candidate { leaf, triangle: triangles.trailing_zeros() };
        triangles &= triangles - 1;
        if let Some((index, corners)) = candidate.read(object, ReadCorners)
            && receiver.receive(TriangleRef::index(index, object.triangle_ids), corners)
        {
            return true;
        }
    }
    false
}

/// Passes the constrained faces of a tet leaf that has no subtree, as far as the line may touch them; returns whether the query is
/// complete. The faces are found by a flood fill, which reaches every face that the line touches, also where it passes through
/// edges and vertices or lies in the plane of a face.
#[cold]
#[inline(never)]
fn pass_faces(
    object: &ObjectView<'_>,
    row: u32,
    (ray, start): ExactRay<'_>,
    receiver: &mut dyn Receiver,
) -> bool {
    let Some(mut line) = Line::new(ray) else { return false };
    if let Some(start) = start {
        line.start_at(start);
    }
    let walker = TetWalker::new(object, row, &line);
    walker.flood_faces(&mut PassedFaces { object, receiver, passed: VisitedSet::new() }, &mut ())
}

/// Passes the faces that a flood reaches to a receiver.
struct PassedFaces<'a> {
    object: &'a ObjectView<'a>,
    receiver: &'a mut dyn Receiver,
    /// Ids of the triangles that were passed: the flood may reach a face from both sides.
    passed: VisitedSet,
}

impl FaceReceiver for PassedFaces<'_> {
    fn receive(&mut self, face: &TetFace) -> bool {
        if !self.passed.insert(face.triangle) {
            return false;
        }
        let corners = face.vertex.map(|v| self.object.tet_vertices[v as usize].position);
        self.receiver.receive(TriangleRef::id(face.triangle, self.object.triangle_ids), corners)
    }
    fn limit(&self) -> f64 {
        self.receiver.limit()
    }
}
