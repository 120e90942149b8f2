//! The arithmetic of [`super::exact`] in f64 for sixteen pairs of a ray and a triangle that the f32
//! filter is sure the ray hits.

use crate::intersect::exact::{
    Intersection, OriginTerms, RoundedIntersection, certain_intersection, reported, reported_barycentric,
};
use crate::intersect::exact_ray::LineLanes;
use crate::intersect::origin::Origin;
use crate::intersect::vector::max_norm;
use crate::simd::{LANES, Simd};
use bth_format::object::ExactPositions;

/// A number of each of sixteen rays or triangles.
pub(crate) type F32Lanes = [f32; LANES];

/// Sixteen rays, and for each a triangle, in object space.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Pairs {
    /// By axis.
    pub(crate) origin: [F32Lanes; 3],
    /// By axis.
    pub(crate) direction: [F32Lanes; 3],
    /// `[corner][axis]`.
    pub(crate) corner: [[F32Lanes; 3]; 3],
}

impl Pairs {
    pub(crate) const NONE: Pairs =
        Pairs { origin: [[0.0; LANES]; 3], direction: [[0.0; LANES]; 3], corner: [[[0.0; LANES]; 3]; 3] };
}

/// Corners of sixteen triangles.
pub(crate) trait LanesOfCorners {
    /// The corners of lane `i`.
    fn corners(&self, i: usize) -> [[f64; 3]; 3];
}

/// As leaves have them: `[corner][axis]`.
impl LanesOfCorners for [[F32Lanes; 3]; 3] {
    #[inline(always)]
    fn corners(&self, i: usize) -> [[f64; 3]; 3] {
        [lane(&self[0], i), lane(&self[1], i), lane(&self[2], i)]
    }
}

/// As the source of an object has them.
pub(crate) struct ExactCorners([[[f64; LANES]; 3]; 3]);

impl ExactCorners {
    /// The corners of the triangles with these ids, of those lanes whose bit is set.
    pub(crate) fn of(exact: &ExactPositions<'_>, ids: &[u32; LANES], mut lanes: u32) -> ExactCorners {
        let mut rows = [[[0.0; LANES]; 3]; 3];
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % LANES;
            lanes &= lanes - 1;
            let corners = exact.corners(ids[lane]).unwrap_or_default();
            for (rows, corner) in rows.iter_mut().zip(corners) {
                for k in 0..3 {
                    rows[k][lane] = corner[k];
                }
            }
        }
        ExactCorners(rows)
    }
}

impl LanesOfCorners for ExactCorners {
    #[inline(always)]
    fn corners(&self, i: usize) -> [[f64; 3]; 3] {
        self.0.each_ref().map(|[x, y, z]| [x[i], y[i], z[i]])
    }
}

/// Numbers in [`OriginTerms`].
const TERMS: usize = 11;

/// [`OriginTerms`] of up to sixteen triangles for one common origin of rays, a row for each number.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct OriginTermsLanes {
    rows: [[f64; LANES]; TERMS],
}

impl OriginTermsLanes {
    pub(crate) const NONE: OriginTermsLanes = OriginTermsLanes { rows: [[0.0; LANES]; TERMS] };

    /// Computes the terms of the first `count` triangles, and of those that complete a half.
    #[inline(always)]
    pub(crate) fn compute(&mut self, origin: impl Origin, triangles: &impl LanesOfCorners, count: usize) {
        const HALF: usize = LANES / 2;
        for first in (0..count.min(LANES)).step_by(HALF) {
            for i in first..first + HALF {
                let OriginTerms { normal, second, third, volume, min_determinant } =
                    OriginTerms::new(origin, triangles.corners(i));
                for k in 0..3 {
                    (self.rows[k][i], self.rows[3 + k][i], self.rows[6 + k][i]) =
                        (normal[k], second[k], third[k]);
                }
                (self.rows[9][i], self.rows[10][i]) = (volume, min_determinant);
            }
        }
    }
}

/// The terms of lane `i`.
#[inline(always)]
fn lane_terms(rows: &[[f64; LANES]; TERMS], i: usize) -> OriginTerms {
    let vector = |first: usize| [rows[first][i], rows[first + 1][i], rows[first + 2][i]];
    OriginTerms {
        normal: vector(0),
        second: vector(3),
        third: vector(6),
        volume: rows[9][i],
        min_determinant: rows[10][i],
    }
}

/// The vector of lane `i`.
#[inline(always)]
pub(crate) fn lane(rows: &[F32Lanes; 3], i: usize) -> [f64; 3] {
    [rows[0][i].into(), rows[1][i].into(), rows[2][i].into()]
}

/// Intersections of sixteen rays, rounded for the answer. In the bit sets, bit i is lane i.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Intersections {
    /// Ids of the triangles.
    pub(crate) triangle: [u32; LANES],
    pub(crate) t: F32Lanes,
    pub(crate) u: F32Lanes,
    pub(crate) v: F32Lanes,
    /// Lanes whose t, u and v are accurate. Their hits lie in the rays' ranges, because the filter
    /// is sure only of such triangles.
    pub(crate) certain: u32,
    /// Lanes whose t, u or v may be inaccurate, to be computed one by one. They are hits as well,
    /// since the filter was sure of them.
    pub(crate) open: u32,
}

impl Intersections {
    pub(crate) const NONE: Intersections = Intersections {
        certain: 0,
        open: 0,
        triangle: [0; LANES],
        t: [0.0; LANES],
        u: [0.0; LANES],
        v: [0.0; LANES],
    };

    /// Computes the intersections of the lanes whose bit is set; `triangle` is not changed.
    #[inline(always)]
    pub(crate) fn compute<S: Simd>(&mut self, s: S, lanes: u32, pairs: &Pairs) {
        let Pairs { origin, direction, corner } = pairs;
        let mut accurate = [0; LANES];
        // There are no branches in this loop, so that the compiler vectorizes it.
        for i in 0..LANES {
            let corners = corner.corners(i);
            let direction = lane(direction, i);
            let terms = OriginTerms::new(lane(origin, i), corners);
            let rounded = RoundedIntersection::new(&terms, direction, max_norm(direction));
            self.store_lane(i, &rounded, &mut accurate);
        }
        self.set_masks(s, lanes, &accurate);
    }

    /// Like [`Self::compute`], for lines that f64 may not hold exactly.
    #[inline(always)]
    pub(crate) fn compute_lines<S: Simd>(
        &mut self,
        s: S,
        lanes: u32,
        lines: &LineLanes,
        triangles: &impl LanesOfCorners,
    ) {
        let mut accurate = [0; LANES];
        // There are no branches in this loop, so that the compiler vectorizes it.
        for i in 0..LANES {
            let line = lines.get(i);
            let terms = OriginTerms::new(line, triangles.corners(i));
            let rounded = RoundedIntersection::new(&terms, line.direction, max_norm(line.direction));
            self.store_lane(i, &rounded, &mut accurate);
        }
        self.set_masks(s, lanes, &accurate);
    }

    /// Like [`Self::compute`], for rays that all start at the origin of `terms`. `of_lane` returns
    /// the direction of a ray and its max |component|; `hit` holds for each ray the index of its
    /// triangle in `terms`; with `FIRST_HALF`, all indices are below eight. It is a kernel that is
    /// inlined into its caller, whose variables the parameters are.
    #[inline(always)]
    pub(crate) fn compute_from_point<S: Simd, const FIRST_HALF: bool>(
        &mut self,
        s: S,
        lanes: u32,
        of_lane: impl Fn(usize) -> ([f64; 3], f64),
        terms: &OriginTermsLanes,
        hit: S::U,
    ) {
        let mut rows = [[0.0; LANES]; TERMS];
        for k in 0..TERMS {
            rows[k] = s.lookup_f64::<FIRST_HALF>(&terms.rows[k], hit);
        }
        let mut accurate = [0; LANES];
        for i in 0..LANES {
            let terms = lane_terms(&rows, i);
            let (direction, norm) = of_lane(i);
            let rounded = RoundedIntersection::new(&terms, direction, norm);
            self.store_lane(i, &rounded, &mut accurate);
        }
        self.set_masks(s, lanes, &accurate);
    }

    #[inline(always)]
    fn store_lane(&mut self, i: usize, rounded: &RoundedIntersection, accurate: &mut [u32; LANES]) {
        let [second, third, _] = rounded.weight;
        accurate[i] = u32::from(rounded.is_accurate);
        self.t[i] = reported(rounded.t);
        self.u[i] = reported_barycentric(second * rounded.inverse);
        self.v[i] = reported_barycentric(third * rounded.inverse);
    }

    /// Sets `certain` and `open` of the given lanes.
    #[inline(always)]
    fn set_masks<S: Simd>(&mut self, s: S, lanes: u32, accurate: &[u32; LANES]) {
        self.certain = s.mask_bits(s.lt_u(s.splat_u(0), s.load_u(accurate))) & lanes;
        self.open = lanes & !self.certain;
    }
}

/// What [`super::exact::estimate`] decides of sixteen pairs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Estimates {
    /// By lane: t, then the weights of [`Intersection`].
    rows: [[f64; LANES]; 4],
    /// Bits of the lanes whose line certainly crosses the triangle, with accurate t, u and v.
    pub(crate) certain: u32,
}

impl Estimates {
    /// The estimates of all lanes.
    #[inline(always)]
    pub(crate) fn new<S: Simd>(s: S, pairs: &Pairs) -> Estimates {
        let Pairs { origin, direction, corner } = pairs;
        let (mut rows, mut certain) = ([[0.0; LANES]; 4], [0; LANES]);
        // There are no branches in this loop, so that the compiler vectorizes it.
        for i in 0..LANES {
            let corners = corner.corners(i);
            let (Intersection { t, weight }, is_certain) =
                certain_intersection(lane(origin, i), lane(direction, i), corners);
            certain[i] = u32::from(is_certain);
            rows[0][i] = t;
            (rows[1][i], rows[2][i], rows[3][i]) = (weight[0], weight[1], weight[2]);
        }
        Estimates { rows, certain: s.mask_bits(s.lt_u(s.splat_u(0), s.load_u(&certain))) }
    }

    /// The intersection of a lane that is certain.
    pub(crate) fn intersection(&self, lane: usize) -> Intersection {
        let [t, u, v, determinant] = [0, 1, 2, 3].map(|row: usize| self.rows[row][lane]);
        Intersection { t, weight: [u, v, determinant] }
    }

    /// Bits of the lanes whose line passes against the triangle's normal.
    #[inline(always)]
    pub(crate) fn against_normal(&self) -> u32 {
        let mut bits = 0;
        for i in 0..LANES {
            bits |= u32::from(self.rows[3][i] < 0.0) << i;
        }
        bits
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intersect::exact::{Estimate, estimate};
    use crate::simd::{Isa, Kernel};
    use bth_random::Rng;

    struct EstimatesOf<'a>(&'a Pairs);

    impl Kernel for EstimatesOf<'_> {
        type Output = (Estimates, u32);
        #[inline(always)]
        fn run<S: Simd>(self, s: S) -> (Estimates, u32) {
            let estimates = Estimates::new(s, self.0);
            (estimates, estimates.against_normal())
        }
    }

    #[test]
    fn estimates_in_lanes_have_the_bits_of_those_of_one_pair() {
        let mut rng = Rng::new(71);
        let (mut certain, mut open, mut against) = (0, 0, 0);
        for round in 0..if cfg!(miri) { 20 } else { 2_000 } {
            let scale = [1.0, 1e-20, 1e20][round % 3];
            let mut number = || (rng.below(1 << 24) as f32 / (1 << 23) as f32 - 1.0) * scale;
            let mut pairs = Pairs::NONE;
            for i in 0..LANES {
                for k in 0..3 {
                    let corners = [number(), number(), number()];
                    // Rays that aim into the triangle, at an edge of it or past it.
                    let target = match i % 4 {
                        0 => 0.5 * corners[0] + 0.5 * corners[1],
                        3 => number(),
                        _ => 0.25 * corners[0] + 0.25 * corners[1] + 0.5 * corners[2],
                    };
                    pairs.origin[k][i] = number();
                    pairs.direction[k][i] = target - pairs.origin[k][i];
                    for corner in 0..3 {
                        pairs.corner[corner][k][i] = corners[corner];
                    }
                }
            }
            for isa in Isa::ALL.into_iter().filter(|isa| isa.is_available()) {
                let (estimates, against_normal) = isa.run(EstimatesOf(&pairs));
                for i in 0..LANES {
                    let corners = [0, 1, 2].map(|corner: usize| lane(&pairs.corner[corner], i));
                    let one = estimate(lane(&pairs.origin, i), lane(&pairs.direction, i), corners);
                    let is_certain = estimates.certain >> i & 1 == 1;
                    match one {
                        Estimate::Intersects(intersection) => {
                            assert!(is_certain, "{isa}, lane {i} of {pairs:?}");
                            assert_eq!(estimates.intersection(i), intersection, "{isa}");
                            let is_against = intersection.weight[2] < 0.0;
                            assert_eq!(against_normal >> i & 1 == 1, is_against, "{isa}");
                            (certain, against) = (certain + 1, against + u32::from(is_against));
                        }
                        Estimate::Missed | Estimate::Open(..) => {
                            assert!(!is_certain, "{isa}, lane {i} of {pairs:?}");
                            open += 1;
                        }
                    }
                }
            }
        }
        assert!(
            certain > open / 4 && open > certain / 4 && against > certain / 4,
            "{certain}, {open}, {against}"
        );
    }
}
