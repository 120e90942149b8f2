//! Conservative ray-box tests in f32 for the sixteen children of a node.
//!
//! Slab test (Kay and Kajiya 1986) as one multiplication and one addition per plane,
//! t = plane · r + (-o · r ∓ pad · |r|): the pad covers every rounding and the clamping of small
//! direction components, so a box that the ray meets is never lost. t is in units of the direction
//! scaled by a power of two such that its greatest component lies in [1, 2).

use crate::layout::{NONE, Object, WIDTH, WideNode};
use crate::rays::Ray;
use crate::trace::line::Line;

/// Pad of a plane relative to the greatest coordinate in play. Half of it covers the roundings
/// (reciprocal, product, addend and sum: at most 4 · 2^-24), half the clamping below.
const PAD: f64 = 1.0 / (1 << 20) as f64;
/// Components below this (of a greatest one in [1, 2)) are raised to it. Over the way to the farthest
/// coordinate that moves the ray by less than half the pad, and it keeps products finite.
const LEAST_COMPONENT: f64 = 1.0 / (1 << 22) as f64;
/// Beyond this, products could overflow f32: every box is visited instead.
const LARGEST_COORDINATE: f64 = 1e30;

/// A ray prepared for box tests.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slabs {
    /// 0 or 1 per axis: which of (lower, upper) is met first.
    near: [usize; 3],
    reciprocal: [f32; 3],
    near_addend: [f32; 3],
    far_addend: [f32; 3],
    /// Power of two from t to scaled t.
    scale: f64,
    tmin: f32,
}

impl Slabs {
    pub(crate) fn new(ray: &Ray, line: &Line, object: &Object) -> Slabs {
        let greatest = line.direction.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
        // Exact: the exponent of a finite non-zero f32 is that of a normal f64.
        let scale = f64::from_bits(greatest.to_bits() & (0x7ff << 52));
        let corners = object.lower.iter().chain(&object.upper);
        let farthest = corners.fold(0.0, |m: f64, &x| m.max(f64::from(x).abs()));
        let extent = farthest + line.origin.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let pad = PAD * extent;
        let mut slabs = Slabs {
            near: [0; 3],
            reciprocal: [0.0; 3],
            near_addend: [f32::NEG_INFINITY; 3],
            far_addend: [f32::INFINITY; 3],
            scale,
            tmin: 0.0,
        };
        slabs.tmin = ((f64::from(ray.tmin) * scale) as f32).next_down();
        for k in 0..3 {
            let d = line.direction[k] / scale;
            let r = 1.0 / d.abs().max(LEAST_COMPONENT).copysign(d);
            slabs.near[k] = (d.is_sign_negative()) as usize;
            if extent < LARGEST_COORDINATE {
                slabs.reciprocal[k] = r as f32;
                slabs.near_addend[k] = (-line.origin[k] * r - pad * r.abs()) as f32;
                slabs.far_addend[k] = (-line.origin[k] * r + pad * r.abs()) as f32;
            }
        }
        slabs
    }

    /// Upper bound of t in scaled units, for [`Self::children`].
    pub(crate) fn limit(&self, t: f64) -> f32 {
        // Rounding to f32 can lower t; one step up makes good for it, also where it underflows.
        ((t * self.scale) as f32).next_up()
    }

    /// The children of a node whose boxes the ray may meet before `limit`: their slots and a lower
    /// bound of t, in `found`; returns how many.
    #[inline(always)]
    pub(crate) fn children(&self, node: &WideNode, limit: f32, found: &mut [(f32, u32); WIDTH]) -> usize {
        let (mut enter, mut leave) = ([self.tmin; WIDTH], [limit; WIDTH]);
        for k in 0..3 {
            let (near, far) = (&node.bounds[k][self.near[k]], &node.bounds[k][1 - self.near[k]]);
            for i in 0..WIDTH {
                let t = near[i] * self.reciprocal[k] + self.near_addend[k];
                enter[i] = if t > enter[i] { t } else { enter[i] };
                let t = far[i] * self.reciprocal[k] + self.far_addend[k];
                leave[i] = if t < leave[i] { t } else { leave[i] };
            }
        }
        let mut count = 0;
        for i in 0..WIDTH {
            if enter[i] <= leave[i] && node.child[i] != NONE {
                found[count] = (enter[i], node.child[i]);
                count += 1;
            }
        }
        count
    }
}
