//! Winding numbers of points: the crossings of a ray from each point along an axis, towards the
//! nearest side of the object's bounds.
//!
//! Along an axis the tests of boxes are comparisons of f32 values. They exclude exactly the boxes
//! that the closed ray does not touch. Sixteen triangles at a time are projected along the axis.
//! Their f32 coordinates relative to the point have exact signs and a relative error of u = 2^-24.
//! For |x| <= X and |y| <= Y, the weight x₁y₂ - y₁x₂ is off by less than 10u·XY because of
//! roundings, and by less than the smallest normal number because of underflow. Most triangles are
//! decided so. [`crossing`] decides those with a weight within the bound, or with corners before
//! and behind the point.
//!
//! That rule moves the ray by infinitely little. What the moved ray crosses, the ray touches. So
//! tests that exclude only what the closed ray certainly does not touch miss no crossing. A weight
//! or depth of certain sign keeps its sign.
//!
//! Points that are no f32 numbers in the space of an object are rounded for these tests, which
//! allow for it; [`PointInObject`] decides the rest about the point itself.

use super::nearest::PointInstance;
use super::searcher::Instances;
use crate::bvh::single_stack::SingleStack;
use crate::bvh::walk::{BoxQuery, ObjectTree, TriangleQuery, all_triangles, walk};
use crate::intersect::boxes::{FAR, planes};
use crate::intersect::crossing::crossing;
use crate::intersect::edge_functions::cross;
use crate::intersect::filter::{TriangleBlock, TriangleFilter};
use crate::intersect::vector::wide;
use crate::intersect::wide_side::PointInObject;
use crate::nodes::placed::{NarrowPoint, PlacedObject};
use crate::rays::Ray;
use crate::scene::Scene;
use crate::simd::{Isa, Kernel, Part, Simd};
use bth_format::layout::{NONE, WIDTH, WideNode};
use bth_format::object::{ExactPositions, ObjectView};
use std::cmp::Ordering;

/// 12u: bounds the error of a weight relative to XY, with the roundings of the bound.
const WEIGHT_ERROR: f32 = 12.0 / (1 << 24) as f32;

/// 1 + 2^-20: covers the roundings of tests in f32 that are shifted by how far a point is off.
const OFF_SLACK: f64 = 1.0 + 1.0 / (1 << 20) as f64;
/// 1 / 4u: what X and Y grow by for each unit by which coordinates are off. It makes the bound of a
/// weight grow by 3 (X + Y) units; the weight is off by 2 (X + Y), and the square.
const OFF_SIZE: f32 = (1 << 22) as f32;

/// Less than x by at least `off`; x itself if that is 0.
fn below(x: f32, off: f32) -> f32 {
    if off > 0.0 { (x - off).next_down() } else { x }
}

/// Stores the winding number of each point in a scene.
pub(super) fn windings(scene: &Scene, points: &[[f64; 3]], winding: &mut [i32]) {
    winding.fill(0);
    let mut instances = Instances::new(scene);
    if instances.are_all_in_world_space() {
        let visit = &mut |at: PointInstance<'_>| {
            add_windings(at, points, winding);
            false
        };
        instances.any(false, |_, _| false, visit);
        return;
    }
    for (point, winding) in points.iter().zip(winding) {
        let visit = &mut |at: PointInstance<'_>| {
            add_windings(at, &[*point], std::slice::from_mut(winding));
            false
        };
        instances.any(false, |world, visit| world.enumerate_in_box([*point; 2], visit), visit);
    }
}

/// Adds the winding number of each point of world space to `winding`: 0 outside of the object's
/// bounds and for points that are not finite.
fn add_windings(at: PointInstance<'_>, points: &[[f64; 3]], winding: &mut [i32]) {
    let PointInstance { object, placed: Some(placed), .. } = at else { return };
    if object.header.root != NONE {
        let stack = &mut SingleStack::new();
        Isa::chosen().run(WindingKernel { object, placed, points, winding, stack });
    }
}

/// The kernel of [`add_windings`].
struct WindingKernel<'a> {
    object: &'a ObjectView<'a>,
    placed: &'a PlacedObject,
    points: &'a [[f64; 3]],
    winding: &'a mut [i32],
    stack: &'a mut SingleStack,
}

impl Kernel for WindingKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let WindingKernel { object, placed, points, winding, stack } = self;
        let tree = ObjectTree::new(object);
        for (point, winding) in points.iter().zip(winding) {
            if !(point[0].is_finite() && point[1].is_finite() && point[2].is_finite()) {
                continue;
            }
            let point = placed.point(*point);
            if let Some(ray) = AxisRay::new(object, &placed.narrow(&point, object), &point) {
                let mut query = AxisCrossings { ray, winding: 0 };
                walk(s, &tree, &mut query, stack);
                *winding += query.winding;
            }
        }
    }
}

/// A ray along an axis.
struct AxisRay<'a> {
    ray: Ray,
    /// 1 or -1, the direction along the axis.
    forward: f32,
    /// Upper bound of how far a coordinate of the origin is off; 0 if the ray is exact.
    off: f32,
    /// The origin as it is, and the triangles where leaves have rounded ones.
    point: &'a PointInObject<'a>,
    exact: ExactPositions<'a>,
    /// Bounds of the origin: of the two coordinates across the axis, and where the ray begins.
    low: [f32; 2],
    high: [f32; 2],
    begin: f32,
    /// Projects triangles along the axis.
    filter: TriangleFilter,
}

/// [`AxisRay::crossings`] as a part of kernels.
struct CrossedTriangles<'a, B> {
    ray: &'a AxisRay<'a>,
    block: &'a B,
    ids: &'a [u32],
    valid: u32,
}

impl<S: Simd, B: TriangleBlock> Part<S> for CrossedTriangles<'_, B> {
    type Output = i32;
    #[inline(always)]
    fn run(self, s: S) -> i32 {
        self.ray.crossings(s, self.block, self.ids, self.valid)
    }
}

impl<'a> AxisRay<'a> {
    /// The ray from a point in the bounds of an object to their nearest side. Of equally near ones
    /// it is the first of the lower sides in x, y and z, then of the upper ones. `None` for a point
    /// outside.
    #[inline(always)]
    fn new(
        object: &ObjectView<'a>,
        &NarrowPoint { point, off }: &NarrowPoint,
        exact_point: &'a PointInObject<'a>,
    ) -> Option<AxisRay<'a>> {
        let off = if off > 0.0 { ((off * OFF_SLACK) as f32).next_up() } else { 0.0 };
        let (lower, upper) = (&object.header.lower, &object.header.upper);
        let (mut axis, mut forward, mut least) = (0, -1.0, f32::INFINITY);
        for (sign, from, to) in [(-1.0, lower, &point), (1.0, &point, upper)] {
            for k in 0..3 {
                let way = to[k] - from[k];
                // The sign of a difference is exact.
                if way < -off || way.is_nan() {
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
        let (low, high) = (|x: f32| below(x, off), |x: f32| -below(-x, off));
        Some(AxisRay {
            ray: Ray::new(point, direction),
            forward,
            off,
            point: exact_point,
            exact: object.exact,
            low: filter.origin.map(low),
            high: filter.origin.map(high),
            begin: below(-filter.start, off),
            filter,
        })
    }

    /// The children of a node whose boxes the ray touches, as bits.
    #[inline(always)]
    fn children<S: Simd>(&self, s: S, node: &WideNode) -> u32 {
        let [i, j, k] = self.filter.axis.map(|axis| axis as usize);
        let far = planes(s, node, k, if self.forward > 0.0 { FAR } else { 0 });
        let mut touched = s.le(s.splat(self.begin), s.mul(far, s.splat(self.forward)));
        for (axis, n) in [(i, 0), (j, 1)] {
            touched = s.and(touched, s.le(planes(s, node, axis, 0), s.splat(self.high[n])));
            touched = s.and(touched, s.le(s.splat(self.low[n]), planes(s, node, axis, FAR)));
        }
        s.mask_bits(touched)
    }

    /// The signed number of crossings with the triangles of a leaf.
    #[inline(always)]
    fn leaf<S: Simd, B: TriangleBlock>(&self, s: S, block: &B, ids: &[u32]) -> i32 {
        let valid = all_triangles(block);
        // Without vectors, the filter in lanes takes as long as decisions, and much code.
        if !S::HAS_VECTORS {
            return decide(self, block, ids, valid);
        }
        CrossedTriangles { ray: self, block, ids, valid }.inline_or_call(s)
    }

    /// The signed number of crossings with the triangles of `valid`.
    #[inline(always)]
    fn crossings<S: Simd, B: TriangleBlock>(&self, s: S, block: &B, ids: &[u32], valid: u32) -> i32 {
        let [a, b, c] = block.project(s, &self.filter);
        let x = s.max(s.max_abs(a[0], b[0]), s.abs(c[0]));
        let y = s.max(s.max_abs(a[1], b[1]), s.abs(c[1]));
        let away = s.splat(self.off * OFF_SIZE);
        let (x, y) = (s.add(x, away), s.add(y, away));
        let error = s.fma(s.mul(x, y), s.splat(WEIGHT_ERROR), s.splat(self.filter.error_floor));
        let minus_error = s.sub(s.splat(0.0), error);
        let weight = [cross(s, b, c), cross(s, c, a), cross(s, a, b)];
        let least = s.min(s.min(weight[0], weight[1]), weight[2]);
        let greatest = s.max(s.max(weight[0], weight[1]), weight[2]);
        // Comparisons with NaN, which an overflow may give, are false, and leave a triangle in
        // doubt.
        let missed = s.and(s.lt(least, minus_error), s.lt(error, greatest));
        if valid & !s.mask_bits(missed) == 0 {
            return 0;
        }
        let behind = s.lt(s.max(s.max(a[2], b[2]), c[2]), s.splat(-self.off));
        let ahead = s.lt(s.splat(self.off), s.min(s.min(a[2], b[2]), c[2]));
        let (front, back) = (s.lt(error, least), s.lt(greatest, minus_error));
        let open = valid & !s.mask_bits(s.or(missed, behind));
        let (front, back) = (open & s.mask_bits(s.and(front, ahead)), open & s.mask_bits(s.and(back, ahead)));
        let signed = front.count_ones() as i32 - back.count_ones() as i32;
        let certain = if self.forward > 0.0 { signed } else { -signed };
        let doubtful = open & !(front | back);
        if doubtful == 0 {
            return certain;
        }
        certain + decide(self, block, ids, doubtful)
    }
}

/// The crossings of a ray along an axis.
struct AxisCrossings<'a> {
    ray: AxisRay<'a>,
    winding: i32,
}

impl BoxQuery for AxisCrossings<'_> {
    type Constants<S: Simd> = ();
    const NEAREST_FIRST: bool = false;
    #[inline(always)]
    fn lanes<S: Simd>(&self, _: S) {}
    #[inline(always)]
    fn children<S: Simd>(&self, s: S, _: &(), node: &WideNode, _limit: f32) -> (u32, S::F) {
        (self.ray.children(s, node), s.splat(0.0))
    }
}

impl TriangleQuery for AxisCrossings<'_> {
    #[inline(always)]
    fn triangles<S: Simd, B: TriangleBlock>(
        &mut self,
        s: S,
        _: &(),
        block: &B,
        ids: &[u32],
        _limit: f32,
    ) -> bool {
        self.winding += self.ray.leaf(s, block, ids);
        false
    }
}

/// The signed number of crossings with the triangles of a leaf whose bit is set.
#[inline(never)]
fn decide<B: TriangleBlock>(ray: &AxisRay<'_>, block: &B, ids: &[u32], mut triangles: u32) -> i32 {
    let mut signed = 0;
    while triangles != 0 {
        let i = triangles.trailing_zeros() as usize % WIDTH;
        let corners = block.corners(i);
        signed += if ray.off == 0.0 {
            crossing(&ray.ray, corners)
        } else {
            let exact = ray.exact.corners(ids[block.first() as usize + i]);
            let corners = exact.unwrap_or_else(|| corners.map(wide));
            ray.point.crossing(ray.filter.axis[2] as usize, ray.forward as i32, corners)
        };
        triangles &= triangles - 1;
    }
    signed
}

/// Returns true if every edge of an object has as many triangles in one direction as in the other.
/// The object must have the triangles of its source.
pub(super) fn is_closed(view: &ObjectView<'_>) -> bool {
    // Positions are distinct in other objects.
    let vertices = view.is_deformable().then(|| vertices_by_place(view.positions));
    // The edges from lower to higher vertices, and the others, turned round.
    let (mut up, mut down) = (Vec::new(), Vec::new());
    for rows in view.triangles {
        let [a, b, c] = vertices.as_ref().map_or(*rows, |vertices| rows.map(|row| vertices[row as usize]));
        for (p, q) in [(a, b), (b, c), (c, a)] {
            let edge = |low: u32, high: u32| u64::from(low) << 32 | u64::from(high);
            match p.cmp(&q) {
                Ordering::Less => up.push(edge(p, q)),
                Ordering::Greater => down.push(edge(q, p)),
                Ordering::Equal => {}
            }
        }
    }
    if up.len() != down.len() {
        return false;
    }
    up.sort_unstable();
    down.sort_unstable();
    up == down
}

/// For each position a number that it shares with those that are equal to it, and with no others.
fn vertices_by_place(positions: &[[f32; 3]]) -> Vec<u32> {
    // The sum has the same bits for zeros of either sign.
    let place = |row: &u32| positions[*row as usize].map(|x| (x + 0.0).to_bits());
    let mut rows: Vec<u32> = (0..positions.len() as u32).collect();
    rows.sort_unstable_by_key(place);
    let mut vertices = vec![0; rows.len()];
    for equal in rows.chunk_by(|a, b| place(a) == place(b)) {
        equal.iter().for_each(|row| vertices[*row as usize] = equal[0]);
    }
    vertices
}
