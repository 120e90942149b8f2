//! Conservative ray-box tests in f32 for the sixteen children of a node.
//!
//! Slab test (Kay and Kajiya 1986) as one multiplication and one addition per plane,
//! t = plane · r + (-o · r ∓ pad · |r|): the pad covers every rounding and the clamping of small
//! direction components, so a box that the ray meets is never lost. t is measured as **depth**: in units of the
//! greatest component of the direction, so that it has the size of coordinates.

use crate::intersect::line::Line;
use crate::rays::Ray;
use crate::simd::Simd;
use bth_format::layout::{Object, PackedNode, WIDTH, WideNode};
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

/// Pad of a plane relative to the greatest coordinate in play. Half of it covers the roundings (reciprocal, product
/// with the origin, addend, product with the plane and sum: at most 5 · 2^-24), half the clamping below.
pub(crate) const PAD: f64 = 1.0 / (1 << 20) as f64;
/// Components below this (of a greatest one of 1) are raised to it. Over the way to the farthest coordinate that moves
/// the ray by less than half the pad, and it keeps products finite.
pub(crate) const LEAST_COMPONENT: f64 = 1.0 / (1 << 22) as f64;
/// Beyond this, products could overflow f32: every box is visited instead.
const LARGEST_COORDINATE: f64 = 1e30;

/// Below this, the pad could be lost to underflow: the same.
pub(crate) const SMALLEST_EXTENT: f64 = f32::MIN_POSITIVE as f64 * (1 << 16) as f64;

/// Where the upper ends of an axis lie, behind the lower ones.
pub(crate) const FAR: u32 = WIDTH as u32;

/// A ray prepared for box tests.
#[derive(Clone, Copy, Debug, FromBytes, IntoBytes, KnownLayout, Immutable)]
#[repr(C)]
pub(crate) struct RaySlabs {
    pub(crate) reciprocal: [f32; 3],
    /// Depth of t = 1.
    pub(crate) scale: f32,
    pub(crate) near_addend: [f32; 3],
    /// Lower bound of the depth.
    pub(crate) first: f32,
    pub(crate) far_addend: [f32; 3],
    /// Upper bound of the depth at the start of the query.
    pub(crate) last: f32,
    /// Per axis the row of the ends that are met first: 0 or [`FAR`].
    pub(crate) near: [u32; 3],
}

impl RaySlabs {
    /// Slopes of no ray.
    pub(crate) const NONE: RaySlabs = RaySlabs {
        reciprocal: [0.0; 3],
        scale: 0.0,
        near_addend: [f32::NEG_INFINITY; 3],
        first: 0.0,
        far_addend: [f32::INFINITY; 3],
        last: 0.0,
        near: [0; 3],
    };

    pub(crate) fn new(ray: &Ray, line: &Line, object: &Object) -> RaySlabs {
        let corners = object.lower.iter().chain(&object.upper);
        RaySlabs::of(ray, line, corners.fold(0.0, |m: f64, &x| m.max(f64::from(x).abs())), |_| 0.0)
    }

    /// For boxes whose coordinates do not exceed `farthest`, widened by what `more` makes of the greatest coordinate of the
    /// origin. None for a ray without a line.
    pub(crate) fn widened(ray: &Ray, farthest: f32, more: impl Fn(f64) -> f64) -> Option<RaySlabs> {
        Some(RaySlabs::of(ray, &Line::new(ray)?, farthest.into(), more))
    }

    fn of(ray: &Ray, line: &Line, farthest: f64, more: impl Fn(f64) -> f64) -> RaySlabs {
        let depth = line.direction[line.axis[2]].abs();
        let start = line.origin.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let extent = farthest + start;
        let pad = PAD * extent + more(start);
        let mut slabs = RaySlabs { scale: depth as f32, ..RaySlabs::NONE };
        // A number even where every box is entered at this depth: lanes are written into the low bits of keys, which would
        // make NaN of an infinity.
        slabs.first = ((f64::from(ray.tmin) * depth) as f32).next_down().max(-f32::MAX);
        slabs.last = slabs.limit(f64::from(ray.tmax));
        for k in 0..3 {
            let d = line.direction[k] / depth;
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

    /// Upper bound of the depth of t, for [`Self::children`].
    #[inline(always)]
    pub(crate) fn limit(&self, t: f64) -> f32 {
        // Rounding to f32 can lower it; one step up makes good for it, also where it underflows.
        ((t * f64::from(self.scale)) as f32).next_up()
    }

    /// Lower bound of the depth of a hit that lies between two t; infinite where there is none.
    #[inline(always)]
    pub(crate) fn nearest(&self, found: Option<[f64; 2]>) -> f32 {
        found.map_or(f32::INFINITY, |[t, _]| ((t * f64::from(self.scale)) as f32).next_down())
    }

    /// From which to which depth a hit certainly lies in the ray's range.
    pub(crate) fn certain_range(&self, ray: &Ray) -> [f32; 2] {
        let depth = |t: f32| (f64::from(t) * f64::from(self.scale)) as f32;
        [depth(ray.tmin).next_up(), depth(ray.tmax.min(f32::MAX)).next_down()]
    }

    /// As [`RaySlabLanes::children`], for one node.
    #[inline(always)]
    pub(crate) fn children<S: Simd, B: ChildBoxes>(&self, s: S, node: &B, limit: f32) -> (u32, S::F) {
        RaySlabLanes::new(s, self).children(s, node, limit)
    }
}

/// [`RaySlabs`] in lanes, for a ray that goes through many nodes.
#[derive(Clone, Copy)]
pub(crate) struct RaySlabLanes<S: Simd> {
    reciprocal: [S::F; 3],
    near_addend: [S::F; 3],
    far_addend: [S::F; 3],
    first: S::F,
    near: [u32; 3],
}

/// Three numbers in lanes.
#[inline(always)]
fn splat<S: Simd>(s: S, [x, y, z]: [f32; 3]) -> [S::F; 3] {
    [s.splat(x), s.splat(y), s.splat(z)]
}

impl<S: Simd> RaySlabLanes<S> {
    #[inline(always)]
    pub(crate) fn new(s: S, slabs: &RaySlabs) -> Self {
        RaySlabLanes {
            reciprocal: splat(s, slabs.reciprocal),
            near_addend: splat(s, slabs.near_addend),
            far_addend: splat(s, slabs.far_addend),
            first: s.splat(slabs.first),
            near: slabs.near,
        }
    }

    /// The children of a node whose boxes the ray may meet before `limit`, a bit each, and lower bounds of
    /// their t. Empty slots may be among them when coordinates are too great for f32.
    #[inline(always)]
    pub(crate) fn children<B: ChildBoxes>(&self, s: S, node: &B, limit: f32) -> (u32, S::F) {
        let (mut enter, mut leave) = (self.first, s.splat(limit));
        for k in 0..3 {
            let (first, second) = (node.ends(s, k, self.near[k]), node.ends(s, k, self.near[k] ^ FAR));
            enter = s.max(s.fma(first, self.reciprocal[k], self.near_addend[k]), enter);
            leave = s.min(s.fma(second, self.reciprocal[k], self.far_addend[k]), leave);
        }
        (s.mask_bits(s.le(enter, leave)), enter)
    }
}

/// The boxes of a node's children, whatever they are stored as.
pub(crate) trait ChildBoxes {
    /// The ends of an axis: the lower ones at 0, the upper ones at [`FAR`].
    fn ends<S: Simd>(&self, s: S, axis: usize, at: u32) -> S::F;
    /// The codes of the children.
    fn child(&self) -> &[u32; WIDTH];
}

/// One of the two rows of an axis: lower ends at 0, upper ends at [`FAR`].
#[inline(always)]
pub(crate) fn row<T>(rows: &[[T; WIDTH]; 2], at: u32) -> &[T; WIDTH] {
    let at = (at & FAR) as usize;
    rows.as_flattened()[at..at + WIDTH].try_into().expect("a row")
}

impl ChildBoxes for WideNode {
    #[inline(always)]
    fn ends<S: Simd>(&self, s: S, axis: usize, at: u32) -> S::F {
        s.load(row(&self.bounds[axis], at))
    }
    #[inline(always)]
    fn child(&self) -> &[u32; WIDTH] {
        &self.child
    }
}

impl ChildBoxes for PackedNode {
    #[inline(always)]
    fn ends<S: Simd>(&self, s: S, axis: usize, at: u32) -> S::F {
        let steps = s.numbers(s.load_bytes(row(&self.bounds[axis], at)));
        s.fma(steps, s.splat(self.step[axis]), s.splat(self.origin[axis]))
    }
    #[inline(always)]
    fn child(&self) -> &[u32; WIDTH] {
        &self.child
    }
}
