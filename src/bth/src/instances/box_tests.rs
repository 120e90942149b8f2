//! Tests of rays against the boxes of the top level.

use super::top_level::TopLevel;
use crate::bvh::stack::BOTTOM;
use crate::intersect::boxes::{RaySlabLanes, RaySlabs};
use crate::rays::Ray;
use crate::simd::Simd;
use bth_format::layout::WideNode;

/// The constants of a ray for box tests, computed in f64. For rays from beyond [`TopLevel::reach`]
/// they widen the boxes. `None` for rays that cannot hit anything.
pub(super) fn widened_slabs(ray: &Ray, top: &TopLevel) -> Option<RaySlabs> {
    RaySlabs::widened(ray, top.greatest_coordinate(), |start| {
        if start > f64::from(top.reach) { f64::from(top.origin_slack) * start } else { 0.0 }
    })
}

/// Upper bound of the depths of hits whose t, rounded to f32, is at most `tmax`; `scale` is the
/// depth of t = 1.
#[inline(always)]
pub(super) fn limit(scale: f32, tmax: f32) -> f32 {
    const SLACK: f64 = 1.0 / (1 << 22) as f64;
    let tmax = f64::from(tmax);
    let limit = ((tmax + tmax.abs() * SLACK + f64::from(f32::from_bits(1))) * f64::from(scale)) as f32;
    // This adds at least one unit in the last place. There is no branch, because a batch may mix
    // finite and infinite values.
    limit + (limit.abs() * f32::EPSILON + f32::MIN_POSITIVE)
}

/// [`limit`] in lanes: an upper bound, for the same scale and t at most a little greater.
#[inline(always)]
pub(super) fn limit_lanes<S: Simd>(s: S, scale: S::F, tmax: S::F) -> S::F {
    /// Greater than four roundings.
    const SLACK: f32 = 1.0 / (1 << 21) as f32;
    let limit = s.mul(scale, tmax);
    s.add(limit, s.fma(s.abs(limit), s.splat(SLACK), s.splat(f32::MIN_POSITIVE)))
}

/// Bits of the children of a node that the ray may enter before the depth `last`, and the depths at
/// which it enters all.
#[inline(always)]
pub(super) fn entered<S: Simd>(s: S, planes: &RaySlabLanes<S>, node: &WideNode, last: f32) -> (u32, S::F) {
    let (bits, enter) = planes.children_soon(s, node, last);
    // With coordinates near the limit of f32 the test accepts all boxes, also of empty slots, so
    // these are excluded here.
    (bits & s.mask_bits(s.lt_u(s.load_u(&node.child), s.splat_u(BOTTOM))), enter)
}
