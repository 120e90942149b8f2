//! Where sixteen rays cross the triangles that f32 is sure they hit: in f64, all at once.

use super::exact::reported;
use crate::intersect::exact::{OriginTerms, Weighed, reported_share, size, wide};
use crate::simd::{LANES, Simd};

/// Sixteen of a number.
pub(crate) type Many = [f32; LANES];

/// Sixteen rays and a triangle of each.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Pairs {
    pub(crate) origin: [Many; 3],
    pub(crate) direction: [Many; 3],
    /// `[corner][axis]`.
    pub(crate) corner: [[Many; 3]; 3],
}

impl Pairs {
    pub(crate) const NONE: Pairs =
        Pairs { origin: [[0.0; LANES]; 3], direction: [[0.0; LANES]; 3], corner: [[[0.0; LANES]; 3]; 3] };
}

/// Numbers of a [`OriginTerms`].
const SEEN: usize = 11;

/// Up to sixteen triangles, seen from one point.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct OriginTermsLanes {
    rows: [[f64; LANES]; SEEN],
}

impl OriginTermsLanes {
    pub(crate) const NONE: OriginTermsLanes = OriginTermsLanes { rows: [[0.0; LANES]; SEEN] };

    /// The first of these triangles (`[corner][axis]`).
    #[inline(always)]
    pub(crate) fn compute(&mut self, origin: [f32; 3], corner: &[[Many; 3]; 3], count: usize) {
        const AT_ONCE: usize = LANES / 2;
        let origin = wide(origin);
        for first in (0..count.min(LANES)).step_by(AT_ONCE) {
            for i in first..first + AT_ONCE {
                let corners = [lane(&corner[0], i), lane(&corner[1], i), lane(&corner[2], i)];
                let OriginTerms { whole, second, third, volume, least } = OriginTerms::new(origin, corners);
                for k in 0..3 {
                    (self.rows[k][i], self.rows[3 + k][i], self.rows[6 + k][i]) =
                        (whole[k], second[k], third[k]);
                }
                (self.rows[9][i], self.rows[10][i]) = (volume, least);
            }
        }
    }
}

/// One of them.
#[inline(always)]
fn seen_of(rows: &[[f64; LANES]; SEEN], i: usize) -> OriginTerms {
    let three = |first: usize| [rows[first][i], rows[first + 1][i], rows[first + 2][i]];
    OriginTerms { whole: three(0), second: three(3), third: three(6), volume: rows[9][i], least: rows[10][i] }
}

/// One of sixteen points.
#[inline(always)]
fn lane(rows: &[Many; 3], i: usize) -> [f64; 3] {
    [rows[0][i].into(), rows[1][i].into(), rows[2][i].into()]
}

/// What f64 makes of the triangles that wait to be computed.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Intersections {
    /// As it is reported.
    pub(crate) triangle: [u32; LANES],
    pub(crate) t: Many,
    pub(crate) u: Many,
    pub(crate) v: Many,
    /// Lanes that certainly cross theirs, at t, u and v, which are rounded for the answer. (They lie in the rays' ranges,
    /// else the triangles would have been decided upon at once.)
    pub(crate) certain: u32,
    /// The others, which must be looked at one by one. (f32 was sure of all of them, so none is certainly missed.)
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

    /// Computes those of lanes whose bit is set; what they are is left as it is.
    #[inline(always)]
    pub(crate) fn compute<S: Simd>(&mut self, s: S, lanes: u32, pairs: &Pairs) {
        let Pairs { origin, direction, corner } = pairs;
        let mut good = [0; LANES];
        // Without branches, so that it is compiled to vectors.
        for i in 0..LANES {
            let corners = [lane(&corner[0], i), lane(&corner[1], i), lane(&corner[2], i)];
            let direction = lane(direction, i);
            let seen = OriginTerms::new(lane(origin, i), corners);
            self.put(i, &Weighed::new(&seen, direction, size(direction)), &mut good);
        }
        self.divide(s, lanes, &good);
    }

    /// The same of triangles that are seen from the one point at which all rays start: which of them each ray hits.
    #[inline(always)]
    pub(crate) fn compute_from_point<S: Simd, const FEWEST_OF_GROUP: bool>(
        &mut self,
        s: S,
        lanes: u32,
        direction: &[Many; 3],
        size: &Many,
        seen: &OriginTermsLanes,
        hit: S::U,
    ) {
        let mut rows = [[0.0; LANES]; SEEN];
        for k in 0..SEEN {
            rows[k] = s.lookup_f64::<FEWEST_OF_GROUP>(&seen.rows[k], hit);
        }
        let mut good = [0; LANES];
        for i in 0..LANES {
            let seen = seen_of(&rows, i);
            self.put(i, &Weighed::new(&seen, lane(direction, i), size[i].into()), &mut good);
        }
        self.divide(s, lanes, &good);
    }

    #[inline(always)]
    fn put(&mut self, i: usize, weighed: &Weighed, good: &mut [u32; LANES]) {
        let [second, third, _] = weighed.weight;
        good[i] = u32::from(weighed.is_good);
        self.t[i] = reported(weighed.t);
        self.u[i] = reported_share(second * weighed.share);
        self.v[i] = reported_share(third * weighed.share);
    }

    #[inline(always)]
    fn divide<S: Simd>(&mut self, s: S, lanes: u32, good: &[u32; LANES]) {
        self.certain = s.mask_bits(s.lt_u(s.splat_u(0), s.load_u(good))) & lanes;
        self.open = lanes & !self.certain;
    }
}
