//! Conservative ray-box tests in f32 for the sixteen children of a node.
//!
//! Slab test (Kay and Kajiya 1986) as one multiplication and one addition per plane,
//! t = plane · r + (-o · r ∓ pad · |r|): the pad covers every rounding and the clamping of small
//! direction components, so a box that the ray meets is never lost. t is in units of the direction
//! scaled by a power of two such that its greatest component lies in [1, 2).

use crate::layout::{Object, WideNode};
use crate::rays::Ray;
use crate::simd::Simd;
use crate::trace::line::Line;

/// Pad of a plane relative to the greatest coordinate in play. Half of it covers the roundings
/// (reciprocal, product, addend and sum: at most 4 · 2^-24), half the clamping below.
pub(crate) const PAD: f64 = 1.0 / (1 << 20) as f64;
/// Components below this (of a greatest one in [1, 2)) are raised to it. Over the way to the farthest
/// coordinate that moves the ray by less than half the pad, and it keeps products finite.
pub(crate) const LEAST_COMPONENT: f64 = 1.0 / (1 << 22) as f64;
/// Beyond this, products could overflow f32: every box is visited instead.
const LARGEST_COORDINATE: f64 = 1e30;

/// A ray prepared for box tests.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slabs {
    /// 0 or 1 per axis: which of (lower, upper) is met first.
    pub(crate) near: [u32; 3],
    pub(crate) reciprocal: [f32; 3],
    pub(crate) near_addend: [f32; 3],
    pub(crate) far_addend: [f32; 3],
    /// Power of two from t to scaled t.
    pub(crate) scale: f32,
    /// Lower bound of t, scaled.
    pub(crate) tmin: f32,
}

impl Slabs {
    /// Of no ray.
    pub(crate) const VACANT: Slabs = Slabs {
        near: [0; 3],
        reciprocal: [0.0; 3],
        near_addend: [0.0; 3],
        far_addend: [0.0; 3],
        scale: 1.0,
        tmin: 0.0,
    };

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
            scale: scale as f32,
            tmin: 0.0,
        };
        slabs.tmin = ((f64::from(ray.tmin) * scale) as f32).next_down();
        for k in 0..3 {
            let d = line.direction[k] / scale;
            let r = 1.0 / d.abs().max(LEAST_COMPONENT).copysign(d);
            slabs.near[k] = d.is_sign_negative().into();
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
        ((t * f64::from(self.scale)) as f32).next_up()
    }

    /// Lower bound of t in scaled units.
    pub(crate) fn lower(&self, t: f64) -> f32 {
        ((t * f64::from(self.scale)) as f32).next_down()
    }

    /// From which to which scaled t a hit certainly lies in the ray's range.
    pub(crate) fn certain_range(&self, ray: &Ray) -> [f32; 2] {
        let scaled = |t: f32| (f64::from(t) * f64::from(self.scale)) as f32;
        [scaled(ray.tmin).next_up(), scaled(ray.tmax.min(f32::MAX)).next_down()]
    }

    /// From depths along the line's greatest axis to scaled t; between 1/2 and 1, or -1/2 and -1.
    pub(crate) fn depth_to_t(&self, line: &Line) -> f32 {
        (line.inverse_depth * f64::from(self.scale)) as f32
    }

    /// The children of a node whose boxes the ray may meet before `limit`, a bit each, and lower bounds of
    /// their t. Empty slots may be among them when coordinates are too great for f32.
    #[inline(always)]
    pub(crate) fn children<S: Simd>(&self, s: S, node: &WideNode, limit: f32) -> (u32, S::F) {
        let (mut enter, mut leave) = (s.splat(self.tmin), s.splat(limit));
        for k in 0..3 {
            let near = (self.near[k] & 1) as usize;
            let reciprocal = s.splat(self.reciprocal[k]);
            let (first, second) = (s.load(&node.bounds[k][near]), s.load(&node.bounds[k][1 - near]));
            enter = s.max(s.fma(first, reciprocal, s.splat(self.near_addend[k])), enter);
            leave = s.min(s.fma(second, reciprocal, s.splat(self.far_addend[k])), leave);
        }
        (s.mask_bits(s.le(enter, leave)), enter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layout::{NONE, WIDTH};
    use crate::simd::{Isa, Kernel};
    use crate::testing::Rng;

    /// The children as a kernel.
    struct Children<'a>(&'a Slabs, &'a WideNode, f32);

    impl Kernel for Children<'_> {
        type Output = u32;
        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> u32 {
            let (bits, _) = self.0.children(s, self.1, self.2);
            (0..WIDTH).filter(|&i| bits >> i & 1 != 0 && self.1.child[i] != NONE).fold(0, |m, i| m | 1 << i)
        }
    }

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
            let crossing = line.crossing(corners);
            let t = crossing.map(|c| c.t).unwrap_or(f64::INFINITY);
            // Also with the range cut off right at the crossing.
            for (tmin, limit) in [(f32::NEG_INFINITY, f64::INFINITY), (t as f32, t)] {
                let slabs = Slabs::new(&Ray { tmin, ..ray }, &line, &object);
                for isa in Isa::ALL {
                    let found = isa.run(Children(&slabs, &node, slabs.limit(limit)));
                    assert!(
                        crossing.is_none() || found == 1,
                        "{isa}, round {round}: {ray:?} crosses {corners:?} at {t}"
                    );
                    assert!(found <= 1, "empty slots are never entered");
                    missed += (found == 0) as u32;
                }
            }
            crossings += crossing.is_some() as u32;
        }
        assert!(crossings > 2_000 && missed > 10_000, "{crossings} crossings, {missed} boxes missed");
    }
}
