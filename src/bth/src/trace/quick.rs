//! Triangle tests in f32 alone, as other tracers have them: what exact answers cost is measured against these.

use super::crossing::Crossing;
use super::query::{Named, Nearest, Query, Sixteen};
use super::sight::{Block, Corners, Sight, cross};
use crate::rays::{Hit, Ray, Surface};
use crate::simd::{LANES, Simd};
use bth_format::layout::WIDTH;
use std::marker::PhantomData;

/// How triangles are decided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Test {
    /// As everywhere: f32 leaves out what certainly does not matter, f64 decides, exact arithmetic where that is open.
    #[default]
    Exact,
    /// Edge functions in f32 without fused multiply-add (Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", JCGT
    /// 2013): neighbours agree on their shared edge, but the line meets it elsewhere than it really does.
    Watertight,
    /// The same fused, so that rays can slip between neighbours. Vertices are projected once for all triangles of a leaf.
    Fast,
    /// Möller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection" (JGT 1997), fused; rays can slip between
    /// neighbours. It seems the cheapest where triangles share no vertices.
    MoellerTrumbore,
}

/// A way to test in f32, as a type.
pub(crate) trait Way: Copy {
    const TEST: Test;
}

/// [`Test::Watertight`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Watertight;
/// [`Test::Fast`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fast;
/// [`Test::MoellerTrumbore`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct MoellerTrumbore;

impl Way for Watertight {
    const TEST: Test = Test::Watertight;
}
impl Way for Fast {
    const TEST: Test = Test::Fast;
}
impl Way for MoellerTrumbore {
    const TEST: Test = Test::MoellerTrumbore;
}

/// A search for the nearest hit by such a test.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quick<W>(Nearest, PhantomData<W>);

impl<W: Way> Query for Quick<W> {
    const ANY: bool = false;
    const TEST: Test = W::TEST;
    type Answer = Hit;
    fn answer(&self, ids: &[u32], instance: u32) -> Hit {
        self.0.answer(ids, instance)
    }
    #[inline(always)]
    fn answer_of(surface: Surface, t: f32, u: f32, v: f32) -> Hit {
        Nearest::answer_of(surface, t, u, v)
    }
    #[inline(always)]
    fn answers_of<S: Simd>(s: S, hits: &Sixteen<'_>, to: &mut [Hit; LANES]) {
        Nearest::answers_of(s, hits, to);
    }
    fn new(ray: &Ray) -> Self {
        Quick(Nearest::new(ray), PhantomData)
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
    pub(crate) t: f32,
    /// Weights of the second and third corner.
    pub(crate) weight: [f32; 2],
}

/// Sixteen lines and triangles: whether they meet, how far off, and with which weights of the second and third corner.
struct Met<S: Simd> {
    inside: S::M,
    depth: S::F,
    weight: [S::F; 2],
}

/// Twice the signed area of the triangle of the line and two points: antisymmetric bit for bit.
#[inline(always)]
fn cross_unfused<S: Simd>(s: S, p: [S::F; 3], q: [S::F; 3]) -> S::F {
    s.sub(s.mul(p[0], q[1]), s.mul(p[1], q[0]))
}

/// By edge functions of projected corners; depths as of the corners.
#[inline(always)]
fn by_edges<S: Simd>(s: S, [a, b, c]: Corners<S>, watertight: bool) -> Met<S> {
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
    Met { inside, depth, weight: [share[1], share[2]] }
}

/// Sixteen vectors.
#[inline(always)]
fn minus<S: Simd>(s: S, a: [S::F; 3], b: [S::F; 3]) -> [S::F; 3] {
    [s.sub(a[0], b[0]), s.sub(a[1], b[1]), s.sub(a[2], b[2])]
}

#[inline(always)]
fn vector_product<S: Simd>(s: S, a: [S::F; 3], b: [S::F; 3]) -> [S::F; 3] {
    let component = |i: usize, j: usize| s.fnma(a[j], b[i], s.mul(a[i], b[j]));
    [component(1, 2), component(2, 0), component(0, 1)]
}

#[inline(always)]
fn dot<S: Simd>(s: S, a: [S::F; 3], b: [S::F; 3]) -> S::F {
    s.fma(a[2], b[2], s.fma(a[1], b[1], s.mul(a[0], b[0])))
}

/// As Möller and Trumbore, without their culling and without their absolute epsilon; depths in units of the direction.
#[inline(always)]
fn by_moeller_trumbore<S: Simd>(s: S, [a, b, c]: Corners<S>, ray: &Ray) -> Met<S> {
    let (origin, direction) = (ray.origin.map(|x| s.splat(x)), ray.direction.map(|x| s.splat(x)));
    let (first, second) = (minus(s, b, a), minus(s, c, a));
    let p = vector_product(s, direction, second);
    let inverse = s.div(s.splat(1.0), dot(s, first, p));
    let from = minus(s, origin, a);
    let u = s.mul(dot(s, from, p), inverse);
    let q = vector_product(s, from, first);
    let v = s.mul(dot(s, direction, q), inverse);
    let (zero, one) = (s.splat(0.0), s.splat(1.0));
    let inside = s.and(s.and(s.le(zero, u), s.le(zero, v)), s.le(s.add(u, v), one));
    Met { inside, depth: s.mul(dot(s, second, q), inverse), weight: [u, v] }
}

impl Sight {
    /// The nearest triangle that f32 finds hit up to a depth, of which t = 1 has `scale`.
    #[inline(always)]
    pub(crate) fn nearby<S: Simd, B: Block>(
        &self,
        s: S,
        block: &B,
        ray: &Ray,
        test: Test,
        limit: f32,
        scale: f32,
    ) -> Option<Nearby> {
        let (met, first, last, per_t) = match test {
            // What is not within the ray's range is refused when it is offered.
            Test::MoellerTrumbore => {
                (by_moeller_trumbore(s, block.points(s), ray), ray.tmin, limit / scale, 1.0)
            }
            _ => {
                let met = by_edges(s, block.project(s, self), test == Test::Watertight);
                (met, self.first, limit.min(self.last), scale)
            }
        };
        let in_range = s.and(s.le(s.splat(first), met.depth), s.le(met.depth, s.splat(last)));
        let valid = (1 << block.triangles().min(WIDTH as u32)) - 1;
        let bits = s.mask_bits(s.and(met.inside, in_range)) & valid;
        if bits == 0 {
            return None;
        }
        let depths = s.select(s.mask(bits), met.depth, s.splat(f32::MAX));
        let depth = s.least(depths);
        let triangle = s.mask_bits(s.le(depths, s.splat(depth))).trailing_zeros() as usize % WIDTH;
        let (mut second, mut third) = ([0.0; WIDTH], [0.0; WIDTH]);
        s.store(met.weight[0], &mut second);
        s.store(met.weight[1], &mut third);
        Some(Nearby { triangle, t: depth / per_t, weight: [second[triangle], third[triangle]] })
    }
}
