//! Conservative tests of sixteen boxes against an axis-aligned box in world space. They only
//! *exclude* boxes; triangles are decided by [`super::triangle_box`].
//!
//! The boxes of an instance are in the space of its object. Along each axis of world space the
//! extent of a box is a sum of one interval per axis of the object: from the min to the max of the
//! products of the box's ends with an element of the transform.

use super::boxes::{FAR, planes};
use crate::simd::{Part, Simd};
use bth_format::layout::{NONE, WideNode};

/// 2^-21: bounds all roundings relative to the magnitudes of the sums. Rounding elements of the
/// transform, products and sums to f32 gives less than six times 2^-24, rounded vertices one more.
const ROUNDING: f64 = 1.0 / (1 << 21) as f64;
/// Where sums could overflow, no box is excluded.
const LARGEST: f64 = f32::MAX as f64 / 4.0;

/// A closed box in world space relative to the origin of an object, for tests of boxes in the space
/// of the object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RegionBox {
    lower: [f32; 3],
    upper: [f32; 3],
    /// The linear part of the transform to world space, by rows.
    rows: [[f32; 3]; 3],
    /// A pad for roundings, below and above.
    pad: [[f32; 2]; 3],
}

impl RegionBox {
    /// For boxes with |coordinates| of at most `greatest`, which a linear map, given by rows, takes
    /// to the space of the region. That space has the origin of the object as its origin, because
    /// this is often far from the origin of world space. `off` bounds how far the region is off but
    /// for one rounding.
    pub(crate) fn new(
        [lower, upper]: [[f64; 3]; 2],
        linear: &[[f64; 3]; 3],
        greatest: f32,
        off: f64,
    ) -> RegionBox {
        let mut region = RegionBox {
            // The steps cover that rounding, too.
            lower: lower.map(|x| (x as f32).next_down()),
            upper: upper.map(|x| (x as f32).next_up()),
            rows: [[0.0; 3]; 3],
            pad: [[f32::MIN, f32::MAX]; 3],
        };
        let greatest = f64::from(greatest);
        for (i, row) in linear.iter().enumerate() {
            let stretch = row.iter().map(|x| x.abs()).sum::<f64>();
            let sum = stretch * greatest;
            // The processor may take denormal numbers for zero: coordinates, elements and products.
            let denormal = f64::from(f32::MIN_POSITIVE) * (stretch + 3.0 * greatest + 4.0);
            let pad = ROUNDING * sum + denormal + off;
            if sum + pad < LARGEST {
                region.rows[i] = row.map(|x| x as f32);
                region.pad[i] = [(-pad as f32).next_down(), (pad as f32).next_up()];
            }
        }
        region
    }

    /// For boxes in world space.
    pub(crate) fn in_world(region: [[f64; 3]; 2], greatest: f32) -> RegionBox {
        RegionBox::new(region, &[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], greatest, 0.0)
    }

    #[inline(always)]
    pub(crate) fn lanes<S: Simd>(&self, s: S) -> RegionLanes<S> {
        let zero = s.splat(0.0);
        let mut lanes = RegionLanes { region: *self, rows: [[zero; 3]; 3] };
        for i in 0..3 {
            for k in 0..3 {
                lanes.rows[i][k] = s.splat(self.rows[i][k]);
            }
        }
        lanes
    }
}

/// [`RegionBox`] with its transform broadcast to lanes.
#[derive(Clone, Copy)]
pub(crate) struct RegionLanes<S: Simd> {
    region: RegionBox,
    rows: [[S::F; 3]; 3],
}

/// [`RegionLanes::children`] as a part of kernels.
struct InRegion<'a, S: Simd> {
    lanes: &'a RegionLanes<S>,
    node: &'a WideNode,
}

impl<S: Simd> Part<S> for InRegion<'_, S> {
    type Output = u32;
    #[inline(always)]
    fn run(self, s: S) -> u32 {
        let RegionLanes { region, rows } = self.lanes;
        let mut apart = s.mask(0);
        for i in 0..3 {
            let [from, to] = region.pad[i];
            let (mut from, mut to) = (s.splat(from), s.splat(to));
            for k in 0..3 {
                let low = s.mul(planes(s, self.node, k, 0), rows[i][k]);
                let high = s.mul(planes(s, self.node, k, FAR), rows[i][k]);
                from = s.add(from, s.min(low, high));
                to = s.add(to, s.max(low, high));
            }
            apart = s.or(apart, s.lt(s.splat(region.upper[i]), from));
            apart = s.or(apart, s.lt(to, s.splat(region.lower[i])));
        }
        let used = s.lt_u(s.load_u(&self.node.child), s.splat_u(NONE));
        s.mask_bits(s.and_not(used, apart))
    }
}

impl<S: Simd> RegionLanes<S> {
    /// The children of a node whose boxes may overlap the region, one bit each.
    #[inline(always)]
    pub(crate) fn children(&self, s: S, node: &WideNode) -> u32 {
        InRegion { lanes: self, node }.inline_or_call(s)
    }
}
