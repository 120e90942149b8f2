//! Conservative ray-box tests in f32 for the sixteen children of a node.
//!
//! Slab test (Kay and Kajiya, "Ray Tracing Complex Scenes", SIGGRAPH 1986) with one multiplication
//! and one addition per plane, depth = plane · r + (-o · r ∓ pad · |r|). The pad covers all
//! roundings and the clamping of small direction components, so a box that the ray hits is never
//! excluded. **Depth** is t times the largest |component| of the direction, so that depths are of
//! the magnitude of coordinates.

use crate::intersect::line::{Line, widened};
use crate::intersect::vector::splat3;
use crate::rays::Ray;
use crate::simd::Simd;
use bth_format::layout::{WIDTH, WideNode};
use bth_format::object::ObjectBounds;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// Pad of a plane relative to what the object asks for ([`ObjectBounds::padded`]) and the smallest
/// of two bounds of how far away the ray's origin o is: the distance of the farthest corner of the
/// object's box, and the largest |coordinate| of o and how far away the object is
/// ([`ObjectBounds::away`]).
///
/// With P a plane, p a point of the box within it, r the reciprocal, u = 2^-24, and c the point of
/// the object's box that is nearest to the origin of its space: products with P and o and the
/// addend are off by at most u(|P| + 2|o|)|r|, reciprocal and sum by 2u|P - o||r|, and clamping
/// moves the ray by at most 4u|p - o| ([`LEAST_COMPONENT`]), all in the maximum norm. Measured from
/// c that is 7u|P - c| + 8u|o - c| + 3u|c|. Both bounds are bounds of |o - c|, if |c| is added to
/// the second: the pad has 16u of it. Of what the object asks for it has 16u, too: of the largest
/// |coordinate|, which is |c| + |P - c| for some P, as these have the same signs, so that it covers
/// an |o - c| of |o| + |c|, too; or, where the object is far away, of its size and |c| / 4. Widened
/// boxes bring 16u|p| instead of it; where P is farther away, its own roundings are less than what
/// it is farther.
pub(crate) const PAD: f64 = 1.0 / (1 << 20) as f64;
/// Smallest |component| of a direction whose largest |component| is 1; smaller ones are raised to
/// it, which keeps products finite. Up to the farthest coordinate this moves the ray by less than
/// half the pad.
pub(crate) const LEAST_COMPONENT: f64 = 1.0 / (1 << 22) as f64;
/// From this extent on, products could overflow f32: every box then counts as hit.
const LARGEST_COORDINATE: f64 = 1e30;
/// Below this extent, the pad could underflow: every box then counts as hit.
pub(crate) const SMALLEST_EXTENT: f64 = f32::MIN_POSITIVE as f64 * (1 << 16) as f64;

/// Offset of the upper bounds of an axis from the lower ones in the flattened rows of a node.
pub(crate) const FAR: u32 = WIDTH as u32;

/// Per-ray constants of the box test, in the space of the boxes.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub(crate) struct RaySlabs {
    /// Reciprocal of each component of the direction, scaled so that the largest |component| is 1.
    pub(crate) reciprocal: [f32; 3],
    /// Depth of t = 1, which is the direction's largest |component|.
    pub(crate) scale: f32,
    /// Addends of the planes through which the ray enters.
    pub(crate) near_addend: [f32; 3],
    /// Lower bound of the depth of `tmin`.
    pub(crate) first: f32,
    /// Addends of the planes through which the ray leaves.
    pub(crate) far_addend: [f32; 3],
    /// Upper bound of the depth of `tmax`.
    pub(crate) last: f32,
    /// For each axis the row of the planes through which the ray enters: 0 for the lower bounds,
    /// [`FAR`] for the upper ones.
    pub(crate) near: [u32; 3],
}

/// An upper bound of a depth in f32. It is not denormal, which would take operations hundreds of
/// cycles: where rays hit the triangle that their origin lies on, depths are 0 or next to it.
#[inline(always)]
pub(crate) fn upper_depth(depth: f64) -> f32 {
    const LEAST: f64 = 2.0 * f32::MIN_POSITIVE as f64;
    let depth = if depth.abs() < LEAST { LEAST } else { depth };
    // The next greater number is an upper bound although the conversion may round down.
    (depth as f32).next_up()
}

/// A lower bound of a depth in f32, as [`upper_depth`].
#[inline(always)]
pub(crate) fn lower_depth(depth: f64) -> f32 {
    -upper_depth(-depth)
}

impl RaySlabs {
    /// Constants with which every box is hit; used for values that are not yet set or cannot be
    /// computed in f32.
    pub(crate) const NONE: RaySlabs = RaySlabs {
        reciprocal: [0.0; 3],
        scale: 0.0,
        near_addend: [f32::NEG_INFINITY; 3],
        first: 0.0,
        far_addend: [f32::INFINITY; 3],
        last: 0.0,
        near: [0; 3],
    };

    /// For the boxes of an object of these bounds.
    pub(crate) fn new(ray: &Ray, line: &Line, bounds: &ObjectBounds) -> RaySlabs {
        RaySlabs::with_pad(ray, line, bounds, |_| 0.0)
    }

    /// For boxes whose |coordinates| do not exceed `farthest`. `extra_pad` maps the largest
    /// |coordinate| of the ray's origin to a length by which the boxes are widened further. None
    /// for a ray without a line.
    pub(crate) fn widened(ray: &Ray, farthest: f32, extra_pad: impl Fn(f64) -> f64) -> Option<RaySlabs> {
        Some(RaySlabs::with_pad(ray, &Line::new(ray)?, &ObjectBounds::around(farthest), extra_pad))
    }

    /// For boxes in these bounds.
    fn with_pad(ray: &Ray, line: &Line, bounds: &ObjectBounds, extra_pad: impl Fn(f64) -> f64) -> RaySlabs {
        let scale = line.direction[line.axis[2]].abs();
        let farthest_origin = line.origin.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let to_corner = |k: usize, corner: &[f32; 4]| (f64::from(corner[k]) - line.origin[k]).abs();
        let reach =
            (0..3).fold(0.0, |m: f64, k| m.max(to_corner(k, &bounds.lower)).max(to_corner(k, &bounds.upper)));
        let [greatest, padded, away] = [bounds.greatest, bounds.padded_in_f64, bounds.away].map(f64::from);
        let extent = greatest + farthest_origin;
        let pad = PAD * (padded + reach.min(farthest_origin + away)) + extra_pad(farthest_origin);
        let mut slabs = RaySlabs { scale: scale as f32, ..RaySlabs::NONE };
        // Finite even where it is the depth of all boxes: the traversal writes lane numbers into
        // the low bits of depths, which would turn an infinity into NaN. A hit is in the range if
        // its t is after it was rounded, as a t of 2^-150 is to 0: with a great direction the depth
        // of such a hit is far beyond the depth of the end of the range.
        let after = |t: f64| widened(t.max(f64::MIN));
        let off = f64::from(bounds.origin_error);
        slabs.first = ((-after(-f64::from(ray.tmin)) * scale - off) as f32).next_down().max(-f32::MAX);
        slabs.last = slabs.limit(after(f64::from(ray.tmax)), bounds.origin_error);
        for k in 0..3 {
            let d = line.direction[k] / scale;
            let r = 1.0 / d.abs().max(LEAST_COMPONENT).copysign(d);
            slabs.near[k] = if d.is_sign_negative() { FAR } else { 0 };
            if SMALLEST_EXTENT <= extent && extent + pad < LARGEST_COORDINATE {
                slabs.reciprocal[k] = r as f32;
                slabs.near_addend[k] = (-line.origin[k] * r - pad * r.abs()) as f32;
                slabs.far_addend[k] = (-line.origin[k] * r + pad * r.abs()) as f32;
            }
        }
        slabs
    }

    /// Upper bound of the depth of t, for [`Self::children`]. `origin_error` is taken from the
    /// bounds for which the ray was prepared.
    #[inline(always)]
    pub(crate) fn limit(&self, t: f64, origin_error: f32) -> f32 {
        upper_depth(t * f64::from(self.scale) + f64::from(origin_error))
    }

    /// Lower bound of the depth of a hit, given bounds of its t; infinite if there is no hit.
    #[inline(always)]
    pub(crate) fn nearest(&self, t: Option<[f64; 2]>, origin_error: f32) -> f32 {
        let depth = |t: f64| t * f64::from(self.scale) - f64::from(origin_error);
        t.map_or(f32::INFINITY, |[t, _]| lower_depth(depth(t)))
    }

    /// The range of depths in which a hit certainly lies in the ray's range of t, whose ends are no
    /// NaN, and is finite. The exact origin may be off by `origin_error`.
    pub(crate) fn certain_range(&self, ray: &Ray, origin_error: f32) -> [f32; 2] {
        let depth = |t: f32, off: f32| (f64::from(t) * f64::from(self.scale) + f64::from(off)) as f32;
        let (tmin, tmax) = (ray.tmin.max(f32::MIN), ray.tmax.min(f32::MAX));
        [depth(tmin, origin_error).next_up(), depth(tmax, -origin_error).next_down()]
    }

    /// Like [`RaySlabLanes::children`], for one node.
    #[inline(always)]
    pub(crate) fn children<S: Simd>(&self, s: S, node: &WideNode, limit: f32) -> (u32, S::F) {
        RaySlabLanes::new(s, self).children(s, node, limit)
    }
}

/// [`RaySlabs`] broadcast to lanes, for a ray that is tested against many nodes.
#[derive(Clone, Copy)]
pub(crate) struct RaySlabLanes<S: Simd> {
    reciprocal: [S::F; 3],
    near_addend: [S::F; 3],
    far_addend: [S::F; 3],
    first: S::F,
    near: [u32; 3],
}

impl<S: Simd> RaySlabLanes<S> {
    #[inline(always)]
    pub(crate) fn new(s: S, slabs: &RaySlabs) -> Self {
        RaySlabLanes {
            reciprocal: splat3(s, slabs.reciprocal),
            near_addend: splat3(s, slabs.near_addend),
            far_addend: splat3(s, slabs.far_addend),
            first: s.splat(slabs.first),
            near: slabs.near,
        }
    }

    /// The children of a node whose boxes the ray may enter before the depth `limit`, as bits, and
    /// lower bounds of the depths at which it enters them. Empty slots may be among them where
    /// coordinates are too great for f32.
    #[inline(always)]
    pub(crate) fn children(&self, s: S, node: &WideNode, limit: f32) -> (u32, S::F) {
        if S::HAS_VECTORS {
            self.children_inlined(s, node, limit)
        } else {
            self.children_called(s, node, limit)
        }
    }

    /// [`Self::children`] for one ray at a time, which waits for the result: comparisons follow
    /// each other twice, not three times.
    #[inline(always)]
    pub(crate) fn children_soon(&self, s: S, node: &WideNode, limit: f32) -> (u32, S::F) {
        if !S::HAS_VECTORS {
            return self.children_called(s, node, limit);
        }
        let depth = |k: usize, side: u32, addend: [S::F; 3]| {
            s.fma(planes(s, node, k, self.near[k] ^ side), self.reciprocal[k], addend[k])
        };
        let enter = |k| depth(k, 0, self.near_addend);
        let leave = |k| depth(k, FAR, self.far_addend);
        let enter = s.max(s.max(enter(1), enter(2)), s.max(enter(0), self.first));
        let leave = s.min(s.min(leave(1), leave(2)), s.min(leave(0), s.splat(limit)));
        (s.mask_bits(s.le(enter, leave)), enter)
    }

    /// Calls [`Self::children`] without inlining it: unrolled in every scalar kernel it would take
    /// much code.
    #[inline(never)]
    fn children_called(&self, s: S, node: &WideNode, limit: f32) -> (u32, S::F) {
        self.children_inlined(s, node, limit)
    }

    #[inline(always)]
    fn children_inlined(&self, s: S, node: &WideNode, limit: f32) -> (u32, S::F) {
        let (mut enter, mut leave) = (self.first, s.splat(limit));
        for k in 0..3 {
            let (near, far) = (planes(s, node, k, self.near[k]), planes(s, node, k, self.near[k] ^ FAR));
            enter = s.max(s.fma(near, self.reciprocal[k], self.near_addend[k]), enter);
            leave = s.min(s.fma(far, self.reciprocal[k], self.far_addend[k]), leave);
        }
        (s.mask_bits(s.le(enter, leave)), enter)
    }
}

/// One of the two rows of an axis: the lower bounds for `side` 0, the upper ones for [`FAR`].
#[inline(always)]
pub(crate) fn row<T>(rows: &[[T; WIDTH]; 2], side: u32) -> &[T; WIDTH] {
    let first = (side & FAR) as usize;
    rows.as_flattened()[first..first + WIDTH].try_into().expect("a row")
}

/// The bounds of a node's child boxes along an axis: the lower ones for `side` 0, the upper ones
/// for [`FAR`].
#[inline(always)]
pub(crate) fn planes<S: Simd>(s: S, node: &WideNode, axis: usize, side: u32) -> S::F {
    s.load(row(&node.bounds[axis], side))
}
