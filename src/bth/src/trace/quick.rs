//! Triangle tests in f32 alone, as other tracers have them: what exact answers cost is measured against these.

use super::crossing::Crossing;
use super::query::{Named, Nearest, Query};
use super::sight::{Block, Sight, cross};
use crate::layout::WIDTH;
use crate::rays::{Hit, Ray, Surface};
use crate::simd::Simd;

/// How triangles are decided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Test {
    /// As everywhere: f32 leaves out what certainly does not matter, f64 decides, exact arithmetic where that is open.
    #[default]
    Exact,
    /// Edge functions in f32 without fused multiply-add (Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", JCGT
    /// 2013): neighbours agree on their shared edge, but the line meets it elsewhere than it really does.
    Watertight,
    /// The same fused, so that rays can slip between neighbours. Cheaper on our leaves than Möller and Trumbore's test, as
    /// vertices are projected once for all triangles.
    Fast,
}

/// A search for the nearest hit by such a test.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quick<const WATERTIGHT: bool>(Nearest);

impl<const WATERTIGHT: bool> Query for Quick<WATERTIGHT> {
    const ANY: bool = false;
    const TEST: Test = if WATERTIGHT { Test::Watertight } else { Test::Fast };
    type Answer = Hit;
    fn answer(&self, ids: &[u32], instance: u32) -> Hit {
        self.0.answer(ids, instance)
    }
    #[inline(always)]
    fn answer_of(surface: Surface, t: f32, u: f32, v: f32) -> Hit {
        Nearest::answer_of(surface, t, u, v)
    }
    fn new(ray: &Ray) -> Self {
        Quick(Nearest::new(ray))
    }
    #[inline(always)]
    fn offer(&mut self, triangle: Named<'_>, crossing: Crossing) -> bool {
        self.0.offer(triangle, crossing)
    }
    #[inline(always)]
    fn limit(&self) -> f64 {
        self.0.limit()
    }
    fn cares(&self, t: [f64; 2]) -> bool {
        self.0.cares(t)
    }
    fn found(&self) -> Option<f64> {
        self.0.found()
    }
    fn accept(&mut self) {}
}

/// The nearest triangle of a leaf.
pub(crate) struct Nearby {
    /// Place in the leaf.
    pub(crate) triangle: usize,
    /// In units of the direction along the ray's greatest axis.
    pub(crate) depth: f32,
    /// Weights of the second and third corner.
    pub(crate) weight: [f32; 2],
}

/// Twice the signed area of the triangle of the line and two points: antisymmetric bit for bit.
#[inline(always)]
fn cross_unfused<S: Simd>(s: S, p: [S::F; 3], q: [S::F; 3]) -> S::F {
    s.sub(s.mul(p[0], q[1]), s.mul(p[1], q[0]))
}

impl Sight {
    /// The nearest triangle that f32 finds hit up to a depth.
    #[inline(always)]
    pub(crate) fn nearby<S: Simd, B: Block>(
        &self,
        s: S,
        block: &B,
        watertight: bool,
        limit: f32,
    ) -> Option<Nearby> {
        let [a, b, c] = block.project(s, self);
        let weight = if watertight {
            [cross_unfused(s, b, c), cross_unfused(s, c, a), cross_unfused(s, a, b)]
        } else {
            [cross(s, b, c), cross(s, c, a), cross(s, a, b)]
        };
        let zero = s.splat(0.0);
        let least = s.min(s.min(weight[0], weight[1]), weight[2]);
        let greatest = s.max(s.max(weight[0], weight[1]), weight[2]);
        let inside = s.or(s.le(zero, least), s.le(greatest, zero));
        let inverse = s.div(s.splat(1.0), s.add(s.add(weight[0], weight[1]), weight[2]));
        let share = [s.mul(weight[0], inverse), s.mul(weight[1], inverse), s.mul(weight[2], inverse)];
        let depth = s.fma(share[2], c[2], s.fma(share[1], b[2], s.mul(share[0], a[2])));
        let in_range = s.and(s.le(s.splat(self.first), depth), s.le(depth, s.splat(limit.min(self.last))));
        let valid = (1 << block.triangles().min(WIDTH as u32)) - 1;
        let bits = s.mask_bits(s.and(inside, in_range)) & valid;
        if bits == 0 {
            return None;
        }
        let depths = s.select(s.mask(bits), depth, s.splat(f32::MAX));
        let depth = s.least(depths);
        let triangle = s.mask_bits(s.le(depths, s.splat(depth))).trailing_zeros() as usize % WIDTH;
        let (mut second, mut third) = ([0.0; WIDTH], [0.0; WIDTH]);
        s.store(share[1], &mut second);
        s.store(share[2], &mut third);
        Some(Nearby { triangle, depth, weight: [second[triangle], third[triangle]] })
    }
}
