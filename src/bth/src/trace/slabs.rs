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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Rng;

    /// A node with one box, and the object whose bounds it has.
    fn boxed(corners: [[f32; 3]; 3]) -> (WideNode, Object) {
        let mut node = WideNode { bounds: [[[f32::MAX; WIDTH], [f32::MIN; WIDTH]]; 3], child: [NONE; WIDTH] };
        let mut object = Object {
            lower: [0.0; 3],
            upper: [0.0; 3],
            root: 0,
            record: 0,
            triangles: 1,
            dropped: 0,
            depth: 1,
            reserved: [0; 5],
        };
        node.child[0] = 7;
        for k in 0..3 {
            object.lower[k] = corners.iter().map(|p| p[k]).fold(f32::INFINITY, f32::min);
            object.upper[k] = corners.iter().map(|p| p[k]).fold(f32::NEG_INFINITY, f32::max);
            node.bounds[k][0][0] = object.lower[k];
            node.bounds[k][1][0] = object.upper[k];
        }
        (node, object)
    }

    #[test]
    fn a_box_is_never_lost_whose_triangle_the_line_crosses() {
        let mut rng = Rng(3);
        let (mut crossings, mut missed) = (0, 0);
        for round in 0..60_000 {
            let unit = |rng: &mut Rng| (rng.below(1 << 24) as f32 / (1 << 23) as f32) - 1.0;
            let scale = [1.0, 1e-30, 1e30, 3e37, 1e-42][round % 5];
            let away = [0.0, 1.0, 1e3, 1e6][round / 5 % 4] * scale;
            // Often flat, often on a coarse grid: boxes without volume, rays along their sides.
            let coarse = round % 3 == 0;
            let mut point = |spread: f32| {
                [(); 3].map(|()| {
                    let x = unit(&mut rng);
                    let x = if coarse { (x * 2.0).round() } else { x };
                    (x * spread * scale + away).clamp(f32::MIN, f32::MAX)
                })
            };
            let corners = [point(1.0), point(1.0), point(1.0)];
            let (origin, target) = (point(4.0), point(1.0));
            let mut direction = [0, 1, 2].map(|k| target[k] - origin[k]);
            if round % 4 == 0 {
                direction[round / 4 % 3] = if round % 8 == 0 { 0.0 } else { -0.0 };
            }
            let ray = Ray { origin, tmin: f32::NEG_INFINITY, direction, tmax: f32::INFINITY };
            let Some(line) = Line::new(&ray) else { continue };
            let (node, object) = boxed(corners);
            let projected = corners.map(|p| line.project(p));
            let crossing = line.crossing(|| corners, projected.each_ref());
            let t = crossing.map(|c| c.t).unwrap_or(f64::INFINITY);
            let mut found = [(0.0, NONE); WIDTH];
            // Also with the range cut off right at the crossing.
            for (tmin, limit) in [(f32::NEG_INFINITY, f64::INFINITY), (t as f32, t)] {
                let slabs = Slabs::new(&Ray { tmin, ..ray }, &line, &object);
                let count = slabs.children(&node, slabs.limit(limit), &mut found);
                assert!(
                    crossing.is_none() || count == 1,
                    "round {round}: {ray:?} crosses {corners:?} at {t}"
                );
                assert!(count <= 1, "empty slots are never entered");
                missed += (count == 0) as u32;
            }
            crossings += crossing.is_some() as u32;
        }
        assert!(crossings > 2_000 && missed > 10_000, "{crossings} crossings, {missed} boxes missed");
    }
}
