//! Winding numbers of points in an object: the crossings of a ray from each point along an axis, towards the nearest side of the
//! object's bounds.
//!
//! Along an axis the tests of boxes are comparisons of f32 values and exclude exactly the boxes that the closed ray does not touch.
//! Sixteen triangles at a time are projected along the axis. Their f32 coordinates relative to the point have exact signs and a
//! relative error of u = 2^-24. For |x| <= X and |y| <= Y, the weight x₁y₂ - y₁x₂ is off by less than 10u·XY because of them
//! and its own roundings, and by less than the least normal number because of underflow. Most triangles are decided so; those with
//! a weight within the bound, or with corners before and behind the point, are decided by [`crossing`].
//!
//! That rule moves the ray by infinitely little. What the moved ray crosses, the ray touches, so no crossing is missed by
//! tests that exclude only what the closed ray certainly does not touch; and a weight or depth of certain sign keeps it.

use crate::bvh::nodes::{indexed_leaf, raw as raw_leaf};
use crate::bvh::single_stack::SingleStack;
use crate::bvh::stack::BOTTOM;
use crate::intersect::boxes::{FAR, planes};
use crate::intersect::crossing::crossing;
use crate::intersect::edge_functions::cross;
use crate::intersect::filter::{TriangleBlock, TriangleFilter};
use crate::query::AnyHit;
use crate::rays::Ray;
use crate::simd::{Isa, Kernel, Part, Simd};
use bth_format::layout::{Child, NONE, TetLeaf, WIDTH, WideNode};
use bth_format::object::ObjectView;

/// 12u: bounds the error of a weight relative to XY, with the roundings of the bound.
const WEIGHT_ERROR: f32 = 12.0 / (1 << 24) as f32;

/// Adds to `winding` for each point in object space its winding number in an object. It is 0 outside of the object's bounds and
/// for points that are not finite.
pub(crate) fn add_windings(object: &ObjectView<'_>, points: &[[f32; 3]], winding: &mut [i32]) {
    if object.header.root != NONE {
        let stack = &mut SingleStack::new();
        Isa::chosen().run(WindingKernel { object, points, winding, stack });
    }
}

/// The kernel of [`add_windings`].
struct WindingKernel<'a> {
    object: &'a ObjectView<'a>,
    points: &'a [[f32; 3]],
    winding: &'a mut [i32],
    stack: &'a mut SingleStack,
}

impl Kernel for WindingKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let WindingKernel { object, points, winding, stack } = self;
        for (point, winding) in points.iter().zip(winding) {
            if let Some(ray) = AxisRay::new(object, *point) {
                *winding += ray.winding(s, object, stack);
            }
        }
    }
}

/// A ray along an axis.
struct AxisRay {
    ray: Ray,
    /// Index of the axis.
    axis: usize,
    /// 1 or -1, the direction along the axis.
    forward: f32,
    /// Projects triangles along the axis.
    filter: TriangleFilter,
}

/// [`AxisRay::crossings`] as a part of kernels.
struct Crossings<'a, B> {
    ray: &'a AxisRay,
    block: &'a B,
    valid: u32,
}

impl<S: Simd, B: TriangleBlock> Part<S> for Crossings<'_, B> {
    type Output = i32;
    #[inline(always)]
    fn run(self, s: S) -> i32 {
        self.ray.crossings(s, self.block, self.valid)
    }
}

impl AxisRay {
    /// The ray from a point in the bounds of an object to their nearest side; of equally near ones the first of the lower sides
    /// in x, y and z, then of the upper ones. `None` for a point outside.
    #[inline(always)]
    fn new(object: &ObjectView<'_>, point: [f32; 3]) -> Option<AxisRay> {
        let (lower, upper) = (&object.header.lower, &object.header.upper);
        let (mut axis, mut forward, mut least) = (0, -1.0, f32::INFINITY);
        for (sign, from, to) in [(-1.0, lower, &point), (1.0, &point, upper)] {
            for k in 0..3 {
                let way = to[k] - from[k];
                // The sign of a difference is exact.
                if way < 0.0 || way.is_nan() {
                    return None;
                }
                if way < least {
                    (axis, forward, least) = (k, sign, way);
                }
            }
        }
        let extent = (0..3).fold(0.0f32, |extent, k| extent.max(upper[k] - lower[k]));
        let mut direction = [0.0; 3];
        direction[axis] = forward;
        let [i, j] = [(axis + 1) % 3, (axis + 2) % 3];
        let filter = TriangleFilter {
            axis: [i as u32, j as u32, axis as u32],
            // Where differences could overflow, f32 decides about no triangle.
            error_floor: if extent.is_finite() { f32::MIN_POSITIVE } else { f32::INFINITY },
            origin: [point[i], point[j]],
            shear: [0.0; 2],
            forward,
            start: -forward * point[axis],
            first: 0.0,
            last: 0.0,
            error_slope: 0.0,
        };
        Some(AxisRay { ray: Ray::new(point, direction), axis, forward, filter })
    }

    /// The children of a node whose boxes the ray touches, as bits.
    #[inline(always)]
    fn children<S: Simd>(&self, s: S, node: &WideNode) -> u32 {
        let [i, j, k] = self.filter.axis.map(|axis| axis as usize);
        let far = planes(s, node, k, if self.forward > 0.0 { FAR } else { 0 });
        let mut touched = s.le(s.splat(-self.filter.start), s.mul(far, s.splat(self.forward)));
        for (axis, at) in [(i, self.filter.origin[0]), (j, self.filter.origin[1])] {
            let at = s.splat(at);
            touched = s.and(touched, s.le(planes(s, node, axis, 0), at));
            touched = s.and(touched, s.le(at, planes(s, node, axis, FAR)));
        }
        s.mask_bits(touched)
    }

    /// The signed number of crossings with the triangles of a leaf.
    #[inline(always)]
    fn leaf<S: Simd, B: TriangleBlock>(&self, s: S, block: &B) -> i32 {
        // At most as many triangles as lanes, even if an unchecked file has a greater count.
        let valid = 1u32.wrapping_shl(block.triangles()).wrapping_sub(1) & (u32::MAX >> WIDTH);
        // Without vectors, the filter in lanes takes as long as decisions, and much code.
        if !S::HAS_VECTORS {
            return decide(&self.ray, block, valid);
        }
        Crossings { ray: self, block, valid }.inline_or_call(s)
    }

    /// The signed number of crossings with the triangles of `valid`.
    #[inline(always)]
    fn crossings<S: Simd, B: TriangleBlock>(&self, s: S, block: &B, valid: u32) -> i32 {
        let [a, b, c] = block.project(s, &self.filter);
        let x = s.max(s.max_abs(a[0], b[0]), s.abs(c[0]));
        let y = s.max(s.max_abs(a[1], b[1]), s.abs(c[1]));
        let error = s.fma(s.mul(x, y), s.splat(WEIGHT_ERROR), s.splat(self.filter.error_floor));
        let minus_error = s.sub(s.splat(0.0), error);
        let weight = [cross(s, b, c), cross(s, c, a), cross(s, a, b)];
        let least = s.min(s.min(weight[0], weight[1]), weight[2]);
        let greatest = s.max(s.max(weight[0], weight[1]), weight[2]);
        // Comparisons with NaN, which an overflow may give, are false, and leave a triangle in doubt.
        let missed = s.and(s.lt(least, minus_error), s.lt(error, greatest));
        if valid & !s.mask_bits(missed) == 0 {
            return 0;
        }
        let zero = s.splat(0.0);
        let behind = s.lt(s.max(s.max(a[2], b[2]), c[2]), zero);
        let ahead = s.lt(zero, s.min(s.min(a[2], b[2]), c[2]));
        let (front, back) = (s.lt(error, least), s.lt(greatest, minus_error));
        let open = valid & !s.mask_bits(s.or(missed, behind));
        let (front, back) = (open & s.mask_bits(s.and(front, ahead)), open & s.mask_bits(s.and(back, ahead)));
        let signed = front.count_ones() as i32 - back.count_ones() as i32;
        let certain = if self.forward > 0.0 { signed } else { -signed };
        let doubtful = open & !(front | back);
        if doubtful == 0 {
            return certain;
        }
        certain + decide(&self.ray, block, doubtful)
    }

    /// The winding number of the ray's origin in an object.
    #[inline(always)]
    fn winding<S: Simd>(&self, s: S, object: &ObjectView<'_>, stack: &mut SingleStack) -> i32 {
        let node_base = object.node_base();
        let mut code = object.header.root;
        let mut stack = stack.start(code);
        let mut winding = 0;
        while code != BOTTOM {
            if code & Child::LEAF_BIT == 0 {
                let node = node_base.node(code);
                let (bits, children) = (self.children(s, node), &node.child);
                if bits == 0 {
                    code = stack.pop(0.0, AnyHit);
                    continue;
                }
                code = children[bits.trailing_zeros() as usize % WIDTH];
                let others = bits & (bits - 1);
                if others != 0 {
                    let free = stack.free_entries();
                    let count = s.compress(others, s.load_u(children), free.codes);
                    free.push(count + 1);
                }
                continue;
            }
            let mut unpacked = None;
            if let Some(leaf) = indexed_leaf(s, object, node_base, code, &mut unpacked) {
                winding += self.leaf(s, leaf);
            } else {
                let mut unpacked = None;
                match Child::from_code(code) {
                    Some(Child::Raw(at)) => winding += self.leaf(s, raw_leaf(s, object, at, &mut unpacked)),
                    Some(Child::Tets(row)) => {
                        let leaf = &object.tet_leaves[row as usize];
                        if leaf.subtree != NONE {
                            code = leaf.subtree;
                            continue;
                        }
                        winding += self.faces(object, leaf);
                    }
                    _ => {}
                }
            }
            code = stack.pop(0.0, AnyHit);
        }
        winding
    }

    /// The signed number of crossings with the constrained faces of a tet leaf that has no subtree.
    #[cold]
    #[inline(never)]
    fn faces(&self, object: &ObjectView<'_>, leaf: &TetLeaf) -> i32 {
        let faces = &object.tet_faces[leaf.first_face as usize..][..leaf.faces as usize];
        let corners = faces.iter().map(|face| face.vertex.map(|v| object.tet_vertices[v as usize].position));
        corners.filter(|corners| self.touches(corners)).map(|corners| crossing(&self.ray, corners)).sum()
    }

    /// Whether the ray touches the box of a triangle.
    fn touches(&self, corners: &[[f32; 3]; 3]) -> bool {
        let on_both_sides = |k: usize| {
            let at = self.ray.origin[k];
            corners.iter().any(|p| p[k] <= at) && corners.iter().any(|p| at <= p[k])
        };
        let ahead = |p: &[f32; 3]| self.filter.start + self.forward * p[self.axis] >= 0.0;
        on_both_sides((self.axis + 1) % 3) && on_both_sides((self.axis + 2) % 3) && corners.iter().any(ahead)
    }
}

/// The signed number of crossings with the triangles of a leaf whose bit is set.
#[inline(never)]
fn decide<B: TriangleBlock>(ray: &Ray, block: &B, mut triangles: u32) -> i32 {
    let mut signed = 0;
    while triangles != 0 {
        signed += crossing(ray, block.corners(triangles.trailing_zeros() as usize % WIDTH));
        triangles &= triangles - 1;
    }
    signed
}
