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
/// transform, products and sums to f32 gives less than six times 2^-24.
const ROUNDING: f64 = 1.0 / (1 << 21) as f64;
/// Where sums could overflow, no box is excluded.
const LARGEST: f64 = f32::MAX as f64 / 4.0;

/// A closed box in world space, for tests of boxes in the space of an object.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RegionBox {
    lower: [f32; 3],
    upper: [f32; 3],
    /// The linear part of the transform to world space, by rows.
    rows: [[f32; 3]; 3],
    /// The translation, less and plus a pad for roundings.
    translation: [[f32; 2]; 3],
}

impl RegionBox {
    /// For boxes with |coordinates| of at most `greatest`, whose triangles are rounded to f32 in a
    /// world box with |coordinates| of at most `extent`.
    pub(crate) fn new(
        [lower, upper]: [[f32; 3]; 2],
        to_world: &[[f64; 4]; 3],
        greatest: f32,
        extent: f64,
    ) -> RegionBox {
        let mut region =
            RegionBox { lower, upper, rows: [[0.0; 3]; 3], translation: [[f32::MIN, f32::MAX]; 3] };
        let greatest = f64::from(greatest);
        for (i, [x, y, z, t]) in to_world.iter().enumerate() {
            let stretch = x.abs() + y.abs() + z.abs();
            let sum = stretch * greatest + t.abs();
            // The processor may take denormal numbers for zero: coordinates, elements and products.
            let denormal = f64::from(f32::MIN_POSITIVE) * (stretch + 3.0 * greatest + 4.0);
            let pad = ROUNDING * (sum + extent) + denormal;
            if sum + pad < LARGEST {
                region.rows[i] = [*x as f32, *y as f32, *z as f32];
                region.translation[i] = [((t - pad) as f32).next_down(), ((t + pad) as f32).next_up()];
            }
        }
        region
    }

    /// For boxes in world space.
    pub(crate) fn in_world(region: [[f32; 3]; 2], greatest: f32) -> RegionBox {
        const IDENTITY: [[f64; 4]; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]];
        RegionBox::new(region, &IDENTITY, greatest, 0.0)
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
            let [from, to] = region.translation[i];
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
